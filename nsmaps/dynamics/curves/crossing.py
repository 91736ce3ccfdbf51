"""The curve in two parameters of the points at which two branches of periodic orbits cross, as at pitchforks.

The unknowns and equations are those of one such point, `nsmaps.dynamics.continuation.crossing`, and the second parameter.
"""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.crossing import H, borders_of, conditions, slope_of, slopes_of
from nsmaps.dynamics.curves.problem import CriticalCurve, CriticalPoint


@dataclass(frozen=True, slots=True)
class CrossingCurve(CriticalCurve):
    """The branch points of a map of two parameters; the first unknown of a point is the share of the column in the gaps."""

    def unknowns(self, y: Floats, second: float) -> Floats:
        """Those of a branch in the first parameter, at a value of the second, as unknowns of the curve."""
        return np.concatenate([[0.0], y, [second / self.unit]])

    def evaluate(self, y: Floats) -> CriticalPoint | None:
        """The orbit at these unknowns, with the derivatives of its gaps and of the conditions; None where there is none."""
        first, second = self.values(y)
        here = self.in_first(second).evaluate(y[1:-1])
        there = None if here is None else self._by_second(here, first, second)
        if here is None or there is None:
            return None
        borders, size = borders_of(here.jacobian), len(here.residual)
        beside = self.in_first(second + H * self.unit), self.in_first(second - H * self.unit)
        slopes = slopes_of(self.in_first(second), here, borders)
        last = slope_of(beside, (here.y, here.y), here.orbit.returns.codes, borders)
        if slopes is None or last is None:
            return None
        jacobian = np.zeros((size + 2, len(y)))
        jacobian[:size, 0], jacobian[:size, 1:-1], jacobian[:size, -1] = borders[0], here.jacobian, there
        jacobian[size:, 1:-1], jacobian[size:, -1] = slopes, last
        residual = np.append(here.residual + y[0] * borders[0], conditions(here.jacobian, borders))
        return CriticalPoint(np.concatenate([y[:1], here.y, y[-1:]]), (first, second), here.orbit, residual, jacobian)

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        return np.concatenate([one[:1] - other[:1], self.along.difference(one[1:-1], other[1:-1]), one[-1:] - other[-1:]])
