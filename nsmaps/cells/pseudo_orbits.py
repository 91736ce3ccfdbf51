"""Pseudo-orbits that jump from cycle to cycle where these pass each other: guesses of longer cycles, as in a horseshoe."""

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.exact.returnmap import ReturnMap

NEAR = 0.05  #: of the window's sides, that a jump may be long in every coordinate
WALKS = 3000  #: of each length
MOST_POINTS = 3000  #: among which jumps are looked for, any of them where there are more


def spliced(return_map: ReturnMap, points: Floats, sides: Floats, period: int) -> list[Floats]:
    """Pseudo-orbits of 1, 2, ..., `period` of the points of cycles, shape (WALKS, p, n) for each p with any, at random.

    Args:
        points: shape (N, n).
        sides: of the window, shape (n,).
    """
    rng = np.random.default_rng(len(points))
    points = rng.permutation(points)[:MOST_POINTS]
    images = return_map.first_return(points).image
    near = Coordinates(return_map.coordinates).near(images[:, None], points, NEAR, sides)
    reach = [np.eye(len(points), dtype=bool)]
    for _ in range(period):
        reach.append(reach[-1].astype(np.float32) @ near.astype(np.float32) > 0)
    return [points[walk] for p in range(1, period + 1) if len(walk := _walks(near, reach, p, rng))]


def _walks(near: Bools, reach: list[Bools], length: int, rng: np.random.Generator) -> Ints:
    """Closed walks, shape (WALKS, length), from any nodes that lie on one, backwards over any arcs that lead there."""
    closes = np.flatnonzero(np.diag(reach[length]))
    if not len(closes):
        return np.empty((0, length), np.int64)
    walk = [rng.choice(closes, WALKS)]
    for k in range(length - 1, 0, -1):
        may = near[:, walk[-1]] & reach[k][walk[0]].T
        walk.append((may * rng.random(may.shape, np.float32)).argmax(axis=0))
    return np.stack(walk[:1] + walk[:0:-1], axis=1)
