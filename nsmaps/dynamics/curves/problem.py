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

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.dynamics.continuation.pieces import AtBorder
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.exponents.growth import product_of
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

H = 1e-6  #: step of the differences of the condition, in the curve's units
FAR = 0.01  #: distance from a border, in units of branches, up to which it is looked for
PARTS = (64, *[8] * 15)  #: into which that distance is divided, and the part with the first other word again: to rounding
Kind = Literal["period doubling", "fold", "branch point", "Neimark-Sacker", "grazing", "border collision", "detachment"]


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
    """Where a border is looked for beside an orbit: along one coordinate of one of its states.

    Beyond it returns have other words or, where these are the same, an image or a derivative that differs by a known jump.
    """

    state: int  #: number of the state
    step: Floats  #: shape (n,), a unit of the coordinate, upwards or downwards
    scale: Floats  #: shape (n,), scale of the coordinates
    image: Floats | None = None  #: shape (n,), jump of the image, in this scale
    derivative: Floats | None = None  #: shape (n, n), jump of the derivative, in this scale

    def distance(self, return_map: ReturnMap, states: Floats) -> Floats:
        """The distances of the state of M orbits (M, q, n) from the border, in units of the step, or infinity."""
        own, rows = states[:, self.state, None], np.arange(len(states))
        near, far, known = np.zeros(len(rows)), np.full(len(rows), FAR), np.ones(len(rows), bool)
        for parts in PARTS:
            steps = np.linspace(near, far, parts + 1, axis=-1)
            tried = own + np.insert(steps, 0, 0.0, axis=-1)[..., None] * self.step
            other = self.beyond(return_map, tried)
            known &= other.any(axis=1)
            if not known.any():
                break
            first = other.argmax(axis=1)
            near, far = steps[rows, np.maximum(first - 1, 0)], steps[rows, first]
        return np.where(known, (near + far) / 2, np.inf)

    def beyond(self, return_map: ReturnMap, states: Floats) -> Bools:
        """True for the states (M, K, n) beyond the border, of each row but for the first, which is on the near side."""
        by_words = self.image is None and self.derivative is None
        returns, shape = return_map.first_return(states.reshape(-1, states.shape[-1]), derivative=not by_words), states.shape[:2]
        if by_words:
            codes = returns.codes.reshape(shape)
            return np.asarray(codes[:, 1:] != codes[:, :1])
        found = self.image if self.derivative is None else self.derivative
        assert found is not None
        off = off_piece(returns, shape, self.scale)[self.derivative is not None].reshape(*shape, -1)[:, 1:]
        return np.asarray(((off - found.ravel()) ** 2).sum(axis=-1) < (off**2).sum(axis=-1))


def off_piece(returns: Returns, shape: tuple[int, int], scale: Floats) -> tuple[Floats, Floats]:
    """How far M K returns are off the linear map of the first of each K, scaled: images (M, K, n), derivatives (M, K, n, n)."""
    n = len(scale)
    assert returns.derivative is not None
    start, image, slopes = returns.start.reshape(*shape, n), returns.image.reshape(*shape, n), returns.derivative
    slopes = slopes.reshape(*shape, n, n) * scale / scale[:, None]
    difference = returns.coordinates.difference
    linear = np.einsum("mij,mkj->mki", slopes[:, 0], difference(start, start[:, :1]) / scale)
    return difference(image, image[:, :1]) / scale - linear, slopes - slopes[:, :1]


@dataclass(frozen=True, slots=True)
class CriticalCurve:
    """The periodic orbits of a map of two parameters that meet a condition, as a curve that can be continued."""

    map_of: Callable[[float, float], ReturnMap]
    along: OrbitCurve  #: of the orbits in the first parameter, at any value of the second
    low: float  #: least value of the second parameter
    high: float  #: its greatest
    kind: Kind
    least: float = 0.0  #: clearance of orbits beside a graze or a border on the curve, in units of branches
    side: Side | AtBorder | None = None  #: where the border is, of a border collision

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

    def unknowns(self, y: Floats, second: float) -> Floats:
        """Those of a branch in the first parameter, at a value of the second, as unknowns of the curve."""
        return np.append(y, second / self.unit)

    def values(self, y: Floats) -> tuple[float, float]:
        """The parameters among the unknowns."""
        return float(y[-2] * self.along.unit), float(y[-1] * self.unit)

    def evaluate(self, y: Floats) -> CriticalPoint | None:
        """The orbit at these unknowns, with the derivatives of its gaps and of the condition; None where there is none."""
        first, second = self.values(y)
        here = self.in_first(second).evaluate(y[:-1])
        there = None if here is None else self._by_second(here, first, second)
        slopes = None if here is None or there is None else self._slopes(y, here)
        if here is None or there is None or slopes is None or not np.isfinite(slopes).all():
            return None
        jacobian = np.empty((len(slopes) - 1, len(slopes)))
        jacobian[:-1, :-1], jacobian[:-1, -1], jacobian[-1] = here.jacobian, there, slopes
        residual = np.append(here.residual, self._conditions(self.map_of(first, second), here.orbit.returns))
        return CriticalPoint(np.append(here.y, y[-1]), (first, second), here.orbit, residual, jacobian)

    def residual(self, y: Floats, codes: Ints) -> tuple[Floats, Floats] | None:
        """Unknowns with wrapped angles, and their gaps and condition, without derivatives; None for other words than these."""
        return_map, _ = map_or_reason(self.map_of, *self.values(y))
        if return_map is None:
            return None
        states = return_map.on_section(self.along.coordinates.wrap(self.along.states(y[:-1])))
        returns = return_map.first_return(states, derivative=not self.least)
        if not returns.valid.all() or not np.array_equal(returns.codes, codes):
            return None
        gaps = returns.coordinates.difference(returns.image, np.roll(states, -1, axis=0)) / self.along.scale
        y = np.append(self.along.y(states, y[-2] * self.along.unit), y[-1])
        return y, np.append(gaps.ravel(), self._conditions(return_map, returns))

    def _by_second(self, here: OrbitPoint, first: float, second: float) -> Floats | None:
        """The derivative of the gaps by the second parameter, shape (q n,), or None."""
        curve = self.in_second(first)
        return_map, _ = map_or_reason(curve.map_of, second)
        slopes = None if return_map is None else curve.by_value(return_map, here.orbit.returns, second)
        return slopes if slopes is not None and np.isfinite(slopes).all() else None

    def clearance(self, return_map: ReturnMap, states: Floats) -> Floats:
        """The distances of M orbits (M, q, n) from the graze or the border, in units of branches."""
        return self.along.margins(return_map, states)[:, 0] if self.side is None else self.side.distance(return_map, states)

    def _conditions(self, return_map: ReturnMap, returns: Returns) -> Floats:
        """The condition of M orbits, given by their M q returns, shape (M,), zero on the curve."""
        shape = (-1, self.along.period, returns.start.shape[1])
        if self.least or self.side is not None:
            return self.clearance(return_map, returns.start.reshape(shape)) - self.least
        assert returns.derivative is not None
        whole = product_of(returns.derivative.reshape(*shape, shape[-1]).swapaxes(0, 1))
        if self.kind != "Neimark-Sacker":
            one = 1.0 if self.kind == "period doubling" else -1.0
            return np.asarray(np.linalg.det(whole + one * np.eye(shape[-1])))
        values = np.linalg.eigvals(whole)
        i, j = np.triu_indices(shape[-1], 1)
        return np.asarray(np.prod(values[:, i] * values[:, j] - 1, axis=1).real)

    def _slopes(self, y: Floats, here: OrbitPoint) -> Floats | None:
        """The derivative of the condition by the unknowns, by central differences.

        It is zero by a coordinate that an orbit keeps, as of a body in contact, so that states beside have other words.
        """
        if isinstance(self.side, AtBorder):
            first, second = self.values(y)
            by_first = self.side.equation(self.in_first(second), here, first)[1]
            return np.append(by_first, self.side.equation(self.in_second(first), here, second)[1][-1])
        h, size = min(H, self.least / 100) if self.least else H, len(y)
        found = np.empty((2, size))
        for sign, row in zip((1, -1), found, strict=True):
            moved = y + sign * h * np.eye(size)
            of_states = self._moved(moved[:-2], here)
            if of_states is None:
                each = [self._moved(one[None], here) for one in moved[:-2]]
                of_states = np.array([np.nan if condition is None else condition[0] for condition in each])
            row[:-2] = of_states
            for k in (-2, -1):
                condition = self._moved(moved[k][None], here)
                if condition is None:
                    return None
                row[k] = condition[0]
        known = np.isfinite(found).all(axis=0)
        slopes = np.where(known, np.subtract(*np.where(known, found, 0.0)) / (2 * h), np.nan)
        slopes[:-2][~np.isfinite(found[:, :-2]).any(axis=0)] = 0.0
        return np.asarray(slopes)

    def _moved(self, y: Floats, here: OrbitPoint) -> Floats | None:
        """The condition at M unknowns of the same parameters, shape (M,); None where a state has no image, or another word."""
        return_map, _ = map_or_reason(self.map_of, *self.values(y[0]))
        if return_map is None:
            return None
        states = return_map.on_section(self.along.coordinates.wrap(np.concatenate([self.along.states(row[:-1]) for row in y])))
        returns = return_map.first_return(states, derivative=not self.least)
        same = (returns.codes.reshape(len(y), -1) == here.orbit.returns.codes).all()
        return self._conditions(return_map, returns) if same and returns.valid.all() else None

    def exists(self, point: CriticalPoint) -> bool:
        """True if an orbit converged and all of its returns are certified by the map."""
        return point.orbit.converged and point.orbit.exists

    def connects(self, one: CriticalPoint, other: CriticalPoint) -> bool:
        """True if two orbits have the same words."""
        return np.array_equal(one.orbit.returns.codes, other.orbit.returns.codes)

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        return np.append(self.along.difference(one[:-1], other[:-1]), one[-1] - other[-1])
