"""The one interface of every return map: exact systems and composite maps satisfy it."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import ValidationError

from nsmaps.arrays import ArrayLike
from nsmaps.exact.impacts import Floats, Returns, Stretches
from nsmaps.explain import explained
from nsmaps.progress import beat


class Ended(Protocol):
    """What a run of a map leaves, with the states (..., n) it ended in, NaN where it ended before."""

    @property
    def final(self) -> Floats: ...


Run = TypeVar("Run", bound=Ended)


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


def compiled(map: object) -> object:
    """What makes a map's returns in compiled loops, if anything does: what it offers as `compiled`, or the map itself."""
    offer = getattr(map, "compiled", None)
    return map if offer is None else offer()


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


def followed(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    start: Floats,
    run: Callable[[ReturnMap, Floats], Run],
    follow: bool,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Run], list[str], Floats]:
    """Runs of the maps at values, in this order; why there is no map, "" where there is one; and the last states (..., n).

    Followed, each run starts where the one before ended, of those states that ended nowhere where that one started.
    """
    runs: list[Run] = []
    reasons = [""] * len(values)
    for k, value in enumerate(values.tolist()):
        map, reasons[k] = map_or_reason(map_of, value)
        if map is not None:
            runs.append(run(map, start))
            if follow:
                final = runs[-1].final
                start = np.where(np.isfinite(final).all(axis=-1, keepdims=True), final, start)
        beat((k + 1) / len(values), f"{k + 1} of {len(values)} values")
        if progress is not None:
            progress(k + 1)
    return runs, reasons, start
