"""The coordinates of a state: angles on the circle, states and boxes of states as arrays."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.errors import StateError, near_match

TWO_PI = 2 * np.pi


class Bounded(Protocol):
    """A region with bounds by coordinate, such as `nsmaps.Box`."""

    @property
    def bounds(self) -> Mapping[str, tuple[float, float]]:
        """Lower and upper end by coordinate."""
        ...


BoxLike = ArrayLike | Mapping[str, tuple[float, float]] | Bounded  #: see `as_box`


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


def angle_mask(coordinates: Sequence[str]) -> Bools:
    """Which coordinates are angles, shape (n,)."""
    return np.array([isinstance(name, Angle) for name in coordinates], bool)


def as_numbers(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    """States of any shape as a float array, or a StateError that says what is expected."""
    try:
        return np.asarray(states, float)
    except (TypeError, ValueError):
        names = ", ".join(coordinates)
        raise StateError(
            f"{states!r:.80} is not an array of numbers; expected: rows ({names}), such as [[{names}], ...]"
        ) from None


def as_states(states: ArrayLike, coordinates: Sequence[str]) -> Floats:
    """States as a float array of shape (N, n), or a StateError that says what is expected."""
    array, n = np.ascontiguousarray(as_numbers(states, coordinates)), len(coordinates)
    if array.ndim != 2 or array.shape[1] != n:
        raise StateError(f"states have shape {array.shape}; expected: shape (N, {n}), one row ({', '.join(coordinates)}) a state")
    return array


def as_box(box: BoxLike, coordinates: Sequence[str]) -> Floats:
    """A box of states as an array of shape (n, 2), lower and upper end of each coordinate, angles in radians on any turn.

    Args:
        box: a mapping of every coordinate to (low, high), a `nsmaps.Box`, or an array of shape (n, 2).

    Raises:
        StateError: a coordinate is missing or unknown, or an end is not finite or not above the lower one.
    """
    names = ", ".join(coordinates)
    bounds = getattr(box, "bounds", box)
    if isinstance(bounds, Mapping):
        for name in [*bounds, *coordinates]:
            if name not in coordinates or name not in bounds:
                wrong = (
                    f"{name!r} is not a coordinate{near_match(str(name), coordinates)}"
                    if name in bounds
                    else f"{name!r} is missing"
                )
                raise StateError(f"the box has {', '.join(map(str, bounds))}: {wrong}; expected: bounds of each of {names}")
        bounds = [bounds[name] for name in coordinates]
    try:
        array = np.array(bounds, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (len(coordinates), 2) or not (np.isfinite(array).all() and (array[:, 0] < array[:, 1]).all()):
        given = array.tolist() if array.size else repr(box)
        raise StateError(f"the box is {given}; expected: finite ends (low, high), low < high, for each of {names}")
    return array
