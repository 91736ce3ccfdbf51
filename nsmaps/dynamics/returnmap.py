"""The one interface of every return map: exact systems and composite maps satisfy it."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from nsmaps.exact.impacts import Floats, Returns, Stretches
from nsmaps.explain import explained


@runtime_checkable
class ReturnMap(Protocol):
    """Anything that says, for a batch of states, where each first returns to."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the n coordinates; an `Angle` lives on the circle."""

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """First returns of states of shape (N, n)."""


@runtime_checkable
class CompiledOrbit(Protocol):
    """What a return map may have beside: many returns in one call, for orbits of few states."""

    def orbits(self, states: ArrayLike, n: int, **how: Any) -> Returns:
        """The first n returns of each of M states: n M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        """


@runtime_checkable
class CompiledStretches(Protocol):
    """What a return map may have beside: many returns with their derivatives in one call, for Lyapunov exponents."""

    def stretches(self, states: ArrayLike, frames: ArrayLike, n: int) -> Stretches:
        """What the first n returns of each of M states do to frames, shape (M, dim, dim)."""


def map_or_reason(map_of: Callable[..., ReturnMap], *values: float) -> tuple[ReturnMap | None, str]:
    """The map at values of parameters, or why there is none, in one line: a `map_of` says so by a ValueError."""
    try:
        return map_of(*values), ""
    except ValueError as error:
        return None, _in_words(error)


def _in_words(error: ValueError) -> str:
    """What was complained of in one line; of pydantic what, the value, and what is accepted."""
    if isinstance(error, ValidationError):
        return "; ".join(told.text for told in explained(error, None))
    return " ".join(str(error).split())


def carried(final: Floats, before: Floats) -> Floats:
    """The states (..., n) from which orbits go on at the next value: their last ones, or the ones before of those that ended."""
    return np.where(np.isfinite(final).all(axis=-1, keepdims=True), final, before)
