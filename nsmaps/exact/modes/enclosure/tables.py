"""The table of a system with modes that enclosures use, computed in many digits and rounded once.

The time unit of a mode is a cell, in which bounds grow by about e. z holds the states, 1 and the waves of the phase; z' = Y z.
Every number of the table is within `balls.UNIT` of itself, relative, of the exact one.
"""

import operator
from collections.abc import Sequence
from itertools import accumulate, repeat
from math import factorial
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, ctx

from nsmaps.arrays import Floats
from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.flows.balls import many_digits, nearest_float
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.enclosure.zeros import facts_of
from nsmaps.exact.modes.tables.rows import rows_of
from nsmaps.exact.modes.tables.tables import Tables, exponential, first_choices, longest_steps, mode_of
from nsmaps.exact.modes.tables.vanishing import flows_of

REACH = 1.0  #: a cell times the spectral radius of |Y|
POWERS = 20  #: of the series of a flow within a cell
CELLS = 32  #: cells in a row whose flows are in the table; so many rows of cells follow
RATES = 6  #: of guards, the function itself and its first five derivatives:
VALUE, RATE, BEND, JERK, SNAP, CRACKLE = range(RATES)
WIDER = 1.0 + 1e-12  #: more than the rounding of sums and products of numbers that are not negative


@by_address
class BallTables(NamedTuple):
    """One system: n states, N = n + 1 + 2 H features, M modes, T transitions, S functions watched, B starts."""

    table: Tables  #: that of its motions, of whose numbers rows are used
    turn: Any  #: shape (M,), radians of phase a cell
    last: Any  #: shape (M,), longest flight, in cells
    powers: Any  #: shape (M, POWERS + 1, N, N), Y^k/k!
    blur: Any  #: shape (M, N, N), the sum of |Y^k/k!| from k = 1 on
    left_out: Any  #: shape (M, N, N), a bound on what the series leaves out at the end of a cell
    near: Any  #: shape (M, CELLS, N, N), exp(Y k)
    far: Any  #: shape (M, CELLS, N, N), exp(Y k CELLS)
    flows: Any  #: shape (M, N, N), Y
    third: Any  #: shape (M, N, N), |Y|^3 exp(|Y|)
    functions: Any  #: shape (S, RATES, N), h Y^k of each function h z
    bounds: Any  #: shape (S, N), |h Y^RATES| exp(|Y|)
    on: Any  #: shape (T, S), whether the function is zero just after the event
    rises: Any  #: shape (T, S), whether its rate is then not negative, as that of the function of the event is not positive
    started: Any  #: shape (B, S), as `on`, for starts


def ball_tables(definition: Definition, values: Sequence[float], table: Tables) -> BallTables:
    """The table for enclosures of a system whose other table is given."""
    with many_digits():
        rows = rows_of(definition, np.array(definition.expansions.at(values), dtype=object))
        (rate, *_), *_ = definition.scalars.at(values)
        flows = flows_of(rows, rate)
        cells = longest_steps(floats_of(flows), table.horizon, REACH).tolist()
        units = [flow * arb(cell) for flow, cell in zip(flows, cells, strict=True)]
        series = [series_of(unit) for unit in units]
        fields: dict[str, Any] = {key: np.array([each[key] for each in series]) for key in next(iter(series))}
        fields |= derived_of([rows.functions[k] for k in first_choices(table)], table, units)
        fields |= facts_of(definition, values, table).fields
        turns = np.array([nearest_float(rate * cell) for cell in cells])
    return BallTables(table, **fields, turn=turns, last=table.horizon / np.array(cells))


def floats(matrix: arb_mat) -> Floats:
    """A matrix of many digits rounded to floats."""
    return np.reshape([nearest_float(x) for x in matrix.entries()], (matrix.nrows(), matrix.ncols()))


def series_of(unit: arb_mat) -> dict[str, Floats]:
    """The flow of a cell as a series, with a bound on what that leaves out, and the flows of whole cells."""
    power, powers = unit**0, [unit**0]
    for k in range(1, POWERS + 1):
        power = power * unit / k
        powers.append(power)
    terms = floats_of(powers)
    _, flow, *_ = terms
    size = np.abs(flow)
    (grown,) = exponential(size[None])
    with ctx.extraprec(2 * CELLS**2):  # for numbers that fall by e a cell
        *_, last = near = powers_of(cell := unit.mid().exp())
        far = powers_of(last * cell)
        whole = {"near": floats_of(near), "far": floats_of(far)}
    left_out = np.linalg.matrix_power(size, POWERS + 1) @ grown / factorial(POWERS + 1)
    return {
        "flows": flow,
        "third": np.linalg.matrix_power(size, 3) @ grown * WIDER,
        "powers": terms,
        "blur": np.abs(terms[1:]).sum(axis=0) * WIDER,
        "left_out": left_out * WIDER,
        **whole,
    }


def powers_of(matrix: arb_mat) -> list[arb_mat]:
    """The powers of a matrix from the first, which is one, on."""
    return list(accumulate(repeat(matrix, CELLS - 1), operator.mul, initial=matrix**0))


def floats_of(matrices: list[arb_mat]) -> Floats:
    """Matrices of many digits rounded to floats."""
    return np.array(list(map(floats, matrices)))


def derived_of(functions: list[Any], table: Tables, units: list[arb_mat]) -> dict[str, Floats]:
    """The functions watched and their first derivatives as rows, and bounds on the next."""
    rows, bounds = [], []
    for f, function in enumerate(functions):
        unit = units[mode_of(table, f)]
        *own, remainder = accumulate(repeat(unit, RATES), operator.mul, initial=arb_mat([list(function)]))
        rows.append(np.concatenate(list(map(floats, own))))
        (grown,) = exponential(np.abs(floats(unit))[None])
        bounds.append((np.abs(floats(remainder)) @ grown * WIDER).ravel())
    return {"functions": np.array(rows), "bounds": np.array(bounds)}
