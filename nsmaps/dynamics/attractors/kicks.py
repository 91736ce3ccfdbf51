"""Kicks of the states of attractors: the smallest after which the orbit does not come back, and the returns until it does."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.dynamics.attractors.arrivals import ENDED, UNRESOLVED, follow
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

LADDER = 2.0 ** (-np.arange(24)[::-1] / 2)  #: kicks of a ray that are tried before bisection, as shares of the scale: 0.0003 to 1
PRECISION = 1e-3  #: width to which the smallest kick that leaves is bracketed, as a share of it


@dataclass(frozen=True, slots=True)
class Kicks:
    """The kicks that are tried at each attractor; sizes are lengths in the scale of the coordinates.

    Raises:
        NsmapsError: a number below one, or a size that is not above 0.
    """

    size: float  #: of the kicks whose return is timed
    count: int  #: of these kicks, each from a random state of the attractor in a random direction
    directions: int  #: of the kicks that search for the boundary; of one coordinate there are two
    points: int  #: states of the attractor, equally many returns apart, from which these begin; at most all of them
    seed: int | Sequence[int]

    def __post_init__(self) -> None:
        if not self.size > 0 or min(self.count, self.directions, self.points) < 1:
            text = f"kicks of size {self.size}, {self.count} of them, {self.directions} directions from {self.points} points"
            raise NsmapsError(f"{text}; expected: a size above 0, numbers of at least 1")

    def rays(self, n: int) -> Floats:
        """Unit vectors in n coordinates, shape (D, n): equally spaced in a plane, random ones in more coordinates."""
        if n <= 2:
            angle = 2 * np.pi * np.arange(self.directions if n == 2 else 2) / (self.directions if n == 2 else 2)
            return np.column_stack([np.cos(angle), np.sin(angle)])[:, :n]
        return _units(np.random.default_rng(self.seed).normal(size=(self.directions, n)))

    def timed(self, attractor: Attractor) -> tuple[Floats, Floats]:
        """States of an attractor and kicks of them in the scale, shapes (count, n)."""
        rng, n = np.random.default_rng(self.seed), len(attractor.coordinates)
        place = (rng.random(self.count) * len(attractor.states)).astype(int)
        return attractor.states[place], self.size * _units(rng.normal(size=(self.count, n)))


def _units(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """How A attractors of one map stand kicks, each array of shape (A,)."""

    distance: Floats  #: the smallest kick found that leads elsewhere, inf where none does, NaN where no orbit arrives in time
    return_time: Floats  #: mean of the returns after the timed kicks that come back; NaN where none does
    return_error: Floats  #: its standard error; NaN for less than two
    returned: Floats  #: share of the timed kicks that come back; NaN where none leads to a state


def nonlocal_stability(
    return_map: ReturnMap, attractors: Sequence[Attractor], kicks: Kicks, scale: Floats, returns: int = 1000
) -> Stability:
    """The stability of attractors against finite kicks of their states; the orbits of all attractors are one batch.

    A kick leads elsewhere if its orbit arrives at another attractor, by the criterion of `basins`, or ends. If it arrives at none
    within `returns`, it counts neither as one that leaves nor as one that comes back. A kick to a point that cannot be a state,
    as with a negative impact speed, is not counted, and ends its ray. Along each ray kicks up to the scale are tried, with ratios
    of sqrt 2; where the first of them leads elsewhere, the change is bisected to 1e-3. The distance is therefore an upper
    estimate: other directions, and thin basins between two kicks of a ray, may be nearer.

    Args:
        attractors: all that are known, as kicks may lead to any.
        scale: shape (n,), the unit of kicks in each coordinate.
        returns: largest number computed for an orbit.
    """
    rays, timed = [_Rays.of(k, each, kicks, scale) for k, each in enumerate(attractors)], [kicks.timed(a) for a in attractors]
    states = [ray.at(np.full(len(ray.start), size)) for ray in rays for size in LADDER]
    states += [start + kick * scale for start, kick in timed]
    if not states:
        return Stability(*(np.zeros(0) for _ in range(4)))
    ends = follow(return_map, np.concatenate(states), attractors, returns, in_time=True)
    no_state = (ends.label == ENDED) & (ends.outcome == Outcome.invalid) & (ends.arrival == 0)
    distance, done = [], 0
    for number, ray in enumerate(rays):
        own = slice(done, done + len(LADDER) * len(ray.start))
        done, shape = own.stop, (len(LADDER), len(ray.start))
        left = _leaves(ends.label[own], number)
        low, high, rows = _brackets(left.reshape(shape), no_state[own].reshape(shape))
        smallest = _nearest(return_map, attractors, ray.select(rows), low, high, returns)
        distance.append(smallest if (ends.label[own] != UNRESOLVED).any() else np.nan)
    label, arrival, lost = (x[done:].reshape(len(rays), -1) for x in (ends.label, ends.arrival, no_state))
    times = [_times(arrival[k, label[k] == k], int((~lost[k]).sum())) for k in range(len(rays))]
    return Stability(np.array(distance), *np.array(times).T)


@dataclass(frozen=True, slots=True, eq=False)
class _Rays:
    """R rays from the states of one attractor."""

    attractor: int
    start: Floats  #: shape (R, n)
    direction: Floats  #: shape (R, n), in the coordinates' units, of a kick of size one

    @classmethod
    def of(cls, number: int, attractor: Attractor, kicks: Kicks, scale: Floats) -> "_Rays":
        """The rays in all directions from some states."""
        count = min(kicks.points, len(attractor.states))
        start = attractor.states[np.arange(count) * len(attractor.states) // count]
        rays = kicks.rays(len(attractor.coordinates)) * scale
        return cls(number, np.repeat(start, len(rays), axis=0), np.tile(rays, (count, 1)))

    def at(self, size: Floats) -> Floats:
        """The states after kicks of these sizes, shape (R,)."""
        return np.asarray(self.start + size[:, None] * self.direction)

    def select(self, rows: NDArray[np.int64]) -> "_Rays":
        """Some of the rays."""
        return _Rays(self.attractor, self.start[rows], self.direction[rows])


def _leaves(label: NDArray[np.int32], number: int) -> Bools:
    """True for orbits that lead elsewhere than to the attractor of this number."""
    return np.asarray((label != number) & (label != UNRESOLVED))


def _brackets(left: Bools, no_state: Bools) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Kicks on either side of the first that leaves, on the rays where they may be the smallest, and these rays.

    Args:
        left, no_state: shape (L, R), for each kick of the ladder and each ray.
    """
    first = left.argmax(axis=0)
    none_before = ~np.logical_or.accumulate(no_state, axis=0)[first, np.arange(len(first))]
    low = np.append(0.0, LADDER)[first]
    some = left.any(axis=0) & none_before
    smallest = LADDER[first][some].min(initial=np.inf)
    rows = np.flatnonzero(some & (low < smallest))
    return low[rows], LADDER[first[rows]], rows


def _nearest(
    return_map: ReturnMap, attractors: Sequence[Attractor], rays: _Rays, low: Floats, high: Floats, returns: int
) -> float:
    """The smallest kick that leaves, by bisection on all rays; inf without rays."""
    if not len(low):
        return float("inf")

    def label(size: Floats) -> Bools:
        return _leaves(follow(return_map, rays.at(size), attractors, returns, in_time=True).label, rays.attractor)

    sides = np.zeros(len(low), bool), np.ones(len(low), bool)
    return float(bisect_change(label, low, high, *sides, PRECISION * high)[1].min())


def _times(arrival: NDArray[np.int32], kicks: int) -> tuple[float, float, float]:
    """The mean return time, its standard error and the share of the kicks that come back."""
    count = len(arrival)
    mean = float(arrival.mean()) if count else np.nan
    error = float(arrival.std(ddof=1) / np.sqrt(count)) if count > 1 else np.nan
    return mean, error, count / kicks if kicks else np.nan
