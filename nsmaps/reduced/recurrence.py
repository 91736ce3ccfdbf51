"""Step iii by itself: where the map may attract, from the diagonals of the phase planes and from where orbits stay."""

from collections.abc import Sequence

import numpy as np

from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.exact.impacts import Floats, Returns
from nsmaps.exact.surface import Grid, Surface
from nsmaps.reduced.cell import Bools, rounded
from nsmaps.reduced.diagonal import Diagonal, attracting

STARTS, RETURNS, TAIL = 24, 256, 64  #: starts along each axis, returns of their orbits, states at their ends that count
RASTER = 40  #: cells of the raster that groups states
MARGIN = 0.01  #: of the grid's sides, around a group
MOST_GROUPS = 4  #: beyond this one hull is taken around all


def attracting_boxes(map: ReturnMap, returns: Returns, grid: Grid, delta: float, slope: float) -> tuple[Floats, Floats]:
    """Boxes around what may attract, shape (B, n, 2), and the states in them that say so, shape (M, n).

    Candidates are the states near both diagonals where the surfaces are gentle (eq. r1uniond). Those are kept that lie
    together with states in which orbits stay: ends of orbits of the map from all over the grid.

    Args:
        returns: of the whole grid, in its order.
    """
    box = box_of(grid)
    stay = ends_of_orbits(map, grid)
    if not len(stay):
        return np.empty((0, *box.shape)), stay
    states = np.concatenate([stay, near_diagonals(returns, grid, delta, slope)])
    group = _groups(states, box)
    margin = MARGIN * (box[:, 1] - box[:, 0])
    kept = [states[group == k] for k in np.unique(group[: len(stay)])]
    if len(kept) > MOST_GROUPS:
        kept = [np.concatenate(kept)]
    return np.array(_united([_around(part, box, margin) for part in kept])), np.concatenate(kept)


def near_diagonals(returns: Returns, grid: Grid, delta: float, slope: float) -> Floats:
    """The grid's states near both diagonals on gentle parts of the surface of their word, shape (M, n)."""
    found = [np.empty((0, len(returns.coordinates)))]
    for code in np.unique(returns.codes[returns.valid]):
        member = returns.valid & (returns.codes == code)
        surface = Surface("word", grid, member, returns.select(member))
        found.append(surface.start[attracting(Diagonal(delta=delta, slope=slope, within=None), surface)])
    return np.concatenate(found)


def ends_of_orbits(map: ReturnMap, grid: Grid) -> Floats:
    """States of the grid's box in which orbits from all over it end, shape (M, n)."""
    box = box_of(grid)
    starts = np.stack(np.meshgrid(*(np.linspace(low, high, STARTS) for low, high in box)), axis=-1).reshape(-1, len(box))
    tail = orbit(map, starts, RETURNS).states[-TAIL:].reshape(-1, len(box))
    return np.unique(tail[inside(tail, box)].round(9), axis=0)


def box_of(grid: Grid) -> Floats:
    """The grid's box, shape (n, 2)."""
    return np.array([[axis.low, axis.high] for axis in grid.axes.values()])


def inside(states: Floats, box: Floats) -> Bools:
    """Which states lie in a box, shape (N,); none that is NaN."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((states >= box[:, 0]) & (states <= box[:, 1])).all(axis=1))


def _around(states: Floats, box: Floats, margin: Floats) -> Floats:
    """The hull of states (M, n) with a margin, in few digits and no larger than the box, shape (n, 2)."""
    ends = np.column_stack([states.min(axis=0) - margin, states.max(axis=0) + margin])
    short = [[rounded(end, 100 * width) for end in pair] for pair, width in zip(ends, margin, strict=True)]
    return np.column_stack([np.maximum(np.array(short)[:, 0], box[:, 0]), np.minimum(np.array(short)[:, 1], box[:, 1])])


def _groups(states: Floats, box: Floats) -> np.ndarray:
    """A number for each state, the same for those whose cells of a raster touch."""
    from scipy.ndimage import label

    place = np.clip(((states - box[:, 0]) / (box[:, 1] - box[:, 0]) * RASTER).astype(int), 0, RASTER - 1)
    raster = np.zeros((RASTER,) * len(box), bool)
    raster[tuple(place.T)] = True
    return label(raster, np.ones((3,) * len(box)))[0][tuple(place.T)]


def _united(boxes: Sequence[Floats]) -> list[Floats]:
    """The boxes, with those that overlap replaced by their hull until none do."""
    boxes = list(boxes)
    for i, a in enumerate(boxes):
        for j in range(i + 1, len(boxes)):
            b = boxes[j]
            if ((a[:, 0] <= b[:, 1]) & (b[:, 0] <= a[:, 1])).all():
                hull = np.column_stack([np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 1], b[:, 1])])
                return _united([hull, *(box for k, box in enumerate(boxes) if k not in (i, j))])
    return boxes
