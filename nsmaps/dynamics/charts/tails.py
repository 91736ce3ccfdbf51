"""The ends of long orbits: the last returns after many, of which exact repetitions are not computed again."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, finite_rows
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.limits.limit import Limit, limit_of, limits, unless_resting
from nsmaps.dynamics.limits.path import ALIGN, Path, diverges
from nsmaps.dynamics.limits.releases import ROUNDED
from nsmaps.dynamics.motion import ESCAPE, UNRESOLVED
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import PLAIN, Alphabet

FIRST = 512  #: returns after which an orbit is first compared with itself; the next time it is after twice as many
LOOKED = 2  #: last states of an orbit, from which the extent of its motion is taken
BLOCK = 100_000  #: most returns of a compiled call, of all starts together, so that memory stays small


@dataclass(frozen=True, slots=True)
class Length:
    """The number of returns of each orbit, and of the last ones that are looked at."""

    discard: int  #: as the transient
    returns: int  #: after it, at least `window`
    window: int  #: the last ones, in which a period is sought


@dataclass(slots=True, eq=False)
class Tail:
    """The last K returns of the orbits of S starts of n coordinates."""

    walls: tuple[str, ...]
    states: Floats  #: shape (S, K, n); NaN after an orbit's end
    turns: NDArray[np.int64]  #: shape (S, K), whole turns of all angles on the return to each state
    codes: NDArray[np.int64]  #: shape (S, K), words as numbers
    outcome: NDArray[np.int8]  #: shape (S,), values of `Outcome`, of the last return or of that which ended the orbit
    slopes: Floats  #: shape (S, K, n, n), derivatives of the returns; NaN where unknown
    scale: Floats  #: shape (S, n), unit of each coordinate on the motion, see `scale_of`; 1 of orbits that end
    growth: Floats  #: shape (S,), mean logarithmic growth of a tangent vector a return; NaN of orbits that repeat or end
    computed: int  #: returns of all starts; the others repeat
    alphabet: Alphabet = PLAIN  #: what the letters of words stand for
    limits: dict[int, Limit] = field(default_factory=dict)  #: of orbits, by number, that do not repeat to the last bit at once

    @classmethod
    def empty(cls, count: int, k: int, dim: int) -> "Tail":
        """Room for the last k returns of some orbits, with the outcome `invalid`."""
        codes, turns, outcome = np.zeros((count, k), np.int64), np.zeros((count, k), np.int64), np.full(count, Outcome.invalid)
        states, slopes = np.full((count, k, dim), np.nan), np.full((count, k, dim, dim), np.nan)
        growth, scale = np.full(count, np.nan), np.ones((count, dim))
        return cls((), states, turns, codes, outcome.astype(np.int8), slopes, scale, growth, 0)

    @property
    def final(self) -> Floats:
        """The last states, shape (S, n)."""
        return self.states[:, -1]


def tail(return_map: ReturnMap, starts: Floats, length: Length, tolerance: float = 1e-6) -> Tail:
    """The ends of the orbits of starts (S, n) after `discard + returns` returns.

    What orbits end on that do not repeat up to rounding in the last ones is decided as by `limits`: in all `returns`, with the
    extent of the motion as the scale, and where that does not show it in those that follow.
    A return is a function of its start. An orbit that comes back to a state to the last bit repeats, and its later
    returns are known: all numbers are those of the whole computation, digit for digit.
    """
    (count, dim), k = starts.shape, length.window
    after, repeats, outcome, computed = _transient(return_map, starts, length)
    found = Tail.empty(count, k, dim)
    found.outcome, found.computed = outcome, computed
    paths: list[tuple[int, Path]] = []
    for own, n in ((repeats, k), (~repeats, length.returns)):
        which = np.flatnonzero(own)
        if len(which):
            part = return_map.orbits(after[which], n, derivative=True)
            _write(found, which, part, n, finite_rows(after[which]))
            if not repeats[which[0]]:
                if part.derivative is not None:
                    found.growth[which] = _growth(part.derivative.reshape(n, len(which), dim, dim))
                path = Path.of(part, len(which))
                paths = [(orbit, path.of_one(place)) for place, orbit in enumerate(which.tolist())]
    found.scale[:] = [scale_of(return_map, own[-LOOKED:], beside=starts) for own in found.states]
    gone = diverges(Coordinates(return_map.coordinates), found.states, starts)
    found.growth[gone], found.outcome[gone] = np.nan, Outcome.escaped
    for orbit, path in paths:
        one = Limit(ESCAPE, path) if gone[orbit] else _limit(return_map, path, found.scale[orbit], length.window, tolerance)
        if one is not None:
            found.limits[orbit] = one
    return found


def _limit(return_map: ReturnMap, path: Path, scale: Floats, window: int, tolerance: float) -> Limit | None:
    """What the orbit of one path ends on; None where it repeats up to rounding in the last returns without rest, or ended."""
    last = path.last(window)
    rests = (last.outcome == Outcome.stuck).any()
    if not np.isfinite(path.states[-1]).all() or (not rests and last.repeats(ROUNDED * scale)[0]):
        return None
    found = unless_resting(return_map, limit_of(return_map, path, scale, tolerance), scale, tolerance)
    if found.kind == UNRESOLVED and not found.rests:
        found = limits(return_map, path.states[-1], scale, tolerance)[0]
    return found


def _transient(return_map: ReturnMap, starts: Floats, length: Length) -> tuple[Floats, NDArray[np.bool_], NDArray[np.int8], int]:
    """The states from which the last returns begin, which orbits repeat, the outcome of those that ended, and returns made."""
    after, repeats, outcome = starts.copy(), np.zeros(len(starts), bool), np.full(len(starts), Outcome.invalid, np.int8)
    going, done, block, computed = np.arange(len(starts)), 0, FIRST, 0
    last = length.discard + length.returns - length.window
    while done < length.discard and len(going):
        n = min(block, length.discard - done)
        part = return_map.orbits(after[going], n)
        images, done, block = part.image.reshape(n, len(going), -1), done + n, min(2 * block, BLOCK // len(going) + 1)
        after[going], outcome[going], computed = images[-1], part.outcome[-len(going) :], computed + n * len(going)
        for column, orbit in enumerate(going.tolist()):
            cycle = _repeating(images[-1 - length.window // 2 :, column])
            if len(cycle):
                after[orbit], repeats[orbit] = cycle[(last - done - 1) % len(cycle)], True
        going = going[~repeats[going] & finite_rows(after[going])]
    return after, repeats, outcome, computed


def _repeating(states: Floats) -> Floats:
    """The states after the last one of an orbit (K, n) in order, if it is equal to an earlier one; otherwise none."""
    equal = np.flatnonzero((states[:-1] == states[-1]).all(axis=1))
    return states[equal[-1] + 1 :] if len(equal) else states[:0]


def _write(found: Tail, which: NDArray[np.int64], part: Returns, n: int, going: NDArray[np.bool_]) -> None:
    """Write the last of n returns of some orbits; those that are not `going` ended before and keep their outcome."""
    m, k = len(which), found.codes.shape[1]

    def rows(table: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.swapaxes(table.reshape(n, m, *table.shape[1:])[n - k :], 0, 1)

    circle = part.coordinates.angles
    found.walls, found.alphabet = part.walls, part.alphabet
    found.states[which], found.codes[which] = rows(part.image), rows(part.codes)
    found.turns[which] = rows(part.known_turns[:, circle].sum(axis=1))
    found.outcome[which] = np.where(going, part.outcome[-m:], found.outcome[which])
    found.computed += n * m
    if part.derivative is not None:
        found.slopes[which] = rows(part.derivative)


def _growth(slopes: Floats) -> Floats:
    """The mean logarithm of the growth of a tangent vector by derivatives (n, M, dim, dim), shape (M,), once it has turned."""
    from nsmaps.dynamics.frames import carried

    n, m, dim, _ = slopes.shape
    growth = np.empty((n, m, dim))
    carried(np.ascontiguousarray(slopes), np.tile(np.eye(dim), (m, 1, 1)), growth)
    each = np.ascontiguousarray(growth[min(ALIGN, n // 2) :, :, 0].T)  # so that no sum depends on the number of orbits
    return np.asarray(each.mean(axis=1))
