"""Which terms of the series of the functions that are watched are zero just after an event, whatever the state."""

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.modes.definitions.definition import Definition

SAME = 1e-13  #: to which a function is in proportion to another, relative to its largest coefficient
FLAT = 3  #: terms of a function that are looked at just after an event


def vanishing(definition: Definition, resets: Floats, zeros: Floats, functions: Floats, modes: Ints, flows: Floats) -> Ints:
    """How many of the first terms of each function are zero just after each event, whatever the state, shape (T, S).

    They are then in proportion to the function of the event, one of `zeros`, as seen through the reset. Terms that a reset by
    another formula changes are not.
    """
    n, width = resets.shape[1:]
    result = np.zeros((len(zeros), len(functions)), np.int64)
    for k, one in enumerate(definition.transitions):
        through, given = np.vstack([resets[k], np.eye(width)[n:]]), [state for state, _ in one.curved]
        for i, (function, mode) in enumerate(zip(functions, modes, strict=True)):
            if mode == one.target:
                result[k, i] = flat_terms(function, flows[mode], through, given, zeros[k])
    return result


def flat_terms(function: Floats, flow: Floats, through: Floats, given: list[int], zero: Floats) -> int:
    """How many of the first terms of a function's series are zero where another is, seen through a reset."""
    term = function
    for k in range(FLAT):
        if term[given].any() or not in_proportion(term @ through, zero, np.abs(term) @ np.abs(through)):
            return k
        term = term @ flow
    return FLAT


def in_proportion(row: Floats, other: Floats, size: Floats) -> bool:
    """Whether a row is another times a number, but for rounding of the terms of this size that add up to it."""
    lead = int(np.argmax(np.abs(other)))
    multiple = other * (row[lead] / other[lead])
    return bool((np.abs(row - multiple) <= SAME * (size + np.abs(multiple))).all())
