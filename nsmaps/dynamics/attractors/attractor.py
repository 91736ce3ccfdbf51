"""Attractors as sets of states: found by following orbits, and recognised when an orbit has reached one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, finite_rows
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.distance import Nearest, distances, extents, widest_gap
from nsmaps.dynamics.limits.cycles import cycle_in
from nsmaps.dynamics.limits.decision import limits, seen
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.limits.path import Path, vast
from nsmaps.dynamics.limits.releases import beside_release
from nsmaps.dynamics.limits.settled import Transient
from nsmaps.dynamics.motion import QUASI_PERIODIC
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.results import Result, array, units_of

if TYPE_CHECKING:
    from scipy.spatial import KDTree

VISITED = 4000  #: number of states that represent an attractor without period
SAMPLE = 1000  #: number of last states of an orbit without period that are compared with others
STAY = 50  #: successive states within the reach of an attractor without period after which an orbit has reached it


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Attractor(WithCoordinates, Result):
    """A set of states that orbits approach and stay on."""

    picture: ClassVar[str] = "nsmaps.figures.attractors.poincare"

    coordinates: Coordinates
    states: Floats = field(metadata=array("point coordinate", "one period in order, or states visited; angles in [0, 2 pi)"))
    period: int  #: in returns; 0 without one
    label: str  #: name of the motion, such as 2:1/T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of the return from each state of a period; without a period, every word on it
    reach: float  #: distance in each coordinate within which a state belongs to it; see `find_attractors`
    scale: Floats | None = field(default=None, metadata=array("coordinate", "unit of the reach; none: the coordinates' units"))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """The numbers that matter."""
        period = f"period {self.period}" if self.period else f"{len(self.states)} states"
        return f"{self.label or 'no name'}, {period}, words {' '.join(self.words[:6])}"

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
        """A mask of the states (N, n), angles in [0, 2 pi), within its reach, shape (N,); False for non-finite states."""
        return self.distances(states, self.reach) <= self.reach

    def distances(self, states: Floats, bound: float = np.inf) -> Floats:
        """The largest difference in a coordinate of each state (N, n) from the nearest of its own, in its scale, shape (N,).

        Infinite beyond the bound, and of non-finite states.
        """
        found, held = np.full(len(states), np.inf), np.isfinite(states).all(axis=1)
        found[held] = _nearest(self).distances(states[held], np.inf, bound)
        return found

    def holds(self, states: Floats) -> bool:
        """True if an orbit of these states stays on it: most are within its reach, as rounding and its edge may lead some out."""
        return bool(self.near(states).mean() > 0.5)


@lru_cache(maxsize=32)
def _nearest(attractor: Attractor) -> Nearest:
    """The search tree of an attractor in its scale, kept, as an orbit is compared with it after every return."""
    return Nearest(attractor.states, attractor.coordinates, 1.0 if attractor.scale is None else attractor.scale)


def own_reach(states: Floats, coordinates: Coordinates, scale: Floats, label: str) -> float:
    """The largest distance of the second half of states (K, n), in order, from the first half; inf for less than 50 states.

    Of quasi-periodic motion it is at least the widest gap between neighbours, in which other orbits on the same curve may lie.
    """
    if len(states) < STAY:
        return np.inf
    half = len(states) // 2
    gap = widest_gap(states, coordinates, scale) if label.endswith(QUASI_PERIODIC) else 0.0
    return max(gap, float(distances(states[:half], states[half:], coordinates, scale, np.inf).max()))


def kept(coordinates: Coordinates, states: Floats, length: int, label: str, near: float, scale: Floats) -> Attractor:
    """The set on which an orbit was found, from states (K, n) in order, to be compared with others by `may_be_one`.

    A period has `length` states, 0 without one. Its reach is `near` in the scale, (n,); without a period, or with one longer
    than K, it is a sample of the last 1000 states, whose reach is at least its own.
    """
    length = length if length <= len(states) else 0
    there = coordinates.wrap(states[:length] if length else states[-SAMPLE:])
    reach = near if length else max(near, own_reach(there, coordinates, scale, label))
    return Attractor(coordinates, there, length, label, (), reach, scale)


def may_be_one(one: Attractor, other: Attractor) -> bool:
    """True if two sets of states may be of one attractor: cycles whose states all agree, or a sample that contains the other.

    A set without a period is a sample, which another orbit on the same attractor need not approach; then most of the states
    of either must lie within the reach of the other.
    """
    if one.period and other.period:
        return bool(one.near(other.states).all() and other.near(one.states).all())
    return one.holds(other.states) or other.holds(one.states)


def find_attractors(
    return_map: ReturnMap,
    starts: Floats,
    discard: int = 1000,
    tolerance: float = 1e-6,
    max_period: int = 32,
    known: Sequence[Attractor] = (),
) -> list[Attractor]:
    """The attractors that orbits of starts, shape (N, n), reach after a transient, except for the known ones.

    Cycles are found where orbits repeat, in words and within `tolerance` in each coordinate (in radians for an angle, otherwise
    as a share of the extent of the motions from the last states, see `scale_of`), which is their reach too. They are sought in
    `2 max_period` returns; orbits that do not repeat there are followed on, and what they end on is decided by `limits`. Chaotic
    and quasi-periodic attractors are the states that one orbit visits, and their reach is the largest distance of their second
    half from the first, in shares of their extents; so are those that come back to a release from rest after a period that
    rounding decides, which are named `unresolved`. Orbits that end or escape reach none, and orbits of which neither a period
    nor chaos was shown make no attractor.
    """
    first = np.array(starts, float)
    coordinates, sizes = Coordinates(return_map.coordinates), Coordinates(return_map.coordinates).magnitudes(first)
    transient = Transient.of(return_map, first, discard, 2 * max_period, 2 * max_period) if len(first) else None
    which = np.flatnonzero(finite_rows(transient.states) & ~vast(coordinates, transient.states, sizes)) if transient else first
    if transient is None or not len(which):
        return []
    path = transient.path(return_map, which, 2 * max_period, first[which], derivative=True)
    scale = scale_of(return_map, path.states[:, ~vast(coordinates, path.states[-1], sizes)], beside=first)
    found, open_ = list[Attractor](), list[int]()
    for k in range(len(which)):
        if not _is_of(path, k, (*known, *found)):
            one = seen(return_map, path.of_one(k), scale, tolerance)
            if one.is_open and not one.unstable:
                one = cycle_in(return_map, one.path, scale, tolerance) or one
            if one.length:
                found += _new(_cycle(one, tolerance, scale), (*known, *found))
            elif one.is_open:
                open_.append(k)
    found += _followed_on(return_map, path, open_, scale, tolerance, (*known, *found))
    return [replace(each, units=units_of(return_map)) for each in found]


def _followed_on(
    return_map: ReturnMap, path: Path, open_: list[int], scale: Floats, tolerance: float, known: Sequence[Attractor]
) -> list[Attractor]:
    """The new attractors of the orbits of these numbers, which do not repeat: of one, then of four times as many at a time."""
    found, count = list[Attractor](), 1
    while open_:
        open_ = [k for k in open_ if not _is_of(path, k, (*known, *found))]
        here, open_, count = open_[:count], open_[count:], 4 * count
        for one in limits(return_map, path.states[-1, here], scale, tolerance, path.begun[here]):
            if one.held and not one.is_open:
                attractor = _cycle(one, tolerance, scale) if one.period else _visited(return_map, one, scale)
                found += _new(attractor, (*known, *found))
    return found


def _new(attractor: Attractor | None, known: Sequence[Attractor]) -> list[Attractor]:
    """An attractor, if it is not one of those known."""
    return [attractor] if attractor is not None and not any(may_be_one(attractor, other) for other in known) else []


def _is_of(path: Path, k: int, attractors: Sequence[Attractor]) -> bool:
    """True if an orbit stays on one of the attractors."""
    tail = path.coordinates.wrap(path.states[1:, k])
    return any(attractor.holds(tail) for attractor in attractors)


def _cycle(one: Limit, tolerance: float, scale: Floats) -> Attractor:
    """The attractor of an orbit that ends on a cycle."""
    return Attractor(one.path.coordinates, one.states, one.period, one.label, one.words, tolerance, scale)


def _visited(return_map: ReturnMap, one: Limit, unit: Floats) -> Attractor | None:
    """The attractor of an orbit without a period, as the states that it visits; None if it ends.

    Where rounding decides when it rests again, the states are those that orbits visit from states up to rounding beside one.
    """
    starts = beside_release(return_map, one.path, unit) if one.rests else one.path.states[-1]
    path = orbit(return_map, starts, VISITED // len(starts))
    held = np.isfinite(path.final).all(axis=1)
    if not held.any():
        return None
    coordinates, states = path.coordinates, np.concatenate(np.swapaxes(path.coordinates.wrap(path.states[1:, held]), 0, 1))
    scale, words = extents(states, coordinates, unit), tuple(np.unique(path.words[:, held]).tolist())
    return Attractor(coordinates, states, 0, one.label, words, own_reach(states, coordinates, scale, one.label), scale)
