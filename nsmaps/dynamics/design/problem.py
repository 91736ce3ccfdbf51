"""A periodic motion as a function of parameters: its orbit, an observable and its conditions, each with derivatives."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.continuation.problem import derivative_of, parameter_rates
from nsmaps.dynamics.design.conditions import FAR, STABILITY, Condition, margins, stability
from nsmaps.dynamics.observables.cycles import cycle_means, moved_states
from nsmaps.dynamics.periodic import PeriodicOrbit, newton_step, refined
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System

LONGEST = 0.2  #: largest predicted change of an orbit, in its scale
BEND = 0.2  #: largest correction of it, as a share of the change
ROUNDED = 1e-8  #: correction that is always allowed, as a share of the scale
SHORTEST = 1 / 64  #: share of the way to other parameters below which the motion counts as lost
NEARLY = 1e-4  #: share of its bound by which a multiplier may exceed it, the root of what `stability` resolves
TRIES = 60  #: steps on the way to other parameters


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """The motion at k parameters."""

    at: Floats  #: shape (k,), as shares of their ranges
    system: System
    orbit: PeriodicOrbit
    moved: Floats  #: shape (k, q, n), derivatives of its states
    value: float  #: of the observable
    gradient: Floats  #: shape (k,)


@dataclass(slots=True, eq=False)
class Problem:
    """A motion of q returns over a box of k parameters, with an observable."""

    system_of: Callable[..., System]
    names: tuple[str, ...]
    low: Floats  #: shape (k,)
    high: Floats
    observable: Observable
    per: str  #: return, period or time
    multiplier: float | None  #: bound of the magnitudes of multipliers
    graze: float  #: least margin from a graze
    known: list[Point] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The unit of the observable: the largest value met, or what its first derivatives make of the ranges."""
        return max(*(abs(one.value) for one in self.known), float(np.linalg.norm(self.known[0].gradient))) or 1.0

    def parameters(self, at: Floats) -> dict[str, float]:
        """The parameters by name."""
        values = (1 - at) * self.low + at * self.high  # exactly the bounds at 0 and 1
        return dict(zip(self.names, values.tolist(), strict=True))

    def system(self, at: Floats) -> System:
        """The system; a ValueError where its class refuses the parameters."""
        return System.require(self.system_of(**self.parameters(at)), "an optimum")

    def point(self, at: Floats) -> Point | None:
        """The motion at parameters, followed from the nearest ones at which it is known; None where it is lost on the way."""
        here = min(self.known, key=lambda one: float(np.linalg.norm(one.at - at)))
        share = 1.0
        for _ in range(TRIES):
            if np.array_equal(here.at, at):
                return here
            orbit = self.orbit(here, here.at + share * (at - here.at) if share < 1 else at)
            found = None if orbit is None or self.grazes(*orbit[1:]) else self.measured(*orbit)
            if found is None:
                share /= 2
                if share < SHORTEST:
                    return None
            else:
                self.known.append(found)
                here, share = found, 1.0
        return None

    def orbit(self, here: Point, at: Floats) -> tuple[Floats, System, PeriodicOrbit] | None:
        """The orbit at other parameters by Newton's method from its linear prediction, with them and the system.

        None where the class refuses the parameters, the words differ or the correction is large: it would be another motion.
        """
        try:
            system = self.system(at)
        except ValueError:
            return None
        coordinates, change = here.orbit.returns.coordinates, np.tensordot(at - here.at, here.moved, 1)
        scale = np.max([one.orbit.scale for one in self.known], axis=0)  # that of a coordinate of a map vanishes with it
        long, guess = float(np.abs(change / scale).max()), coordinates.wrap(here.orbit.states + change)
        if long > LONGEST:
            return None
        returns = system.first_return(system.on_section(guess), derivative=True)
        if not np.abs(newton_step(returns, scale) / scale).max() <= BEND * long + ROUNDED:
            return None
        found = refined(system, returns)
        correction = np.abs(coordinates.difference(found.states, guess) / scale).max()
        same = np.array_equal(found.returns.codes, here.orbit.returns.codes) and correction <= BEND * long + ROUNDED
        return (at, system, found) if same and found.converged and found.exists else None

    def grazes(self, system: System, orbit: PeriodicOrbit) -> bool:
        """Whether a motion is nearer to a graze than half of what is asked for, where it counts as lost.

        Where a turning point appears beside a wall the margin jumps, so that no derivative leads back.
        """
        return bool(margins(system, orbit).min() < self.graze / 2)

    def measured(self, at: Floats, system: System, orbit: PeriodicOrbit) -> Point | None:
        """The observable of an orbit with its exact gradient; None where it has no derivative."""
        moved, slopes, value = [], [], float("nan")
        for k in range(len(self.names)):
            rates = self._rates(at, k)
            means = cycle_means(system, orbit, [self.observable], rates)
            mean = getattr(means, f"per_{self.per}")
            value, unit = float(mean.value[0]), self.high[k] - self.low[k]
            slopes.append(mean.derivative[0] * unit)
            moved.append(moved_states(system, orbit, np.array([rates[n] for n in system.parameter_names()])) * unit)
        found = Point(at, system, orbit, np.array(moved), value, np.array(slopes))
        return found if np.isfinite([value, *slopes]).all() and np.isfinite(found.moved).all() else None

    def _rates(self, at: Floats, k: int) -> dict[str, float]:
        """The rates of change of the system's parameters with the k-th one of the box."""
        here = self.parameters(at)
        unit = float(self.high[k] - self.low[k])
        return parameter_rates(lambda value: self.system_of(**{**here, self.names[k]: value}), here[self.names[k]], unit)

    def conditions(self, system: System, orbit: PeriodicOrbit) -> Floats:
        """Numbers at least zero where the motion is stable and far enough from a graze, shape (c,)."""
        stable = np.empty(0) if self.multiplier is None else stability(orbit.derivative, self.multiplier)
        return np.append(stable, np.minimum(margins(system, orbit), FAR).ravel() - self.graze)

    def stable(self, orbit: PeriodicOrbit) -> bool:
        """Whether all multipliers are within the bound, which `stability` does not show of more than two."""
        return self.multiplier is None or bool(np.abs(orbit.multipliers).max() <= self.multiplier * (1 + NEARLY))

    def slopes(self, point: Point) -> Floats:
        """Their derivatives, shape (c, k): central differences of neighbouring orbits, extrapolated."""
        now = self.conditions(point.system, point.orbit)

        def along(k: int) -> Floats:
            def conditions(share: float) -> Floats | None:
                at = point.at.copy()
                at[k] = share
                found = self.orbit(point, at)
                return None if found is None else self.conditions(*found[1:])

            return np.broadcast_to(derivative_of(conditions, float(point.at[k]), 1.0, np.maximum(np.abs(now), 1.0)), now.shape)

        return np.stack([along(k) for k in range(len(self.names))], axis=1)

    def limits(self, point: Point, active: Bools, each: Floats) -> tuple[Condition, ...]:
        """The conditions in plain terms, from which of the numbers (c,) are zero and their Lagrange multipliers (c,)."""
        found, skip = list[Condition](), 0
        if (bound := self.multiplier) is not None:
            skip, step = STABILITY, 1e-6 * bound
            wide, narrow = (stability(point.orbit.derivative, bound + h) for h in (step, -step))
            gain = float(each[:skip] @ (wide - narrow)) / (2 * step)
            radius = float(np.abs(point.orbit.multipliers).max())
            found.append(Condition("multiplier", radius, -np.inf, bound, bool(active[:skip].any()), gain))
        if not isinstance(point.system, FlowSystem):
            return tuple(found)
        halves = active[skip:].reshape(2, -1), each[skip:].reshape(2, -1)
        names = "clearance", "impact speed"
        for name, values, on, more in zip(names, margins(point.system, point.orbit), *halves, strict=True):
            found.append(Condition(name, float(values.min()), self.graze, np.inf, bool(on.any()), float(more.sum())))
        return tuple(found)
