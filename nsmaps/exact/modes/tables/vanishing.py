"""Which terms of the series of the functions that are watched are zero just after an event, whatever the state.

This is decided in balls of many digits, of the numbers that the formulas are at the parameters, here for all that rests on it.
"""

from collections.abc import Sequence

import numpy as np
from flint import arb, arb_mat

from nsmaps.arrays import Ints
from nsmaps.exact.flows.balls import many_digits
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.numbers import BallRow
from nsmaps.exact.modes.tables.rows import Rows, flow_matrices, rows_of
from nsmaps.exact.modes.tables.taylor import TERMS

Basis = list[tuple[int, BallRow]]  #: rows, each with the place of a one where all others are zero


def ball_rows(definition: Definition, values: Sequence[float], width: int) -> Rows:
    """All rows over so many features in many digits: arrays of balls."""
    harmonics = (width - len(definition.columns) - 1) // 2
    return rows_of(definition, np.array(definition.facts(harmonics).at(values), dtype=object))


def flows_of(rows: Rows, rate: arb) -> list[arb_mat]:
    """The matrices Y of modes in many digits, shape (N, N), by rows and the rate of the phase: z' = Y z."""
    return [arb_mat(flow.tolist()) for flow in flow_matrices(rows.rates, rate)]


def features_after(states: Sequence[Sequence[arb]]) -> arb_mat:
    """The matrix of the features by those before a reset, shape (N, N), from the rows of the states."""
    n, (width, *_) = len(states), map(len, states)
    return arb_mat([list(row) for row in states] + np.eye(width)[n:].tolist())


def vanishing(definition: Definition, values: Sequence[float], leads: Sequence[int], width: int) -> Ints:
    """How many of the first terms of the functions of some transitions are zero just after each event, shape (T, S).

    They are then sums of what is zero just before it, the function of the event and what its mode holds at zero, as seen through
    the reset. Terms that a reset by another formula changes are not. All `TERMS` are zero of a function that stays zero. In a
    nonlinear system at most the first one counts.
    """
    result = np.zeros((len(definition.transitions), len(leads)), np.int64)
    with many_digits():
        rows, ((rate, *_), *_) = ball_rows(definition, values, width), definition.scalars.at(values)
        flows, functions = flows_of(rows, rate), [arb_mat([list(row)]) for row in rows.functions]
        for k, one in enumerate(definition.transitions):
            reset, given = features_after(rows.resets[k]), [*dict(one.curved), *definition.states_to_recompute[k]]
            zeros = independent_rows([rows.functions[k], *rows.held[k]])
            for i, lead in enumerate(leads):
                if definition.transitions[lead].mode == one.target:
                    result[k, i] = zero_terms(functions[lead], flows[one.target], reset, given, zeros)
    return np.minimum(result, 1) if definition.smooth else result


def zero_terms(function: arb_mat, flow: arb_mat, reset: arb_mat, given: list[int], zeros: Basis) -> int:
    """How many of the first terms of a function's series are zero where others are, seen through a reset."""
    term = function
    for k in range(term.ncols()):
        entries = term.entries()
        if not all(entries[state].contains(0) for state in given) or not is_combination(term * reset, zeros):
            return k
        term = term * flow
    return TERMS  # by Cayley and Hamilton


def independent_rows(rows: Sequence[Sequence[arb]]) -> Basis:
    """Rows that span the same space."""
    found: Basis = []
    for given in rows:
        row = reduce_row(given, found)
        sizes = [0.0 if x.contains(0) else abs(float(x)) for x in row]
        if any(sizes):
            lead = int(np.argmax(sizes))
            row = [x / row[lead] for x in row]
            found = [(k, reduce_row(one, [(lead, row)])) for k, one in found] + [(lead, row)]
    return found


def reduce_row(row: Sequence[arb], basis: Basis) -> BallRow:
    """What a row is less multiples of others, zero at their places."""
    remaining = list(row)
    for lead, one in basis:
        if not row[lead].contains(0):
            remaining = [x - row[lead] * y for x, y in zip(remaining, one, strict=True)]
            remaining[lead] = arb(0)
    return remaining


def is_combination(row: arb_mat, basis: Basis) -> bool:
    """Whether a row, shape (1, N), is a sum of multiples of others."""
    return all(x.contains(0) for x in reduce_row(row.entries(), basis))
