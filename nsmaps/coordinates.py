"""The coordinates of a state: their names, the angles among them, and states and boxes of states as arrays."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Bools, Floats, Storable
from nsmaps.errors import NsmapsError, StateError, near_match

TWO_PI = 2 * np.pi


class Bounded(Protocol):
    """A region with bounds by coordinate, such as `nsmaps.Box`."""

    @property
    def bounds(self) -> Mapping[str, tuple[float, float]]:
        """Lower and upper end by coordinate."""
        ...


StateLike = ArrayLike | Mapping[str, float]  #: see `as_starts`
BoxLike = ArrayLike | Mapping[str, tuple[float, float]] | Bounded  #: see `as_box`


class Angle(str):
    """The name of one coordinate that lives on the circle [0, 2 pi), in radians."""

    __slots__ = ()


def is_angle(name: object) -> bool:
    """True for the name of an angle, as `Coordinates` yields it; where they are available, `Coordinates.angles` says the same."""
    return isinstance(name, Angle)


def wrap(angle: ArrayLike) -> Floats:
    """The angle, in radians, brought to [0, 2 pi)."""
    wrapped = np.mod(np.asarray(angle, float), TWO_PI)
    return np.where(wrapped >= TWO_PI, 0.0, wrapped)


def nearest_turn(angle: ArrayLike, to: ArrayLike) -> Floats:
    """The angle plus the whole turns that bring it nearest to `to`, in radians."""
    angle = np.asarray(angle, float)
    return angle - TWO_PI * np.round((angle - np.asarray(to, float)) / TWO_PI)


@dataclass(frozen=True, init=False, eq=False)
class Coordinates(Sequence[str], Storable):
    """The names of the n coordinates of a state, and which of them are angles; a sequence of names, angles as `Angle`.

    Arrays of states have the coordinates as their last axis, shape (..., n).

    >>> c = Coordinates(("v", "phi"), angles=("phi",))
    >>> c == Coordinates(("v", Angle("phi"))), c.angles.tolist(), str(c)
    (True, [False, True], 'v, phi')
    >>> c.difference([1.0, 0.1], [0.5, 6.2]).round(3).tolist()
    [0.5, 0.183]
    """

    names: tuple[str, ...]
    angles: Bools  #: shape (n,), which coordinates are angles

    def __init__(self, names: Sequence[str], angles: Collection[str] = ()) -> None:
        """Coordinates by their names, in their order.

        Args:
            names: at least one, each once; an `Angle` among them, also one of other coordinates, is an angle.
            angles: the names of further angles.

        Raises:
            NsmapsError: there is no name, one occurs twice or is not a printable text, or an angle is not among the names.
        """
        if isinstance(names, Coordinates) and not angles:
            vars(self).update(vars(names))
            return
        plain = tuple(map(_plain, names)) if isinstance(names, Iterable) and not isinstance(names, str) else ()
        wrong = [name for name in plain if not name or plain.count(name) > 1] + [name for name in angles if name not in plain]
        if wrong or not plain:
            given = repr(names) if not angles else f"{names!r} with the angles {angles!r}"
            why = f": {wrong[0]!r} is not printable, occurs twice or is not among the names" if wrong else ""
            raise NsmapsError(f"the coordinates are {given}{why}; expected: distinct names, such as ('v', Angle('phi'))")
        mask = np.array([is_angle(name) or name in angles for name in names], bool)
        mask.flags.writeable = False
        object.__setattr__(self, "names", plain)
        object.__setattr__(self, "angles", mask)

    def __len__(self) -> int:
        return len(self.names)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> "Coordinates": ...
    def __getitem__(self, index: int | slice) -> "str | Coordinates":
        if isinstance(index, slice):
            return Coordinates([self[k] for k in range(*index.indices(len(self)))])
        return Angle(self.names[index]) if self.angles[index] else self.names[index]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Coordinates) and self.plain == other.plain

    def __hash__(self) -> int:
        return hash(tuple(self.plain.values()))

    def __str__(self) -> str:
        return ", ".join(self.names)

    def __reduce__(self) -> tuple[Any, ...]:
        return Coordinates, tuple(self.plain.values())

    @property
    def plain(self) -> dict[str, tuple[str, ...]]:
        """The arguments that make the same coordinates, as plain texts, which JSON can hold."""
        return {"names": self.names, "angles": tuple(name for name, angle in zip(self.names, self.angles, strict=True) if angle)}

    def wrap(self, states: ArrayLike) -> Floats:
        """States with their angles brought to [0, 2 pi)."""
        x = np.asarray(states, float)
        with np.errstate(invalid="ignore"):
            return np.where(self.angles, wrap(x), x)

    def lift(self, states: ArrayLike, to: ArrayLike) -> Floats:
        """States with their angles on the turn nearest to that of `to`; where this is not finite, as they are."""
        x = np.asarray(states, float)
        with np.errstate(invalid="ignore"):
            near = nearest_turn(x, to)
        return np.where(self.angles & np.isfinite(near), near, x)

    def difference(self, a: ArrayLike, b: ArrayLike) -> Floats:
        """a - b, of angles the shorter way round, in (-pi, pi]."""
        with np.errstate(invalid="ignore"):
            gap = np.subtract(a, b, dtype=float)
        if (~self.angles | (np.abs(gap) < np.pi)).all():
            return np.asarray(gap)
        with np.errstate(invalid="ignore"):
            turned = np.fmod(gap, TWO_PI)  # exact, as the sums below are
        turned = np.where(turned > np.pi, turned - TWO_PI, np.where(turned <= -np.pi, turned + TWO_PI, turned))
        return np.where(self.angles, turned, gap)

    def turns_of_phase(self, turns: NDArray[np.signedinteger[Any]]) -> NDArray[np.signedinteger[Any]]:
        """Of whole turns (..., n) those of the only angle, shape (...); 0 where there are several, of which none is the phase."""
        return np.asarray(turns[..., self.angles].sum(axis=-1) * (self.angles.sum() == 1))

    def near(self, a: ArrayLike, b: ArrayLike, tolerance: ArrayLike, scale: ArrayLike = 1.0) -> Bools:
        """True where a and b differ in no coordinate by more than `tolerance * scale`, shape (...); see `magnitudes`."""
        return np.asarray((np.abs(self.difference(a, b)) <= np.multiply(tolerance, scale)).all(axis=-1))

    def magnitudes(self, *states: Floats) -> Floats:
        """Scale of each coordinate for relative tolerances, shape (n,): its largest finite magnitude among the states.

        One radian of an angle; 1 where every state is zero.
        """
        sizes = np.concatenate([np.abs(some).reshape(-1, len(self)) for some in states])
        largest = sizes.max(axis=0, initial=0.0, where=np.isfinite(sizes))
        return np.where(self.angles | (largest == 0), 1.0, largest)


class WithCoordinates:
    """A dataclass with coordinates that may be given as names, of which an `Angle` is an angle."""

    __slots__ = ()

    coordinates: Coordinates

    def __post_init__(self) -> None:
        if not isinstance(self.coordinates, Coordinates):
            object.__setattr__(self, "coordinates", Coordinates(self.coordinates))


def _plain(name: object) -> str:
    """The name as a plain text, "" of what is not a printable one."""
    return str(name) if isinstance(name, str) and name.isprintable() else ""


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


def as_starts(states: StateLike, coordinates: Sequence[str]) -> Floats:
    """One state or many as a float array of shape (n,) or (..., n).

    Args:
        states: an array with the coordinates as its last axis, or for one state a mapping of every coordinate to its value.

    Raises:
        StateError: a coordinate is missing or unknown, or the array has another shape.
    """
    given = _in_order(states, coordinates, "state") if isinstance(states, Mapping) else states
    array, n = as_numbers(given, coordinates), len(coordinates)
    if array.ndim == 0 or array.shape[-1] != n:
        raise StateError(
            f"the start has shape {array.shape}; expected: ({n},) or (..., {n}), the coordinates {', '.join(coordinates)} last"
        )
    return array


def as_box(box: BoxLike, coordinates: Sequence[str], whole_turn: bool = False) -> Floats:
    """A box of states as an array of shape (n, 2), lower and upper end of each coordinate, angles in radians on any turn.

    Args:
        box: a mapping of every coordinate to (low, high), a `nsmaps.Box`, or an array of shape (n, 2).
        whole_turn: whether the side of an angle is at most a whole turn.

    Raises:
        StateError: a coordinate is missing or unknown, or an end is not finite or not above the lower one.
    """
    bounds = getattr(box, "bounds", box)
    ends = _in_order(bounds, coordinates, "box") if isinstance(bounds, Mapping) else bounds
    try:
        array = np.array(ends, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    bad, turn = [repr(box) if not array.size else str(array.tolist())], TWO_PI * (1 + 1e-12)
    if array.shape == (len(coordinates), 2):
        widest = np.where(Coordinates(coordinates).angles & whole_turn, turn, np.inf)
        sides = zip(coordinates, array.tolist(), widest, strict=True)
        bad = [f"{name} from {a!r} to {b!r}" for name, (a, b), side in sides if not (-np.inf < a < b < np.inf and b - a <= side)]
    if bad:
        least = ", an angle within a whole turn" if whole_turn else ""
        names = ", ".join(coordinates)
        raise StateError(f"the box is {bad[0]}; expected: finite ends (low, high), low < high{least}, for each of {names}")
    return array


def _in_order(values: Mapping[str, Any], coordinates: Sequence[str], what: str) -> list[Any]:
    """The values by name in the order of the coordinates; raises StateError if one is missing or unknown."""
    expected = "bounds" if what == "box" else "a value"
    for name in [*values, *coordinates]:
        if name not in coordinates or name not in values:
            why = "missing" if name in coordinates else f"not a coordinate{near_match(str(name), coordinates)}"
            given, names = ", ".join(map(str, values)), ", ".join(coordinates)
            raise StateError(f"the {what} has {given}: {name!r} is {why}; expected: {expected} of each of {names}")
    return [values[name] for name in coordinates]
