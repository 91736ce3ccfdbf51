"""The curve in two parameters beyond which a body remains in contact for all times, where its orbit detaches.

The orbit shrinks to a point of the contact there, and its derivatives by the parameters grow without bound. The curve is
therefore followed in the plane of the parameters alone: from a point along the line through the last two, and by bisection
across it, on whether the motion ends in contact. Parameters are in units of their ranges.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.continuation.core import correct, passes_by
from nsmaps.dynamics.continuation.ends import rests_for_good
from nsmaps.dynamics.curves.problem import CriticalCurve
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import map_or_reason

SHORTEST = 1e-7  #: step at which a curve is abandoned
WIDTH = 0.25  #: share of a step, to either side of its end within which the curve is looked for
SECANT = 1e-3  #: distance of the second point, which gives the first direction
BEND = 0.98  #: least cosine between the directions of two steps
BESIDE = 1e-4  #: distance in the first parameter of the orbits that are still released
CLOSED = "closed"  #: the reason of a curve that returns to its first point
FIRST = np.array([1.0, 0.0])  #: the direction of the first parameter


@dataclass(frozen=True, slots=True)
class ContactCurve:
    """The boundary of lasting contact in the plane of two parameters."""

    curve: CriticalCurve  #: the orbits, and the ranges of the parameters
    orbit: PeriodicOrbit  #: from whose first state contact is tried
    step: float  #: longest step
    max_points: int  #: greatest number of points in a direction

    @property
    def units(self) -> Floats:
        """The lengths of the ranges, shape (2,)."""
        return np.array([self.curve.along.unit, self.curve.unit])

    @property
    def bounds(self) -> Floats:
        """The ends of the ranges, shape (2, 2): least and greatest value by parameter."""
        along = self.curve.along
        return np.array([[along.low, along.high], [self.curve.low, self.curve.high]]) / self.units[:, None]

    def way(self, start: Floats, sense: float) -> tuple[Floats, str]:
        """The points (K, 2) after a first one, from a sense in the second parameter on, and the reason of the end."""
        points, ended = [start / self.units], ""
        for point, last in self._followed(points[0], sense):
            if not self.bounds[0, 0] <= point[0] <= self.bounds[0, 1]:
                ended = f"the range of the first parameter ends before {point[0] * self.units[0]:.9g}"
                break
            points.append(point)
            if last:
                ended = f"the range of the second parameter ends at {point[1] * self.units[1]:g}"
            elif len(points) > 3 and passes_by(point - points[-2], points[0] - points[-2]):
                ended = CLOSED
            elif len(points) > self.max_points:
                ended = f"{self.max_points} points, before a range was covered"
            if ended:
                break
        first, second = points[-1] * self.units
        found = np.array(points[1:]).reshape(-1, 2) * self.units
        return found, ended or f"lost at {first:.9g}, {second:.9g}: no end of contact beyond"

    def orbit_beside(self, first: float, second: float) -> PeriodicOrbit | None:
        """The orbit of the same words on either side of a value of the first parameter, as a motion makes it; None if none is."""
        branch, k, q = self.curve.in_first(second), self.curve.along.resting[0], len(self.orbit.states)
        for sign in (1, -1):
            value = first + sign * BESIDE * branch.unit
            return_map, _ = map_or_reason(branch.map_of, value)
            if return_map is None:
                continue
            y = branch.y(np.roll(orbit(return_map, self.orbit.states[k], 2 * q).states[-q:], k + 1, axis=0), value)
            found = correct(branch, y, np.eye(1, len(y), len(y) - 1)[0]) if np.isfinite(y).all() else None
            if found is not None and np.array_equal(found.orbit.returns.codes, self.orbit.returns.codes):
                return found.orbit
        return None

    def _lasts(self, points: Floats) -> Bools:
        """True for the points (K, 2) at which contact lasts."""
        values = (points * self.units).tolist()
        return np.array([rests_for_good(map_or_reason(self.curve.map_of, *each)[0], self.orbit.states) for each in values])

    def _followed(self, start: Floats, sense: float) -> Iterator[tuple[Floats, bool]]:
        """The points of the curve after a first one, and whether the range of the second parameter ends there."""
        beside = self._across(start + np.array([0.0, sense * SECANT]), FIRST, SECANT / WIDTH)
        if beside is None:
            return
        along, here, h, last = _unit(beside - start), start, self.step, False
        while h > SHORTEST and not last:
            end = self.bounds[1, int(along[1] > 0)]
            to_end = (end - here[1]) / along[1] if along[1] else np.inf
            last = to_end <= h
            ahead = here + min(h, to_end) * along
            there = self._across(ahead, FIRST if last else np.array([-along[1], along[0]]), h)
            if there is None or not _unit(there - here) @ along > BEND:
                h, last = h / 2, False
                continue
            yield there, last
            along, here, h = _unit(there - here), there, min(1.5 * h, self.step)

    def _across(self, middle: Floats, direction: Floats, h: float) -> Floats | None:
        """The point at which contact begins to last, on a line through another point in a direction, or None."""
        low, high = (middle + sign * WIDTH * h * direction for sign in (-1, 1))
        lasts = self._lasts(np.array([low, high]))
        if lasts[0] == lasts[1]:
            return None
        return np.asarray(bisect_change(self._lasts, low[None], high[None], lasts[:1], lasts[1:])[1][0])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
