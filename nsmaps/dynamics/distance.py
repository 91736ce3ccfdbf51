"""How far apart two attractors are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from nsmaps.errors import StateError
from nsmaps.exact.impacts import TWO_PI, Floats, angle_mask, as_states, wrap


def hausdorff(a: ArrayLike, b: ArrayLike, coordinates: Sequence[str]) -> float:
    """The Hausdorff distance of two sets of states: how far the farthest of either is from the nearest of the other.

    Distances are Euclidean in the coordinates' units, angles the shorter way round.

    Args:
        a, b: shapes (N, n) and (M, n), at least one state each; angles on any turn.

    Raises:
        StateError: sets of another shape, empty, or with states that are not finite.
    """
    from scipy.spatial import KDTree

    sets = [_placed(states, coordinates) for states in (a, b)]
    around = np.where(angle_mask(coordinates), TWO_PI, 0.0)
    trees = [KDTree(states, boxsize=around) for states in sets]
    return float(max(tree.query(states)[0].max() for tree, states in zip(trees, reversed(sets), strict=True)))


def _placed(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    x = as_states(states, coordinates)
    if not len(x) or not np.isfinite(x).all():
        raise StateError(
            f"a set of {len(x)} states, {int(np.isfinite(x).all(axis=1).sum())} of them finite; accepted: all, at least one"
        )
    return np.where(angle_mask(coordinates), wrap(x), x)
