"""Step iii: sets in which the map may attract, from the diagonals of the phase planes and from the ends of orbits."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.coordinates import TWO_PI, Coordinates, nearest_turn
from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.reduced.fit.filter import NearDiagonal
from nsmaps.reduced.fit.lifts import stretch_of
from nsmaps.reduced.partition.cell import BY_WORDS, Sorting, rounded, side_of

STARTS, RETURNS, TAIL = 24, 256, 64  #: starts along each axis of the plane, returns of their orbits, last states that count
RASTER, MOST_CELLS = 40, 10**7  #: cells of the raster that groups states, along each axis and at most in all
MARGIN = 0.01  #: margin around a group, as a share of the grid's sides
MOST_GROUPS = 4  #: for more boxes one hull is taken around all


def attracting_boxes(
    return_map: ReturnMap, returns: Returns, grid: Grid, criterion: NearDiagonal, sorting: Sorting = BY_WORDS
) -> tuple[Floats, Floats]:
    """Boxes around possible attractors, shape (B, n, 2), and the states in them that indicate these, shape (M, n).

    Where orbits that end in the grid's box leave it for single states, boxes hold these too: an attractor is not cut off.

    Candidates are the states near both diagonals where the surfaces have small derivatives (eq. r1uniond). Those are selected
    that lie
    together with states in which orbits stay: ends of orbits of the map from the whole grid. Where the grid covers
    an angle's circle a box may lie across its ends: then its upper bound is beyond them.

    Args:
        returns: of the whole grid, in its order.
    """
    box = box_of(grid)
    circles = returns.coordinates.angles & (box[:, 1] - box[:, 0] >= TWO_PI)
    stay = ends_of_orbits(return_map, grid)
    if not len(stay):
        return np.empty((0, *box.shape)), stay
    box = _reached(box, stay, np.any(returns.image[returns.valid] < 0, axis=0))
    states = np.concatenate([stay, near_diagonals(returns, grid, criterion, sorting)])
    group = _groups(states, box, circles)
    margin = MARGIN * (box[:, 1] - box[:, 0])
    kept = [states[group == k] for k in np.unique(group[: len(stay)])]
    if len(kept) > MOST_GROUPS:
        kept = [np.concatenate(kept)]
    boxes = np.array(_united([_around(part, box, margin, circles) for part in kept], box, circles))
    return boxes, np.concatenate([*kept, _beside_cuts(boxes, circles)])


def near_diagonals(returns: Returns, grid: Grid, criterion: NearDiagonal, sorting: Sorting = BY_WORDS) -> Floats:
    """The grid's states near both diagonals on parts of the surface of their word or family with small slopes, shape (M, n)."""
    found, sorts = [np.empty((0, len(returns.coordinates)))], sorting(returns)
    for number in np.unique(sorts[returns.valid]):
        member = returns.valid & (sorts == number)
        found.append(criterion.near(Surface("one sort", grid, member, returns.select(member))).start)
    return np.concatenate(found)


def ends_of_orbits(return_map: ReturnMap, grid: Grid) -> Floats:
    """States of the grid's box in which orbits from all over it end, and those to which they leave it for one return, (M, n).

    Longer ways outside, as in chatter, are left to resets.
    """
    box = box_of(grid)
    side = side_of(len(box), STARTS)
    starts = np.stack(np.meshgrid(*(np.linspace(low, high, side) for low, high in box)), axis=-1).reshape(-1, len(box))
    tail = Coordinates(return_map.coordinates).lift(orbit(return_map, starts, RETURNS).states[-TAIL:], box.mean(axis=1))
    there = inside(tail.reshape(-1, len(box)), box).reshape(tail.shape[:2])
    stays = there.copy()
    stays[1:-1] |= there[:-2] & there[2:] & np.isfinite(tail[1:-1]).all(axis=2)
    return np.unique(tail[stays].round(9), axis=0)


def _reached(box: Floats, states: Floats, signed: ArrayLike) -> Floats:
    """The hull of a box and of states (M, n), with a margin where these leave it; a coordinate that is not signed stays so."""
    margin = MARGIN * np.ptp(box, axis=1)
    low, high = states.min(axis=0), states.max(axis=0)
    below = np.where(low < box[:, 0], low - margin, box[:, 0])
    above = np.where(high > box[:, 1], high + margin, box[:, 1])
    return np.column_stack([np.where(~np.asarray(signed) & (box[:, 0] >= 0), np.maximum(below, 0.0), below), above])


def box_of(grid: Grid) -> Floats:
    """The grid's box, shape (n, 2)."""
    return np.array([[axis.low, axis.high] for axis in grid.axes.values()])


def inside(states: Floats, box: Floats) -> Bools:
    """A mask of the states in a box, shape (N,); False if NaN."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((states >= box[:, 0]) & (states <= box[:, 1])).all(axis=1))


def _around(states: Floats, box: Floats, margin: Floats, circles: Bools) -> Floats:
    """The hull of states (M, n) with a margin, in few digits and no larger than the box, shape (n, 2)."""
    x = np.column_stack([stretch_of(column) if circle else column for column, circle in zip(states.T, circles, strict=True)])
    ends = np.column_stack([x.min(axis=0) - margin, x.max(axis=0) + margin])
    short = np.array([[rounded(end, 100 * width) for end in pair] for pair, width in zip(ends, margin, strict=True)])
    return _part_in(short, box, circles)


def _beside_cuts(boxes: Floats, circles: Bools) -> Floats:
    """The centres of boxes (B, n, 2) on both ends of each circle that they lie across: the parts on either side may attract."""
    found = [np.empty((0, boxes.shape[1]))]
    for i in np.flatnonzero(circles):
        turn = np.floor(boxes[:, i] / TWO_PI)
        across = boxes[(turn[:, 0] < turn[:, 1]) & (np.ptp(boxes[:, i], axis=1) < TWO_PI)].mean(axis=2)
        for end in (0.0, np.nextafter(TWO_PI, 0)):
            found.append(np.where(np.arange(boxes.shape[1]) == i, end, across))
    return np.concatenate(found)


def _part_in(hull: Floats, box: Floats, circles: Bools) -> Floats:
    """The part of a hull (n, 2) in the box; on a circle all of it, up to one turn."""
    inner = np.column_stack([np.maximum(hull[:, 0], box[:, 0]), np.minimum(hull[:, 1], box[:, 1])])
    whole = hull[:, 1] - hull[:, 0] >= TWO_PI
    return np.where((circles & ~whole)[:, None], hull, np.where((circles & whole)[:, None], box, inner))


def _groups(states: Floats, box: Floats, circles: Bools) -> np.ndarray:
    """A number for each state, equal for those whose cells of a raster touch, around circles too."""
    from scipy.ndimage import label

    side = min(RASTER, int(MOST_CELLS ** (1 / len(box))))
    place = np.clip(((states - box[:, 0]) / (box[:, 1] - box[:, 0]) * side).astype(int), 0, side - 1)
    raster = np.zeros((side,) * len(box), bool)
    raster[tuple(place.T)] = True
    numbers = label(np.pad(raster, [(0, int(circle)) for circle in circles], mode="wrap"), np.ones((3,) * len(box)))[0]
    for i in np.flatnonzero(circles):  # the first cells are repeated after the last ones
        cells = np.moveaxis(numbers, i, 0)
        for k in map(tuple, np.argwhere(cells[0])):
            numbers[numbers == cells[side][k]] = cells[0][k]
    return numbers[tuple(place.T)]


def _united(boxes: Sequence[Floats], box: Floats, circles: Bools) -> list[Floats]:
    """The boxes, with those that overlap replaced by their hull until none do."""
    boxes = list(boxes)
    for i, a in enumerate(boxes):
        for j in range(i + 1, len(boxes)):
            middle = boxes[j].mean(axis=1)
            b = boxes[j] + np.where(circles, nearest_turn(middle, a.mean(axis=1)) - middle, 0.0)[:, None]
            if ((a[:, 0] <= b[:, 1]) & (b[:, 0] <= a[:, 1])).all():
                hull = _part_in(np.column_stack([np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 1], b[:, 1])]), box, circles)
                return _united([hull, *(other for k, other in enumerate(boxes) if k not in (i, j))], box, circles)
    return boxes
