"""Cycles to which orbits lead: those on which they repeat, and those that they come nearer and nearer to."""

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.distance import distances
from nsmaps.dynamics.limits.limit import Limit, largest_multiplier
from nsmaps.dynamics.limits.path import Path
from nsmaps.dynamics.limits.releases import ROUNDED, is_determined
from nsmaps.dynamics.motion import UNRESOLVED
from nsmaps.dynamics.periodic import SAME, PeriodicOrbit, least_period, periodic_orbit
from nsmaps.exact.returnmap import ReturnMap

NEARLY = 1e3  #: tolerances within which an orbit nearly repeats
SINGULAR = 1e-4  #: least distance from one of a multiplier of a cycle that Newton's method locates
RISING = 10  #: successive parts of an orbit, in each of which differences are larger than before where it leaves a cycle
COMING = 1e-3  #: of the scale: distance of a cycle to which an orbit that repeats within the tolerance may lead
NEAR = 0.05  #: of the scale: least repetition from which a cycle is sought that an orbit approaches
LONGEST, TRIED = 256, 4  #: max_period period of such a cycle, and how many are tried
FALLS = 0.98  #: largest ratio of the differences after a period on successive fifths of an orbit that approaches a cycle
PARTS = 5  #: fifths of the differences after a period, of which the last two are compared
SHORT = 64  #: last returns in which a period is sought first
UNSTABLE = 1e-9  #: by how much the largest multiplier of an unstable cycle exceeds one, at least


def cycle_in(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float, by_newton: bool = True) -> Limit | None:
    """The cycle on which the orbit of one path repeats within a tolerance, in its last half or in all of it; None without one.

    An orbit that has not come to it up to rounding is led there by Newton's method, if so wanted.
    """
    near = tolerance * scale
    length = path.last(-(-len(path.codes) // 2)).repeats(near) or path.repeats(near)
    if not length or not is_determined(return_map, path, length, scale):
        return None
    off = np.abs(path.coordinates.difference(path.states[-1, 0], path.states[-1 - length, 0]) / scale).max()
    if off <= ROUNDED:
        return _exact(return_map, path, length)
    return refined(return_map, Limit("", path, length), scale, tolerance) if by_newton else None


def _exact(return_map: ReturnMap, path: Path, length: int) -> Limit:
    """The cycle of the last states of a path that repeat up to rounding, unresolved if it is unstable."""
    found = Limit("", path, length)
    if path.slopes is None:
        slopes = return_map.first_return(path.states[-1 - length : -1, 0], derivative=True).derivative
        multiplier = largest_multiplier(slopes)
    else:
        multiplier = found.multiplier
    return Limit(UNRESOLVED, path, unstable=True) if multiplier > 1 + UNSTABLE else found


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
    distance = largest_distances(found.states, states, path.coordinates, scale).max()
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
    period = least_period(found.states, found.returns.coordinates, scale)
    whole = period == len(found.states)
    return found if whole else periodic_orbit(return_map, found.states[:period], period, scale=scale)


def approached(return_map: ReturnMap, path: Path, scale: Floats) -> Limit | None:
    """The stable cycle that the orbit of one path comes nearer and nearer to; None without one, or without derivatives."""
    periods = [period for period in near_periods(path, scale) if _settles(path, period, scale)]
    for period in periods if _has_slopes(return_map, path.states[-1:, 0]) else ():
        if not is_determined(return_map, path, period, scale):
            continue
        found = least(return_map, periodic_orbit(return_map, path.states[-period:, 0], period, scale=scale), scale)
        if not (_is_located(found) and found.stable):
            continue
        parts = np.array_split(path.states[:, 0], PARTS)[1:]
        off = [largest_distances(found.states, part, path.coordinates, scale).max() for part in parts]
        if comes_nearer(np.array(off)):
            return Limit("", path, len(found.states), found)
    return None


def near_periods(path: Path, scale: Floats, bound: float = NEAR) -> list[int]:
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


def departs(path: Path, scale: Floats) -> bool:
    """True if the differences of an orbit after a period only grow, as on the way from an unstable cycle to somewhere else."""
    rising = (np.diff(_parts(path, period, scale, RISING)) for period in near_periods(path, scale))
    return any(len(rises) and bool((rises > 0).all()) for rises in rising)


def comes_nearer(off: Floats) -> Bools:
    """True where the largest distances of orbits from a cycle, in successive parts (P, ...), fall or are rounding at last."""
    return np.asarray((off[-1] <= SAME) | ((np.diff(off, axis=0) < 0).all(axis=0) & (off[-1] <= NEAR)))


def largest_distances(known: Floats, states: Floats, coordinates: Coordinates, scale: Floats) -> Floats:
    """The distance of each of N states from the nearest of known ones, the largest in a coordinate, shape (N,)."""
    return distances(coordinates.wrap(known), coordinates.wrap(states), coordinates, scale, np.inf)
