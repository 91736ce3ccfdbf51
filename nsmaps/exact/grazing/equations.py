"""The equations of a touch of a wall with speed zero, and their solutions as curves.

With s the time from the last impact before the touch, gap and rate of the flight vanish together: two equations in (v, phi, s).
"""

from dataclasses import dataclass
from math import hypot, isfinite, sqrt
from operator import mul

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Control, correct, follow, length, passes, tangent
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.itinerary import touch

SHORTEST = 1e-9  # flight to a touch, in periods: in shorter ones the ball has not left the wall
SMALLEST = 1e-13  # step, in sizes of the box, at which a curve is abandoned
NEAR_CURVE = 1e-6  # as a share of the size of the box: a point nearer to a curve than this counts as lying on it
POINT_ROUNDING = 1e-14  # relative rounding of a point, by which a wall may be met shortly before it would be touched
BEND = 0.995  # least cosine between the directions at both ends of a step
MAX_POINTS = 20_000
WHOLE = 1e-12  # of a turn: boxes that lack less contain every phase
EARLY = 1e-5  # of the time of a touch, at least: an impact so shortly before it is the touch itself
CROWDED = 0.02  # of the greatest step, below which points are left out
SPEED, PHASE, TIME = range(3)  # columns of points, the first two also of states


@dataclass(frozen=True, slots=True)
class Frame:
    """The box of states and a kernel, in units of the box's sizes and of a period: (v, phi, s) is `scale` times a point."""

    p: Flow
    base_up: bool  #: True if the base wall is the upper one
    low: Floats
    high: Floats
    scale: Floats

    @property
    def circle(self) -> bool:
        """True if the box contains every phase."""
        return bool(self.high[PHASE] - self.low[PHASE] >= TWO_PI * (1 - WHOLE))

    def difference_of(self, difference: Floats) -> Floats:
        """A difference of points (..., 3), with phases the shorter way round the circle."""
        if self.circle:
            turn, difference = TWO_PI / self.scale[PHASE], difference.copy()
            phi = difference[..., PHASE]
            phi -= turn * np.rint(phi / turn)
        return difference

    def outside(self, y: Floats) -> str:
        """The reason why a point is outside the box, or an empty string."""
        v, phi, s = map(mul, y.tolist(), self.scale.tolist())
        if v <= SMALLEST * self.scale[SPEED] or s <= SHORTEST * self.scale[TIME]:
            return "rest"
        (low_v, low_phi), (high_v, high_phi) = self.low.tolist(), self.high.tolist()
        return "" if low_v <= v <= high_v and (self.circle or low_phi <= phi <= high_phi) else "box"


@dataclass(frozen=True, slots=True)
class TouchPoint:
    """A point on or near a curve, with gap and rate of the flight at the touch."""

    y: Floats  #: v, phi and the flight's time s as shares of the frame's scale, shape (3,)
    residual: Floats  #: gap and rate, shape (2,)
    jacobian: Floats  #: their derivatives, shape (2, 3)
    why: str  #: the reason why there is no such touch nearby; "" where there is one
    slowest: float  #: least speed of the impacts before it

    @property
    def by_gap(self) -> Floats:
        """The derivatives of the gap, shape (3,)."""
        gap, _ = self.jacobian
        return np.asarray(gap)

    @property
    def near(self) -> bool:
        """True if the gap is within reach of a curve."""
        gap, _ = self.residual
        return bool(abs(gap) < NEAR_CURVE * np.linalg.norm(self.by_gap))


@dataclass(frozen=True, slots=True)
class Touch:
    """One kind of touch: of the upper or lower wall, after a number of impacts on the wall that is not the base."""

    frame: Frame
    hits: int
    upper: bool

    def evaluate(self, y: Floats) -> TouchPoint | None:
        """Gap and rate at a point; None where there is no flight."""
        scale = self.frame.scale.tolist()
        v, phi, s = map(mul, y.tolist(), scale)
        if not (v > 0 and s > 0):
            return None
        found = touch(self.frame.p, v, phi, s, self.hits, self.upper)
        gap_v, gap_phi, rate_v, rate_phi = found.by_state
        by_gap = [*map(mul, (gap_v, gap_phi, found.rate), scale)]
        by_rate = [*map(mul, (rate_v, rate_phi, found.acceleration), scale)]
        if not all(map(isfinite, (found.gap, found.rate, *by_gap, *by_rate))):
            return None
        why = "graze"
        if found.slowest > 0 and found.acceleration <= 0:
            why = "inflection"
        elif found.slowest > 0:
            early = max(EARLY, sqrt(2 * POINT_ROUNDING * hypot(*by_gap) / found.acceleration) / s)
            why = "" if found.share > 1 - early else "graze"
        return TouchPoint(y, np.array([found.gap, found.rate]), np.array([by_gap, by_rate]), why, float(found.slowest))

    def exists(self, point: TouchPoint) -> bool:
        """True if the flight of a solution is that of a state in the box and meets no wall on its way."""
        return not (self.frame.outside(point.y) or point.why)

    def connects(self, one: TouchPoint, other: TouchPoint) -> bool:
        """Touches of one kind belong to one curve."""
        return True

    def difference(self, one: Floats, other: Floats) -> Floats:
        """A difference of points, with phases the shorter way round."""
        return self.frame.difference_of(one - other)

    def direction(self, point: TouchPoint) -> Floats:
        """The unit tangent at a point, oriented by the product of the gradients of gap and rate."""
        return tangent(point, np.cross(*point.jacobian))

    def end(self, point: TouchPoint, along: Floats) -> str:
        """The reason why the curve ends in a direction at its last point, from what is found a little beyond it."""
        beyond = point.y + 10 * NEAR_CURVE * along
        if reason := self.frame.outside(beyond):
            return reason
        there = self.evaluate(beyond)
        if there is None or not there.near:
            return "graze"
        return (there.why or "lost") if point.slowest > 100 * NEAR_CURVE * self.frame.scale[SPEED] else "graze"

    def branch(self, start: TouchPoint, along: Floats, max_points: float) -> tuple[str, list[Floats]]:
        """The curve from a point on it in one direction: (the reason why it ends, or `closed`; its further points)."""
        points: list[Floats] = []
        last, direction = start, along
        for step in follow(self, start, along, Control(max_points, SMALLEST, BEND, growth=2.0)):
            if len(points) > 2 and passes(self, step, start, along, BEND):
                return "closed", points
            points.append(step.end.y)
            last, direction = step.end, step.turned
            if len(points) >= MAX_POINTS:
                break
        return self.end(last, direction), points

    def curve(self, seed: Floats, max_points: float) -> tuple[Floats, tuple[str, str]] | None:
        """The curve through a point near it: its points, shape (M, 3), and why it ends at both ends; None if there is none."""
        near = self.evaluate(seed)
        start = None if near is None else correct(self, seed, self.direction(near))
        if start is None or length(self.difference(start.y, seed)) > NEAR_CURVE:
            return None
        along = self.direction(start)
        last, ahead = self.branch(start, along, max_points)
        if last == "closed":
            *_, end = ahead
            turns = end - start.y - self.difference(end, start.y)
            return np.array([start.y, *ahead, start.y + turns]), ("closed", "closed")
        first, behind = self.branch(start, -along, max_points)
        points = [*behind[::-1], start.y, *ahead]
        return (_thin(points, CROWDED * max_points), (first, last)) if len(points) > 1 else None


def _thin(points: list[Floats], least: float) -> Floats:
    """The points without those whose states crowd at an end; both ends are preserved."""
    first, *inner, end = points
    kept, last = [first], first
    for point in inner:
        if min(np.linalg.norm((point - other)[:TIME]) for other in (last, end)) > least:
            kept.append(last := point)
    return np.array([*kept, end])
