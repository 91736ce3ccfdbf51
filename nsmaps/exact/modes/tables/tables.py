"""A system with modes in numbers: the table that compiled code follows.

A flow is y' = Y z, where z holds the states y, 1, and cosine and sine of the multiples of the phase. The time unit of a mode is
its longest step.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.engine.constants import OUTWARD
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.numbers import Numbers
from nsmaps.exact.modes.tables.clock import at_phase, phase_of_fall
from nsmaps.exact.modes.tables.memory import Moved
from nsmaps.exact.modes.tables.nonlinear import taylor_of
from nsmaps.exact.modes.tables.polynomials import exponential_series, polynomials_of
from nsmaps.exact.modes.tables.rows import Rows, flow_matrices, plain_of, rows_of, transitions_of
from nsmaps.exact.modes.tables.taylor import ORDER, TERMS
from nsmaps.exact.modes.tables.vanishing import vanishing

REACH = 3.0  #: a longest step times the growth rate of the bounds, the spectral radius of |Y|
TINY = 1e-18  #: of a series: what is left out of it
PACE = 8  #: terms of a series from one look at what is left out to the next, more than REACH


@by_address
class Tables(NamedTuple):
    """One system at its parameters: n states, N = n + 1 + 2 H features, M modes, T transitions, S functions watched."""

    rate: float  #: radians of phase a unit of time
    horizon: float  #: longest flight
    nonlinear: Any  #: (1,) of a system all of whose modes have Taylor flights, else (): code is compiled for either by itself
    taylor: Any  #: shape (M,), address of heyoka's step for a mode with Taylor flights, 0 for one with affine rates
    variations: Any  #: shape (2, M), for derivatives by the start, and along a direction too; 0 until they are asked for
    rates: Any  #: shape (M,), address of the law of the rates of a mode with Taylor flights
    derived: int  #: address of the law of the derived states, 0 if there are none
    own: int  #: states that are not derived; they come first
    kinds: Any  #: shape (M, K), of functions with flat parts in the rates of a mode, `NO_KIND` behind them
    steps: Any  #: shape (M,), longest step, of a mode with Taylor flights only the unit of time
    first: Any  #: shape (M, n + 1), where the coefficients of each state's rate begin
    columns: Any  #: the features of these coefficients
    values: Any  #: and the coefficients, times the mode's longest step
    abscissa: Any  #: shape (M,), largest real part of an eigenvalue, or zero: the rate at which rounding grows
    watched: Any  #: shape (M + 1,), where the functions of each mode begin
    functions: Any  #: shape (S, N), positive before their event
    propagators: Any  #: shape (M, TERMS, n N), Taylor series of exp(Y step tau) - 1 in tau, rows of the states
    flows: Any  #: shape (M, n, N, TERMS), the same by state and feature, of some states less that of another
    flow_features: Any  #: features of these, (M, n, N), those with more terms first, and how many each degree has, (M, n, TERMS)
    flow_bases: Any  #: shape (M, n), this other state, or the state itself
    flow_order: Any  #: shape (M, n), the states, others than themselves last
    whole: Any  #: shape (M, n N), the value of `propagators` at tau = 1
    series: Any  #: shape (S, N, TERMS), that of each function along the flow, by the features at the start
    series_features: Any  #: as `flow_features`, shapes (S, N) and (S, TERMS)
    points: Any  #: the same as `series`, coefficients over a longest step in the basis of Bernstein
    shapes: Any  #: the same without the constants of the functions
    twins: Any  #: shape (S,), a function watched before, of the same shape up to its sign, or the same function
    signs: Any  #: shape (S,), this sign
    sizes: Any  #: shape (S, N), sum of the sizes of the coefficients of `series`
    bends: Any  #: shape (S, N), bounds on the second derivative over a longest step
    left: Any  #: shape (S, N), bounds on what `series` leaves out there
    choices: Any  #: shape (S + 1,), where the transitions of each function begin in `chosen`
    chosen: Any  #: shape (T,)
    function: Any  #: shape (T,), that is zero at the event
    leaves: Any  #: shape (S,), whether sliding or contact ends where it is negative
    plain: Any  #: shape (S,), whether nothing is to be decided at an event but which transition it is
    mode: Any  #: shape (T,), in which it takes place
    target: Any  #: shape (T,), mode that follows, -1 where the motion ends
    resets: Any  #: shape (T, n, N)
    moves: Any  #: shape (T,), whether there is a reset
    jumps: Any  #: shape (T, n), whether it changes the state
    laws: Any  #: shape (T,), address of the compiled part of the reset, 0 for none
    curved: Any  #: shape (T, n), whether the state is given by that part
    parameters: Any  #: shape (P,), their values, for these parts
    conditions: Any  #: shape (T + 1,), where the conditions of each transition begin
    where: Any  #: rows over the features that must not be negative
    digit: Any  #: shape (T,), of the letter in words, 0 for none
    base: int  #: of the numbers of words
    on: Any  #: shape (T, S), how many of the first terms of the function are zero just after the event, but for rounding
    impacts: Any  #: shape (T,), the number of the contact that may begin after the impact, -1 for none
    contacts: Any  #: shape (T,), the number of the contact that begins, that of sliding behind these; -1 for none
    bounces: Any  #: shape (T,), its function in the mode after an event that may follow itself without lasting contact; or -1
    begins: Any  #: shape (T, 2, N), speed away from the surface and pressure towards it, where contact begins
    releases: Any  #: shape (T,), whether contact ends
    resting: Any  #: shape (M,), whether the mode is one of lasting contact
    surfaces: Any  #: shape (Q, 3, N), function of each surface of sliding, its rate above, and below with the other sign
    beside: Any  #: shape (Q, M), whether the mode lies above or below the surface
    below: Any  #: shape (M,), how many of the functions that are crossed in a mode are below zero there
    is_section: Any  #: shape (T,)
    after: bool  #: whether start and image are just after the reset
    phase: float  #: at which the section is, where no coordinate is a phase
    starts: Any  #: shape (number of starts,), the transition of each
    states: Any  #: shape (number of starts, n, N), the state by that which the coordinates are
    landings: (
        Any  #: shape (number of starts, K, N), what is zero just after each of several events, with rows of zeros; K = 0 of one
    )
    start_laws: Any  #: shape (number of starts,), address of the law of the other states, 0 for none
    start_curved: Any  #: shape (number of starts, own), whether that law gives the state
    places: Any  #: shape (number of coordinates,), the state that each is, -1 for the phase


def tables_of(definition: Definition, values: Sequence[float], max_step: float = math.inf) -> Tables:
    """The table of a system at values of its parameters, with steps of at most `max_step`."""
    rows = rows_of(definition, definition.expansions.floats(values))
    (rate, horizon, _), *_ = definition.scalars.floats(values).tolist()
    flows = flows_of(rows, rate, min(horizon, max_step))
    functions = functions_of(definition, values, rows, rate, flows)
    tables = Tables(
        rate=rate,
        horizon=horizon,
        **taylor_of(definition),
        **flows,
        **functions,
        **transitions_of(definition, rows),
        parameters=np.array(values),
        after=definition.after,
        phase=0.0 if definition.clock < 0 else phase_of_fall(definition, rows.functions[definition.clock], values),
        states=rows.starts,
        landings=landings_of(definition, rows, values),
    )
    return Tables(*map(_in_rows, tables))


def landings_of(definition: Definition, rows: Rows, values: Sequence[float]) -> Floats:
    """The field `landings` of a table."""
    n, width = rows.resets.shape[1:]
    names = {definition.transitions[start.transition].name for start in definition.starts}
    count = max(len(start.surface) for start in definition.starts) if definition.after and len(names) > 1 else 0
    found = np.zeros((len(definition.starts), count, width))
    for k, start in enumerate(definition.starts if count else ()):
        found[k, : len(start.surface)] = Numbers(start.surface, definition.symbols, (width - n - 1) // 2).floats(values)
    return found


def _in_rows(value: Any) -> Any:
    """A field with its arrays row by row, so that the tables of all systems are of one type, for which the engine is compiled."""
    if isinstance(value, tuple):
        return tuple(map(_in_rows, value))
    plain = not isinstance(value, np.ndarray) or (value.flags.c_contiguous and value.flags.writeable)
    return value if plain else np.require(value, requirements=["C", "W"])


def flows_of(rows: Rows, rate: float, horizon: float) -> dict[str, Any]:
    """The fields of a table that describe the flows of its modes."""
    n = rows.rates.shape[1]
    flows = flow_matrices(rows.rates, rate)
    steps = longest_steps(flows, horizon, REACH)
    first, columns, coefficients = sparse(rows.rates * steps[:, None, None])
    return {
        "steps": steps,
        "first": first,
        "columns": columns,
        "values": coefficients,
        "abscissa": np.maximum(0.0, np.linalg.eigvals(flows[:, :n, :n]).real.max(axis=1)),
    }


def functions_of(
    definition: Definition, values: Sequence[float], rows: Rows, rate: float, flows: dict[str, Any]
) -> dict[str, Any]:
    """The fields of a table that describe the functions watched in each mode, those of several transitions once."""
    groups = [group_transitions(definition, rows, mode) for mode in range(len(definition.modes))]
    sets = [group for mode in groups for group in mode]
    leads = [lead for lead, *_ in sets]
    functions = rows.functions[leads]
    modes, matrices = np.array([definition.transitions[k].mode for k in leads]), flow_matrices(rows.rates, rate)
    steps = flows["steps"][:, None, None]
    bounds = np.einsum("si,sij->sj", np.abs(functions), exponential(np.abs(matrices) * steps)[modes])
    which = {k: function for function, group in enumerate(sets) for k in group}
    on = vanishing(definition, values, leads, functions.shape[1])
    bounces = [function_after(definition, functions, modes, on, k, which.get(k, 0)) for k in range(len(definition.transitions))]
    return {
        "watched": np.cumsum([0, *map(len, groups)]),
        "functions": functions,
        **polynomials_of(rows.rates.shape[1], steps * matrices, functions, modes, bounds),
        "choices": np.cumsum([0, *map(len, sets)]),
        "chosen": np.array([k for group in sets for k in group]),
        "function": np.array([which.get(k, 0) for k in range(len(definition.transitions))]),
        "leaves": np.array([all(definition.transitions[k].leaves for k in group) for group in sets]),
        "plain": np.array([all(plain_of(definition)[k] for k in group) for group in sets]),
        "bounces": np.array(bounces),
        "on": on,
    }


def function_after(definition: Definition, functions: Floats, modes: Ints, on: Ints, k: int, function: int) -> int:
    """The function of an event in the mode that follows, if it is watched there and zero, and no contact may last; or -1."""
    one = definition.transitions[k]
    if one.begins or one.guard or one.leaves:
        return -1
    same = (modes == one.target) & (functions == functions[function]).all(axis=1) & (on[k] > 0) & (on[k] < TERMS)
    return int(np.argmax(same)) if same.any() else -1


def moved_of(definition: Definition, table: Tables, values: Sequence[float], rates: Floats) -> Moved:
    """The derivative of a table by the parameters, which change at these rates."""
    if not rates.any():
        return Moved(True, 0.0, 0.0, rates, *map(np.zeros_like, (table.flows, table.functions, table.resets, table.states)))
    n, width = table.resets.shape[1:]
    harmonics, total, turn = (width - n - 1) // 2, None, 0.0
    turns, *_ = definition.scalars.floats(values)[1:].T.tolist() or [[]]
    for k, rate in enumerate(rates.tolist()):
        if rate:
            rows = rows_of(definition, definition.derivative(k, harmonics).floats(values))
            parts = [rate * part for part in (rows.rates, rows.functions, rows.resets, rows.starts)]
            total = parts if total is None else [a + b for a, b in zip(total, parts, strict=True)]
            turn += rate * turns[k]
    assert total is not None
    changes, functions, resets, states = total
    later = 0.0
    if definition.clock >= 0:
        row = table.functions[table.function[definition.clock]]
        (rise, _), (_, slope) = at_phase(functions[definition.clock][n:], table.phase), at_phase(row[n:], table.phase)
        later = float(-rise / slope)
    flows, leads = moved_flows(table, changes, turn), first_choices(table)
    return Moved(True, turn, later, rates, flows, functions[leads], resets, states)


def first_choices(table: Tables) -> Ints:
    """A transition of each function that is watched, shape (S,)."""
    first = table.choices[:-1]
    return table.chosen[first]


def mode_of(table: Tables, function: int) -> int:
    """The mode in which a function is watched."""
    return int(np.searchsorted(table.watched, function, side="right")) - 1


def moved_flows(table: Tables, changes: Floats, turn: float) -> Floats:
    """The field `flows` of `Moved`, by the derivatives of the rates of states, shape (M, n, N), and of the phase.

    In the exponential of [[Y, dY], [0, Y]] tau that of Y tau stands above its derivative (C. F. Van Loan, 1978).
    """
    if not changes.any() and not turn:
        return np.zeros_like(table.flows)
    n, width = changes.shape[1:]
    first, steps = 1, table.steps[:, None, None]
    flows = flow_matrices(table.propagators[:, first].reshape(changes.shape), table.rate * table.steps)
    moved = flow_matrices(changes * steps, turn * table.steps)
    terms = exponential_series(np.block([[flows, moved], [np.zeros_like(flows), flows]]))[:, : ORDER + 1, :n, width:]
    return np.ascontiguousarray(np.pad(np.moveaxis(terms, 1, -1).astype(float), [(0, 0)] * 3 + [(0, TERMS - ORDER - 1)]))


def exponential(matrices: Floats) -> Floats:
    """Upper bounds on the exponentials of matrices (M, N, N) without negative entries, by their series."""
    total = np.broadcast_to(np.eye(matrices.shape[1]), matrices.shape).copy()
    term = total.copy()
    for k in range(1, 1000):
        term = term @ matrices
        term /= k
        total += term
        if k % PACE == 0 and (term <= TINY * total).all():
            break
    return total * OUTWARD


def longest_steps(flows: Floats, horizon: float, reach: float) -> Floats:
    """The longest step of each mode: within it the bounds grow by about exp(reach), whatever the units."""
    radii = np.abs(np.linalg.eigvals(np.abs(flows))).max(axis=1).tolist()
    return np.array([min(reach / radius, horizon) if radius > reach / horizon else horizon for radius in radii])


def sparse(rates: Floats) -> tuple[Ints, Ints, Floats]:
    """The coefficients that are not zero, row by row: where each row begins, their columns and values."""
    filled_rows = rates != 0
    counts = filled_rows.sum(axis=2)
    ends = np.cumsum(counts).reshape(counts.shape)
    first = np.concatenate([ends[:, :1] - counts[:, :1], ends], axis=1)
    *_, columns = np.nonzero(filled_rows)
    return first, columns, rates[filled_rows]


def group_transitions(definition: Definition, rows: Rows, mode: int) -> list[list[int]]:
    """The transitions of a mode, those with the same function together."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for k, one in enumerate(definition.transitions):
        if one.mode == mode and not one.begins:
            groups.setdefault(tuple(rows.functions[k].tolist()), []).append(k)
    return [*groups.values()]
