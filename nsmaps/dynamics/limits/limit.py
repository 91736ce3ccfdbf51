"""What orbits end on: a cycle, chaos, quasi-periodic motion, escape, or nothing that was shown. It is decided here alone."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.distance import distances, extents
from nsmaps.dynamics.limits.path import Path, escapes, exponent_of, followed, growth_on
from nsmaps.dynamics.limits.releases import ROUNDED, between_releases, is_determined, until_release
from nsmaps.dynamics.motion import CHAOS, ESCAPE, QUASI_PERIODIC, UNRESOLVED, label
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.words import words_of

FOLLOWED = 1024, 4096  #: returns over which orbits without a period are followed, one after the other
SHORT = 64  #: last returns in which a period is sought first
ERRORS = 4.0  #: standard errors by which the exponent of chaos exceeds zero
BOUNDED, STEADY = 12.0, 1.0  #: largest changes of the logarithm of growth of a quasi-periodic orbit, and of its mean by quarters
RECURS = 0.05  #: share of the extents within which a quasi-periodic orbit comes back to where it was
NEARLY = 1e3  #: tolerances within which an orbit nearly repeats
SINGULAR = 1e-4  #: least distance from one of a multiplier of a cycle that Newton's method locates
LEAVES = 40.0  #: largest growth of a difference, as a logarithm, on the way from rounding to the extent of the motion
RISING = 10  #: successive parts of an orbit, in each of which differences are larger than before where it leaves a cycle
COMING = 1e-3  #: of the scale: distance of a cycle to which an orbit that repeats within the tolerance may lead
NEAR = 0.05  #: of the scale: least repetition from which a cycle is sought that an orbit approaches
RESONANT = 1e-3  #: of the scale: repetition that is taken for the slow approach of a cycle, not for quasi-periodic motion
LONGEST, TRIED = 256, 4  #: max_period period of such a cycle, and how many are tried
FALLS = 0.98  #: largest ratio of the differences after a period on successive fifths of an orbit that approaches a cycle
PARTS = 5  #: fifths of the differences after a period, of which the last two are compared
SAME = 1e-8  #: of the scale: difference of states that count as one, far above the residual of Newton's method


@dataclass(frozen=True, eq=False)
class Limit:
    """What one orbit ends on."""

    kind: str  #: "" of a cycle and of an orbit that ended, otherwise one of `nsmaps.dynamics.motion.MEANING`
    path: Path  #: the last returns of the orbit
    length: int = 0  #: number of states of a period; 0 without one
    cycle: PeriodicOrbit | None = None  #: by Newton's method, where it was applied
    exponent: float = np.nan  #: largest Lyapunov exponent per return
    error: float = np.nan  #: its standard error
    more: int = 0  #: returns over which the orbit was followed for it
    rests: bool = False  #: True of an orbit that comes back to one release from rest, after a period that floats do not determine

    @cached_property
    def period(self) -> int:
        """In returns; 0 without one."""
        seen = int(self.path.numbers[-self.length :, 0].sum()) if self.length else 0
        return self.cycle.period if self.cycle is not None else seen

    @property
    def held(self) -> bool:
        """True if the orbit stays within bounds and did not end."""
        return bool(self.kind or self.length) and self.kind != ESCAPE

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Of the return from each state of a period; without a period, every word on the way."""
        if self.cycle is not None:
            return self.cycle.words
        words = words_of(self.path.codes[-self.length :, 0], self.path.walls).tolist()
        return tuple(words if self.length else sorted(set(words)))

    @cached_property
    def states(self) -> Floats:
        """Shape (K, n), angles in [0, 2 pi): one period in order, from which the words lead on, or states visited."""
        if self.cycle is not None:
            return self.cycle.states
        states = self.path.states[-self.length - 1 : -1, 0] if self.length else self.path.states[1:, 0]
        return self.path.coordinates.wrap(states)

    @cached_property
    def turns(self) -> int:
        """Whole turns of the phase in a period."""
        if self.cycle is not None:
            returns = self.cycle.returns
            found = int(returns.known_turns[:, returns.coordinates.angles].sum())
        else:
            found = int(self.path.turns[-self.length :, 0].sum()) if self.length else 0
        return found or self.period * self.path.alphabet.turns

    @cached_property
    def label(self) -> str:
        """The name of the motion; see `nsmaps.dynamics.motion.label`."""
        if not self.held:
            return self.kind
        return label(self.words, [self.turns], self.period, self.path.alphabet, self.kind)


def limits(return_map: ReturnMap, states: Floats, scale: Floats, tolerance: float = 1e-6) -> list[Limit]:
    """What the orbits of states (M, n) end on, which are followed for up to 5000 returns.

    A cycle is one to which Newton's method leads, or one that is seen to repeat where the map has no derivative, as in chatter.
    Chaos is shown by a largest Lyapunov exponent above four times its standard error and growth by more than a factor of e^12,
    quasi-periodic motion by growth that stays within this factor and has no trend, of an orbit that comes back to where it was,
    an escape by coordinates that grow without end.

    Args:
        scale: shape (n,), of each coordinate, such as the magnitudes of the starts and the states known.
        tolerance: share of it within which the states of a cycle repeat.
    """
    found: dict[int, Limit] = {}
    open_, now, done = np.arange(len(states)), states, 0
    for count in FOLLOWED:
        if not len(open_):
            break
        path, done = followed(return_map, now, count), done + count
        for place, k in enumerate(open_.tolist()):
            one = unless_resting(return_map, limit_of(return_map, path.of_one(place), scale, tolerance), scale, tolerance)
            found[k] = replace(one, more=done)
        left = [place for place, k in enumerate(open_.tolist()) if found[k].kind == UNRESOLVED and not found[k].rests]
        open_, now = open_[left], path.states[-1, left]
    return [found[k] for k in range(len(states))]


def unless_resting(return_map: ReturnMap, found: Limit, scale: Floats, tolerance: float) -> Limit:
    """A limit; of chaos the cycle from release to release instead, where an orbit of compiled returns rests within 4096 more.

    Rare rests make an orbit periodic, however chaotic it is between them; unresolved if it rests at different phases, or if
    rounding decides when it rests again.
    """
    path = found.path
    if found.kind == CHAOS and return_map.has_orbits and not _has_rest(path):
        path = Path.of(return_map.orbits(path.states[-1], FOLLOWED[-1]), 1)
    if found.kind not in (CHAOS, UNRESOLVED) or not _has_rest(path):
        return found
    path = until_release(path)
    period = between_releases(path, tolerance * scale)
    if period and is_determined(return_map, path, period, scale):
        return Limit("", path, period)
    return Limit(UNRESOLVED, path, rests=period > 0)


def _has_rest(path: Path) -> bool:
    """True if the orbit of one path rests on the way."""
    return bool((path.outcome == Outcome.stuck).any())


def limit_of(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit:
    """What the orbit of one path ends on, as far as this path shows it."""
    if not np.isfinite(path.states[-1]).all():
        gone = path.outcome[-1, 0] in (Outcome.returned, Outcome.escaped)  # a formula that has overflowed
        return Limit(ESCAPE if gone else "", path)
    if escapes(path, scale):
        return Limit(ESCAPE, path)
    short = path.last(min(SHORT, len(path.codes)))
    cycle = cycle_in(return_map, short, scale, tolerance)
    if cycle is not None:
        return replace(cycle, path=path.first(len(path.codes) - len(short.codes) + len(cycle.path.codes)))
    growth = growth_on(return_map, path, scale)
    exponent, error = exponent_of(growth, float(path.numbers[:, 0].mean()))
    about: Any = {"exponent": exponent, "error": error}
    grows = bool(np.isfinite(exponent) and exponent > ERRORS * error)
    if grows and growth.sum() > LEAVES and not short.repeats(tolerance * scale)[0]:
        return Limit(CHAOS, path, **about)
    cycle = cycle_in(return_map, path, scale, tolerance) or approached(return_map, path, scale)
    if cycle is not None:
        return cycle
    if grows:
        return Limit(UNRESOLVED if growth.sum() <= BOUNDED or _departs(path, scale) else CHAOS, path, **about)
    return Limit(QUASI_PERIODIC if _is_quasi_periodic(path, growth, scale) else UNRESOLVED, path, **about)


def cycle_in(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit | None:
    """The cycle on which the orbit of one path repeats within a tolerance, in its last half or in all of it; None without one."""
    near = tolerance * scale
    length = between_releases(until_release(path), near)
    path = until_release(path) if length else path
    length = length or int(path.last(-(-len(path.codes) // 2)).repeats(near)[0] or path.repeats(near)[0])
    if not length or not is_determined(return_map, path, length, scale):
        return None
    seen = Limit("", path, length)
    off = np.abs(path.coordinates.difference(path.states[-1, 0], path.states[-1 - length, 0]) / scale).max()
    return seen if off <= ROUNDED else refined(return_map, seen, scale, tolerance)


def refined(return_map: ReturnMap, seen: Limit, scale: Floats, tolerance: float) -> Limit | None:
    """A cycle on which an orbit repeats within a tolerance, by Newton's method; as seen where the map has no derivative there.

    None where Newton's method does not converge, as beside a resonance, or leads to an unstable cycle, which the orbit passes;
    without derivatives where the orbit nearly repeats in a part of the period.
    """
    path, states = seen.path, seen.path.states[-seen.length :, 0]
    if not _has_slopes(return_map, states):
        return None if _nearly_shorter(path, seen.length, NEARLY * tolerance * scale) else seen
    found = least(return_map, periodic_orbit(return_map, states, seen.length, scale=scale), scale)
    if not _is_located(found) or np.abs(found.multipliers).max() > 1 + SINGULAR:
        return None
    distance = _distances(found.states, states, path.coordinates, scale).max()
    return Limit("", path, len(found.states), found) if distance <= (COMING if found.stable else 10 * tolerance) else seen


def _is_located(found: PeriodicOrbit) -> bool:
    """True if Newton's method has converged to one cycle: with a multiplier of nearly one all states near it nearly close."""
    closes = found.converged and found.exists and np.isfinite(found.derivative).all()
    return bool(closes and np.abs(found.multipliers - 1).min() > SINGULAR)


def _nearly_shorter(path: Path, period: int, near: Floats) -> bool:
    """True if an orbit nearly repeats in a part of its period: it may approach that cycle from alternating sides."""
    shorter = [q for q in range(1, period // 2 + 1) if period % q == 0]
    return any(bool(path.coordinates.near(path.states[-1, 0], path.states[-1 - q, 0], near)) for q in shorter)


def _has_slopes(return_map: ReturnMap, states: Floats) -> bool:
    """True if the map has finite derivatives at states (N, n)."""
    slopes = return_map.first_return(states, derivative=True).derivative
    return slopes is not None and bool(np.isfinite(slopes).all())


def least(return_map: ReturnMap, found: PeriodicOrbit, scale: Floats) -> PeriodicOrbit:
    """The same cycle with its least period.

    An orbit that approaches it from alternating sides repeats sooner at twice its period.
    """
    period = len(found.states)
    for shorter in range(1, period // 2 + 1):
        if period % shorter == 0:
            distance = np.abs(found.returns.coordinates.difference(found.states, np.roll(found.states, shorter, axis=0)))
            if (distance / scale).max() <= SAME:
                return periodic_orbit(return_map, found.states[:shorter], shorter, scale=scale)
    return found


def approached(return_map: ReturnMap, path: Path, scale: Floats) -> Limit | None:
    """The stable cycle that the orbit of one path comes nearer and nearer to; None without one, or without derivatives."""
    periods = [period for period in _nearly(path, scale) if _settles(path, period, scale)]
    for period in periods if _has_slopes(return_map, path.states[-1:, 0]) else ():
        if not is_determined(return_map, path, period, scale):
            continue
        found = least(return_map, periodic_orbit(return_map, path.states[-period:, 0], period, scale=scale), scale)
        if _is_located(found) and found.stable and _comes_nearer(path, found.states, scale):
            return Limit("", path, len(found.states), found)
    return None


def _nearly(path: Path, scale: Floats, bound: float = NEAR) -> list[int]:
    """Periods after which the last states nearly repeat, each more nearly than those before it."""
    states, found, best = path.states[:, 0], list[int](), bound
    max_period = min(LONGEST, (len(states) - 1) // 2)
    near = path.coordinates.near(states[-1], states[-2 : -2 - max_period : -1], bound, scale)
    for period in (np.flatnonzero(near) + 1).tolist():
        window = states[-2 * max(period, 8) :]
        off = float(np.abs(path.coordinates.difference(window[period:], window[:-period]) / scale).max())
        if off <= best:
            found.append(period)
            best = off / 2
    return found[:TRIED]


def _settles(path: Path, period: int, scale: Floats) -> bool:
    """True if the differences of an orbit after a period still fall, as on the way to a cycle."""
    parts = _parts(path, period, scale, PARTS)
    return bool(len(parts) and parts[-1] <= max(FALLS * parts[-2], 2 * SAME))


def _parts(path: Path, period: int, scale: Floats, count: int) -> Floats:
    """The largest differences of an orbit after a period in successive parts of it; none of an orbit too short for this."""
    states = path.states[:, 0]
    off = np.abs(path.coordinates.difference(states[period:], states[:-period]) / scale).max(axis=1)
    return np.array([part.max() for part in np.array_split(off, count)]) if len(off) >= count else np.zeros(0)


def _departs(path: Path, scale: Floats) -> bool:
    """True if the differences of an orbit after a period only grow, as on the way from an unstable cycle to somewhere else."""
    rising = (np.diff(_parts(path, period, scale, RISING)) for period in _nearly(path, scale))
    return any(len(rises) and bool((rises > 0).all()) for rises in rising)


def _comes_nearer(path: Path, cycle: Floats, scale: Floats) -> bool:
    """True if the largest distances of four successive parts of an orbit from a cycle fall, or it is there already."""
    parts = np.array_split(path.states[:, 0], 5)[1:]
    off = np.array([_distances(cycle, part, path.coordinates, scale).max() for part in parts])
    return bool(off[-1] <= SAME or ((np.diff(off) < 0).all() and off[-1] <= NEAR))


def _distances(known: Floats, states: Floats, coordinates: Coordinates, scale: Floats) -> Floats:
    """The distance of each of N states from the nearest of known ones, the largest in a coordinate, shape (N,)."""
    return distances(coordinates.wrap(known), coordinates.wrap(states), coordinates, scale, np.inf)


def _is_quasi_periodic(path: Path, growth: Floats, unit: Floats) -> bool:
    """True if growth stays bounded and the orbit comes back to where it was, without a period."""
    if len(growth) < FOLLOWED[-1] // 2 or not np.isfinite(growth).all():
        return False
    total = growth.cumsum()
    if np.ptp(total) > BOUNDED or np.ptp([part.mean() for part in np.array_split(total, 4)]) > STEADY:
        return False
    if min(_nearly(path, unit, RESONANT), default=LONGEST) < SHORT:
        return False
    first, *_, last = np.array_split(path.coordinates.wrap(path.states[1:, 0]), 4)
    scale = extents(np.concatenate([first, last]), path.coordinates, unit)
    return bool(_distances(last, first, path.coordinates, scale).max() <= RECURS)
