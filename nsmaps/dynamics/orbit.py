"""Orbits of return maps, in batches."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.errors import StateError
from nsmaps.exact.outcome import OUTCOMES
from nsmaps.exact.returnmap import ReturnMap, repeat_outcomes, single_returns
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import PLAIN, Alphabet, words_of
from nsmaps.progress import Progress, beat, shows
from nsmaps.results import NONE, RETURNS, TIME, TURNS, Result, array, array_property, units_of

BLOCK = 100_000  #: returns of a compiled orbit between calls of `progress`: a fraction of a second
MANY = 1000  #: states for which a call costs next to nothing beside their returns, on all cores


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Orbit(WithCoordinates, Result):
    """The orbits of one or more starts under a return map; `...` is the shape of the starts without their last axis.

    Return k leads from state k to state k + 1.
    """

    picture: ClassVar[str] = "nsmaps.figures.composite.orbits"
    leading: ClassVar[tuple[str, ...]] = ("start",)

    coordinates: Coordinates
    walls: tuple[str, ...]
    states: Floats = field(metadata=array("step ... coordinate", "the starts and their images; NaN after an orbit's end"))
    turns: NDArray[np.int32] = field(
        metadata=array("return ... coordinate", "whole turns of an angle, see `Returns.known_turns`", TURNS)
    )
    codes: NDArray[np.int64]  #: shape (n, ...), words as numbers; see `words`
    outcome: NDArray[np.int8] = field(metadata=array("return ...", f"{OUTCOMES}; what ended an orbit is repeated after it", NONE))
    time: Floats = field(metadata=array("return ...", "of each return; NaN where unknown", TIME))
    alphabet: Alphabet = PLAIN  #: what the letters of words stand for
    number: NDArray[np.int32] | None = field(
        default=None, metadata=array("return ...", "successive returns from state to state; without it one each", RETURNS)
    )
    units: Mapping[str, str] = field(default_factory=dict)  #: of coordinates, by name

    def summary(self) -> str:
        """The numbers that matter."""
        orbits = int(np.prod(self.outcome.shape[1:]))
        ended = orbits - int(np.isfinite(self.final).all(axis=-1).sum())
        text = f"{len(self.outcome)} returns of ({self.coordinates}) from {orbits} start{'s' * (orbits != 1)}; {ended} ended"
        return text if self.states.ndim > 2 else f"{text}, last state {self.final.round(6).tolist()}"

    @property
    def numbers(self) -> NDArray[np.int32]:
        """The number of successive returns from each state to the next, shape (n, ...), above one by some composite maps."""
        return np.ones(self.codes.shape, np.int32) if self.number is None else self.number

    @array_property("return ...", "impact word of each return; empty after an orbit's end", NONE)
    def words(self) -> NDArray[np.str_]:
        """The word of each return, shape (n, ...); "" after an orbit's end."""
        return words_of(self.codes, self.walls)

    @property
    def final(self) -> Floats:
        """The last states, shape (..., dim)."""
        return self.states[-1]


@shows
def orbit(system: ReturnMap, starts: StateLike, n_returns: int, *, progress: Progress | None = None, **how: Any) -> Orbit:
    """The first n returns of one state, shape (dim,) or a mapping by name, or of many, shape (..., dim).

    By a composite map with pieces of several returns these are n images, whose `numbers` say how many returns each is.

    Args:
        system: an exact system, a composite map, or any other return map.
        starts: one state or many.
        n_returns: their number.
        progress: called now and then with the fraction of the returns that is made, from 0 to 1.
        how: passed on to the map's returns, such as `chatter=inf` of an exact system.

    Raises:
        StateError: the state has not the map's coordinates, or `n_returns` is negative.
    """
    coordinates = Coordinates(ReturnMap.require(system, "an orbit").coordinates)
    first, dim, n = as_starts(starts, coordinates), len(coordinates), n_returns
    if n < 0:
        raise StateError(f"n_returns is {n}; expected: a number of returns >= 0")
    flat = first.reshape(-1, dim)
    m, done = len(flat), 0
    states, turns = np.empty((n + 1, m, dim)), np.empty((n, m, dim), np.int32)
    codes, outcome, time = np.empty((n, m), np.int64), np.empty((n, m), np.int8), np.empty((n, m))
    number = np.ones((n, m), np.int32)
    states[0], none = flat, system.first_return(flat[:0], **how) if not n * m else None
    walls, alphabet = (none.walls, none.alphabet) if none is not None else ((), PLAIN)
    for part in returns_of(system, flat, n, **how):
        rows = slice(done, done + len(part) // m)
        done, walls, alphabet = rows.stop, part.walls, part.alphabet
        states[1:][rows], turns[rows] = part.image.reshape(-1, m, dim), part.known_turns.reshape(-1, m, dim)
        codes[rows], outcome[rows], time[rows] = (x.reshape(-1, m) for x in (part.codes, part.outcome, part.time))
        if part.number is not None:
            number[rows] = part.number.reshape(-1, m)
        beat(done / n)
    shape = n, *first.shape
    each = turns.reshape(shape), codes.reshape(shape[:-1]), outcome.reshape(shape[:-1]), time.reshape(shape[:-1])
    several = number.reshape(shape[:-1]) if (number > 1).any() else None
    about = alphabet, several, units_of(system)
    return Orbit(coordinates, walls, states.reshape(n + 1, *first.shape), *each, *about)


def returns_of(return_map: ReturnMap, states: Floats, n: int, **how: Any) -> Iterator[Returns]:
    """The first n returns of each of M states, shape (M, dim), in parts: rows as of `ReturnMap.orbits`; no part of no states."""
    if not len(states):
        return
    if not return_map.has_orbits or len(states) >= MANY:
        yield from single_returns(return_map, states, n, **how)
        return
    block, before = BLOCK // len(states), None
    for first in range(0, n, block):
        part = repeat_outcomes(return_map.orbits(states, min(block, n - first), **how), before)
        before = part.select(np.arange(len(part) - len(states), len(part)))
        states = before.image
        yield part
