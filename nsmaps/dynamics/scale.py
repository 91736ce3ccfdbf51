"""The unit of small quantities in each coordinate of a map: from how far its motions move, and its own dimensions.

Tolerances, steps and arclengths are shares of it. It follows a change of units and does not depend on the origin of a coordinate,
so that nothing happens where a coordinate of an orbit is zero.
"""

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.errors import StateError
from nsmaps.exact.returnmap import ExactMap, ReturnMap

MOST = 4  #: states whose motions are looked at
SMALL = 1e-3  #: share of what a coordinate changes by with the others, below which its magnitude is near zero by chance
CONSTANT = 1e-12  #: share of the magnitude of a coordinate, below which its extent is rounding


def scale_of(return_map: ReturnMap, *states: Floats, beside: Floats | None = None) -> Floats:
    """The unit of each coordinate at some states (..., n) of a map, shape (n,): a radian of an angle.

    Of others it is the extent of the states and of the motions through them between events, and of an impact speed the largest
    speed on these: `extents` of the map. Where a coordinate does not move between events, as of a map that resets give, it is at
    least what the image would change by if a parameter changed by its own value (the median of those that move it: one may be an
    origin), or another coordinate by its unit. Of a map that has no `extents` it is the largest magnitude among the states and
    those `beside` them, unless it is far below what the image changes by with the others. It is above zero: 1 where all of these
    are zero.
    """
    coordinates = Coordinates(return_map.coordinates)
    points = np.concatenate([np.reshape(some, (-1, len(coordinates))) for some in states])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.ones(len(coordinates)) if beside is None else coordinates.magnitudes(beside)
    some = points if len(points) <= MOST else points[np.unique(np.linspace(0, len(points) - 1, MOST).astype(int))]
    moved = extents_of(return_map, some)
    if moved is None:
        known = coordinates.magnitudes(points, points if beside is None else beside)
        linked = (_slopes(return_map, some) * np.where(coordinates.angles, 0.0, known)).max(axis=1)
        return np.where(~coordinates.angles & (known < SMALL * linked), linked, known)
    sizes = np.abs(points).max(axis=0, initial=0.0)
    fixed = ~coordinates.angles & ~(moved > CONSTANT * sizes)
    if fixed.any():
        moved = _linked(return_map, np.where(fixed, 0.0, np.where(coordinates.angles, 1.0, moved)), some, fixed)
        moved = np.where(moved > CONSTANT * sizes, moved, sizes)
    moved = np.maximum(moved, np.ptp(points, axis=0))
    return np.where(coordinates.angles | (moved == 0), 1.0, moved)


def extents_of(return_map: ReturnMap, points: Floats) -> Floats | None:
    """The extents of the motions through states (N, n) that are starts, shape (n,), zero without one; None if none are known."""
    found = np.zeros(points.shape[1])
    for k, point in enumerate(points):
        if k and (point == points[k - 1]).all():
            continue
        try:
            own = return_map.extents(point[None])
        except StateError:
            continue
        if own is None:
            return None
        found = np.fmax(found, own)
    return found


def _linked(return_map: ReturnMap, unit: Floats, points: Floats, fixed: Bools) -> Floats:
    """Units (n,) in which those of fixed coordinates are found from the parameters and the others, by derivatives of images."""
    slopes = _slopes(return_map, points)
    if isinstance(return_map, ExactMap):
        moves = [return_map.sensitivity(points, {name: value}) for name, value in return_map.parameters.items() if value]
        each = np.nan_to_num(np.abs(np.reshape(moves, (-1, *points.shape))), posinf=0.0).max(axis=1, initial=0.0)
        middle = [float(np.median(column[column > 0])) if column.any() else 0.0 for column in each.T]
        unit = np.where(fixed, middle, unit)
    for _ in unit:
        unit = np.where(fixed, np.maximum(unit, (slopes * unit).max(axis=1)), unit)
        if unit.all():
            break
    return unit


def _slopes(return_map: ReturnMap, points: Floats) -> Floats:
    """The largest magnitudes of the derivatives of images by other coordinates, shape (n, n); zero where there are none."""
    n = points.shape[1]
    returns = return_map.first_return(points, derivative=True)
    if returns.derivative is None:
        return np.zeros((n, n))
    known = returns.derivative[np.isfinite(returns.derivative).all(axis=(1, 2))]
    return np.asarray(np.abs(known).max(axis=0, initial=0.0) * (1 - np.eye(n)))
