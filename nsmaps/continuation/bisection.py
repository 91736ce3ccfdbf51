"""Bisection for the places at which a label of states changes, such as the word of a return, a basin or an itinerary."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints

Labels = NDArray[Any]


def bisect_change(
    label: Callable[[Floats], Labels],
    low: Floats,
    high: Floats,
    before: Labels,
    beyond: Labels,
    width: ArrayLike = 0.0,
    halvings: int = 60,
) -> tuple[Floats, Floats, Labels]:
    """The first change of a label that bisection finds on each of K segments: both of its sides, and the label on the far one.

    A state whose label is that at `low` replaces `low`, any other one replaces `high`: if a segment has several changes, one is
    found, on whose near side the label is that at `low`. All segments are bisected until all are short enough.

    Args:
        label: of states of shape (K, n), an array of shape (K,) or (K, c) whose rows are compared.
        low, high: the ends of the segments, shape (K, n), or (K,) for numbers.
        before, beyond: the labels at `low` and at `high`.
        width: length in every coordinate, shape (n,) or one for all, at which a segment is short enough; 0: rounding.
        halvings: greatest number of bisections.
    """
    beyond = np.array(beyond)
    for _ in range(halvings):
        middle = (low + high) / 2
        resolved = (np.abs(high - low) <= width) | (middle == low) | (middle == high)
        if resolved.all():
            break
        found = label(middle)
        same = _same(found, before)
        rows = same.reshape(-1, *[1] * (low.ndim - 1))
        low, high = np.where(rows, middle, low), np.where(rows, high, middle)
        beyond[~same] = found[~same]
    return low, high, beyond


def bisect_changes(
    label: Callable[[Floats], Labels],
    low: Floats,
    high: Floats,
    before: Labels,
    beyond: Labels,
    most_changes: int,
    halvings: int = 60,
) -> tuple[Ints, Floats, Floats]:
    """The changes of a label that bisection finds on each of K segments, up to a number on each: those nearest to `low`.

    Where the label in the middle of a segment is that at neither end, both halves are bisected. The labels at the ends of a
    segment differ.

    Returns:
        The numbers of the segments (C,), in order, and both sides of the changes, from `low` on, each of shape (C, n) or (C,).
    """
    rows: Ints = np.arange(len(low))
    before, beyond = np.asarray(before), np.asarray(beyond)
    for _ in range(halvings):
        middle = (low + high) / 2
        wide = _any((middle != low) & (middle != high))
        if not wide.any():
            break
        middle[~wide] = high[~wide]
        found = beyond.copy()
        found[wide] = label(middle[wide])
        halves = np.column_stack([~_same(found, before), ~_same(found, beyond)])
        pairs: list[tuple[Any, Any]] = [(rows, rows), (low, middle), (middle, high), (before, found), (found, beyond)]
        rows, low, high, before, beyond = (np.stack(pair, axis=1)[halves] for pair in pairs)
        first = np.arange(len(rows)) - np.searchsorted(rows, rows) < most_changes
        if not first.all():
            rows, low, high, before, beyond = rows[first], low[first], high[first], before[first], beyond[first]
    return rows, low, high


def _same(labels: Labels, others: Labels) -> Bools:
    """True for the labels that agree in every column, shape (K,)."""
    same = np.asarray(labels == others)
    return np.asarray(same.all(axis=tuple(range(1, same.ndim))))


def _any(true: Bools) -> Bools:
    """True for the rows with any true coordinate, shape (K,)."""
    return np.asarray(true.any(axis=tuple(range(1, true.ndim))))
