"""The return surfaces over the plane of states, a picture a coordinate: fig. 3d."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import is_angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.mesh import Mesh, grid_mesh
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import plane, position
from nsmaps.figures.returns.facets import Facets, shaded
from nsmaps.figures.style import GREY, dress, family_colours, symbol, tint
from nsmaps.figures.ticks import angle_ticks

Surfaces = Surface | Mapping[str, Surface]  #: one, or several by name
Meshing = Callable[[Surface], Mesh]
Part = tuple[Floats, Ints, str]  #: places and heights (P, 3), triangles (T, 3), and their colour

_WIDE = 1.5  #: inches of a panel, in which there is room for all ticks
_STEEP = 0.08  #: of the height of a surface, beyond which a triangle between states of a grid is left out
_FEWER = 1.3  #: times fewer ticks of an angle along a side of the plane, which is seen shortened
TINT = 0.2  #: share of white in the colour of a surface
ELEVATION, AZIMUTH = 24, -128  #: from where they are seen, degrees


def sheets(named: Surfaces, mesh: Meshing = grid_mesh) -> tuple[Sheet, ...]:
    """One sheet with a panel for every coordinate of the image."""
    coordinates = next(iter(by_name(named).values())).coordinates
    panels = tuple(partial(surfaces, named, mesh=mesh, coordinate=name) for name in coordinates)
    return (Sheet("surfaces", panels, 2, 0.84, "3d", legend=True),)


def by_name(named: Surfaces) -> Mapping[str, Surface]:
    """Surfaces by name, of which one may be given alone."""
    return {named.name: named} if isinstance(named, Surface) else named


def surfaces(named: Surfaces, ax: Axes, coordinate: str = "", mesh: Meshing = grid_mesh) -> Axes:
    """One coordinate of the image over the states, coloured by family and shaded, by the first coordinate or the one named.

    `mesh` gives the triangles of a surface, which end at the edges of the map's smooth pieces if it knows the map, and else at
    the grid's cells beside these, without those as steep as beside a graze. The axes must have `projection="3d"`.
    """
    named = by_name(named)
    first = next(iter(named.values()))
    name = coordinate or first.coordinates[0]
    position(first.coordinates, name)
    colours = family_colours(list(named))
    parts = [part_of(mesh(named[family]), plane(first.grid), name, colour) for family, colour in colours.items()]
    if mesh is grid_mesh:
        parts = [(points, _gentle(points, triangles), colour) for points, triangles, colour in parts]
    raised(ax, "surfaces", parts, [first.coordinates[k] for k in plane(first.grid)], name)
    handles = [Patch(color=tint(colour, TINT), label=family) for family, colour in colours.items() if colour != GREY]
    if more := len(colours) - len(handles):
        handles.append(Patch(color=tint(GREY, TINT), label=f"{more} more words"))
    ax.legend(handles=handles)
    return ax


def part_of(mesh: Mesh, seen: Sequence[int], coordinate: str, colour: str) -> Part:
    """One coordinate of the image of a mesh over two coordinates of the states."""
    height = mesh.returns.image[:, position(mesh.coordinates, coordinate)]
    return np.column_stack([mesh.returns.start[:, seen], height]), mesh.triangles, colour


def _gentle(points: Floats, triangles: Ints) -> Ints:
    """Triangles without those that are higher than the states at an edge can say, as beside a square root."""
    height = points[:, 2][triangles]
    return triangles[np.ptp(height, axis=1) <= _STEEP * np.ptp(points[:, 2])] if len(triangles) else triangles


def raised(ax: Axes, figure: str, parts: Sequence[Part], over: Sequence[str], image: str, zoom: float = 1.05) -> None:
    """Shaded surfaces on dressed axes, over two coordinates of the states the image of one.

    All are one collection, so that each triangle is sorted by depth among all others.
    """
    if ax.name != "3d":
        raise NsmapsError(f"the axes of the figure {figure!r} are {ax.name!r}; expected: axes made with projection='3d'")
    space = cast(Any, ax)
    points = np.concatenate([part[0] for part in parts])
    ends = np.cumsum([0, *(len(part[0]) for part in parts)])
    triangles = np.concatenate([part[1] + end for part, end in zip(parts, ends[:-1], strict=True)])
    Facets(space, points, triangles, np.concatenate([shaded(*part[:2], tint(part[2], TINT)) for part in parts]))
    used = np.full(len(points), len(triangles) == 0)
    used[triangles] = True
    shown = points[used]
    space.set_zmargin(0.05)
    space.auto_scale_xyz(*shown.T)
    for set_limits, starts in zip((space.set_xlim, space.set_ylim), shown.T[:2], strict=True):
        set_limits(starts.min(), starts.max())
    space.set_zlim(bottom=min(0.0, float(shown[:, 2].min())))
    space.view_init(elev=ELEVATION, azim=AZIMUTH)
    wide = ax.bbox.width > _WIDE * cast(Any, ax.figure).dpi
    space.set_box_aspect((1, 1, 0.95), zoom=zoom if wide else 0.8 * zoom)
    dress(ax, (over[0], "k"), (over[1], "k"))
    ax.set_title(symbol(image, "k+1"))  # beside the axis it would meet the ticks
    spans: dict[str, float] = {}
    for axis, name, step in zip((space.xaxis, space.yaxis, space.zaxis), (*over, image), ("k", "k", ""), strict=True):
        axis.set_rotate_label(False)
        axis.set_label_text("" if axis is space.zaxis else symbol(name, step))
        axis.set_tick_params(pad=-1.5)
        axis.labelpad = -5
        if is_angle(name):
            few = 1 if axis is space.zaxis else _FEWER
            spans[name] = min(float(np.ptp(axis.get_view_interval())) * few, spans.get(name, np.inf))
            angle_ticks(axis, spans[name] * (1 if wide else 2 / few))  # of one kind on both axes of a phase
        else:
            count = (5 if axis is space.zaxis else 3) if wide else 2
            meets = "lower" if axis is space.xaxis else None  # where the ticks of both axes below would touch
            axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 5, 10], prune=meets))
