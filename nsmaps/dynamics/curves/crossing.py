"""The curve in two parameters of the points at which two branches of periodic orbits cross, as at pitchforks.

There the derivative A of the gaps by states and first parameter has two null vectors, so that orbit and condition alone are not
independent. A is bordered by a column and two rows: the last entries of the row that solves the bordered equations are zero
exactly where A has two null vectors. These are two conditions; an unknown share of the column added to the gaps, zero wherever
the crossing persists, makes the equations independent: W.-J. Beyn et al., in: Handbook of Dynamical Systems 2 (2002) 149.
"""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.dynamics.curves.problem import CriticalCurve, CriticalPoint

H = 1e-5  #: step of the differences of the conditions, in the curve's units


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
        left, _, right = np.linalg.svd(here.jacobian)
        column, rows = left[:, -1] * np.copysign(1.0, left[np.abs(left[:, -1]).argmax(), -1]), right[-2:]
        slopes = self._changes(y, here.orbit.returns.codes, column, rows)
        if slopes is None:
            return None
        size = len(here.residual)
        jacobian = np.zeros((size + 2, len(y)))
        jacobian[:size, 0], jacobian[:size, 1:-1], jacobian[:size, -1] = column, here.jacobian, there
        jacobian[size:, 1:] = slopes
        residual = np.append(here.residual + y[0] * column, _deficiency(here.jacobian, column, rows))
        return CriticalPoint(
            self.unknowns(here.y, second) + y[0] * np.eye(1, len(y))[0], (first, second), here.orbit, residual, jacobian
        )

    def _changes(self, y: Floats, codes: Ints, column: Floats, rows: Floats) -> Floats | None:
        """The derivatives of both conditions by the unknowns but for the first, by central differences."""
        found = np.empty((2, len(y) - 1))
        for k in range(1, len(y)):
            sides = [y + sign * H * np.eye(1, len(y), k)[0] for sign in (1, -1)]
            ends = [self.in_first(self.values(side)[1]).evaluate(side[1:-1]) for side in sides]
            if any(end is None or not np.array_equal(end.orbit.returns.codes, codes) for end in ends):
                return None
            high, low = (_deficiency(end.jacobian, column, rows) for end in ends if end is not None)
            found[:, k - 1] = (high - low) / (2 * H)
        return found

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        others = self.along.difference(one[1:-1], other[1:-1])
        return np.concatenate([[one[0] - other[0]], others, [one[-1] - other[-1]]])


def _deficiency(jacobian: Floats, column: Floats, rows: Floats) -> Floats:
    """Two numbers that are zero where a matrix (m, m + 1) has two null vectors, shape (2,)."""
    size = len(jacobian)
    bordered = np.zeros((size + 2, size + 2))
    bordered[:size, :-1], bordered[:size, -1], bordered[size:, :-1] = jacobian, column, rows
    return np.linalg.solve(bordered.T, np.eye(1, size + 2, size + 1)[0])[size:]
