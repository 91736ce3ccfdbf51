"""First returns, their margins and itineraries, and the impacts of a trajectory: the results of a map.

A point that fails is data: its `Outcome` states why and its image is NaN.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, finite_rows
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.words import PLAIN, Alphabet, encode, words_of
from nsmaps.results import NONE, RETURNS, TIME, TURNS, Result, array, array_property

ROWS = ("start", "image", "turns", "codes", "outcome", "time", "derivative", "number")  #: arrays of returns
FEW = 8  #: number of words that are shown of returns


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Margin(Result):
    """The distance of each of N returns from a graze; where either number falls to zero, the word changes."""

    clearance: Floats = field(
        metadata=array("state", "least gap to the wall ahead at a turning point, in displacement; inf without a turning point")
    )
    slowest: Floats = field(
        metadata=array("state", "least impact speed of the return, the last impact included; inf without an impact")
    )

    def summary(self) -> str:
        """The numbers that matter."""
        least, slowest = np.min(self.clearance, initial=np.inf), np.min(self.slowest, initial=np.inf)
        return f"{len(self.clearance)} returns: least clearance {least:.4g}, slowest impact {slowest:.4g}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Returns(WithCoordinates, Result):
    """First returns of a batch of N states with n coordinates, by an exact or a composite map.

    Besides the fields there are `words`, `lifted`, `valid` and `certified`, each an array of N rows like the others.
    """

    coordinates: Coordinates
    walls: tuple[str, ...]
    start: Floats = field(metadata=array("state coordinate", "as given"))
    image: Floats = field(metadata=array("state coordinate", "angles in [0, 2 pi); NaN where there is none"))
    turns: NDArray[np.int32] = field(
        metadata=array("state coordinate", "whole turns of an angle from its start to its image; zero elsewhere", TURNS)
    )
    codes: NDArray[np.int64]  #: shape (N,), words as numbers; see `words`
    outcome: NDArray[np.int8] = field(metadata=array("state", OUTCOMES, NONE))
    time: Floats = field(
        metadata=array(
            "state", "from start to image, or to where events accumulate or endless rest begins; NaN where unknown", TIME
        )
    )
    derivative: Floats | None = field(
        default=None, metadata=array("state coordinate by", "d image / d start; its unit is that over that of `by`")
    )
    margin: Margin | None = None  #: distance from a graze, if requested
    fitted: bool = False  #: True if the images are those of fitted polynomials, which nothing certifies
    integrated: bool = False  #: True if flights were integrated numerically, which nothing certifies either
    alphabet: Alphabet = PLAIN  #: what the letters of words stand for
    number: NDArray[np.int32] | None = field(
        default=None, metadata=array("state", "successive returns that each row is", RETURNS)
    )

    def __len__(self) -> int:
        return len(self.start)

    def summary(self) -> str:
        """The number of returns, their outcomes, and the words of those with an image, the most frequent first."""
        words, numbers = np.unique(self.words[self.valid], return_counts=True)
        order = np.argsort(-numbers, kind="stable")[:FEW]
        shown = ", ".join(f"{words[k]} {numbers[k]}" for k in order) + ", ..." * (len(words) > FEW)
        ends = ", ".join(f"{number} {outcome}" for outcome, number in self.counts().items())
        return f"{len(self)} first returns of ({self.coordinates}): {ends or 'none'}; words: {shown or 'none'}"

    @classmethod
    def of_map(
        cls,
        coordinates: Sequence[str],
        states: ArrayLike,
        image: ArrayLike,
        derivative: ArrayLike | None = None,
        words: Sequence[str] | None = None,
        walls: Sequence[str] = (),
    ) -> "Returns":
        """The returns of a map by formula, each of which takes one unit of time, for the `first_return` of a user-defined map.

        Args:
            coordinates: the n names, an `Angle` for one on the circle.
            states: shape (N, n), as given to `first_return`.
            image: shape (N, n), as the formula has it, angles beyond a turn too; NaN or infinite where there is none.
            derivative: shape (N, n, n), d image / d state.
            words: of the N returns, of the letters `walls`; without them motions are named by their period.

        Raises:
            StateError: arrays of other shapes, or a word of other letters.
        """
        names, start, there = Coordinates(coordinates), np.asarray(states, float), np.asarray(image, float)
        count, dim = len(start), len(names)
        slopes = None if derivative is None else np.asarray(derivative, float)
        shapes = start.shape, there.shape, (count, dim, dim) if slopes is None else slopes.shape
        if shapes != ((count, dim), (count, dim), (count, dim, dim)):
            expected = f"(N, {dim}) of states and images, (N, {dim}, {dim}) of derivatives"
            raise StateError(f"states, images and derivatives have the shapes {shapes}; expected: {expected}")
        known = finite_rows(start)
        lost = ~(known & finite_rows(there))
        inner = np.where(lost[:, None], 0.0, there) if lost.any() else there
        turns = np.where(names.angles, np.floor(inner / TWO_PI), 0.0).astype(np.int32)
        given = () if words is None else words
        code_of = {word: encode(word, walls) for word in set(given)}
        codes = np.array([code_of[word] for word in given], np.int64).reshape(count) if code_of else np.zeros(count, np.int64)
        wrapped, outcome, time = names.wrap(inner), np.zeros(count, np.int8), np.ones(count)
        if lost.any():
            wrapped[lost] = time[lost] = np.nan
            turns[lost] = codes[lost] = 0
            outcome[lost] = np.where(known, Outcome.escaped, Outcome.invalid)[lost]
        return cls(names, tuple(walls), start, wrapped, turns, codes, outcome, time, derivative=slopes)

    @property
    def numbers(self) -> NDArray[np.int32]:
        """The number of successive returns that each row is, shape (N,)."""
        return np.ones(len(self), np.int32) if self.number is None else self.number

    @property
    def slopes(self) -> Floats:
        """The derivative; NsmapsError where the map gave none, although it was requested."""
        if self.derivative is None:
            raise NsmapsError(
                "the map has no derivative; expected: returns with the field `derivative`, shape (N, n, n), from "
                "`first_return(states, derivative=True)`, such as `Returns.of_map(..., derivative=...)`"
            )
        return self.derivative

    @array_property("state", "impact word", NONE)
    def words(self) -> NDArray[np.str_]:
        """The word of each return, shape (N,): the base wall, every impact on the way, the base wall."""
        return words_of(self.codes, self.walls)

    @property
    def certified(self) -> NDArray[np.bool_]:
        """The images that are certain to be those of the first impacts, shape (N,): returned, and no graze within rounding.

        False for fitted polynomials and for flights that were integrated numerically.
        """
        return self.decided & (not self.fitted) & (not self.integrated)

    @property
    def decided(self) -> NDArray[np.bool_]:
        """The returns with an image that is not one of several within rounding of a graze, shape (N,): returned or stuck."""
        return np.asarray((self.outcome == Outcome.returned) | (self.outcome == Outcome.stuck))

    @property
    def lifted(self) -> Floats:
        """Images with angles not wrapped but continued from their start, shape (N, n)."""
        return self.image + TWO_PI * self.turns

    @property
    def known_turns(self) -> NDArray[np.int32]:
        """The turns, shape (N, n), but 0 where a fit states no time: its phases are correct modulo whole turns."""
        return np.where(np.isnan(self.time)[:, None], 0, self.turns).astype(np.int32) if self.fitted else self.turns

    @property
    def valid(self) -> NDArray[np.bool_]:
        """The returns that have an image, shape (N,)."""
        return finite_rows(self.image)

    def has_word(self, word: str) -> NDArray[np.bool_]:
        """The returns with this word, shape (N,)."""
        return self.codes == encode(word, self.walls)

    def select(self, mask: ArrayLike) -> "Returns":
        """The returns that a mask or an index array selects."""
        k = np.arange(len(self))[np.asarray(mask)]  # rows are taken by number in a fiftieth of the time
        rows: dict[str, Any] = {name: array.take(k, axis=0) for name, array in arrays_of(self).items()}
        margin = None if self.margin is None else Margin(self.margin.clearance[k], self.margin.slowest[k])
        return replace(self, **rows, margin=margin)

    @classmethod
    def concatenate(cls, parts: "Sequence[Returns]") -> "Returns":
        """The returns of one or more batches of one map, the first one first; margins and derivatives where all have them."""
        known, rows = [arrays_of(part) for part in parts], dict[str, Any](derivative=None)
        rows |= {name: np.concatenate([each[name] for each in known]) for name in set.intersection(*map(set, known))}
        margins = [part.margin for part in parts if part.margin is not None]
        margin = None
        if len(margins) == len(parts):
            margin = Margin(np.concatenate([m.clearance for m in margins]), np.concatenate([m.slowest for m in margins]))
        if any(part.number is not None for part in parts):
            rows["number"] = np.concatenate([part.numbers for part in parts])
        first, *_ = parts
        return replace(first, **rows, margin=margin)

    def counts(self) -> dict[str, int]:
        """The number of returns for each outcome, by name."""
        values, numbers = np.unique(self.outcome, return_counts=True)
        return {Outcome(value).name: int(number) for value, number in zip(values, numbers, strict=True)}


def arrays_of(returns: Returns) -> dict[str, NDArray[Any]]:
    """The arrays of returns by name, of shape (N, ...): those that are there, without the margin's."""
    found = {name: getattr(returns, name) for name in ROWS}
    return {name: array for name, array in found.items() if array is not None}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Itineraries(Result):
    """The itineraries of N first returns: the turning points of their flights, and their distance from a graze."""

    walls: tuple[str, ...]
    codes: NDArray[np.int64]  #: shape (N,), itineraries as numbers; see `words`
    turns: NDArray[np.int32] = field(metadata=array("state", "number of turning points", NONE))
    clearance: Floats = field(metadata=array("state", "as in `Margin`"))
    slowest: Floats = field(metadata=array("state", "as in `Margin`"))
    outcome: NDArray[np.int8] = field(
        metadata=array("state", "values of `Outcome`; a graze within rounding is not distinguished here", NONE)
    )

    @array_property("state", "word with turning points", NONE)
    def words(self) -> NDArray[np.str_]:
        """The word of each return with its turning points, shape (N,), such as `BvTB`; see `decode`."""
        return words_of(self.codes, self.walls, turns=True)

    @property
    def margin(self) -> Margin:
        """The distance of the returns from a graze."""
        return Margin(self.clearance, self.slowest)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Impacts(Result):
    """Every impact of one trajectory in order, on any wall; M impacts."""

    walls: tuple[str, ...]
    wall: NDArray[np.int8] = field(metadata=array("impact", "index into `walls`", NONE))
    time: Floats = field(metadata=array("impact", "since the start", TIME))
    phase: Floats = field(metadata=array("impact", "radians in [0, 2 pi)", "rad"))
    speed: Floats = field(metadata=array("impact", "impact speed just before the impact, at least zero"))
    mark: NDArray[np.str_] = field(
        metadata=array("impact", "'' for an impact, '~' or '_' for a release after chatter or rest", NONE)
    )

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{len(self.time)} impacts on {', '.join(self.walls)}, until {np.max(self.time, initial=0.0):.6g}"
