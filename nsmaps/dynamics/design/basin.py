"""The basin of a motion as a condition: its share of some states, sampled, and a search without a derivative."""

from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.arrivals import follow
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.design.problem import Point
from nsmaps.dynamics.design.search import Search

REACH = 1e-6  #: distance from the motion, in its scale, within which a state has come to it
BESIDE = 1e-3  #: share of a parameter's range within which a share that is asked for is held too: it is erratic
SIZES, SPREAD = 10, 8  #: boxes in which points are tried, each half as wide as the one before, and points in each per parameter
ROUNDS = 8  #: times that they are tried, at most


def attractor_of(point: Point) -> Attractor:
    """The motion as an attractor."""
    orbit = point.orbit
    coordinates = orbit.returns.coordinates
    return Attractor(coordinates, orbit.states, len(orbit.states), orbit.label, orbit.words, REACH, orbit.scale)


@dataclass(slots=True, eq=False)
class Basin:
    """The basin of a motion over the parameters, as shares of the same states."""

    search: Search
    states: Floats  #: shape (N, n)
    returns: int  #: within which a state is to come to the motion
    least: float  #: share that is asked for
    offsets: Floats  #: shape (m, k), of parameters at which the share is asked for, as shares of their ranges, zero first
    shares: dict[bytes, float] = field(default_factory=dict)

    def share(self, point: Point) -> float:
        """The least share of the states that come to a motion, at its parameters and beside them; or the first one too small."""
        key = point.at.tobytes()
        if key not in self.shares:
            found = 1.0
            beside = BESIDE * np.vstack([np.eye(len(point.at)), -np.eye(len(point.at))]) if self.least else self.offsets[:0]
            for at in (*(point.at + self.offsets), *np.clip(point.at + beside, 0.0, 1.0)):
                found = min(found, self._share(at))
                if found < self.least:
                    break
            self.shares[key] = found
        return self.shares[key]

    def _share(self, at: Floats) -> float:
        """The share at parameters, zero where the motion is lost."""
        point = self.search.here(at)[0]
        if point is None:
            return 0.0
        return float((follow(point.system, self.states, [attractor_of(point)], self.returns, in_time=True).label == 0).mean())

    def best(self, begin: Floats) -> Point | None:
        """The best motion found that meets all conditions; None without one.

        Which points hold the share is erratic, so that points of a Halton sequence are tried in boxes of all sizes around
        `begin`, those of the best values first, until one holds it; then around that, as long as it leads to a better one.
        """
        from scipy.stats.qmc import Halton

        k, found, around = len(begin), None, begin
        points, sides = Halton(k, scramble=False), np.repeat(0.5 ** np.arange(-1, SIZES - 1), SPREAD * k)[:, None]
        for _ in range(ROUNDS):
            spread = np.clip(around + sides * (points.random(len(sides)) - 0.5), 0.0, 1.0)
            better = self._first(spread, np.inf if found is None else self.search.sought(found.at))
            if better is not None:
                found, around = better, better.at
            elif found is not None:
                break
        return found

    def _first(self, spread: Floats, limit: float) -> Point | None:
        """The best motion at some parameters (m, k), better than a limit, that meets all conditions."""
        for at in sorted(filter(self.search.met, spread), key=self.search.sought):
            point = self.search.here(at)[0]
            if point is None or self.search.sought(at) >= limit:
                break
            if self.share(point) >= self.least:
                return point
        return None
