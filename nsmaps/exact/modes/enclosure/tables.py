"""The table of a system with modes that enclosures use, computed in many digits and rounded once.

The time unit of a mode is a cell, in which bounds grow by about e. z holds the states, 1 and the waves of the phase; z' = Y z.
Every number of the table is within `balls.UNIT` of itself, relative, of the exact one.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.flows.recording import DIGITS
from nsmaps.exact.modes.definitions.definition import Definition, harmonics_of
from nsmaps.exact.modes.enclosure.zeros import mode_of, zeros_of
from nsmaps.exact.modes.tables.tables import Tables

REACH = 1.0  #: a cell times the spectral radius of |Y|
POWERS = 20  #: of the series of a flow within a cell
CELLS = 32  #: cells in a row whose flows are in the table; so many rows of cells follow
RATES = 6  #: of guards: the function itself and its first five derivatives
WIDER = 1.0 + 1e-12  #: more than the rounding of sums and products of numbers that are not negative


class BallTables(NamedTuple):
    """One system: n states, N = n + 1 + 2 H features, M modes, T transitions, S functions watched, B starts."""

    cell: Any  #: shape (M,), length of a cell, in the system's time
    turn: Any  #: shape (M,), radians of phase a cell
    last: Any  #: shape (M,), longest flight, in cells
    powers: Any  #: shape (M, POWERS + 1, N, N), Y^k/k!
    blur: Any  #: shape (M, N, N), the sum of |Y^k/k!| from k = 1 on
    left_out: Any  #: shape (M, N, N), a bound on what the series leaves out at the end of a cell
    near: Any  #: shape (M, CELLS, N, N), exp(Y k)
    far: Any  #: shape (M, CELLS, N, N), exp(Y k CELLS)
    flows: Any  #: shape (M, N, N), Y
    third: Any  #: shape (M, N, N), |Y|^3 exp(|Y|)
    watched: Any  #: shape (M + 1,), where the functions of each mode begin
    functions: Any  #: shape (S, RATES, N), h Y^k of each function h z
    bounds: Any  #: shape (S, N), |h Y^RATES| exp(|Y|)
    choices: Any  #: shape (S + 1,), where the transitions of each function begin in `chosen`
    chosen: Any  #: shape (T,)
    mode: Any  #: shape (T,), in which it takes place
    target: Any  #: shape (T,), mode that follows, -1 where the motion ends
    leaves: Any  #: shape (S,), whether sliding or contact ends where it is negative
    resets: Any  #: shape (T, n, N)
    moves: Any  #: shape (T,), whether there is a reset
    conditions: Any  #: shape (T + 1,), where the conditions of each transition begin
    where: Any  #: rows over the features that must not be negative
    digit: Any  #: shape (T,), of the letter in words, 0 for none
    base: int  #: of the numbers of words
    on: Any  #: shape (T, S), whether the function is zero just after the event
    rises: Any  #: shape (T, S), whether its rate is then not negative, as that of the function of the event is not positive
    surfaces: Any  #: shape (Q, 3, N), function of each surface of sliding, its rate above, and below with the other sign
    beside: Any  #: shape (Q, M), whether the mode lies above or below the surface
    below: Any  #: shape (M,), how many of the functions that are crossed in a mode are below zero there
    is_section: Any  #: shape (T,)
    after: bool  #: whether start and image are just after the reset
    starts: Any  #: shape (B,), the transition of each
    states: Any  #: shape (B, n, N), the state by that which the coordinates are
    function: Any  #: shape (T,), that is zero at the event
    started: Any  #: shape (B, S), as `on`, for starts
    places: Any  #: shape (m,), the state that each coordinate is, -1 for the phase


def ball_tables(definition: Definition, values: Sequence[float], table: Tables) -> BallTables:
    """The table for enclosures of a system whose other table is given."""
    with mp.workdps(DIGITS):
        given = definition.expansions.at(values)
        rows = [row_of(row, harmonics_of(given)) for row in given]
        rate = definition.scalars.at(values)[0][0][0]
        n, modes = len(definition.states), len(definition.modes)
        flows = [flow_of(rows[k * n : (k + 1) * n], rate) for k in range(modes)]
        cells = [cell_of(flow, table.horizon) for flow in flows]
        units = [flow * mp.mpf(cell) for flow, cell in zip(flows, cells, strict=True)]
        series = [series_of(unit) for unit in units]
        functions = derived_of(functions_of(definition, rows[n * modes :], table), table, units)
        turns = np.array([float(rate * cell) for cell in cells])
    fields: dict[str, Any] = {key: np.array([each[key] for each in series]) for key in series[0]} | functions
    fields |= zeros_of(table, fields["flows"], functions["functions"])
    fields |= {"cell": np.array(cells), "turn": turns, "last": table.horizon / np.array(cells)}
    return BallTables(**{name: fields[name] if name in fields else getattr(table, name) for name in BallTables._fields})


def row_of(row: tuple[list[Any], dict[int, Any]], harmonics: int) -> list[Any]:
    """A row over the features in many digits; in floats `nsmaps.exact.modes.definitions.definition.filled`."""
    known, waves = row
    zero = mp.mpf(0)
    values = [*map(mp.re, known), mp.re(waves.get(0, zero))]
    for m in range(1, harmonics + 1):
        plus, minus = waves.get(m, zero), waves.get(-m, zero)
        values += [mp.re(plus + minus), mp.re(mp.mpc(0, 1) * (plus - minus))]
    return values


def flow_of(rates: list[list[Any]], rate: Any) -> Any:
    """The matrix Y of a mode in many digits, shape (N, N)."""
    n, width = len(rates), len(rates[0])
    flow = np.array(rates + [[mp.mpf(0)] * width for _ in range(width - n)], dtype=object)
    for m in range(1, (width - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        flow[c, c + 1], flow[c + 1, c] = -m * rate, m * rate
    return flow


def floats(values: Any) -> Floats:
    """Numbers of many digits rounded to floats."""
    return np.array(values, dtype=float)


def cell_of(flow: Any, horizon: float) -> float:
    """The length of a cell, a float."""
    radius = float(np.abs(np.linalg.eigvals(np.abs(floats(flow)))).max())
    return min(REACH / radius, horizon) if radius > REACH / horizon else horizon


def exponential_bound(matrix: Floats) -> Floats:
    """An upper bound on the exponential of a matrix without negative entries and of a spectral radius up to `REACH`."""
    total = term = np.eye(len(matrix))
    for k in range(1, 60):
        term = term @ matrix / k
        total = total + term
    return total * WIDER


def series_of(unit: Any) -> dict[str, Floats]:
    """The flow of a cell as a series, with a bound on what that leaves out, and the flows of whole cells."""
    width = len(unit)
    eye = np.array([[mp.mpf(i == j) for j in range(width)] for i in range(width)], dtype=object)
    terms = [eye]
    while len(terms) <= 3 * POWERS:
        terms.append(product(terms[-1], unit) / len(terms))
    cell = sum(terms[1:], eye)
    near = powers_of(cell, eye)
    powers = np.array([floats(term) for term in terms[: POWERS + 1]])
    left = np.abs(powers[1])
    grown = exponential_bound(left)
    left_out = np.linalg.matrix_power(left, POWERS + 1) @ grown / float(mp.factorial(POWERS + 1))
    return {
        "flows": powers[1],
        "third": np.linalg.matrix_power(left, 3) @ grown * WIDER,
        "powers": powers,
        "blur": np.abs(powers[1:]).sum(axis=0) * WIDER,
        "left_out": left_out * WIDER,
        "near": np.array([floats(power) for power in near]),
        "far": np.array([floats(power) for power in powers_of(product(near[-1], cell), eye)]),
    }


def powers_of(matrix: Any, eye: Any) -> list[Any]:
    """The powers of a matrix from the first, which is one, on."""
    powers = [eye]
    while len(powers) < CELLS:
        powers.append(product(powers[-1], matrix))
    return powers


def product(left: Any, right: Any) -> Any:
    """The product of two square matrices in many digits, of which most numbers are zero."""
    found = np.full(left.shape, mp.mpf(0), dtype=object)
    rows = [[(j, y) for j, y in enumerate(row) if y] for row in right.tolist()]
    for total, row in zip(found, left.tolist(), strict=True):
        for x, others in zip(row, rows, strict=True):
            if x:
                for j, y in others:
                    total[j] += x * y
    return found


def functions_of(definition: Definition, rows: list[list[Any]], table: Tables) -> list[Any]:
    """The rows of the functions watched, in many digits."""
    found, at = [], 0
    for one in definition.transitions:
        found.append(np.array(rows[at], dtype=object))
        at += 1 + len(one.reset) + len(one.where) + len(one.begins) + len(one.held)
    return [found[k] for k in table.chosen[table.choices[:-1]]]


def derived_of(functions: list[Any], table: Tables, units: list[Any]) -> dict[str, Floats]:
    """The functions watched and their first derivatives as rows, and bounds on the next."""
    rows, bounds = [], []
    for f, function in enumerate(functions):
        unit, own = units[mode_of(table, f)], [function]
        while len(own) <= RATES:
            own.append(own[-1] @ unit)
        rows.append([floats(row) for row in own[:-1]])
        bounds.append(np.abs(floats(own[-1])) @ exponential_bound(np.abs(floats(unit))) * WIDER)
    return {"functions": np.array(rows), "bounds": np.array(bounds)}
