"""Return maps as functions of parameters: the map at values, or the reason why there is none, and sweeps."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from nsmaps.arrays import Floats
from nsmaps.coordinates import StateLike, as_numbers, as_starts
from nsmaps.dynamics.chatter.complete import CompleteChatter
from nsmaps.errors import NsmapsError, check_known
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.systems.parameters import System
from nsmaps.files.complaints import explained
from nsmaps.parallel import NOT_COMPUTED, Arrays
from nsmaps.progress import beat


class Ended(Protocol):
    """The result of following orbits under a map: `final` holds the last states (..., n), NaN where an orbit ended before."""

    @property
    def final(self) -> Floats:
        """The last states (..., n)."""
        ...


Run = TypeVar("Run", bound=Ended)


def check_values(values: Floats) -> None:
    """NsmapsError unless values of a parameter are one or more finite numbers, shape (V,)."""
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise NsmapsError(f"the values have shape {values.shape}; expected: one or more finite numbers, shape (V,)")


def check_range(value: float, bounds: tuple[float, float]) -> None:
    """NsmapsError unless bounds of a parameter contain a value."""
    low, high = bounds
    if not low <= value <= high or not low < high:
        raise NsmapsError(f"the value {value:g} is not between {low:g} and {high:g}; expected: bounds that contain it")


def check_steps(step: float, least: float, max_points: int) -> None:
    """NsmapsError unless a branch or a curve has a longest step above ten times the shortest, and one orbit or more."""
    if not 10 * least < step <= 1 or max_points < 1:
        raise NsmapsError(f"{max_points} orbits, step {step:g}; expected: at least one orbit, a step up to 1")


Model = System | CompleteChatter | Callable[..., ReturnMap]  #: a map with parameters, or a function of their values


def map_along(model: Model, *parameters: str) -> Callable[..., ReturnMap]:
    """The return map as a function of one or two parameters: of a system or its `CompleteChatter`, or a function as it is.

    Raises:
        NsmapsError: the system has no such parameter, or it is a map without parameters.
    """
    if not isinstance(model, System | CompleteChatter):
        if not callable(model) or isinstance(model, ReturnMap) or (isinstance(model, type) and issubclass(model, System)):
            System.require(model, "parameters")
        return model
    for name in parameters:
        check_known("there is no parameter", name, model.parameters)
    return Along(model, *parameters)


def map_or_reason(map_of: Callable[..., ReturnMap], *values: float) -> tuple[ReturnMap | None, str]:
    """The map at values of parameters, or the reason why there is none, on one line: it or its formulas raise ValueError."""
    try:
        return_map = map_of(*values)
        if isinstance(return_map, System):
            return_map.check_formulas()
    except ValueError as error:
        return None, _in_words(error)
    return ReturnMap.require(return_map, "returns"), ""


def first_map(map_of: Callable[..., ReturnMap], values: Floats, what: str = "values") -> ReturnMap:
    """The first map that there is at values of parameters, shape (V, P). NsmapsError if there is none."""
    reason = ""
    for each in values.tolist():
        found, why = map_or_reason(map_of, *each)
        if found is not None:
            return found
        reason = reason or f"at {', '.join(f'{value:g}' for value in each)}: {why}"
    raise NsmapsError(f"there is no map at any of {len(values)} {what}; {reason}")


def reasons_over(values: Floats, blocks: Sequence[tuple[NDArray[np.int64], Arrays]]) -> tuple[NDArray[np.object_], Arrays]:
    """The reasons of no map at all values, from the arrays at some of them, by their indices; and the first arrays with a map.

    NsmapsError if there is no map at any value.
    """
    reasons = np.full(len(values), NOT_COMPUTED, object)
    for cut, part in blocks:
        reasons[cut] = part["reasons"]
    known = next((part for _, part in blocks if (part["reasons"] == "").any()), None)
    if known is None:
        raise NsmapsError(f"there is no map at any of {len(values)} values; at {values[0]:g}: {reasons[0]}")
    return reasons, known


def starts_under(map_of: Callable[..., ReturnMap], values: Floats, starts: StateLike) -> Floats:
    """The starts of a sweep as an array; those by name in the order of the coordinates of the first map that there is.

    Raises:
        StateError: the starts are not numbers, or have other names.
        NsmapsError: no value has a map.
    """
    if not isinstance(starts, Mapping):
        return as_numbers(starts, ("the coordinates",))
    return as_starts(starts, first_map(map_of, values[:, None]).coordinates)


def _in_words(error: ValueError) -> str:
    """An error on one line; for pydantic's errors the quantity, the value, and what is expected."""
    if isinstance(error, ValidationError):
        return "; ".join(complaint.text for complaint in explained(error, None))
    return " ".join(str(error).split())


def nearest_starts(return_map: ReturnMap, states: Floats) -> Floats:
    """States (..., n) on the section of a map, nearest to these, where its coordinates are not all free."""
    return return_map.on_section(states.reshape(-1, states.shape[-1])).reshape(states.shape)


def followed(
    map_of: Callable[..., ReturnMap],
    values: Floats,
    start: Floats,
    run: Callable[[ReturnMap, Floats], Run],
    directed: bool,
) -> tuple[list[Run], list[str], Floats]:
    """Results of `run` for the maps at values, in this order; reasons, "" where there is a map; and the last states (..., n).

    If `directed`, each run starts where the previous one ended; states whose orbit ended start where the previous run did.
    A start of one more axis, shape (V, ..., n), holds those of each value.
    """
    runs: list[Run] = []
    reasons = [""] * len(values)
    for k, value in enumerate(values.tolist()):
        return_map, reasons[k] = map_or_reason(map_of, value)
        if return_map is not None:
            runs.append(run(return_map, nearest_starts(return_map, start[k] if start.ndim > 2 else start)))
            if directed:
                final = runs[-1].final
                start = np.where(np.isfinite(final).all(axis=-1, keepdims=True), final, start)
        beat((k + 1) / len(values), f"{k + 1} of {len(values)} values")
    return runs, reasons, start
