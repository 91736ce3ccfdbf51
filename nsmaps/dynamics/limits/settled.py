"""Orbits after a transient, of which exact repetitions are not computed again, and which do not stay on an unstable cycle."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints, finite_rows
from nsmaps.dynamics.limits.decision import beside, seen
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.limits.path import Path, followed
from nsmaps.dynamics.orbit import orbit, returns_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

FIRST = 512  #: returns after which an orbit is first compared with itself; the next time it is after twice as many
BLOCK = 100_000  #: most returns of a compiled call, of all starts together, so that memory stays small


@dataclass(frozen=True, slots=True, eq=False)
class Transient:
    """The orbits of S starts of n coordinates after a transient."""

    starts: Floats  #: shape (S, n)
    states: Floats  #: shape (S, n), from which the last returns begin; NaN of orbits that ended
    repeats: Bools  #: shape (S,), orbits that have come back to a state to the last bit
    outcome: NDArray[np.int8]  #: shape (S,), of orbits that ended
    computed: int  #: returns of all starts; the others repeat

    @classmethod
    def of(cls, return_map: ReturnMap, starts: Floats, discard: int, returns: int, window: int) -> "Transient":
        """The transient of `discard` returns, before `returns` of which the last `window` are looked at.

        A return is a function of its start. An orbit that comes back to a state to the last bit repeats, and its later returns
        are known: they are those of the whole computation, digit for digit, from a state that is `window` before the last.
        """
        after, repeats, outcome = starts.copy(), np.zeros(len(starts), bool), np.full(len(starts), Outcome.invalid, np.int8)
        going, done, block, computed = np.arange(len(starts)), 0, FIRST, 0
        last = discard + returns - window
        while done < discard and len(going):
            n = min(block, discard - done)
            *_, part = returns_of(return_map, after[going], n)
            images = part.image.reshape(-1, *after[going].shape)
            done, computed, block = done + n, computed + n * len(going), min(2 * block, BLOCK // len(going) + 1)
            after[going], outcome[going] = images[-1], part.outcome[-len(going) :]
            for column, number in enumerate(going.tolist()):
                cycle = _repeating(images[-1 - window // 2 :, column])
                if len(cycle):
                    after[number], repeats[number] = cycle[(last - done - 1) % len(cycle)], True
            going = going[~repeats[going] & finite_rows(after[going])]
        return cls(starts, after, repeats, outcome, computed)

    def path(self, return_map: ReturnMap, which: Ints, count: int, begun: Floats, derivative: bool = False) -> Path:
        """The path of some of the orbits over `count` returns; those that ended before keep their outcome."""
        states = self.states[which]
        path = (
            followed(return_map, states, count, begun) if derivative else Path.of_orbit(orbit(return_map, states, count), begun)
        )
        ended = ~finite_rows(states)
        return replace(path, outcome=np.where(ended & (self.computed > 0), self.outcome[which], path.outcome))


def _repeating(states: Floats) -> Floats:
    """The states after the last one of an orbit (K, n) in order, if it is equal to an earlier one; otherwise none."""
    equal = np.flatnonzero((states[:-1] == states[-1]).all(axis=1))
    return states[equal[-1] + 1 :] if len(equal) else states[:0]


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """The last returns of the orbits of S starts of n coordinates, and what they show the orbits to end on."""

    path: Path
    scale: Floats  #: shape (S, n), of the motion of each
    limits: list[Limit]  #: unresolved where more returns are needed

    @property
    def final(self) -> Floats:
        """The last states, shape (S, n)."""
        return self.path.states[-1]


def settled(return_map: ReturnMap, starts: Floats, discard: int, returns: int, begun: Floats, tolerance: float) -> Settled:
    """The orbits of states (S, n) after a transient; those on an unstable cycle start again from beside it, once.

    They may come back to it, as where rounding of a map by formula leads there.

    Args:
        begun: shape (S, n), see `Path`.
    """
    found = _settled(return_map, starts, discard, returns, begun, tolerance)
    if not any(one.unstable for one in found.limits):
        return found
    each = zip(found.limits, starts, found.final, found.scale, strict=True)
    starts = np.array([beside(return_map, last, scale) if one.unstable else start for one, start, last, scale in each])
    return _settled(return_map, starts, discard, returns, begun, tolerance)


def _settled(return_map: ReturnMap, starts: Floats, discard: int, returns: int, begun: Floats, tolerance: float) -> Settled:
    every = np.arange(len(starts))
    path = Transient.of(return_map, starts, discard, returns, returns).path(return_map, every, returns, begun)
    scale = path.scales(return_map)
    limits = [seen(return_map, path.of_one(k), scale[k], tolerance) for k in every.tolist()]
    return Settled(path, scale, limits)
