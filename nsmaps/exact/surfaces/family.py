"""Families of returns: the sets of impact words that belong to one surface, eq. exactmap."""

import re
from abc import ABC, abstractmethod
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from nsmaps.errors import NsmapsError
from nsmaps.exact.patterns import reach_of
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.compose import compose_returns, returns_in_word
from nsmaps.exact.surfaces.surface import Grid, Surface, check_axes
from nsmaps.exact.systems.files import Transferable, place_of
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.words import decode, encode
from nsmaps.results import units_of

OPERATORS = re.compile(r"[+*?|()]")
LONG = 16  #: consecutive returns that a pattern may contain
LONGEST, DEEPEST = 3000, 50  #: letters of a word or pattern, nested parentheses


class ReturnFamily(BaseModel, Transferable, ABC):
    """A set of returns that form one surface over the states: first returns, or up to `max_returns` consecutive ones."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    max_returns: int = Field(
        default=1, ge=1, le=1000, description="consecutive returns that a member may contain; the shortest such sequence counts"
    )

    @abstractmethod
    def contains(self, returns: Returns) -> NDArray[np.bool_]:
        """The returns of the family, shape (N,); if `max_returns` exceeds one, called again for two in a row, and so forth."""

    def surface(self, system: System, grid: Grid) -> Surface:
        """The family's returns over a grid of states."""
        check_axes(grid, system.coordinates)
        return Surface(self.name, grid, *members(system, system.first_return(grid.states()), self), units_of(system))


def membership(family: ReturnFamily, returns: Returns) -> NDArray[np.bool_]:
    """The returns that a family contains, shape (N,); a NsmapsError where its class gives anything else."""
    name, count = f"{type(family).__name__}.contains", len(returns)
    try:
        found = family.contains(returns)
    except NsmapsError:
        raise
    except Exception as error:
        where = place_of(type(family), "contains")
        raise NsmapsError(f"{name}{where} of {count} returns: {type(error).__name__}: {error}") from error
    if not (isinstance(found, np.ndarray) and found.dtype == bool and found.shape == (count,)):
        what = f"{found.dtype} of shape {found.shape}" if isinstance(found, np.ndarray) else type(found).__name__
        raise NsmapsError(f"{name} gives {what} for {count} returns; expected: an array of bool, shape ({count},)")
    return found


def members(system: System, returns: Returns, family: ReturnFamily) -> tuple[NDArray[np.bool_], Returns]:
    """The first returns, of N, with which a member of the family begins, and these members.

    A member is the shortest sequence of at most `family.max_returns` returns that the family contains.
    """
    found = membership(family, returns) & returns.valid
    rows, row = np.arange(len(returns)), returns
    numbers, parts = [np.flatnonzero(found)], [returns.select(found)]
    on, margin = ~found & returns.valid, {} if returns.margin is None else {"margin": True}  # systems with modes take none
    for _ in range(family.max_returns - 1):
        rows, row = rows[on], row.select(on)
        if not len(rows):
            break
        row = compose_returns(row, system.first_return(row.image, row.derivative is not None, **margin))
        hit = membership(family, row) & row.valid
        numbers.append(rows[hit])
        parts.append(row.select(hit))
        on = ~hit & row.valid
    order = np.argsort(np.concatenate(numbers), kind="stable")
    member = np.zeros(len(returns), bool)
    member[np.concatenate(numbers)] = True
    return member, Returns.concatenate(parts).select(order)


class WordFamily(ReturnFamily):
    """The returns with one of a few impact words or patterns of words.

    `BTB` is a first return, `BBTB` two consecutive returns. In a pattern `+`, `*`, `?`, `|` and parentheses mean what they do in
    regular expressions: `B+TB` is any number of returns BB and then BTB. Unless `max_returns` is given, members have as many
    returns as the longest word needs, and at most 16 for patterns.
    """

    words: tuple[str, ...] = Field(min_length=1)

    @model_validator(mode="before")
    @classmethod
    def _as_many_as_needed(cls, data: Any) -> Any:
        if isinstance(data, dict) and "max_returns" not in data and isinstance(words := data.get("words"), list | tuple):
            needed = [LONG if is_pattern(word) else returns_in_word(word) for word in words if isinstance(word, str) and word]
            return {**data, "max_returns": max(needed, default=1)}
        return data

    @field_validator("words")
    @classmethod
    def _readable(cls, words: tuple[str, ...]) -> tuple[str, ...]:
        for word in words:
            if not letters_of(word):
                raise ValueError(f"{word!r} is not a word; expected: the letters of walls, such as BTB")
            if len(word) > LONGEST:
                raise ValueError(f"a word of {len(word)} letters; expected: at most {LONGEST}")
            if max(accumulate((letter == "(") - (letter == ")") for letter in word)) > DEEPEST:
                raise ValueError(f"the pattern {word[:40]}... is nested deeper than {DEEPEST} levels")
            try:
                re.compile(word)
            except (re.error, RecursionError, OverflowError) as error:
                shown = word if len(word) <= 40 else f"{word[:40]}..."
                raise ValueError(f"the pattern {shown!r} cannot be read: {error}") from error
        return words

    def contains(self, returns: Returns) -> NDArray[np.bool_]:
        """The returns with one of the words, shape (N,)."""
        return np.logical_or.reduce([_have_word(returns, word) for word in self.words])


def is_pattern(word: str) -> bool:
    """True if a text denotes several words."""
    return bool(OPERATORS.search(word))


def letters_of(word: str) -> str:
    """A word or pattern without its operators."""
    return OPERATORS.sub("", word)


def _have_word(returns: Returns, word: str) -> NDArray[np.bool_]:
    if not is_pattern(word):
        return returns.has_word(word)
    encode(letters_of(word), returns.walls)  # the word contains a letter that is not a wall
    codes, inverse = np.unique(returns.codes, return_inverse=True)
    reach = reach_of(word)
    matching = [len(text) in reach(text, frozenset({0})) for text in (decode(int(code), returns.walls) for code in codes)]
    return np.array(matching, bool)[inverse.reshape(-1)]
