"""Pseudo-arclength continuation (Keller) of the states whose flight touches a wall with speed zero.

With s the time from the last impact before the touch, gap and rate of the flight vanish together: two equations in (v, phi, s),
solved by Newton's method in the plane across the direction of the last step.
"""

from dataclasses import dataclass

import numpy as np

from nsmaps.exact.engine.flow import Flow
from nsmaps.exact.engine.itinerary import touch
from nsmaps.exact.impacts import TWO_PI, Floats

SHORTEST = 1e-9  # flight to a touch, in periods: below it the ball has not left the wall
SMALLEST = 1e-13  # step, in sizes of the box, at which a curve is given up
NEAR = 1e-6  # of the size of the box: what is this near to a curve may be taken to lie on it
BEND = 0.995  # least cosine between the directions at both ends of a step
MOST_POINTS = 20_000


@dataclass(frozen=True, slots=True)
class Frame:
    """The box of states and a kernel, in units of the box's sizes and of a period: (v, phi, s) is `scale` times a place."""

    p: Flow
    base_up: bool  #: is the base wall the upper one
    low: Floats
    high: Floats
    scale: Floats

    @property
    def circle(self) -> bool:
        """Does the box hold every phase."""
        return bool(self.high[1] - self.low[1] >= TWO_PI * (1 - 1e-12))

    def apart(self, difference: Floats) -> Floats:
        """A difference of places (..., 3), of phases that on the circle."""
        if self.circle:
            turn = TWO_PI / self.scale[1]
            difference = difference - np.array([0.0, turn, 0.0]) * np.round(difference[..., 1:2] / turn)
        return difference

    def outside(self, place: Floats) -> str:
        """Why a place is not in the box, or nothing."""
        v, phi, s = place * self.scale
        if v <= SMALLEST * self.scale[0] or s <= SHORTEST * self.scale[2]:
            return "rest"
        return "" if self.low[0] <= v <= self.high[0] and (self.circle or self.low[1] <= phi <= self.high[1]) else "box"


@dataclass(frozen=True, slots=True)
class Touch:
    """One kind of touch: of the upper or lower wall, after so many impacts on the wall that is not the base."""

    frame: Frame
    hits: int
    upper: bool

    def equations(self, place: Floats) -> tuple[str, Floats, Floats]:
        """Why there is no such touch near here, or nothing; gap and rate; their derivatives by place, shape (2, 3)."""
        v, phi, s = place * self.frame.scale
        if not (v > 0 and s > 0):
            return "rest", np.full(2, np.nan), np.empty((2, 3))
        slowest, share, gap, rate, a, by = touch(self.frame.p, v, phi, s, self.hits, self.upper)
        slopes = np.array([[by[0], by[1], rate], [by[2], by[3], a]]) * self.frame.scale
        why = "inflection" if a <= 0 else "" if share > 1 - 1e-5 else "graze"
        return (why if slowest > 0 else "graze"), np.array([gap, rate]), slopes

    def direction(self, place: Floats) -> Floats:
        """The unit tangent of the curve through a place on it."""
        _, _, (one, two) = self.equations(place)
        along = np.cross(one / np.linalg.norm(one), two / np.linalg.norm(two))
        return along / np.linalg.norm(along)

    def solve(self, place: Floats, along: Floats) -> tuple[str, Floats]:
        """The place on the curve in the plane across a direction through a place near it: (why there is none, or nothing; it)."""
        size = np.inf
        for _ in range(20):
            _, values, slopes = self.equations(place)
            if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
                break
            norms = np.linalg.norm(slopes, axis=1)
            try:
                step = np.linalg.solve(np.vstack([slopes / norms[:, None], along]), np.append(-values / norms, 0.0))
            except np.linalg.LinAlgError:
                return "lost", place
            before, size = size, float(np.abs(step[:2]).max())
            if size <= 4e-16 or (size <= 1e-12 and size >= 0.5 * before):
                return self.frame.outside(place) or self.equations(place)[0], place
            place = place + step
        return "lost", place

    def end(self, place: Floats, along: Floats) -> str:
        """Why the curve goes on in a direction from its last place no further: by what is found a little beyond."""
        beyond = place + 10 * NEAR * along
        slowest = touch(self.frame.p, *place * self.frame.scale, self.hits, self.upper)[0]
        why, (gap, _), (slope, _) = self.equations(beyond)
        same = abs(gap) < NEAR * np.linalg.norm(slope) and slowest > 100 * NEAR * self.frame.scale[0]  # path to the touch
        return self.frame.outside(beyond) or ((why or "lost") if same else "graze")

    def branch(self, start: Floats, along: Floats, longest: float) -> tuple[str, list[Floats]]:
        """The curve from a place on it in one direction: (why it ends, or `closed`; its further places)."""
        places: list[Floats] = []
        h, place = longest, start
        while h > SMALLEST and len(places) < MOST_POINTS:
            told, new = self.solve(place + h * along, along)
            if told or np.linalg.norm(self.frame.apart(new - place)) > 2 * h:
                h /= 2
                continue
            turned = self.direction(new)
            turned = turned * np.copysign(1.0, turned @ along)
            if turned @ along < BEND and h > NEAR:
                h /= 2
                continue
            if len(places) > 2 and self.passes(start, place, new, along):
                return "closed", places
            places.append(new)
            place, along, h = new, turned, min(2 * h, longest)
        return self.end(place, along), places

    def passes(self, start: Floats, place: Floats, new: Floats, along: Floats) -> bool:
        """Does the step from a place to a new one pass the start."""
        step, back = new - place, self.frame.apart(start - place)
        share = float(back @ step) / float(step @ step)
        return 0 < share <= 1 and float(np.linalg.norm(back - share * step)) < 0.1 * float(np.linalg.norm(step))

    def curve(self, seed: Floats, longest: float) -> tuple[Floats, tuple[str, str]] | None:
        """The curve through a place near it: its places, shape (M, 3), and why it ends at both; None if there is none."""
        told, start = self.solve(seed, self.direction(seed))
        if told or np.linalg.norm(self.frame.apart(start - seed)) > NEAR:
            return None
        along = self.direction(start)
        last, ahead = self.branch(start, along, longest)
        if last == "closed":
            turns = np.round((ahead[-1] - start)[1] * self.frame.scale[1] / TWO_PI) * TWO_PI / self.frame.scale[1]
            return np.array([start, *ahead, start + np.array([0.0, turns, 0.0])]), ("closed", "closed")
        first, behind = self.branch(start, -along, longest)
        places = [*behind[::-1], start, *ahead]
        return (_thinned(places, 0.02 * longest), (first, last)) if len(places) > 1 else None


def _thinned(places: list[Floats], least: float) -> Floats:
    """The places without those whose states crowd at an end; both ends stay."""
    kept = places[:1]
    for place in places[1:-1]:
        if min(np.linalg.norm((place - other)[:2]) for other in (kept[-1], places[-1])) > least:
            kept.append(place)
    return np.array([*kept, places[-1]])
