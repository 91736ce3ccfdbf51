"""The curve of a periodic orbit that meets one condition, in states and two parameters.

A point is (x_1, ..., x_q, first, second), in units in which the ranges of the parameters and a whole orbit are of order one, as
for branches in one parameter. The condition is a further equation: det(J + 1) = 0 at a period doubling, det(J - 1) = 0 at a fold,
with the derivative J of q returns, and a product of (a b - 1) over pairs of its eigenvalues at a Neimark-Sacker bifurcation. At a
graze a clearance, at a border the distance of a state from states of other words, equals a small number.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import ReturnMap, map_or_reason

H = 1e-6  #: step of the differences of the condition, in the curve's units
FAR = 0.01  #: distance from a border, in units of branches, up to which it is looked for
PARTS, DIVISIONS = 64, 9  #: into which that distance is divided, and the part with the first other word again
Kind = Literal["period doubling", "fold", "Neimark-Sacker", "grazing", "border collision"]


@dataclass(frozen=True, slots=True)
class CriticalPoint:
    """A point on or near the curve."""

    y: Floats  #: shape (q n + 2,), in units of the curve
    values: tuple[float, float]  #: of the parameters
    orbit: PeriodicOrbit
    residual: Floats  #: the gaps and the condition, shape (q n + 1,)
    jacobian: Floats  #: shape (q n + 1, q n + 2)


@dataclass(frozen=True, slots=True)
class Side:
    """Where a border is looked for beside an orbit: along one coordinate of one of its states."""

    state: int  #: number of the state
    step: Floats  #: shape (n,), a unit of the coordinate, upwards or downwards

    def distance(self, map: ReturnMap, states: Floats) -> float:
        """The distance of the state from one with another word, in units of the step, or infinity."""
        near, far = 0.0, FAR
        for _ in range(DIVISIONS):
            steps = np.linspace(near, far, PARTS + 1)
            codes = map.first_return(states[self.state] + np.append(0.0, steps)[:, None] * self.step).codes
            other = np.flatnonzero(codes[1:] != codes[0])
            if not len(other):
                return np.inf
            near, far = steps[max(other[0] - 1, 0)], steps[other[0]]
        return float(near + far) / 2


@dataclass(frozen=True, slots=True)
class CriticalCurve:
    """The periodic orbits of a map of two parameters that meet a condition, as a curve that can be continued."""

    map_of: Callable[[float, float], ReturnMap]
    along: OrbitCurve  #: of the orbits in the first parameter, at any value of the second
    low: float  #: least value of the second parameter
    high: float  #: its greatest
    kind: Kind
    least: float = 0.0  #: clearance of orbits beside a graze or a border on the curve, in units of branches
    side: Side | None = None  #: where the border is, of a border collision

    @property
    def unit(self) -> float:
        """The unit of the second parameter: the length of its range."""
        return self.high - self.low

    def in_first(self, second: float) -> OrbitCurve:
        """The orbits in the first parameter at a value of the second."""
        return replace(self.along, map_of=lambda first: self.map_of(first, second))

    def in_second(self, first: float) -> OrbitCurve:
        """The orbits in the second parameter at a value of the first."""
        return replace(self.along, map_of=lambda second: self.map_of(first, second), low=self.low, high=self.high)

    def values(self, y: Floats) -> tuple[float, float]:
        """The parameters among the unknowns."""
        return float(y[-2] * self.along.unit), float(y[-1] * self.unit)

    def evaluate(self, y: Floats) -> CriticalPoint | None:
        """The orbit at these unknowns, with the derivatives of its gaps and of the condition; None where there is none."""
        first, second = self.values(y)
        here = self.in_first(second).evaluate(y[:-1])
        there = self.in_second(first).evaluate(np.append(y[:-2], y[-1]))
        if here is None or there is None:
            return None
        slopes = self._slopes(y, here)
        if slopes is None or not np.isfinite(slopes).all():
            return None
        jacobian = np.vstack([np.hstack([here.jacobian, there.jacobian[:, -1:]]), slopes])
        residual = np.append(here.residual, self.condition(self.map_of(first, second), here.orbit))
        return CriticalPoint(np.append(here.y, y[-1]), (first, second), here.orbit, residual, jacobian)

    def clearance(self, map: ReturnMap, states: Floats) -> float:
        """The distance of an orbit from the graze or the border, in units of branches."""
        return float(self.along.margins(map, states)[0]) if self.side is None else self.side.distance(map, states)

    def condition(self, map: ReturnMap, orbit: PeriodicOrbit) -> float:
        """The condition, zero on the curve."""
        if self.least:
            return self.clearance(map, orbit.states) - self.least
        if self.kind != "Neimark-Sacker":
            one = 1.0 if self.kind == "period doubling" else -1.0
            return float(np.linalg.det(orbit.derivative + one * np.eye(len(orbit.derivative))))
        values = np.linalg.eigvals(orbit.derivative)
        i, j = np.triu_indices(len(values), 1)
        return float(np.prod(values[i] * values[j] - 1).real)

    def _slopes(self, y: Floats, here: OrbitPoint) -> Floats | None:
        """The derivative of the condition by the unknowns, by central differences."""
        h = min(H, self.least / 100) if self.least else H
        found = np.empty(len(y))
        for k in range(len(y)):
            ends = []
            for sign in (h, -h):
                moved = y.copy()
                moved[k] += sign
                map, _ = map_or_reason(self.map_of, *self.values(moved))
                orbit = None if map is None else self._orbit(map, moved)
                if map is None or orbit is None or not np.array_equal(orbit.returns.codes, here.orbit.returns.codes):
                    return None
                ends.append(self.condition(map, orbit))
            found[k] = (ends[0] - ends[1]) / (2 * h)
        return found

    def _orbit(self, map: ReturnMap, y: Floats) -> PeriodicOrbit | None:
        """The returns of the states among the unknowns, with derivatives; None where one has no image."""
        returns = map.first_return(self.along.coordinates.wrap(self.along.states(y[:-1])), derivative=True)
        known = returns.valid.all() and returns.derivative is not None
        return PeriodicOrbit(returns, self.along.tolerance, self.along.scale) if known else None

    def exists(self, point: CriticalPoint) -> bool:
        """True if an orbit converged and all of its returns are certified by the map."""
        return point.orbit.converged and point.orbit.exists

    def connects(self, one: CriticalPoint, other: CriticalPoint) -> bool:
        """True if two orbits have the same words."""
        return np.array_equal(one.orbit.returns.codes, other.orbit.returns.codes)

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        return np.append(self.along.difference(one[:-1], other[:-1]), one[-1] - other[-1])
