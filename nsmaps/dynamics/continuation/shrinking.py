"""Ends of branches at which the orbit shrinks: to an equilibrium, or to a point, by quantities extrapolated to zero."""

from itertools import pairwise

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.zeros import extrapolated
from nsmaps.dynamics.continuation.branch import GrowingBranch
from nsmaps.dynamics.continuation.events import BORDER, HOPF, BifurcationPoint
from nsmaps.dynamics.continuation.problem import OrbitPoint
from nsmaps.dynamics.scale import extents_of

SMALLEST = 1e-9  #: step, as a share of the parameter's range, at which a branch is abandoned
CLOSE = 1e-3  #: a margin from a graze, in the curve's units, within which a branch that ends while it falls is taken to end there
APART = 1.1  #: least ratio of the distances from the end of a branch, of successive points that are considered there
WORST = 1e-4  #: precision of a graze, in the parameter's range, above which it is not one
TINY = 1e-300  #: least margin above one that is zero
ALIKE = 0.5  #: least ratio of their growth with the logarithm of the distance, of a homoclinic orbit


def points_from_end(grown: GrowingBranch) -> list[OrbitPoint]:
    """Points of a branch from the last one back, at distances that grow geometrically: next to a graze steps are rounding."""
    points, reached = [grown.points[-1]], 0.0
    for point, arclength in zip(grown.points[-2::-1], grown.arclength[-2::-1], strict=True):
        if (off := grown.arclength[-1] - arclength) > reached:
            points.append(point)
            reached = APART * off
    return points


def vanishes(grown: GrowingBranch, _: float) -> BifurcationPoint | None:
    """The place next to the last point at which the time of the orbit is zero, as where two thresholds become one."""
    last, unit, points = grown.points[-1], grown.curve.unit, points_from_end(grown)
    times = np.array([point.orbit.returns.time.sum() for point in points])
    rows = doubling_rows(times)
    if len(rows) < 3 or not 0 < times[0] <= CLOSE * max(point.orbit.returns.time.sum() for point in grown.points):
        return None
    value, precision = at_zero(times[rows].tolist(), np.array([points[k].value for k in rows]))
    if not precision <= WORST * unit:
        return None
    return BifurcationPoint(BORDER, value, precision + SMALLEST * unit, last.orbit, "the time of the orbit falls to zero")


def becomes_equilibrium(grown: GrowingBranch, _: float) -> BifurcationPoint | None:
    """The Hopf bifurcation next to the last point: the square of the extent is linear in the parameter, and falls to zero.

    Events of orbits that are so small are left out: rounding makes them. See Kuznetsov 2004, section 3.4.
    """
    last, unit = grown.points[-1], grown.curve.unit
    if not CLOSE * _extent(grown, grown.points[0]) > _extent(grown, last) > 0:
        return None
    points = points_from_end(grown)
    squares, values = np.array([_extent(grown, point) ** 2 for point in points]), np.array([point.value for point in points])
    large = squares > (CLOSE * _extent(grown, grown.points[0])) ** 2  # of smaller orbits rounding changes the extent
    rows = doubling_rows(squares[large])
    if len(rows) < 3:
        return None
    value, precision = at_zero(squares[large][rows].tolist(), values[large][rows])
    shares = squares[large][rows] / np.abs(values[large][rows] - value)
    if not (precision <= WORST * unit and shares.min() > ALIKE * shares.max()):
        return None
    small = float(np.abs(values[~large] - value).max())
    grown.events[:] = [event for event in grown.events if abs(event.value - value) > small]
    return BifurcationPoint(HOPF, value, precision + SMALLEST * unit, last.orbit, "the orbit shrinks to an equilibrium")


def _extent(grown: GrowingBranch, point: OrbitPoint) -> float:
    """The largest extent of an orbit in any coordinate, in the curve's units; NaN where none are known."""
    moved = extents_of(grown.curve.map_of(point.value), point.orbit.states)
    return np.nan if moved is None else float((moved / grown.curve.scale).max())


def at_zero(margins: list[float], values: Floats) -> tuple[float, float]:
    """Where a margin is zero, by the four successive points that agree best with their first three and with the next four.

    Next to a graze a parameter is known to fewer digits, far from it the margin is of higher degree.
    """
    found = [extrapolated(margins[k : k + 4], values[k : k + 4]) for k in range(max(len(margins) - 3, 1))]
    shift = [abs(one - other) for (one, _), (other, _) in pairwise(found)]
    errors = [max(error, off) for (_, error), off in zip(found, [*shift, *shift[-1:]] or [0.0], strict=True)]
    best = int(np.argmin(errors))
    return found[best][0], errors[best]


def doubling_rows(margins: Floats) -> list[int]:
    """Up to eight rows, the first and each with at least twice the margin of the one before, as far as it grows."""
    rows = [0]
    for k in range(1, len(margins)):
        if not margins[k] >= 0.5 * margins[rows[-1]]:  # it falls, by more than rounding
            return rows
        if max(2 * margins[rows[-1]], TINY) <= margins[k] < np.inf and len(rows) < 8:
            rows.append(k)
    return rows
