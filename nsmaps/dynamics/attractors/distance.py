"""Distances between attractors, and extents of sets of states."""

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, Coordinates, as_states
from nsmaps.errors import StateError
from nsmaps.errors.arguments import checked

if TYPE_CHECKING:
    from scipy.spatial import KDTree

FEW = 4  #: known states, up to which others are compared with each of them
NEIGHBOURS = 16  #: nearest states among which the two on either side of one are looked for first
FLAT = 0.01  #: share of the unit of a coordinate, or of the circle: a smaller extent is not used as a scale


def extents(states: ArrayLike, coordinates: Sequence[str], unit: Floats | None = None) -> Floats:
    """The extent of a set of states in each coordinate, shape (n,), always above 0: the scale of its distances.

    For an angle it is the shortest arc that contains all. States that nearly agree have no extent of their own: it is at least
    1 % of its unit, for an angle 1 % of the circle; 1 where every state is 0.

    Args:
        states: shape (N, n), at least one; angles on any turn.
        unit: shape (n,), of each coordinate, such as `scale_of`; the largest magnitudes if omitted.

    Raises:
        StateError: a set of another shape, empty, or with states that are not finite.
    """
    x, circle = _placed(states, coordinates), Coordinates(coordinates).angles
    ordered = np.sort(x, axis=0)
    gaps = np.diff(ordered, axis=0, append=ordered[:1] + TWO_PI)
    extent = np.where(circle, TWO_PI - gaps.max(axis=0), np.ptp(x, axis=0))
    extent = np.maximum(extent, FLAT * np.where(circle, TWO_PI, np.abs(x).max(axis=0) if unit is None else unit))
    return np.where(extent > 0, extent, 1.0)


@checked
def hausdorff(a: ArrayLike, b: ArrayLike, coordinates: Sequence[str], scale: ArrayLike = 1.0, p: float = 2) -> float:
    """The Hausdorff distance of two sets: the largest distance of a state of either from the nearest state of the other.

    Distances are in the coordinates' units, or in a given scale, with angles the shorter way round.

    Args:
        a, b: shapes (N, n) and (M, n), at least one state each; angles on any turn.
        scale: shape (n,), the unit of each coordinate, such as `extents`.
        p: order of the norm: 2 for the Euclidean one, infinity for the largest coordinate.

    Raises:
        StateError: sets of another shape, empty, or with states that are not finite.
    """
    sets = [_placed(states, coordinates) for states in (a, b)]
    return max(float(distances(x, y, coordinates, scale, p).max()) for x, y in (sets, reversed(sets)))


def distances(known: Floats, states: Floats, coordinates: Sequence[str], scale: ArrayLike = 1.0, p: float = 2) -> Floats:
    """The distance of each of N states (N, n) from the nearest of known ones (M, n), in a scale (n,), shape (N,).

    Args:
        known, states: angles in [0, 2 pi).
        scale: unit of each coordinate.
        p: order of the norm: 2 for the Euclidean one, infinity for the largest coordinate.
    """
    return Nearest(known, coordinates, scale).distances(states, p)


def widest_gap(states: Floats, coordinates: Sequence[str], scale: ArrayLike = 1.0) -> float:
    """The widest gap between neighbours on a curve that is known by states (N, n), in any order; 0 for less than three.

    Beside each state it is the distance of the nearest one on the side opposite to the nearest of all, as `distances` with the
    norm of infinity. An orbit whose rotation number is nearly rational leaves such gaps, though it comes back to itself.
    """
    if len(states) < 3:
        return 0.0
    nearest = Nearest(states, coordinates, scale)
    x, neighbours = nearest.known, nearest.tree.query(nearest.known, k=min(NEIGHBOURS, len(states)), p=np.inf)[1][:, 1:]

    def opposite(row: int, to: Floats) -> Floats:
        """The distance from the state of a row to the nearest of others on the side opposite to its neighbour."""
        off = nearest.shorter(to - x[row])
        behind = off @ nearest.shorter(x[neighbours[row, 0]] - x[row]) < 0
        return np.abs(off[behind]).max(axis=1).min(initial=np.inf)

    beside = np.array([opposite(row, x[few]) for row, few in enumerate(neighbours)])
    for row in np.flatnonzero(np.isinf(beside)).tolist():
        beside[row] = opposite(row, x)
    return float(beside[np.isfinite(beside)].max(initial=0.0))


class Nearest:
    """The nearest of M known states (M, n) to others, searched for by one tree; arguments as of `distances`."""

    def __init__(self, known: Floats, coordinates: Sequence[str], scale: ArrayLike = 1.0) -> None:
        self.unit = np.broadcast_to(np.asarray(scale, float), len(coordinates))
        above = np.nextafter(TWO_PI / self.unit, np.inf)  # above every state, after rounding too
        self.around = np.where(Coordinates(coordinates).angles, above, 0.0)
        self.known = known / self.unit

    def shorter(self, off: Floats) -> Floats:
        """Differences of states in the scale, with angles the shorter way round."""
        return off - self.around * np.round(off / np.where(self.around, self.around, 1.0))

    @cached_property
    def tree(self) -> "KDTree":
        """The search tree."""
        from scipy.spatial import KDTree

        return KDTree(self.known, boxsize=self.around)

    def distances(self, states: Floats, p: float = 2, max_distance: float = np.inf) -> Floats:
        """The distance of each state (N, n) from the nearest known one, shape (N,); infinity beyond `max_distance`."""
        x = states / self.unit
        if p == np.inf and len(self.known) <= FEW:
            nearest = self._least(x)
            return np.where(nearest <= max_distance, nearest, np.inf)
        return np.asarray(self.tree.query(x, p=p, distance_upper_bound=np.nextafter(max_distance, np.inf))[0])

    def _least(self, x: Floats) -> Floats:
        """The least over all known states of the largest difference in a coordinate, shape (N,), as the tree has it."""
        least, circles = np.full(len(x), np.inf), [(j, full) for j, full in enumerate(self.around.tolist()) if full]
        for j, full in circles:
            x[:, j] -= np.floor(x[:, j] / full) * full
        for one in self.known:
            gaps = np.abs(x - one)
            for j, full in circles:
                gaps[:, j] = np.minimum(gaps[:, j], full - gaps[:, j])
            np.minimum(least, gaps.max(axis=1), out=least)
        return least


def _placed(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    x = as_states(states, coordinates)
    if not len(x) or not np.isfinite(x).all():
        raise StateError(
            f"a set of {len(x)} states, {int(np.isfinite(x).all(axis=1).sum())} of them finite; expected: all, at least one"
        )
    return Coordinates(coordinates).wrap(x)
