"""The interface of every return map: exact systems and composite maps satisfy it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol, TypeGuard, TypeVar, runtime_checkable

import numpy as np
from pydantic import ValidationError

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import StateLike, as_numbers, as_starts
from nsmaps.errors import NsmapsError, check_class
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.files.complaints import explained
from nsmaps.progress import beat


class Ended(Protocol):
    """The result of following orbits under a map: `final` holds the last states (..., n), NaN where an orbit ended before."""

    @property
    def final(self) -> Floats: ...


Run = TypeVar("Run", bound=Ended)


@runtime_checkable
class ReturnMap(Protocol):
    """A map with coordinates and first returns of batches of states."""

    @property
    def coordinates(self) -> Sequence[str]:
        """The n coordinates: `Coordinates`, or names of which an `Angle` lives on the circle."""

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """First returns of states of shape (N, n), see `Returns.of_map`; N may be 0, and states of orbits that ended are NaN."""


@runtime_checkable
class OrbitMap(ReturnMap, Protocol):
    """A return map that computes many returns in one call, as exact systems, composite maps and maps of strips do."""

    def orbits(self, states: ArrayLike, n: int, derivative: bool = False, **how: Any) -> Returns:
        """The first n returns of each of M states: n M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        """


EXACT = ("parameter_names", "phase_rate", "itineraries", "sensitivity")  #: the methods of an `ExactMap`


class ExactMap(ReturnMap, Protocol):
    """A return map whose flights and parameters are known, as for exact systems."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The values of the parameters by name."""

    def parameter_names(self) -> Sequence[str]:
        """The names of the parameters, in their order."""

    def phase_rate(self) -> float:
        """Radians of phase per unit of time."""

    def itineraries(self, states: ArrayLike) -> Itineraries:
        """The distance of the flights of first returns of states (N, n) from a graze."""

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivative of first returns by the parameters, which change at these rates, shape (N, n)."""


def is_exact(map: ReturnMap) -> TypeGuard[ExactMap]:
    """True if the flights and parameters of a map are known; `isinstance` of a protocol takes many times longer."""
    return all(hasattr(map, name) for name in EXACT)


def continued(returns: Returns, before: Returns | None) -> Returns:
    """Returns of M states, in which the outcome of the M previous returns is repeated where these ended."""
    if before is None:
        return returns
    ended = np.isnan(returns.start[: len(before)]).any(axis=1)
    if not ended.any():
        return returns
    outcome = np.where(ended, before.outcome, returns.outcome.reshape(-1, len(before)))
    return replace(returns, outcome=outcome.ravel().astype(np.int8))


def single_returns(map: ReturnMap, states: Floats, n: int, **how: Any) -> Iterator[Returns]:
    """The first n returns of M states, shape (M, dim), by one call for each of the n."""
    before: Returns | None = None
    for _ in range(n):
        found = map.first_return(states, **how)
        check_class(found, Returns, f"`first_return` of a {type(map).__name__} gives what `Returns.of_map` makes")
        before = continued(found, before)
        states = before.image
        yield before


def map_or_reason(map_of: Callable[..., ReturnMap], *values: float) -> tuple[ReturnMap | None, str]:
    """The map at values of parameters, or the reason why there is none, on one line: a `map_of` raises a ValueError."""
    try:
        return map_of(*values), ""
    except ValueError as error:
        return None, _in_words(error)


def starts_under(map_of: Callable[..., ReturnMap], values: Floats, starts: StateLike) -> Floats:
    """The starts of a sweep as an array; those by name in the order of the coordinates of the first map that there is.

    Raises:
        StateError: the starts are not numbers, or have other names.
        NsmapsError: no value has a map.
    """
    if not isinstance(starts, Mapping):
        return as_numbers(starts, ("the coordinates",))
    found = (map_or_reason(map_of, *np.atleast_1d(value).tolist()) for value in values)
    map = next((map for map, _ in found if map is not None), None)
    if map is None:
        raise NsmapsError(f"there is no map at any of {len(values)} values, whose coordinates a start by name has")
    return as_starts(starts, map.coordinates)


def _in_words(error: ValueError) -> str:
    """An error on one line; for pydantic's errors the quantity, the value, and what is expected."""
    if isinstance(error, ValidationError):
        return "; ".join(complaint.text for complaint in explained(error, None))
    return " ".join(str(error).split())


def nearest_starts(map: ReturnMap, states: Floats) -> Floats:
    """States (..., n) on the section of a map, nearest to these, where its coordinates are not all free."""
    nearest = getattr(map, "on_section", None)
    return states if nearest is None else np.asarray(nearest(states.reshape(-1, states.shape[-1]))).reshape(states.shape)


def followed(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    start: Floats,
    run: Callable[[ReturnMap, Floats], Run],
    directed: bool,
) -> tuple[list[Run], list[str], Floats]:
    """Results of `run` for the maps at values, in this order; reasons, "" where there is a map; and the last states (..., n).

    If `directed`, each run starts where the previous one ended; states whose orbit ended start where the previous run did.
    """
    runs: list[Run] = []
    reasons = [""] * len(values)
    for k, value in enumerate(values.tolist()):
        map, reasons[k] = map_or_reason(map_of, value)
        if map is not None:
            runs.append(run(map, nearest_starts(map, start)))
            if directed:
                final = runs[-1].final
                start = np.where(np.isfinite(final).all(axis=-1, keepdims=True), final, start)
        beat((k + 1) / len(values), f"{k + 1} of {len(values)} values")
    return runs, reasons, start
