"""The curve of a periodic orbit in states and parameter, by multiple shooting.

A point is (x_1, ..., x_q, value) in units in which the range of the parameter and a whole orbit are of order one: coordinates are
shares of the extent of the motion on the first orbit. On the curve each x_k is mapped to x_{k+1}, and x_q to x_1.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from inspect import unwrap

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.margins import margins_of, speeds_of
from nsmaps.dynamics.motion import has_rest
from nsmaps.dynamics.periodic import PeriodicOrbit, shooting_jacobian
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.dynamics.scale import extents_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ExactMap, ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.systems.parameters import System
from nsmaps.results import units_of

NOTHING = 1e-15  #: share of the scale of a coordinate, below which it is zero: no speed is negative by rounding
ROUNDING = 1e-15  #: share of the parameter's range within which a value counts as an end of the range
SHARES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  #: steps of differences, as shares of the parameter's range, tried in turn
AGREE = 1e-5  #: largest difference of slopes, in the curve's units, of two steps whose extrapolation is used


@dataclass(frozen=True, slots=True)
class OrbitPoint:
    """A point on or near the curve: the orbit there, and the derivatives of its gaps."""

    y: Floats  #: shape (q n + 1,), states and parameter in units of the curve
    value: float  #: of the parameter
    orbit: PeriodicOrbit
    residual: Floats  #: the gaps in units of the curve, shape (q n,)
    jacobian: Floats  #: shape (q n, q n + 1)


@dataclass(frozen=True, slots=True)
class OrbitCurve(WithCoordinates):
    """The periodic orbits of q returns of a map that depends on a parameter, as a curve that can be continued."""

    map_of: Callable[[float], ReturnMap]
    period: int
    low: float  #: least value of the parameter
    high: float  #: its greatest
    tolerance: float  #: tolerance of the residual
    coordinates: Coordinates
    scale: Floats  #: shape (n,), scale of the coordinates
    speeds: Floats | None = None  #: of `speeds_of`, the units of margins; None of maps that have none
    least_time: float = 0.0  #: time that a motion must take, as of `PeriodicOrbit`
    resting: tuple[int, ...] = ()  #: numbers of the states whose image does not depend on them, as a body comes to rest
    parameter: str = ""  #: its name
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    @property
    def unit(self) -> float:
        """The unit of the parameter: the length of its range."""
        return self.high - self.low

    def y(self, states: Floats, value: float) -> Floats:
        """States (q, n) and a value as unknowns of the curve."""
        return np.append((states / self.scale).ravel() / np.sqrt(self.period), value / self.unit)

    def states(self, y: Floats) -> Floats:
        """The states (q, n) among the unknowns; what is rounding beside the scale is zero, as the speed of a body at rest."""
        shares = (y[:-1] * np.sqrt(self.period)).reshape(self.period, -1)
        return np.asarray(np.where(np.abs(shares) < NOTHING, 0.0, shares) * self.scale)

    def physical(self, change: Floats) -> Floats:
        """A change of the unknowns as one of states and parameter, shape (q n + 1,); see `scaled`."""
        return np.append(self.states(change).ravel(), change[-1] * self.unit)

    def scaled(self, change: Floats) -> Floats:
        """A change of states and parameter as one of the unknowns."""
        return self.y(change[:-1].reshape(self.period, -1), change[-1])

    def evaluate(self, y: Floats) -> OrbitPoint | None:
        """The orbit at these unknowns and the derivatives of its gaps; None where there is no map, or a state has no image."""
        try:
            return self._evaluate(y)
        except ValueError:
            return None

    def _evaluate(self, y: Floats) -> OrbitPoint | None:
        value = float(y[-1] * self.unit)
        for end in (self.low, self.high):
            value = end if abs(value - end) <= ROUNDING * (abs(end) + self.unit) else value  # no map may exist beyond
        return_map = self.map_of(value)
        states = self._with_releases(return_map, return_map.on_section(self.coordinates.wrap(self.states(y))))
        if states is None:
            return None
        returns = return_map.first_return(states, derivative=True)
        if not returns.valid.all() or returns.derivative is None:
            return None
        q, n = states.shape
        orbit = PeriodicOrbit(returns, self.tolerance, self.scale, self.least_time)
        jacobian = np.empty((q * n, q * n + 1))
        jacobian[:, :-1] = shooting_jacobian(returns.derivative, self.scale) * np.sqrt(q)
        jacobian[:, -1] = self.by_value(return_map, returns, value)
        if not np.isfinite(jacobian).all():
            return None
        residual = (orbit.gaps / self.scale).ravel()
        return OrbitPoint(self.y(states, value), value, orbit, residual, jacobian)

    def _with_releases(self, return_map: ReturnMap, states: Floats) -> Floats | None:
        """States of which those that follow a rest are the images of those before it, as these do not depend on them.

        The instant of a release is the border of the states that are at rest: one before it, as predicted, is released later.
        None where one before it comes to no rest: its image depends on it, and would lead away from the states predicted.
        """
        before = list(self.resting)
        if before:
            rested = return_map.first_return(states[before])
            if not all(has_rest(word) for word in rested.words):
                return None
            states[[(k + 1) % self.period for k in before]] = rested.image
        return states

    def exists(self, point: OrbitPoint) -> bool:
        """True if an orbit converged and all of its returns are certified by the map."""
        return point.orbit.converged and point.orbit.exists

    def connects(self, one: OrbitPoint, other: OrbitPoint) -> bool:
        """True if two orbits have the same words and, over a cycle, the same turns of each angle."""
        words_agree = np.array_equal(one.orbit.returns.codes, other.orbit.returns.codes)
        return words_agree and np.array_equal(one.orbit.turns.sum(axis=0), other.orbit.turns.sum(axis=0))

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""
        states = self.coordinates.difference(self.states(one), self.states(other))
        return self.y(states, (one[-1] - other[-1]) * self.unit)

    def margins(self, return_map: ReturnMap, states: Floats) -> Floats:
        """The least gap to a wall that is not met and the least impact speed of orbits (..., q, n), shape (..., 2).

        Infinity where unknown; as of `margins_of`, with the largest speeds on the first orbit.
        """
        shape = states.shape[:-1]
        if not isinstance(return_map, ExactMap):
            return np.full((*shape[:-1], 2), np.inf)
        found = margins_of(return_map, states.reshape(-1, states.shape[-1]), self.speeds)
        return np.stack([each.reshape(shape).min(axis=-1) for each in found], axis=-1)

    def by_value(self, return_map: ReturnMap, returns: Returns, value: float) -> Floats:
        """The derivative of the gaps by the parameter, shape (q n,), in the curve's units; of exact maps through impacts."""

        def images(value: float) -> Floats | None:
            there = self.map_of(value).first_return(unknown.start)
            if not (there.valid.all() and np.array_equal(there.codes, unknown.codes)):
                return None
            return unknown.coordinates.difference(there.image, unknown.image)

        slopes = np.full_like(returns.start, np.nan)
        if isinstance(return_map, ExactMap):
            slopes = return_map.sensitivity(returns.start, parameter_rates(self.map_of, value, self.unit, return_map))
        rows = np.flatnonzero(~np.isfinite(slopes).all(axis=1))
        if rows.size:
            unknown = returns.select(rows)
            slopes[rows] = derivative_of(images, value, self.unit, self.scale)
        return (slopes / self.scale * self.unit).ravel()

    def missing(self, value: float) -> str:
        """The reason why there is no map at a value of the parameter, or an empty string."""
        return map_or_reason(self.map_of, value)[1]

    def outcomes(self, states: Floats, value: float) -> str:
        """The outcomes of states at a value of the parameter, in words."""
        returns = self.map_of(value).first_return(states)
        ends = (f"{word} {Outcome(k).name}".strip() for word, k in zip(returns.words, returns.outcome.tolist(), strict=True))
        return ", ".join(dict.fromkeys(ends))


def curve_from(
    map_of: Callable[[float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    bounds: tuple[float, float],
    tolerance: float,
    parameter: str = "",
) -> OrbitCurve:
    """The curve of orbits near one at a value of the parameter, in units of its motion."""
    return_map, _ = map_or_reason(map_of, value)
    scale, coordinates = orbit.scale, orbit.returns.coordinates
    if return_map is not None and extents_of(return_map, orbit.states) is None:
        scale = np.maximum(scale, np.where(coordinates.angles, 0.0, _moved(map_of, orbit, value, bounds[1] - bounds[0])))
    speeds = None if return_map is None else speeds_of(return_map, orbit.states, scale)
    slopes = np.abs(orbit.returns.slopes) * scale / scale[:, None]
    constant = slopes.max(axis=(1, 2)) <= NOTHING
    resting = tuple(k for k, word in enumerate(orbit.words) if constant[k] and has_rest(word))
    low, high, units = *bounds, units_of(return_map)
    return OrbitCurve(
        map_of, len(orbit.states), low, high, tolerance, coordinates, scale, speeds, orbit.least_time, resting, parameter, units
    )


def _moved(map_of: Callable[[float], ReturnMap], orbit: PeriodicOrbit, value: float, unit: float) -> Floats:
    """What the images of an orbit change by over a range of the parameter, at their rate at the orbit, shape (n,)."""
    states, coordinates = orbit.states, orbit.returns.coordinates

    def images(value: float) -> Floats | None:
        there = map_of(value).first_return(states)
        return coordinates.difference(there.image, states) if there.valid.all() else None

    slopes = derivative_of(images, value, unit, orbit.scale)
    return unit * np.abs(slopes).max(axis=0) if np.isfinite(slopes).all() else np.zeros(len(coordinates))


def parameter_rates(
    map_of: Callable[[float], ReturnMap], value: float, unit: float, return_map: ReturnMap | None = None
) -> dict[str, float]:
    """The rates at which the parameters of a system change with a parameter of which it is a function, in this unit.

    The map at the value is made unless it is given. A parameter of the system itself changes at the rate 1, and alone.
    """

    def parameters(return_map: ReturnMap) -> Floats:
        assert isinstance(return_map, ExactMap | System)
        return np.array(list(return_map.parameters.values()))

    return_map = map_of(value) if return_map is None else return_map
    assert isinstance(return_map, ExactMap | System)
    along = unwrap(map_of)  # of a cache
    if isinstance(along, Along) and along.second is None and along.parameter in return_map.parameter_names():
        return {name: float(name == along.parameter) for name in return_map.parameter_names()}
    known = np.abs(parameters(return_map))
    rates = derivative_of(lambda value: parameters(map_of(value)), value, unit, np.where(known == 0, 1.0, known))
    return dict(zip(return_map.parameter_names(), rates.tolist(), strict=True))


def derivative_of(f: Callable[[float], Floats | None], x: float, unit: float, scale: Floats) -> Floats:
    """The derivative of an array by a number, by central differences of two widths, extrapolated (Richardson).

    The widest pair that agrees, in a unit and a scale of order one, is used; one-sided where the other side has no value, as
    next to the end of a valid domain; otherwise NaN, as where the steps that are left are below the rounding of the number.
    """

    def slope(low: float, high: float) -> Floats | None:
        if low == high:
            return None
        try:
            below = f(low)
            above = None if below is None else f(high)
        except ValueError:
            return None
        return None if below is None or above is None else (above - below) / (high - low)

    for h in unit * np.array(SHARES):
        wide = slope(x - h, x + h)
        narrow = None if wide is None else slope(x - h / 2, x + h / 2)
        if wide is None or narrow is None:
            continue
        if np.abs((wide - narrow) / scale).max() <= AGREE * (1 / unit + np.abs(narrow / scale).max()):
            return (4 * narrow - wide) / 3
    h = SHARES[-1] * unit
    sided = (slope(*ends) for ends in ((x, x + h), (x - h, x)))
    return next((one for one in sided if one is not None), np.full(1, np.nan))
