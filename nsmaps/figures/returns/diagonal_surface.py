"""A return surface with the part of it that lies near the diagonals of all coordinates: fig. 3d-area."""

from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.figures.data import NEAR, position, section
from nsmaps.figures.page import Sheet
from nsmaps.figures.returns.surfaces import raised
from nsmaps.figures.style import BLUE, family_colours, tint

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.surface import Surface
    from nsmaps.study.result import StudyResult

_ELEVATION = 42.0  #: of the view, degrees


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with a panel for every coordinate of the image."""
    coordinates = NEAR.of(result, "diagonal_surface")[0].surface.coordinates
    panels = tuple(partial(diagonal_surface, result, coordinate=name) for name in coordinates)
    return (Sheet("diagonal_surface", panels, len(panels), 0.83, "3d"),)


def diagonal_surface(result: "StudyResult", ax: Axes, coordinate: str = "") -> Axes:
    """One coordinate of the image of the family that the study filters, blue where the filter holds at its own parameters.

    It is the first coordinate unless another is named. The axes must be three-dimensional (`projection="3d"`).
    """
    near = NEAR.of(result, "diagonal_surface")[0]
    family = section(result.study.diagonal, "diagonal").family
    surface = result.surfaces[family]
    i = position(surface.coordinates, coordinate or surface.coordinates[0])
    others = surface.restricted(~near.surface.member[surface.member]) if near.surface.grid == surface.grid else surface
    colours = {family: family_colours(list(result.surfaces))[family], rf"near diagonals, $\delta = {near.delta:g}$": BLUE}
    parts = [(part, part.image[:, i], colour) for part, colour in zip((others, near.surface), colours.values(), strict=True)]
    raised(ax, "diagonal_surface", parts, surface.coordinates[i])
    handles = [Patch(color=tint(colour, 0.15), label=text) for text, colour in colours.items()]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
    cast(Any, ax).view_init(elev=_ELEVATION, azim=_towards(near.surface))
    return ax


def _towards(near: "Surface") -> float:
    """The azimuth, in degrees, from which the states near the diagonals lie in front of all others."""
    middle = [(axis.low + axis.high) / 2 for axis in near.grid.axes.values()]
    x, y = (near.start.mean(axis=0) - middle) / [axis.high - axis.low for axis in near.grid.axes.values()]
    return float(np.degrees(np.arctan2(y, x)))
