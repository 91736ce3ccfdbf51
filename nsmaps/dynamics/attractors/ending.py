"""What an orbit ends on: a cycle, found by Newton's method from its last states, or states without a period."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import angle_mask
from nsmaps.dynamics.attractors.attractor import on_circle
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.motion import differences, label, magnitudes
from nsmaps.dynamics.orbit import Orbit, orbit
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import OrbitMap, ReturnMap

LONGEST = 64  #: returns of the longest period that is looked for
WINDOW = 32  #: last returns, at least, that must repeat
CLOSE = 1e-9, 1e-6, 1e-3  #: of magnitudes, within which the last states repeat, tried in turn: what has come, or nearly
RESTED = 1e-6  #: the same, within which a cycle is believed although Newton's method finds none, as where it has no derivative
VISITED = 1000  #: states that stand for an attractor without period
SAME = 1e-8  #: the same, of states that count as one, far above the residual of Newton's method
TOLD = 4  #: states of a cycle that a sentence lists
LONG = 40  #: letters of a label from which a sentence leaves it out


@dataclass(frozen=True, slots=True, eq=False)
class Ending:
    """What one orbit ends on, in n coordinates."""

    coordinates: tuple[str, ...]
    period: int  #: in returns; 0 where none was found
    looked: int  #: the longest period that was looked for
    label: str  #: the motion, such as 1:1/2T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of the return from each state of a period; without one, every word that was met
    states: Floats  #: shape (K, n), angles in [0, 2 pi): one period in order, or states visited
    multipliers: NDArray[np.complex128]  #: shape (n,), the largest first; none where Newton's method did not find the cycle
    exponent: float = math.nan  #: largest Lyapunov exponent, a return; NaN with a period, or where the map is not compiled
    exponent_error: float = math.nan  #: its standard error
    more: int = 0  #: returns made beyond the orbit's own to see it

    @property
    def stable(self) -> bool | None:
        """Whether every multiplier lies within the unit circle; None where they are not known."""
        return bool((np.abs(self.multipliers) < 1).all()) if len(self.multipliers) else None

    @property
    def name(self) -> str:
        """The label without the period, or nothing where it has none or one of many words, as motion that chatters."""
        return self.label.removesuffix(f", period {self.period}") if len(self.label) <= LONG else ""

    @property
    def text(self) -> str:
        """The same in a few words."""
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
        seen = f"seen after {self.more} more returns" if self.more else ""
        return ", ".join(part for part in (f"{kind} {what}", *parts, seen) if part)


def ending(map: ReturnMap, path: Orbit) -> Ending | None:
    """What the orbit of one start under a map ends on; None where it has no image before its last return.

    A cycle of at most 64 returns, and half of those made, is looked for in the last states, and where there is none in those of
    1000 more returns. Newton's method must find one within ten times of what they repeat to, a stable one where that is more than
    1e-6, unless they repeat within 1e-6 and have no derivatives, as where they chatter: in radians of an angle, else in shares of
    the coordinate's largest magnitude on the orbit.
    """
    if not np.isfinite(path.states).all() or not len(path.codes):
        return None
    if made := _cycle(map, path):
        return made
    after = orbit(map, path.final, VISITED)
    if not np.isfinite(after.states).all():
        return _visited(map, path)
    made = _cycle(map, after)
    return replace(made, more=VISITED) if made else _visited(map, after)


def _cycle(map: ReturnMap, path: Orbit) -> Ending | None:
    """The cycle that an orbit has come to, if it has."""
    looked = _looked(path)
    for close in CLOSE:
        period = _repeats(path, looked, close)
        if period:
            found = _least(map, periodic_orbit(map, path.states[-period:], period, scale=_scale(path)))
            if _is_found(found, path, close):
                return _of(path, looked, found.states, found.words, found.label, found.multipliers)
            if close <= RESTED and not np.isfinite(found.derivative).all():
                words = tuple(path.words[-period:].tolist())
                states = np.roll(path.states[-period:], 1, axis=0)  # from which these words lead on
                name = label(words, _turns(path)[-period:], period, path.walls)
                return _of(path, looked, states, words, name, np.zeros(0, complex))
    return None


def _looked(path: Orbit) -> int:
    """The longest period that an orbit shows twice, and that is looked for."""
    return min(LONGEST, len(path.codes) // 2)


def _least(map: ReturnMap, found: PeriodicOrbit) -> PeriodicOrbit:
    """The same cycle with its least period: an orbit that comes to it from either side in turn repeats sooner at twice of it."""
    period = len(found.states)
    for shorter in range(1, period):
        apart = np.abs(differences(found.states, np.roll(found.states, shorter, axis=0), found.returns.coordinates))
        if period % shorter == 0 and (apart / found.scale).max() <= SAME:
            return periodic_orbit(map, found.states[:shorter], shorter, scale=found.scale)
    return found


def _scale(path: Orbit) -> Floats:
    """What is small in each coordinate of an orbit is a share of this, shape (n,)."""
    return magnitudes(path.coordinates, path.states)


def _repeats(path: Orbit, looked: int, close: float) -> int:
    """The least number of returns after which the last states and words repeat; 0 where there is none."""
    near = close * _scale(path)
    for period in range(1, looked + 1):
        window = min(max(2 * period, WINDOW), len(path.codes))
        states, codes = path.states[-window:], path.codes[-window:]
        apart = np.abs(differences(states[period:], states[:-period], path.coordinates))
        if len(apart) and (apart <= near).all() and (codes[period:] == codes[:-period]).all():
            return period
    return 0


def _is_found(found: PeriodicOrbit, path: Orbit, close: float) -> bool:
    """Whether Newton's method came to a cycle, and to that which the last states are near to."""
    if not (found.converged and found.exists and np.isfinite(found.derivative).all()):
        return False
    last = path.states[-1:]
    apart = (np.abs(differences(found.states, last, path.coordinates)) / _scale(path)).max(axis=1).min()
    return bool(apart <= 10 * close) and (found.stable or close <= RESTED)


def _of(path: Orbit, looked: int, states: Floats, words: Sequence[str], name: str, multipliers: NDArray[np.complex128]) -> Ending:
    """A cycle, from its state with the least first coordinate on."""
    first = int(np.argmin(states[:, 0]))
    there = on_circle(np.roll(states, -first, axis=0), path.coordinates)
    return Ending(path.coordinates, len(states), looked, name, (*words[first:], *words[:first]), there, multipliers)


def _visited(map: ReturnMap, seen: Orbit) -> Ending:
    """The states that an orbit without a period visits."""
    words = seen.words.tolist()
    name = label(words, _turns(seen), 0, seen.walls)
    states = on_circle(seen.states[1:], seen.coordinates)
    grows = lyapunov(map, seen.final, VISITED, 0) if isinstance(map, OrbitMap) else None
    exponent = (float(grows.exponents[0]), float(grows.error[0])) if grows else (math.nan, math.nan)
    every = tuple(sorted(set(words)))
    return Ending(seen.coordinates, 0, _looked(seen), name, every, states, np.zeros(0, complex), *exponent)


def _turns(path: Orbit) -> list[int]:
    turns: list[int] = path.turns[:, angle_mask(path.coordinates)].sum(axis=-1).tolist()
    return turns


def _number(value: complex) -> str:
    return f"{value.real:.4g}" if not value.imag else f"{value.real:.4g}{value.imag:+.4g}i"
