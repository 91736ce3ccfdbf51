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
    """The changes of a label that bisection finds one after another on each of K segments, up to a number on each.

    Behind a change the search continues as long as the label there is not that at the end of the segment. The labels at the ends
    of a segment differ.

    Returns:
        The numbers of the segments (C,), not in order, and both sides of the changes, each of shape (C, n) or (C,).
    """
    found, rows = [], np.arange(len(low))
    for _ in range(most_changes):
        near, far, now = bisect_change(label, low, high, before, beyond, halvings=halvings)
        found.append((rows, near, far))
        more = ~_same(now, beyond)
        rows, low, high, before, beyond = rows[more], far[more], high[more], now[more], beyond[more]
        if not len(rows):
            break
    numbers, below, above = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return numbers, below, above


def _same(labels: Labels, others: Labels) -> Bools:
    """True for the labels that agree in every column, shape (K,)."""
    same = np.asarray(labels == others)
    return np.asarray(same.all(axis=tuple(range(1, same.ndim))))
