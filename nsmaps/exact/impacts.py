"""What a map answers: outcomes, returns and impacts; words of impacts; the phase circle.

A point that fails is data: its `Outcome` says why and its image is NaN.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, brief
from nsmaps.errors import StateError

if TYPE_CHECKING:
    from xarray import Dataset

Floats = NDArray[np.float64]
TWO_PI = 2 * np.pi
FEW = 8  #: words that are shown of returns


class Outcome(IntEnum):
    """Why a return ended as it did; `Outcome.x.advice` says what to do about it."""

    returned = 0
    stuck = 1
    rests = 2
    escaped = 3
    undecided = 4
    uncovered = 5
    invalid = 6

    @property
    def advice(self) -> str:
        """One sentence: what happened and what may be tried."""
        return _ADVICE[self]


_ADVICE = {
    Outcome.returned: "Came back to the base wall.",
    Outcome.stuck: "Came to rest on the base wall; the image is its release, at speed zero.",
    Outcome.rests: "Rests on a wall for ever: the forcing never lifts it off. There is no image.",
    Outcome.escaped: "No return within the horizon. Look at the displacement, or raise the system's horizon.",
    Outcome.undecided: "A flight passes a wall within rounding of a graze; the image is that of one of the two words.",
    Outcome.uncovered: "The state lies in no piece of the composite map. Add a piece, or restrict the starts.",
    Outcome.invalid: "The start is no state: NaN, infinite, with a negative impact speed or a phase beyond 1e10.",
}


class Angle(str):
    """The name of a coordinate that lives on the circle [0, 2 pi), in radians."""

    __slots__ = ()


def wrap(angle: ArrayLike) -> Floats:
    """The angle, in radians, brought to [0, 2 pi)."""
    wrapped = np.mod(np.asarray(angle, float), TWO_PI)
    return np.where(wrapped >= TWO_PI, 0.0, wrapped)


def nearest_turn(angle: ArrayLike, to: ArrayLike) -> Floats:
    """The angle plus the whole turns that bring it nearest to `to`, in radians."""
    angle = np.asarray(angle, float)
    return angle - TWO_PI * np.round((angle - np.asarray(to, float)) / TWO_PI)


def angle_mask(coordinates: Sequence[str]) -> NDArray[np.bool_]:
    """Which coordinates are angles, shape (n,)."""
    return np.array([isinstance(name, Angle) for name in coordinates], bool)


def as_numbers(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    """States of any shape as a float array, or a StateError that says what is accepted."""
    try:
        return np.asarray(states, float)
    except (TypeError, ValueError):
        names = ", ".join(coordinates)
        raise StateError(f"{states!r:.80} is no array of numbers; accepted: rows ({names}), such as [[{names}], ...]") from None


def as_states(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    """States as a float array of shape (N, n), or a StateError that says what is accepted."""
    array, n = np.ascontiguousarray(as_numbers(states, coordinates)), len(coordinates)
    if array.ndim != 2 or array.shape[1] != n:
        raise StateError(
            f"states have shape {array.shape}; a batch of shape (N, {n}) is accepted, one row ({', '.join(coordinates)}) a state"
        )
    return array


CHATTER, REST, LONGER = "~", "_", "..."
HIGHEST, LOWEST = "^", "v"  # turning points in itineraries: the displacement has a maximum, a minimum


def _letters(walls: Sequence[str], turns: bool) -> tuple[str, ...]:
    return (*walls, CHATTER, REST, *((HIGHEST, LOWEST) if turns else ()))


def decode(code: int, walls: Sequence[str], turns: bool = False) -> str:
    """The word of a code: a letter for each impact in order, `~` after a wall on which chatter ran its course,
    `_` after one on which the ball rested, `...` where the word is longer than the code holds. With `turns` the code is that of
    an itinerary, in which `^` and `v` are turning points passed: maxima and minima of the displacement.

    >>> decode(1 + 4 * 5 + 3 * 25, ("B", "T")), decode(1 + 2 * 5 + 1 * 25, ("B", "T"))
    ('B_~', 'BTB')
    """
    letters = ("", *_letters(walls, turns))
    text, code = "", int(code)
    if code < 0:
        text, code = LONGER, -code
    word = ""
    while code:
        code, digit = divmod(code, len(letters))
        word += letters[digit]
    return word + text


def encode(word: str, walls: Sequence[str]) -> int:
    """The code of a word, the inverse of `decode` for words that it holds whole.

    >>> decode(encode("BTTB", ("B", "T")), ("B", "T"))
    'BTTB'
    """
    letters = _letters(walls, turns=False)
    code, power, rest = 0, 1, word
    while rest:
        digit = next((k for k, letter in enumerate(letters, 1) if rest.startswith(letter)), 0)
        if not digit:
            raise StateError(
                f"the word {word!r} has no letter at {rest!r}; accepted: the walls {', '.join(walls)}, "
                f"{CHATTER!r} (chatter) and {REST!r} (rest)"
            )
        code, power, rest = code + digit * power, power * (len(letters) + 1), rest[len(letters[digit - 1]) :]
    return code


def longer_than(letters: int, codes: NDArray[np.int64], walls: Sequence[str], turns: bool = False) -> NDArray[np.bool_]:
    """Which codes are those of words (with `turns`: of itineraries) of more letters, shape as the codes.

    >>> longer_than(2, np.array([encode("BB", ("B", "T")), encode("BTB", ("B", "T"))]), ("B", "T"))
    array([False,  True])
    """
    return (codes < 0) | (codes >= (len(_letters(walls, turns)) + 1) ** letters)


def decoded(codes: NDArray[np.int64], walls: Sequence[str], turns: bool = False) -> NDArray[np.str_]:
    """The words of codes, in their shape; see `decode`."""
    values, inverse = np.unique(codes, return_inverse=True)
    return np.array([decode(value, walls, turns) for value in values] or [""], dtype=str)[inverse.reshape(codes.shape)]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Margin:
    """How far each of N returns is from a graze; where either number falls to zero, the word changes."""

    __repr__ = brief

    clearance: Floats  #: shape (N,), least gap to a wall at a turning point before it, in displacement; inf without one
    slowest: Floats  #: shape (N,), least impact speed on the way, the last included; inf without an impact


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Returns:
    """First returns of a batch of N states with n coordinates, by an exact or a composite map.

    Beside what is stored there are `words`, `lifted`, `valid` and `certified`, each an array of N rows like the others.
    """

    __repr__ = brief

    coordinates: tuple[str, ...]
    walls: tuple[str, ...]
    start: Floats  #: shape (N, n), as given
    image: Floats  #: shape (N, n), angles in [0, 2 pi); NaN where there is none
    turns: NDArray[np.int32]  #: shape (N, n), whole turns an angle made from its start to its image; zero elsewhere
    codes: NDArray[np.int64]  #: shape (N,), words as numbers; see `words`
    outcome: NDArray[np.int8]  #: shape (N,), values of `Outcome`
    time: Floats  #: shape (N,), from start to image in the system's time; NaN where unknown
    derivative: Floats | None = None  #: shape (N, n, n), d image / d start, if asked for
    margin: Margin | None = None  #: how far from a graze, if asked for
    fitted: bool = False  #: whether the images are those of fitted polynomials, which nothing certifies

    def __len__(self) -> int:
        return len(self.start)

    def __str__(self) -> str:
        """How many returns there are, how they ended, and which words those with an image made, the commonest first."""
        words, numbers = np.unique(self.words[self.valid], return_counts=True)
        order = np.argsort(-numbers, kind="stable")[:FEW]
        told = ", ".join(f"{words[k]} {numbers[k]}" for k in order) + ", ..." * (len(words) > FEW)
        ends = ", ".join(f"{number} {outcome}" for outcome, number in self.counts().items())
        return f"{len(self)} first returns of ({', '.join(self.coordinates)}): {ends or 'none'}; words: {told or 'none'}"

    @property
    def words(self) -> NDArray[np.str_]:
        """The word of each return, shape (N,): the base wall, every impact on the way, the base wall."""
        return decoded(self.codes, self.walls)

    @property
    def certified(self) -> NDArray[np.bool_]:
        """Which images are certain to be those of the first impacts, shape (N,): returned, and no graze within rounding.

        None of fitted polynomials.
        """
        return np.isin(self.outcome, (Outcome.returned, Outcome.stuck)) & (not self.fitted)

    @property
    def lifted(self) -> Floats:
        """Images with angles not wrapped but continued from their start, shape (N, n)."""
        return self.image + TWO_PI * self.turns

    @property
    def told_turns(self) -> NDArray[np.int32]:
        """The turns, shape (N, n), but 0 where a fit tells no time: its phases are right but for whole turns."""
        return np.where(np.isnan(self.time)[:, None], 0, self.turns).astype(np.int32) if self.fitted else self.turns

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which returns have an image, shape (N,)."""
        return np.asarray(np.isfinite(self.image).all(axis=1))

    def has_word(self, word: str) -> NDArray[np.bool_]:
        """Which returns made this word, shape (N,)."""
        same: NDArray[np.bool_] = self.codes == encode(word, self.walls)
        return same

    def select(self, keep: ArrayLike) -> "Returns":
        """The returns that a mask or an index array keeps."""
        k = np.asarray(keep)
        rows = {name: getattr(self, name)[k] for name in ("start", "image", "turns", "codes", "outcome", "time")}
        derivative = None if self.derivative is None else self.derivative[k]
        margin = None if self.margin is None else Margin(self.margin.clearance[k], self.margin.slowest[k])
        return replace(self, **rows, derivative=derivative, margin=margin)

    def counts(self) -> dict[str, int]:
        """How many returns ended in which outcome, by name."""
        values, numbers = np.unique(self.outcome, return_counts=True)
        return {Outcome(value).name: int(number) for value, number in zip(values, numbers, strict=True)}

    def to_xarray(self) -> "Dataset":
        """The returns as an xarray dataset with dimensions `state`, `coordinate`, `by`. NsmapsError without xarray."""
        from nsmaps.exact.data import EACH, NONE, OUTCOMES, TIME, TURNS, dataset

        rows = {
            "start": ("state coordinate", self.start, EACH, "where the return starts"),
            "image": ("state coordinate", self.image, EACH, "where it arrives; angles in [0, 2 pi)"),
            "turns": ("state coordinate", self.turns, TURNS, "whole turns of an angle from start to image"),
            "word": ("state", self.words, NONE, "impact word"),
            "outcome": ("state", self.outcome, NONE, OUTCOMES),
            "time": ("state", self.time, TIME, "from start to image"),
        }
        if self.derivative is not None:
            rows["derivative"] = ("state coordinate by", self.derivative, EACH, "d image / d start; its unit is that over `by`'s")
        if self.margin is not None:
            rows["clearance"] = ("state", self.margin.clearance, NONE, "least gap to a wall at a turning point")
            rows["slowest"] = ("state", self.margin.slowest, NONE, "least impact speed on the way")
        by = {} if self.derivative is None else {"by": map(str, self.coordinates)}
        return dataset(self.coordinates, rows, by, walls=self.walls, fitted=self.fitted)


@dataclass(frozen=True, slots=True, eq=False)
class Stretches:
    """What n returns of each of M states of dim coordinates did to frames of tangent vectors."""

    states: Floats  #: shape (M, dim), where they are now; NaN after an orbit's end
    frames: Floats  #: shape (M, dim, dim), orthonormal columns, the fastest growing first
    growth: Floats  #: shape (n, M, dim), logarithms of the diagonal of R in D Q = Q' R; -inf where a return forgets a direction
    log_det: Floats  #: shape (n, M), log |det D| of each return's derivative D
    time: Floats  #: shape (n, M), of each return; NaN where unknown
    outcome: NDArray[np.int8]  #: shape (n, M), values of `Outcome`; that which ended an orbit is repeated


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Legs:
    """The flights of N first returns: which turning points they pass, and how far from a graze they are."""

    __repr__ = brief

    walls: tuple[str, ...]
    codes: NDArray[np.int64]  #: shape (N,), itineraries as numbers; see `itineraries`
    turns: NDArray[np.int32]  #: shape (N,), turning points passed
    clearance: Floats  #: shape (N,), as of `Margin`
    slowest: Floats  #: shape (N,), as of `Margin`
    outcome: NDArray[np.int8]  #: shape (N,), values of `Outcome`; a graze within rounding is not told apart here

    @property
    def itineraries(self) -> NDArray[np.str_]:
        """The word of each return with its turning points, shape (N,), such as `BvTB`; see `decode`."""
        return decoded(self.codes, self.walls, turns=True)

    @property
    def margin(self) -> Margin:
        """How far the returns are from a graze."""
        return Margin(self.clearance, self.slowest)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Impacts:
    """Every impact of one trajectory in order, on any wall; M impacts."""

    __repr__ = brief

    walls: tuple[str, ...]
    wall: NDArray[np.int8]  #: shape (M,), index into `walls`
    time: Floats  #: shape (M,), since the start
    phase: Floats  #: shape (M,), radians in [0, 2 pi)
    speed: Floats  #: shape (M,), impact speed just before the impact, at least zero
    mark: NDArray[np.str_]  #: shape (M,), "" for an impact, "~" or "_" for a release after chatter or rest
