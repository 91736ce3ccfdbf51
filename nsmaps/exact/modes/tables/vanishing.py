"""Which terms of the series of the functions that are watched are zero just after an event, whatever the state."""

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.tables.nonlinear import recomputed
from nsmaps.exact.modes.tables.rows import Rows
from nsmaps.exact.modes.tables.taylor import TERMS

SAME = 1e-13  #: to which a function is in proportion to another, relative to its largest coefficient


def vanishing(definition: Definition, rows: Rows, functions: Floats, modes: Ints, flows: Floats) -> Ints:
    """How many of the first terms of each function are zero just after each event, whatever the state, shape (T, S).

    They are then sums of what is zero just before it, the function of the event and what its mode holds at zero, as seen through
    the reset. Terms that a reset by another formula changes are not. All `TERMS` are zero of a function that stays zero. In a
    nonlinear system at most the first one counts.
    """
    n, width = rows.resets.shape[1:]
    result = np.zeros((len(rows.functions), len(functions)), np.int64)
    for k, one in enumerate(definition.transitions):
        through, given = np.vstack([rows.resets[k], np.eye(width)[n:]]), [*dict(one.curved), *recomputed(definition, one)]
        zeros = independent(np.vstack([rows.functions[k], rows.held[k]]))
        for i, (function, mode) in enumerate(zip(functions, modes, strict=True)):
            if mode == one.target:
                result[k, i] = flat_terms(function, flows[mode], through, given, zeros)
    return np.minimum(result, 1) if definition.smooth else result


def independent(rows: Floats) -> list[tuple[int, Floats]]:
    """Rows that span the same space, each with the place of a one where all others are zero."""
    found: list[tuple[int, Floats]] = []
    for row in rows:
        size = np.abs(row)
        for lead, one in found:
            row, size = row - row[lead] * one, size + abs(row[lead]) * np.abs(one)
        row = np.where(np.abs(row) <= SAME * size, 0.0, row)
        if row.any():
            k = int(np.argmax(np.abs(row)))
            row = row / row[k]
            found = [(lead, one - one[k] * row) for lead, one in found] + [(k, row)]
    return found


def flat_terms(function: Floats, flow: Floats, through: Floats, given: list[int], zeros: list[tuple[int, Floats]]) -> int:
    """How many of the first terms of a function's series are zero where others are, seen through a reset."""
    term, size, sizes = function, np.abs(function), np.abs(flow)
    for k in range(len(function)):
        if term[given].any() or not combined(term @ through, zeros, size @ np.abs(through)):
            return k
        term, size = term @ flow, size @ sizes
    return TERMS  # by Cayley and Hamilton


def combined(row: Floats, others: list[tuple[int, Floats]], size: Floats) -> bool:
    """Whether a row is a sum of multiples of others, but for rounding of the terms of this size that add up to it."""
    row = np.where(np.abs(row) <= SAME * size, 0.0, row)
    left, size = row, size + np.abs(row)
    for lead, one in others:
        left, size = left - row[lead] * one, size + np.abs(row[lead] * one)
    return bool((np.abs(left) <= SAME * size).all())
