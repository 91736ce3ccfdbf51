"""Attractors as sets of states: found by following orbits, and recognised when an orbit has reached one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.distance import Nearest, distances, extents
from nsmaps.dynamics.motion import label, periods
from nsmaps.dynamics.orbit import Orbit, orbit, returns_of
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.dynamics.scale import scale_of

if TYPE_CHECKING:
    from scipy.spatial import KDTree

VISITED = 4000  #: number of states that represent an attractor without period
SAMPLE = 1000  #: number of last states of an orbit without period that are compared with others
COMING = 1e-3  #: share of the scale within which an orbit that repeats is taken to approach a stable cycle
STAY = 50  #: successive states within the reach of an attractor without period after which an orbit has reached it


@dataclass(frozen=True, slots=True, eq=False)
class Attractor(WithCoordinates):
    """A set of states that orbits approach and stay on."""

    coordinates: Coordinates
    states: Floats  #: shape (K, n), angles in [0, 2 pi): one period in order, or states visited
    period: int  #: in returns; 0 without one
    label: str  #: name of the motion, such as 2:1/T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of the return from each state of a period; without a period, every word on it
    reach: float  #: distance in each coordinate within which a state belongs to it; see `find_attractors`
    scale: Floats | None = None  #: shape (n,), scale of the reach; None: the coordinates' units

    @property
    def stay(self) -> int:
        """The number of successive states within its reach after which an orbit has reached it."""
        return 1 if self.period else STAY

    @property
    def tree(self) -> "KDTree":
        """A search tree of the states, around the circle."""
        from scipy.spatial import KDTree

        return KDTree(self.states, boxsize=np.where(self.coordinates.angles, TWO_PI, 0.0))

    def near(self, states: Floats) -> NDArray[np.bool_]:
        """A mask of the states, shape (N, n), angles in [0, 2 pi), within its reach, shape (N,); False for states that are not
        finite.
        """
        near = np.array(np.isfinite(states).all(axis=1))
        near[near] = _nearest(self).distances(states[near], np.inf, self.reach) <= self.reach
        return near

    def holds(self, states: Floats) -> bool:
        """True if an orbit of these states stays on it: most are within its reach, as rounding and its edge may lead some out."""
        return bool(self.near(states).mean() > 0.5)


@lru_cache(maxsize=32)
def _nearest(attractor: Attractor) -> Nearest:
    """The search tree of an attractor in its scale, kept, as an orbit is compared with it after every return."""
    return Nearest(attractor.states, attractor.coordinates, 1.0 if attractor.scale is None else attractor.scale)


def own_reach(states: Floats, coordinates: Coordinates, scale: Floats) -> float:
    """The largest distance of the second half of states (K, n), in order, from the first half; inf for less than 50 states."""
    half = len(states) // 2
    return np.inf if len(states) < STAY else float(distances(states[:half], states[half:], coordinates, scale, np.inf).max())


def kept(coordinates: Coordinates, states: Floats, period: int, label: str, near: float, scale: Floats) -> Attractor:
    """The set on which an orbit was found, from states (K, n) in order, to be compared with others by `may_be_one`.

    Its reach is `near` in the scale, (n,); without a period it is a sample of the last 1000 states, whose reach is at least
    its own.
    """
    there = coordinates.wrap(states[:period] if period else states[-SAMPLE:])
    reach = near if period else max(near, own_reach(there, coordinates, scale))
    return Attractor(coordinates, there, period, label, (), reach, scale)


def may_be_one(one: Attractor, other: Attractor) -> bool:
    """True if two sets of states may belong to one attractor: two cycles whose states all agree, or a sample that contains the
    other set.

    A set without a period is a sample, which another orbit on the same attractor need not approach; then most of the states
    of either must lie within the reach of the other.
    """
    if one.period and other.period:
        return bool(one.near(other.states).all() and other.near(one.states).all())
    return one.holds(other.states) or other.holds(one.states)


def find_attractors(
    map: ReturnMap,
    starts: Floats,
    discard: int = 1000,
    tolerance: float = 1e-6,
    max_period: int = 32,
    known: Sequence[Attractor] = (),
) -> list[Attractor]:
    """The attractors that orbits of starts, shape (N, n), reach after a transient, except for the known ones.

    Attractors of a period up to `max_period`, in words and within `tolerance` in each coordinate (in radians for an angle,
    otherwise as a share of the extent of the motions from the last states, see `scale_of`), have the tolerance as their reach.
    Others are the states that one orbit visits, and their reach is the largest distance of their second half from the first, in
    shares of their extents. A stable cycle within 1e-3 of a repetition is refined by Newton's method, since slowly converging
    orbits repeat far from it. Orbits that end reach none; after too short a transient the set has no period.
    """
    last = np.array(starts, float)
    for part in returns_of(map, last, discard):
        last = part.image[-len(last) :]
    kept = orbit(map, last[np.isfinite(last).all(axis=1)], 2 * max_period)
    scale, found = scale_of(map, kept.states, beside=starts), list[Attractor]()
    for k in np.flatnonzero(np.isfinite(kept.final).all(axis=1)).tolist():
        if not _is_of(kept, k, (*known, *found)):
            found_here = _attractor(map, kept, k, tolerance, scale)
            found_here = _closed(map, found_here) if found_here and found_here.period else found_here
            found += [found_here] if found_here and not any(may_be_one(found_here, other) for other in (*known, *found)) else []
    return found


def _is_of(kept: Orbit, k: int, attractors: Sequence[Attractor]) -> bool:
    """True if an orbit stays on one of the attractors."""
    tail = kept.coordinates.wrap(kept.states[1:, k])
    return any(attractor.holds(tail) for attractor in attractors)


def _attractor(map: ReturnMap, kept: Orbit, k: int, tolerance: float, scale: Floats) -> Attractor | None:
    """The attractor of one orbit: its period, or the states that it visits from there on; None if the orbit ends.

    An orbit that becomes periodic only later was on a long transient; its attractor is the later one.
    """
    found_here, max_period = _periodic(kept, k, tolerance, scale), (len(kept.states) - 1) // 2
    if found_here is not None:
        return found_here
    path = orbit(map, kept.final[k : k + 1], VISITED)
    after = orbit(map, path.final, 2 * max_period)
    if not np.isfinite(after.final).all():
        return None
    return _periodic(after, 0, tolerance, scale) or _visited(path, scale)


def _periodic(kept: Orbit, k: int, tolerance: float, scale: Floats) -> Attractor | None:
    """The attractor of one orbit with a period, None without one."""
    period = int(periods(kept.states[1:, k], kept.codes[:, k], kept.coordinates, tolerance * scale))
    if not period:
        return None
    words = kept.words[:, k].tolist()
    name = label(words, _turns(kept, k), period, kept.walls)
    states = kept.coordinates.wrap(kept.states[1 : period + 1, k])
    return Attractor(kept.coordinates, states, period, name, tuple(words[1 : period + 1]), tolerance, scale)


def _closed(map: ReturnMap, seen: Attractor) -> Attractor:
    """The cycle that an orbit with a period approaches, by Newton's method: slow convergence may leave it far beyond the
    tolerance.

    It has the least period that leads to a stable cycle within 1e-3 of the scale; otherwise, as without derivatives, the
    observed
    states are returned.
    """
    if map.first_return(seen.states, derivative=True).derivative is None:
        return seen
    scale = scale_of(map, seen.states)
    for period in (q for q in range(1, seen.period + 1) if seen.period % q == 0):
        found = periodic_orbit(map, seen.states[:period], period, scale=scale)
        if found.converged and found.exists and found.stable:
            distance = distances(found.states, seen.states, seen.coordinates, scale, np.inf).max()
            if distance <= COMING:
                name = seen.label if period == seen.period else found.label
                return replace(seen, states=found.states, period=period, label=name, words=found.words)
    return seen


def _visited(path: Orbit, unit: Floats) -> Attractor:
    """The attractor of one orbit without a period, as the states that it visits."""
    states, words = path.coordinates.wrap(path.states[1:, 0]), path.words[:, 0].tolist()
    name, every = label(words, _turns(path, 0), 0, path.walls), tuple(sorted(set(words)))
    scale = extents(states, path.coordinates, unit)
    return Attractor(path.coordinates, states, 0, name, every, own_reach(states, path.coordinates, scale), scale)


def _turns(path: Orbit, k: int) -> list[int]:
    turns: list[int] = path.turns[:, k, path.coordinates.angles].sum(axis=-1).tolist()
    return turns
