"""Bisection for the places at which a label of states changes, such as the word of a return, a basin or an itinerary."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats

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

    A state whose label is that at `low` replaces `low`, any other one replaces `high`: if a segment has several changes, one
    is
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
        same = (found == before).reshape(len(low), -1).all(axis=1)
        rows = same.reshape(-1, *[1] * (low.ndim - 1))
        low, high = np.where(rows, middle, low), np.where(rows, high, middle)
        beyond[~same] = found[~same]
    return low, high, beyond
