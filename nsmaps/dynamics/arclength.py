"""The curve of a periodic orbit in states and parameter, by pseudo-arclength (Keller) and multiple shooting.

A place is (x_1, ..., x_q, value) in units in which the range of the parameter and a whole orbit are of order one: speeds are
shares of the largest on the first orbit. On the curve each x_k is mapped to x_{k+1}, x_q to x_1. Newton's method stays in the
plane across a direction: folds are no obstacle.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsmaps.dynamics.motion import differences
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import ReturnMap, map_or_reason
from nsmaps.exact.impacts import Floats, Outcome, Returns, angle_mask, wrap
from nsmaps.exact.system import ImpactSystem

MOST_STEPS = 12  #: of Newton's method
LAST_STEP = 1e-9  #: of Newton's method: after it the error is below rounding
SHARES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  #: of the parameter's range, tried in turn for differences
AGREE = 1e-5  #: of the slope, in units of the curve, between differences of two steps whose extrapolation is taken


@dataclass(frozen=True, slots=True)
class Place:
    """A place on or near the curve: the orbit there, and the derivatives of its gaps by place."""

    y: Floats  #: shape (q n + 1,), states and parameter in units of the curve
    value: float  #: of the parameter
    orbit: PeriodicOrbit
    jacobian: Floats  #: shape (q n, q n + 1)
    margins: Floats  #: least gap to a wall that is not met and least impact speed, in the curve's units, shape (2,); inf: unknown

    @property
    def tangent(self) -> Floats:
        """A unit vector along the curve, of either sense."""
        return np.asarray(np.linalg.svd(self.jacobian)[2][-1])


@dataclass(frozen=True, slots=True)
class Curve:
    """The cycles of q returns of a map that depends on a parameter."""

    map_of: Callable[[float], ReturnMap]
    period: int
    low: float  #: least value of the parameter
    high: float  #: its greatest
    tolerance: float  #: of the residual
    scale: Floats  #: shape (n,), of the coordinates

    @property
    def unit(self) -> float:
        """Of the parameter: the length of its range."""
        return self.high - self.low

    def y(self, states: Floats, value: float) -> Floats:
        """States (q, n) and a value as a place."""
        return np.append((states / self.scale).ravel() / np.sqrt(self.period), value / self.unit)

    def place(self, y: Floats) -> Place | None:
        """The orbit at a place and the derivatives of its gaps; None where a state has no image.

        Raises:
            ValueError: there is no map at the place's value.
        """
        value = float(y[-1] * self.unit)
        for end in (self.low, self.high):
            value = end if np.isclose(value, end, rtol=1e-15, atol=0) else value  # met exactly: no map may be beyond
        map = self.map_of(value)
        states = (y[:-1] * np.sqrt(self.period)).reshape(self.period, -1) * self.scale
        states = np.where(angle_mask(map.coordinates), wrap(states), states)
        returns = map.first_return(states, derivative=True)
        if not returns.valid.all() or returns.derivative is None:
            return None
        q, n = states.shape
        jacobian = np.zeros((q, n, q, n))
        for k in range(q):
            jacobian[k, :, k] += returns.derivative[k] * self.scale / self.scale[:, None]
            jacobian[k, :, (k + 1) % q] -= np.eye(n)
        orbit = PeriodicOrbit(returns, self.tolerance, self.scale)
        by_value = np.broadcast_to(self._by_value(map, returns, value) / self.scale * self.unit, (q, n)).reshape(q * n, 1)
        both = np.hstack([jacobian.reshape(q * n, q * n) * np.sqrt(q), by_value])
        return Place(self.y(states, value), value, orbit, both, self._margins(map, states)) if np.isfinite(both).all() else None

    def _margins(self, map: ReturnMap, states: Floats) -> Floats:
        """As of a place: speeds as shares of the speed's scale, gaps of what that flies in a radian of the forcing's phase."""
        if not isinstance(map, ImpactSystem):
            return np.full(2, np.inf)
        legs, speed = map.legs(states), self.scale[0]
        return np.array([legs.clearance.min() * map.phase_rate() / speed, legs.slowest.min() / speed])

    def _by_value(self, map: ReturnMap, returns: Returns, value: float) -> Floats:
        """The derivative of the images by the parameter, shape (q, n): through impacts where the map is exact."""

        def images(value: float) -> Floats | None:
            there = self.map_of(value).first_return(returns.start)
            if not (there.valid.all() and np.array_equal(there.codes, returns.codes)):
                return None
            return differences(there.image, returns.image, returns.coordinates)

        def parameters(value: float) -> Floats:
            there = self.map_of(value)
            assert isinstance(there, ImpactSystem)
            return np.array(list(there.parameters.values()))

        if isinstance(map, ImpactSystem):
            known = np.abs(parameters(value))
            rates = _derivative(parameters, value, self.unit, np.where(known == 0, 1.0, known))
            exact = map.sensitivity(returns.start, dict(zip(map.parameter_names(), rates.tolist(), strict=True)))
            if np.isfinite(exact).all():
                return exact
        return _derivative(images, value, self.unit, self.scale)

    def solve(self, y: Floats, along: Floats) -> Place | None:
        """The place on the curve in the plane across a direction through a place near it; None where there is none."""
        try:
            for _ in range(MOST_STEPS):
                here = self.place(y)
                if here is None:
                    return None
                step = np.linalg.solve(np.vstack([here.jacobian, along]), np.append(-(here.orbit.gaps / self.scale).ravel(), 0.0))
                y = here.y + step
                if np.linalg.norm(step) <= LAST_STEP:
                    there = self.place(y)
                    return there if there is not None and there.orbit.converged and there.orbit.exists else None
        except ValueError:  # no map where the method went, or a singular matrix
            return None
        return None

    def missing(self, value: float) -> str:
        """Why there is no map at a value of the parameter, or nothing."""
        return map_or_reason(self.map_of, value)[1]

    def outcomes(self, states: Floats, value: float) -> str:
        """What becomes of states at a value of the parameter, in words."""
        returns = self.map_of(value).first_return(states)
        told = (f"{word} {Outcome(k).name}".strip() for word, k in zip(returns.words, returns.outcome.tolist(), strict=True))
        return ", ".join(dict.fromkeys(told))

    def apart(self, a: Place, b: Place) -> float:
        """The distance of two places, angles the shorter way round."""
        states = differences(a.orbit.states, b.orbit.states, a.orbit.returns.coordinates)
        return float(np.linalg.norm(self.y(states, a.value - b.value)))


def _derivative(f: Callable[[float], Floats | None], x: float, unit: float, scale: Floats) -> Floats:
    """The derivative of an array by a number, by central differences of two widths, extrapolated (Richardson).

    The widest that agree, in a unit and a scale of order one, are taken; to one side where the other has no value, as next to the
    end of a valid domain; else NaN.
    """

    def slope(low: float, high: float) -> Floats | None:
        try:
            ends = f(low), f(high)
        except ValueError:
            return None
        return None if ends[0] is None or ends[1] is None else (ends[1] - ends[0]) / (high - low)

    for h in unit * np.array(SHARES):
        wide, narrow = slope(x - h, x + h), slope(x - h / 2, x + h / 2)
        if wide is None or narrow is None:
            continue
        if np.abs((wide - narrow) / scale).max() <= AGREE * (1 / unit + np.abs(narrow / scale).max()):
            return (4 * narrow - wide) / 3
    h = SHARES[-1] * unit
    sided = (slope(x, x + h), slope(x - h, x))
    return next((one for one in sided if one is not None), np.full(1, np.nan))
