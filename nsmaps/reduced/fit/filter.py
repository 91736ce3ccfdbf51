"""States near the diagonals: the ratio filter of eq. r1uniond, the derivatives there, their union over a parameter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.errors import FitError
from nsmaps.errors.arguments import checked
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import members
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Region
from nsmaps.results import Result, array

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.family import ReturnFamily
    from nsmaps.exact.systems.parameters import System


class NearDiagonal(BaseModel):
    """The criterion for potentially attracting states: near all diagonals, and not on steep parts of the surfaces."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    delta: Number = Field(gt=1, description="upper bound on the ratio of a coordinate and its image, and on its reciprocal")
    slope: Number | None = Field(None, gt=0, description="upper bound on abs(dx'_i/dx_i)")
    region: Region | None = Field(None, description="the region considered; all states if omitted")

    def near(self, surface: Surface) -> Surface:
        """The part of a surface that passes the filter."""
        mask = near_diagonal(surface.returns, self.delta)
        if self.region is not None:
            mask &= self.region.over(surface.coordinates).contains(surface.start)
        if self.slope is not None:
            mask &= (np.abs(own_slopes(surface)) <= self.slope).all(axis=1)
        return surface.restrict(mask)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DiagonalRegion(WithCoordinates, Result):
    """The states near the diagonals for at least one value of a parameter (eq. r1uniond)."""

    coordinates: Coordinates
    delta: float
    start: Floats = field(metadata=array("state coordinate", "the union over the parameter, each state once"))
    box: Floats = field(metadata=array("coordinate end", "the hull of `start`; NaN if it is empty"))
    values: tuple[tuple[float, Floats], ...]  #: for each value of the parameter its own states, shape (m, n)
    images: tuple[Floats, ...] = field(
        default=(),
        metadata=array("state coordinate", "their images, each of shape (m, n), angles in [0, 2 pi); older runs stored none"),
    )
    slope: float | None = None  #: upper bound on abs(dx'_i/dx_i); None without one

    def summary(self) -> str:
        """The numbers that matter."""
        return f"delta = {self.delta:g}: {len(self.start)} states of ({self.coordinates}) in {self.box.round(6).tolist()}"


def near_diagonal(returns: Returns, delta: float) -> Bools:
    """A mask of the returns with 1/delta < |image/start| < delta in every coordinate, shape (N,); eq. r1uniond.

    Angles are compared in [0, 2 pi), as in the paper.
    """
    start, image = np.abs(_wrapped(returns.start, returns)), np.abs(_wrapped(returns.image, returns))
    return np.asarray(np.logical_and(start < delta * image, image < delta * start).all(axis=1))


def own_slopes(surface: Surface) -> Floats:
    """The derivative dx'_i/dx_i of each coordinate's image at the surface's states, shape (M, n).

    It is computed by central differences on the surface's grid; NaN next to the edge of the grid or the surface. Angles are
    unwrapped.
    """
    slopes = np.empty((len(surface.returns), len(surface.coordinates)))
    for i, axis in enumerate(surface.grid.axes.values()):
        image = np.moveaxis(surface.on_grid(surface.lifted[:, i]), i, 0)
        slope = np.full(image.shape, np.nan)
        slope[1:-1] = (image[2:] - image[:-2]) / (2 * axis.step)
        slopes[:, i] = np.moveaxis(slope, 0, i).ravel()[surface.member]
    return slopes


@dataclass(frozen=True, slots=True, eq=False)
class Attracting:
    """The filter for first returns anywhere, with exact derivatives: 1 for those that pass, else 0, as parts of a `Mesh`."""

    diagonal: NearDiagonal
    system: "System"
    family: "ReturnFamily"

    def __call__(self, returns: Returns) -> Ints:
        """Of N returns of the family, shape (N,)."""
        mask = near_diagonal(returns, self.diagonal.delta)
        if self.diagonal.region is not None:
            mask &= self.diagonal.region.over(returns.coordinates).contains(returns.start)
        if self.diagonal.slope is not None and mask.any():
            first = self.system.first_return(returns.start[mask], derivative=True)
            slopes = members(self.system, first, self.family)[1].derivative
            assert slopes is not None
            mask[mask] = (np.abs(np.diagonal(slopes, axis1=1, axis2=2)) <= self.diagonal.slope).all(axis=1)
        return mask.astype(np.int64)


@checked
def diagonal_region(diagonal: NearDiagonal, sweeps: Sequence[tuple[float, Surface]]) -> DiagonalRegion:
    """The states that pass the filter on one of the surfaces, one for each value of a parameter; eq. r1uniond.

    Raises:
        FitError: there is no surface, or they have different coordinates.
    """
    names = {surface.coordinates for _, surface in sweeps}
    if len(names) != 1:
        given = " and ".join(f"({each})" for each in sorted(names, key=str)) or "none"
        raise FitError(f"the surfaces near the diagonals have coordinates {given}; expected: one or more, of the same")
    near = [(float(value), diagonal.near(surface)) for value, surface in sweeps]
    values = tuple((value, surface.start) for value, surface in near)
    start = np.unique(np.concatenate([states for _, states in values]), axis=0)
    hull = np.stack([start.min(axis=0), start.max(axis=0)], axis=1) if len(start) else np.full((start.shape[1], 2), np.nan)
    images = tuple(surface.image for _, surface in near)
    return DiagonalRegion(names.pop(), diagonal.delta, start, hull, values, images, diagonal.slope)


def _wrapped(states: Floats, returns: Returns) -> Floats:
    with np.errstate(invalid="ignore"):
        return returns.coordinates.wrap(states)
