"""The limit set of an orbit: a cycle, found by Newton's method from its last states, or states without a period."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.motion import label
from nsmaps.dynamics.orbit import Orbit, orbit
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit, stability
from nsmaps.dynamics.returnmap import OrbitMap, ReturnMap
from nsmaps.dynamics.scale import scale_of

LONGEST = 64  #: longest period, in returns, that is tested
WINDOW = 32  #: least number of last returns that must repeat
CLOSE = 1e-9, 1e-6, 1e-3  #: shares of the scale within which the last states repeat, tried in turn: converged, or nearly
RESTED = 1e-6  #: the same, within which a cycle counts without Newton's method, as where it has no derivative
VISITED = 1000  #: number of states that represent an attractor without period
SAME = 1e-8  #: the same, for states that count as one, far above the residual of Newton's method
TOLD = 4  #: number of states of a cycle that a sentence lists
LONG = 40  #: number of letters from which a sentence omits a label


@dataclass(frozen=True, slots=True, eq=False)
class LimitSet(WithCoordinates):
    """The limit set of one orbit in n coordinates."""

    coordinates: Coordinates
    period: int  #: in returns; 0 where none was found
    looked: int  #: longest period tested
    label: str  #: name of the motion, such as 1:1/2T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of the return from each state of a period; without a period, every word of the sample
    states: Floats  #: shape (K, n), angles in [0, 2 pi): one period in order, or states visited
    multipliers: NDArray[np.complex128]  #: shape (n,), the largest first; empty where Newton's method did not find the cycle
    exponent: float = math.nan  #: largest Lyapunov exponent per return; NaN with a period, or where the map is not compiled
    exponent_error: float = math.nan  #: its standard error
    more: int = 0  #: returns beyond those of the orbit that were needed

    @property
    def stable(self) -> bool | None:
        """True if every multiplier lies within the unit circle; None where the multipliers are unknown."""
        return stability(self.multipliers)

    @property
    def name(self) -> str:
        """The label without the period; empty where there is none or one of many words, as for motion that chatters."""
        return self.label.removesuffix(f", period {self.period}") if len(self.label) <= LONG else ""

    @property
    def text(self) -> str:
        """A description in a few words."""
        if not self.period:
            text = f"no period up to {self.looked} returns{f' ({self.name})' if self.name else ''}"
            exponent = f"largest Lyapunov exponent {self.exponent:.3g} +- {self.exponent_error:.1g} per return"
            if math.isinf(self.exponent):
                exponent = f"largest Lyapunov exponent {self.exponent}, as where orbits that rest become one"
            return text if math.isnan(self.exponent) else f"{text}, {exponent}"
        kind = {True: "stable", False: "unstable", None: "seen"}[self.stable]
        what = "fixed point" if self.period == 1 else f"cycle of {self.period} returns"
        factors = ", ".join(_number(value) for value in self.multipliers.tolist())
        listed = ", ".join("(" + ", ".join(f"{x:.5g}" for x in state) + ")" for state in self.states)
        parts = [self.name, factors and f"multipliers {factors}", f"at {listed}" if self.period <= TOLD else ""]
        seen = f"found after {self.more} more returns" if self.more else ""
        return ", ".join(part for part in (f"{kind} {what}", *parts, seen) if part)


def limit_set(map: ReturnMap, path: Orbit) -> LimitSet | None:
    """The limit set of the orbit of one start under a map; None where it has no image before its last return.

    A cycle of at most 64 returns, and half of those computed, is sought in the last states, and if there is none in those of
    1000 more returns. Newton's method must find one within ten times of the tolerance of the repetition, a stable one if that
    is more than
    1e-6, unless the states repeat within 1e-6 and have no derivatives, as for chatter: in radians for an angle, otherwise in
    shares of the extent of the motion (`scale_of`).
    """
    if not np.isfinite(path.states).all() or not len(path.codes):
        return None
    if cycle := _cycle(map, path):
        return cycle
    after = orbit(map, path.final, VISITED)
    if not np.isfinite(after.states).all():
        return _visited(map, path)
    cycle = _cycle(map, after)
    return replace(cycle, more=VISITED) if cycle else _visited(map, after)


def _cycle(map: ReturnMap, path: Orbit) -> LimitSet | None:
    """The cycle that an orbit has reached, if any."""
    looked, scale = _looked(path), scale_of(map, path.states)
    for close in CLOSE:
        period = _repeats(path, looked, close * scale)
        if period:
            found = _least(map, periodic_orbit(map, path.states[-period:], period, scale=scale))
            if _is_found(found, path, close):
                return _of(path, looked, found.states, found.words, found.label, found.multipliers)
            if close <= RESTED and not np.isfinite(found.derivative).all():
                words = tuple(path.words[-period:].tolist())
                states = np.roll(path.states[-period:], 1, axis=0)  # the states from which these words lead on
                name = label(words, _turns(path)[-period:], period, path.walls)
                return _of(path, looked, states, words, name, np.zeros(0, complex))
    return None


def _looked(path: Orbit) -> int:
    """The longest period that occurs twice in an orbit and is tested."""
    return min(LONGEST, len(path.codes) // 2)


def _least(map: ReturnMap, found: PeriodicOrbit) -> PeriodicOrbit:
    """The same cycle with its least period: an orbit that approaches it from alternating sides repeats sooner at twice its
    period.
    """
    period = len(found.states)
    for shorter in range(1, period):
        distance = np.abs(found.returns.coordinates.difference(found.states, np.roll(found.states, shorter, axis=0)))
        if period % shorter == 0 and (distance / found.scale).max() <= SAME:
            return periodic_orbit(map, found.states[:shorter], shorter, scale=found.scale)
    return found


def _repeats(path: Orbit, looked: int, near: Floats) -> int:
    """The least number of returns after which the last states, within a distance (n,), and words repeat; 0: none."""
    for period in range(1, looked + 1):
        window = min(max(2 * period, WINDOW), len(path.codes))
        states, codes = path.states[-window:], path.codes[-window:]
        distance = np.abs(path.coordinates.difference(states[period:], states[:-period]))
        if len(distance) and (distance <= near).all() and (codes[period:] == codes[:-period]).all():
            return period
    return 0


def _is_found(found: PeriodicOrbit, path: Orbit, close: float) -> bool:
    """True if Newton's method converged to a cycle, and to one near the last states."""
    if not (found.converged and found.exists and np.isfinite(found.derivative).all()):
        return False
    last = path.states[-1:]
    distance = (np.abs(path.coordinates.difference(found.states, last)) / found.scale).max(axis=1).min()
    return bool(distance <= 10 * close) and (found.stable or close <= RESTED)


def _of(path: Orbit, looked: int, states: Floats, words: Sequence[str], name: str, factors: NDArray[np.complex128]) -> LimitSet:
    """A cycle, from its state with the least first coordinate on."""
    first = int(np.argmin(states[:, 0]))
    there = path.coordinates.wrap(np.roll(states, -first, axis=0))
    return LimitSet(path.coordinates, len(states), looked, name, (*words[first:], *words[:first]), there, factors)


def _visited(map: ReturnMap, seen: Orbit) -> LimitSet:
    """The states that an orbit without a period visits."""
    words = seen.words.tolist()
    name = label(words, _turns(seen), 0, seen.walls)
    states = seen.coordinates.wrap(seen.states[1:])
    grows = lyapunov(map, seen.final, VISITED, 0) if isinstance(map, OrbitMap) else None
    exponent = (float(grows.exponents[0]), float(grows.error[0])) if grows else (math.nan, math.nan)
    every = tuple(sorted(set(words)))
    return LimitSet(seen.coordinates, 0, _looked(seen), name, every, states, np.zeros(0, complex), *exponent)


def _turns(path: Orbit) -> list[int]:
    turns: list[int] = path.turns[:, path.coordinates.angles].sum(axis=-1).tolist()
    return turns


def _number(value: complex) -> str:
    return f"{value.real:.4g}" if not value.imag else f"{value.real:.4g}{value.imag:+.4g}i"
