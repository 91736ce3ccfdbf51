"""The basin of a motion as a condition: its share of some states, sampled, and a search without its derivative."""

from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.arrivals import follow
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.design.problem import Point
from nsmaps.dynamics.design.search import Search

REACH = 1e-6  #: distance from the motion, in its scale, within which a state has come to it
FIRST, LAST = 0.05, 1e-3  #: steps of COBYLA, as shares of the parameters' ranges
TRIALS = 60  #: points of COBYLA, at most
SPREAD = 64  #: points in the bounds that are tried where one is better than the best known
ROUNDS = 8  #: searches from the best point known, at most


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
    met: list[Point] = field(default_factory=list)  #: motions that meet all conditions

    def share(self, point: Point) -> float:
        """The least share of the states that come to a motion, at its parameters and beside them; or the first one too small."""
        key = point.at.tobytes()
        if key not in self.shares:
            found = 1.0
            for offset in self.offsets:
                found = min(found, self._share(point.at + offset))
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

    def conditions(self, at: Floats) -> Floats:
        """The conditions and the share beyond what is asked for, shape (c + 1,)."""
        point, found = self.search.here(at)
        if point is None:
            return np.append(found, -1.0)
        beyond = self.share(point) - self.least
        if beyond >= 0 and self.search.met(at):
            self.met.append(point)
        return np.append(found, beyond)

    def best(self, begin: Floats) -> Point | None:
        """The best motion known that meets all conditions; None without one.

        COBYLA first continues from `begin`. Which of the points that hold the share it meets is chance, so that points spread
        over the bounds are tried too, those of the best values first, until one is better; then COBYLA continues from the
        best known, as long as that leads further.
        """
        self._search(begin)
        for at in self._spread(len(begin)):
            if self.search.sought(at) >= self._least():
                break
            self.conditions(at)
        for _ in range(ROUNDS):
            least = self._least()
            if self.met:
                self._search(self._known().at)
            if self._least() >= least:
                break
        return self._known() if self.met else None

    def _spread(self, k: int) -> list[Floats]:
        """Points of a Halton sequence at which the other conditions are met, the best first."""
        from scipy.stats.qmc import Halton

        return sorted(filter(self.search.met, Halton(k, scramble=False).random(SPREAD)), key=self.search.sought)

    def _known(self) -> Point:
        """The best motion known that meets all conditions."""
        return min(self.met, key=lambda point: self.search.sign * point.value)

    def _least(self) -> float:
        """What is sought at the best motion known; infinite without one."""
        return self.search.sought(self._known().at) if self.met else np.inf

    def _search(self, begin: Floats) -> None:
        """Search with COBYLA; its points that meet all conditions are kept."""
        from scipy.optimize import minimize

        minimize(
            lambda x: min(self.search.sought(np.clip(x, 0.0, 1.0)), 1e3),
            begin,
            bounds=[(0.0, 1.0)] * len(begin),
            constraints=[{"type": "ineq", "fun": lambda x: self.conditions(np.clip(x, 0.0, 1.0))}],
            method="COBYLA",
            tol=LAST,
            options={"rhobeg": FIRST, "maxiter": TRIALS},
        )
