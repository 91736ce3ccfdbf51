"""The curve of a periodic orbit that meets one condition, in states and two parameters.

A point is (x_1, ..., x_q, first, second), in units in which the ranges of the parameters and a whole orbit are of order one, as
for branches in one parameter. The condition is a further equation: det(J + 1) = 0 at a period doubling, det(J - 1) = 0 at a fold,
with the derivative J of q returns, and at a graze a clearance that equals a small number.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import ReturnMap

H = 1e-6  #: step of the differences of the condition, in the curve's units
Kind = Literal["period doubling", "fold", "grazing"]


@dataclass(frozen=True, slots=True)
class CriticalPoint:
    """A point on or near the curve."""

    y: Floats  #: shape (q n + 2,), in units of the curve
    values: tuple[float, float]  #: of the parameters
    orbit: PeriodicOrbit
    residual: Floats  #: the gaps and the condition, shape (q n + 1,)
    jacobian: Floats  #: shape (q n + 1, q n + 2)


@dataclass(frozen=True, slots=True)
class CriticalCurve:
    """The periodic orbits of a map of two parameters that meet a condition, as a curve that can be continued."""

    map_of: Callable[[float, float], ReturnMap]
    along: OrbitCurve  #: of the orbits in the first parameter, at any value of the second
    low: float  #: least value of the second parameter
    high: float  #: its greatest
    kind: Kind
    least: float = 0.0  #: clearance of grazing orbits on the curve, in units of branches

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
        residual = np.append(here.residual, self.condition(here))
        return CriticalPoint(np.append(here.y, y[-1]), (first, second), here.orbit, residual, jacobian)

    def condition(self, point: OrbitPoint) -> float:
        """The condition, zero on the curve."""
        if self.kind == "grazing":
            return float(point.margins[0] - self.least)
        derivative = point.orbit.derivative
        return float(np.linalg.det(derivative + (1.0 if self.kind == "period doubling" else -1.0) * np.eye(len(derivative))))

    def _slopes(self, y: Floats, here: OrbitPoint) -> Floats | None:
        """The derivative of the condition by the unknowns, by central differences."""
        h = min(H, self.least / 100) if self.least else H
        found = np.empty(len(y))
        for k in range(len(y)):
            ends = []
            for sign in (h, -h):
                moved = y.copy()
                moved[k] += sign
                first, second = self.values(moved)
                point = self._plain(moved, first, second)
                if point is None or not np.array_equal(point.orbit.returns.codes, here.orbit.returns.codes):
                    return None
                ends.append(self.condition(point))
            found[k] = (ends[0] - ends[1]) / (2 * h)
        return found

    def _plain(self, y: Floats, first: float, second: float) -> OrbitPoint | None:
        """The orbit at these unknowns, without the derivatives of its gaps."""
        try:
            map = self.map_of(first, second)
        except ValueError:
            return None
        states = self.along.coordinates.wrap(self.along.states(y[:-1]))
        returns = map.first_return(states, derivative=True)
        if not returns.valid.all() or returns.derivative is None:
            return None
        orbit, none = PeriodicOrbit(returns, self.along.tolerance, self.along.scale), np.empty(0)
        margins = self.along.margins(map, states) if self.kind == "grazing" else np.full(2, np.inf)
        return OrbitPoint(y[:-1], first, orbit, none, none, margins)

    def exists(self, point: CriticalPoint) -> bool:
        """True if an orbit converged and all of its returns are certified by the map."""
        return point.orbit.converged and point.orbit.exists

    def connects(self, one: CriticalPoint, other: CriticalPoint) -> bool:
        """True if two orbits have the same words."""
        return np.array_equal(one.orbit.returns.codes, other.orbit.returns.codes)

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        return np.append(self.along.difference(one[:-1], other[:-1]), one[-1] - other[-1])
