"""Regions of the state space: the class `Region` of the domains of pieces, a `Box` and a `ConditionRegion`."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, InstanceOf, PlainSerializer, ValidationInfo, field_validator

from nsmaps.arrays import ArrayLike, Bools, Floats, Storable
from nsmaps.coordinates import TWO_PI, Coordinates, as_box, as_states, is_angle
from nsmaps.errors import ConditionError
from nsmaps.exact.systems.files import Transferable
from nsmaps.reduced.conditions.condition import Condition, Number, read_condition, with_numbers

if TYPE_CHECKING:
    import sympy as sp


def _coordinates(given: Any) -> Coordinates:
    return Coordinates(**given) if isinstance(given, dict) else Coordinates(given)


class Region(BaseModel, Transferable, Storable, ABC):
    """A set of states, once in numbers (`contains`) and once in symbols (`condition`).

    An `Angle` among the coordinates lives on a circle, a plain name on a line: give the names as the system has them. Compiled
    loops, enclosures, exports and files have the condition, which both methods see at angles in [0, 2 pi).
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    coordinates: Annotated[InstanceOf[Coordinates], BeforeValidator(_coordinates), PlainSerializer(lambda given: given.plain)]

    @abstractmethod
    def contains(self, states: ArrayLike) -> Bools:
        """A mask of the states (N, n) in the region, shape (N,); False if NaN or infinite."""

    @abstractmethod
    def condition(self) -> "sp.Basic":
        """The region as a sympy Boolean in real symbols of the coordinates, for angles in [0, 2 pi)."""

    def over(self, coordinates: Sequence[str]) -> Self:
        """The same region over the coordinates of a system, which determine their order and which of them are angles."""
        return type(self).model_validate({**dict(self), "coordinates": coordinates})


class Box(Region):
    """Closed intervals of every coordinate: lower <= x <= upper.

    An angle is taken on the turn nearest to the interval's middle, so that [-0.2, 0.2] also holds 6.2 radians.

    >>> from nsmaps.coordinates import Angle
    >>> Box(coordinates=("v", Angle("phi")), bounds={"v": (0.63, 0.94), "phi": (-0.2, "pi/3")}).contains([[0.7, 6.2], [0.7, 3.0]])
    array([ True, False])
    """

    bounds: dict[str, tuple[Number, Number]]  #: by coordinate

    @field_validator("bounds")
    @classmethod
    def _bounded(cls, bounds: dict[str, tuple[float, float]], info: ValidationInfo) -> dict[str, tuple[float, float]]:
        names = info.data.get("coordinates", ())
        return dict(zip(names, map(tuple, as_box(bounds, names).tolist()), strict=True)) if names else bounds

    @classmethod
    def of(cls, coordinates: Sequence[str], array: ArrayLike) -> Self:
        """The box of an array of lower and upper bounds, shape (n, 2). StateError if it is not one."""
        bounds = dict(zip(coordinates, as_box(array, coordinates).tolist(), strict=True))
        return cls.model_validate({"coordinates": coordinates, "bounds": bounds})

    @property
    def array(self) -> Floats:
        """Lower and upper bounds, shape (n, 2)."""
        return np.array(list(self.bounds.values()), float)

    @property
    def lower(self) -> Floats:
        """Shape (n,)."""
        return self.array[:, 0]

    @property
    def upper(self) -> Floats:
        """Shape (n,)."""
        return self.array[:, 1]

    def contains(self, states: ArrayLike) -> Bools:
        """Which states lie in the box, its boundary included, states (N, n) -> shape (N,)."""
        x = as_states(states, self.coordinates)
        lower, upper = self.array.T
        x = self.coordinates.lift(x, (lower + upper) / 2)
        return np.asarray(np.logical_and(lower <= x, x <= upper).all(axis=1))

    def condition(self) -> "sp.Basic":
        """The box as inequalities; an interval of an angle that leaves [0, 2 pi) is written on each turn that meets it."""
        import sympy as sp

        return sp.And(*(_interval(name, *self.bounds[name]) for name in self.coordinates))


def _interval(name: str, lower: float, upper: float) -> "sp.Basic":
    import sympy as sp

    x = sp.Symbol(str(name), real=True)
    if not is_angle(name):
        return sp.And(sp.Float(lower) <= x, x <= sp.Float(upper))
    if upper - lower >= TWO_PI:
        return sp.true
    turns = {0} | {k for k in range(-round(upper / TWO_PI) - 1, 2 - round(lower / TWO_PI)) if _meets(k, lower, upper)}
    shifts = [2 * sp.pi * k for k in sorted(turns)]
    return sp.Or(*(sp.And(sp.Float(lower) + s <= x, x <= sp.Float(upper) + s) for s in shifts))


def _meets(turn: int, lower: float, upper: float) -> bool:
    """True if the interval, moved by some turns, meets [0, 2 pi)."""
    return lower + TWO_PI * turn < TWO_PI and upper + TWO_PI * turn >= 0


class ConditionRegion(Region):
    """The states that satisfy a condition in text, such as `v > 0.63 - 0.53*phi and v > 0.55`.

    The condition is applied as written: for an angle it sees the number it is given.
    """

    text: str

    @field_validator("text")
    @classmethod
    def _read(cls, text: str, info: ValidationInfo) -> str:
        if "coordinates" in info.data:
            read_condition(text, info.data["coordinates"])
        return text

    @cached_property
    def _condition(self) -> Condition:
        return read_condition(self.text, self.coordinates)

    def contains(self, states: ArrayLike) -> Bools:
        """A mask of the states (N, n) that satisfy the condition, shape (N,)."""
        return self._condition(states)

    def at(self, values: Mapping[str, float]) -> "ConditionRegion":
        """The condition at values of some of its names, such as parameters, over the others."""
        own = {name: values[name] for name in self.coordinates if name in values}
        others = [name for name in self.coordinates if name not in own]
        return (
            ConditionRegion(text=with_numbers(self.text, own, self.coordinates), coordinates=Coordinates(others)) if own else self
        )

    def condition(self) -> "sp.Basic":
        """The condition as a sympy Boolean."""
        return self._condition.sympy()


def as_condition(region: Region) -> ConditionRegion:
    """The states of a region of any class by its `condition()` in text, which is compiled, enclosed, exported and stored.

    Raises:
        ConditionError: the condition has no text, as it has a function that conditions do not; says which.
    """
    if isinstance(region, ConditionRegion):
        return region
    from nsmaps.reduced.conditions.text import text_of

    try:
        return ConditionRegion(coordinates=region.coordinates, text=text_of(region.condition(), region.coordinates))
    except ConditionError as error:
        raise ConditionError(f"the region {type(region).__name__}: {error}") from error
