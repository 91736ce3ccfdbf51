"""A return surface with the part of it that lies near the diagonals of all coordinates: fig. 3d-area."""

from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.figures.data import NEAR, plane, section
from nsmaps.figures.page import Sheet
from nsmaps.figures.returns.surfaces import TINT, part_of, raised
from nsmaps.figures.style import BLUE, family_colours, tint
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.filter import Attracting, NearDiagonal

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.mesh import Mesh
    from nsmaps.exact.surfaces.surface import Surface
    from nsmaps.study.result import StudyResult

_ELEVATION = 42.0  #: of the view, degrees
_ZOOM = 0.95  #: at which the farthest corner is below the title


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with a panel for every coordinate of the image."""
    coordinates = NEAR.of(result, "diagonal_surface")[0].surface.coordinates
    panels = tuple(partial(diagonal_surface, result, coordinate=name) for name in coordinates)
    return (Sheet("diagonal_surface", panels, 2, 0.84, "3d", legend=True),)


def diagonal_surface(result: "StudyResult", ax: Axes, coordinate: str = "") -> Axes:
    """One coordinate of the image of the family that the study filters, blue where the filter holds at its own parameters.

    It is the first coordinate unless another is named. The axes must be three-dimensional (`projection="3d"`).
    """
    near = NEAR.of(result, "diagonal_surface")[0]
    family = section(result.study.diagonal, "diagonal").family
    mesh, seen = _mesh(result), plane(result.surfaces[family].grid)
    name = coordinate or mesh.coordinates[0]
    colours = {family: family_colours(list(result.surfaces))[family], rf"near diagonals, $\delta = {near.delta:g}$": BLUE}
    points, triangles, _ = part_of(mesh, seen, name, BLUE)
    number = mesh.part[triangles[:, 0]]
    parts = [(points, triangles[number == k], colour) for k, colour in enumerate(colours.values())]
    raised(ax, "diagonal_surface", parts, [mesh.coordinates[k] for k in seen], name, _ZOOM)
    ax.legend(handles=[Patch(color=tint(colour, TINT), label=text) for text, colour in colours.items()])
    cast(Any, ax).view_init(elev=_ELEVATION, azim=_towards(near.surface))
    return ax


@lru_cache(maxsize=1)  # of all panels
def _mesh(result: "StudyResult") -> "Mesh":
    """The surface, whose part 1 passes the filter of the study."""
    asked = section(result.study.diagonal, "diagonal")
    region = None if asked.region is None else ConditionRegion(coordinates=result.system.coordinates, text=asked.region)
    near = NearDiagonal(delta=NEAR.of(result, "diagonal_surface")[0].delta, slope=asked.slope, region=region)
    return result.mesh(asked.family, Attracting(near, result.system, result.family(asked.family)))


def _towards(near: "Surface") -> float:
    """The azimuth, in degrees, from which the states near the diagonals lie in front of all others."""
    middle = [(axis.low + axis.high) / 2 for axis in near.grid.axes.values()]
    x, y = (near.start.mean(axis=0) - middle) / [axis.high - axis.low for axis in near.grid.axes.values()]
    return float(np.degrees(np.arctan2(y, x)))
