"""Grids of starts, and the return surfaces over them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from nsmaps.arrays import ArrayLike, Floats, Storable
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.results import NONE, Result, array


class Axis(BaseModel, Storable):
    """Equidistant values of one coordinate, both ends included, or one value at which it is held."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    low: float
    high: float
    points: int = Field(ge=1, le=100_000)

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.points == 1 and self.low != self.high:
            raise ValueError(f"the axis runs from {self.low} to {self.high} with 1 point; expected: 2 or more, or the same ends")
        if self.points > 1 and not self.low < self.high:
            raise ValueError(f"the axis runs from {self.low} to {self.high}; its start must lie below its end")
        return self

    @classmethod
    def at(cls, value: float) -> Self:
        """The axis of a coordinate that is held at a value, in a plane through the states of a map of more coordinates."""
        return cls(low=value, high=value, points=1)

    @property
    def step(self) -> float:
        """The distance of neighbouring values; zero if the coordinate is held at one."""
        return (self.high - self.low) / max(self.points - 1, 1)

    def values(self) -> Floats:
        """Shape (points,)."""
        return np.linspace(self.low, self.high, self.points)


class Grid(BaseModel, Storable):
    """A rectangular grid of states, one axis for each coordinate in the system's order; the last axis varies fastest.

    With coordinates held at a value (`Axis.at`) it is a plane through the states.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    axes: dict[str, Axis]

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each axis."""
        return tuple(axis.points for axis in self.axes.values())

    @property
    def varying(self) -> dict[str, Axis]:
        """The axes along which the grid has more than one point."""
        return {name: axis for name, axis in self.axes.items() if axis.points > 1}

    @property
    def size(self) -> int:
        """The number of states of the grid."""
        return int(np.prod(self.shape))

    def mesh(self) -> tuple[Floats, ...]:
        """The coordinates of the grid points, an array of `shape` for each."""
        return tuple(np.meshgrid(*(axis.values() for axis in self.axes.values()), indexing="ij"))

    def states(self, first: int = 0, stop: int | None = None) -> Floats:
        """The grid points from number `first` up to `stop`, all by default, shape (stop - first, n)."""
        numbers = np.arange(first, self.size if stop is None else min(stop, self.size))
        places = np.unravel_index(numbers, self.shape)
        return np.column_stack([axis.values()[place] for axis, place in zip(self.axes.values(), places, strict=True)])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Surface(Result):
    """The first returns of one family over a grid: M of the grid's states belong to it."""

    picture: ClassVar[str] = "nsmaps.figures.returns.surfaces"

    name: str
    grid: Grid
    member: NDArray[np.bool_] = field(metadata=array("grid_state", "states of the grid that belong to the family", NONE))
    returns: Returns  #: the M members, in the grid's order
    units: Mapping[str, str] = field(default_factory=dict)

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{self.name}: {len(self.returns)} of {len(self.member)} states of a grid in ({self.returns.coordinates})"

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates."""
        return self.returns.coordinates

    @property
    def start(self) -> Floats:
        """Shape (M, n)."""
        return self.returns.start

    @property
    def image(self) -> Floats:
        """Shape (M, n), angles in [0, 2 pi)."""
        return self.returns.image

    @property
    def lifted(self) -> Floats:
        """Images with angles continued from their start, not wrapped, shape (M, n)."""
        return self.returns.lifted

    def restrict(self, mask: ArrayLike) -> "Surface":
        """The part of the surface that a mask over its M members selects."""
        mask = np.asarray(mask, bool)
        member = self.member.copy()
        member[self.member] = mask
        return replace(self, member=member, returns=self.returns.select(mask))

    def on_grid(self, values: ArrayLike) -> Floats:
        """Values of the M members, shape (M,), on the grid, with NaN elsewhere."""
        out = np.full(self.grid.size, np.nan)
        out[self.member] = values
        return out.reshape(self.grid.shape)


def check_axes(grid: Grid, coordinates: Sequence[str]) -> None:
    """Raise a NsmapsError unless the axes of a grid are these coordinates, in their order."""
    if tuple(grid.axes) != tuple(coordinates):
        raise NsmapsError(f"the grid has axes {', '.join(grid.axes)}; expected: {', '.join(coordinates)}, in this order")
