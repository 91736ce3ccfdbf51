"""A return surface with the part of it that lies near the diagonals of all coordinates: fig. 3d-area."""

from collections.abc import Mapping
from functools import partial
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.exact.surfaces.surface import Surface
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import plane
from nsmaps.figures.returns.surfaces import TINT, Meshing, part_of, raised
from nsmaps.figures.style import BLUE, family_colours, tint
from nsmaps.reduced.fit.filter_errors import NearDiagonals

_ELEVATION = 42.0  #: of the view, degrees
_CORNER = 0.05  #: of the second axis, at the nearest corner, where its names would meet those of the first
_ZOOM = 0.95  #: at which the farthest corner is below the title


def sheets(near: NearDiagonals, surfaces: Mapping[str, Surface], mesh: Meshing) -> tuple[Sheet, ...]:
    """One sheet with a panel for every coordinate of the image."""
    of = partial(diagonal_surface, near, surfaces=surfaces, mesh=mesh)
    panels = tuple(partial(of, coordinate=name) for name in near.surface.coordinates)
    return (Sheet("diagonal_surface", panels, 2, 0.84, "3d", legend=True),)


def diagonal_surface(near: NearDiagonals, ax: Axes, surfaces: Mapping[str, Surface], mesh: Meshing, coordinate: str = "") -> Axes:
    """One coordinate of the image of the family that is filtered, blue where the filter holds.

    It is the first coordinate unless another is named. `mesh` gives the surface with 1 as the part that passes the filter. The
    axes must be three-dimensional (`projection="3d"`).
    """
    family = near.surface.name
    facets, seen = mesh(surfaces[family]), plane(near.surface.grid)
    name = coordinate or facets.coordinates[0]
    colours = {family: family_colours(list(surfaces))[family], rf"near both diagonals, $\delta = {near.delta:g}$": BLUE}
    points, triangles, _ = part_of(facets, seen, name, BLUE)
    number = facets.part[triangles[:, 0]]
    parts = [(points, triangles[number == k], colour) for k, colour in enumerate(colours.values())]
    raised(ax, "diagonal_surface", parts, [facets.coordinates[k] for k in seen], name, _ZOOM)
    ax.legend(handles=[Patch(color=tint(colour, TINT), label=text) for text, colour in colours.items()])
    space, towards = cast(Any, ax), _towards(near.surface)
    space.view_init(elev=_ELEVATION, azim=towards)
    low, high = space.get_ylim()
    nearest, span = (high if towards > 0 else low), high - low
    space.set_yticks([tick for tick in space.get_yticks() if low <= tick <= high and abs(tick - nearest) > _CORNER * span])
    return ax


def _towards(near: Surface) -> float:
    """The azimuth, in degrees, from which the states near the diagonals lie in front of all others."""
    middle = [(axis.low + axis.high) / 2 for axis in near.grid.axes.values()]
    x, y = (near.start.mean(axis=0) - middle) / [axis.high - axis.low for axis in near.grid.axes.values()]
    return float(np.degrees(np.arctan2(y, x)))
