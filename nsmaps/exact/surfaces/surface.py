"""Grids of starts, the return surfaces over them, and sweeps over a parameter: step i of the general algorithm."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.compose import members
from nsmaps.parallel import SERIAL, Arrays, Jobs, divides

if TYPE_CHECKING:
    from xarray import Dataset

    from nsmaps.exact.surfaces.family import ReturnFamily
    from nsmaps.exact.systems.parameters import System


class Axis(BaseModel):
    """Equidistant values of one coordinate, both ends included, or one value at which it is held."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    low: float
    high: float
    points: int = Field(ge=1, le=100_000)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
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


class Grid(BaseModel):
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

    def states(self, start: int = 0, stop: int | None = None) -> Floats:
        """The grid points from number `start` up to `stop`, all by default, shape (stop - start, n)."""
        numbers = np.arange(start, self.size if stop is None else min(stop, self.size))
        places = np.unravel_index(numbers, self.shape)
        return np.column_stack([axis.values()[place] for axis, place in zip(self.axes.values(), places, strict=True)])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Surface:
    """The first returns of one family over a grid: M of the grid's states belong to it."""

    __repr__ = brief

    name: str
    grid: Grid
    member: NDArray[np.bool_]  #: shape (grid.size,)
    returns: Returns  #: the M members, in the grid's order

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

    def restricted(self, mask: ArrayLike) -> "Surface":
        """The part of the surface that a mask over its M members selects."""
        mask = np.asarray(mask, bool)
        member = self.member.copy()
        member[self.member] = mask
        return Surface(self.name, self.grid, member, self.returns.select(mask))

    def on_grid(self, values: ArrayLike) -> Floats:
        """Values of the M members, shape (M,), on the grid, with NaN elsewhere."""
        out = np.full(self.grid.size, np.nan)
        out[self.member] = values
        return out.reshape(self.grid.shape)

    def to_xarray(self) -> "Dataset":
        """The surface as an xarray dataset on the grid, with a dimension for each coordinate, NaN where the family has no state.

        Raises NsmapsError without xarray.
        """
        from nsmaps.datasets import EACH, TIME, dataset

        axes = {str(name): axis.values() for name, axis in self.grid.axes.items()}
        image = np.stack([self.on_grid(values) for values in self.image.T], axis=-1)
        lifted = np.stack([self.on_grid(values) for values in self.lifted.T], axis=-1)
        words = np.full(self.grid.size, "", self.returns.words.dtype)
        words[self.member] = self.returns.words
        dims = " ".join(axes)
        rows = {
            "image": (f"{dims} coordinate", image, EACH, "where the return arrives; angles in [0, 2 pi)"),
            "lifted": (f"{dims} coordinate", lifted, EACH, "the same with angles continued from the start"),
            "time": (dims, self.on_grid(self.returns.time), TIME, "from start to image"),
            "word": (dims, words.reshape(self.grid.shape), "", "impact word; empty where the family has no state"),
        }
        return dataset(self.coordinates, rows, axes, family=self.name)


def surfaces(system: "System", grid: Grid, families: Sequence["ReturnFamily"]) -> dict[str, Surface]:
    """The return surfaces of all families over one grid, from one batch of returns.

    Raises:
        NsmapsError: the grid's axes are not the system's coordinates, in their order.
    """
    check_axes(grid, system.coordinates)
    return surfaces_among(system, system.first_return(grid.states()), grid, families)


def surfaces_among(system: "System", returns: Returns, grid: Grid, families: Iterable["ReturnFamily"]) -> dict[str, Surface]:
    """The surfaces of all families among the first returns of a whole grid, in its order."""
    found = {family.name: members(system, returns, family) for family in families}
    return {name: Surface(name, grid, member, own) for name, (member, own) in found.items()}


def check_axes(grid: Grid, coordinates: Sequence[str]) -> None:
    """Raise a NsmapsError unless the axes of a grid are these coordinates, in their order."""
    if tuple(grid.axes) != tuple(coordinates):
        raise NsmapsError(f"the grid has axes {', '.join(grid.axes)}; expected: {', '.join(coordinates)}, in this order")


@divides
def sweep(
    system: "System",
    parameter: str,
    values: ArrayLike,
    grid: Grid,
    families: Sequence["ReturnFamily"],
    *,
    jobs: Jobs = SERIAL,
) -> list[tuple[float, dict[str, Surface]]]:
    """The return surfaces for each value of one parameter, in the order of the values.

    Each value is a part of `jobs`, see `nsmaps.Jobs`. Errors as `surfaces`; on Ctrl-C Interrupted, whose `result` has the values
    that are finished.
    """
    check_axes(grid, system.coordinates)
    along = [system.at(**{parameter: float(value)}) for value in np.asarray(values, float)]
    cuts = jobs.cuts(len(along))

    def found(parts: Mapping[int, Arrays]) -> list[tuple[float, dict[str, Surface]]]:
        grids = {cuts[number].start + k: _row(part, k) for number, part in parts.items() for k in range(len(part["codes"]))}
        rows = [(along[k], _returns_of(along[k], grids[k])) for k in sorted(grids)]
        return [(getattr(each, parameter), surfaces_among(each, returns, grid, families)) for each, returns in rows]

    return found(dict(enumerate(jobs.run(_returns_over, [(tuple(along[cut]), grid) for cut in cuts], found))))


def _row(arrays: Arrays, k: int) -> Arrays:
    """Row k of each array."""
    return {name: rows[k] for name, rows in arrays.items()}


def _returns_over(systems: Sequence["System"], grid: Grid) -> Arrays:
    """The arrays of the first returns of a whole grid, of each system a row."""
    sweeps = [system.first_return(grid.states()) for system in systems]
    names = "start", "image", "turns", "codes", "outcome", "time"
    return {name: np.stack([getattr(returns, name) for returns in sweeps]) for name in names}


def _returns_of(system: "System", arrays: Mapping[str, Any]) -> Returns:
    """The returns whose arrays these are."""
    return replace(system.first_return(arrays["start"][:0]), **arrays)
