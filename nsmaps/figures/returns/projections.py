"""The return surfaces seen in the phase planes of each coordinate: fig. 2Dpi-2pi and 2D0-2pi."""

from functools import partial
from itertools import pairwise
from typing import Any, cast

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.path import Path
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.exact.surfaces.mesh import grid_mesh
from nsmaps.exact.surfaces.surface import Axis, Surface
from nsmaps.figures.lines import diagonal as identity
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import position
from nsmaps.figures.returns.surfaces import Meshing, Surfaces, by_name
from nsmaps.figures.style import BLACK, BROWN, RED, dress, label
from nsmaps.figures.ticks import angle_ticks
from nsmaps.reduced.fit.filter import DiagonalRegion, near_diagonal, own_slopes

Part = tuple[float, float]  #: of the last coordinate, from and to
GENTLE = 1.0  #: the largest slope of red stars where the study sets none
_STRANDS = 24  #: lines in a picture, at most
_SHADES = 100  #: of the colours
_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0, 0.93, 200)))  #: without the yellow that white swallows


def sheets(surfaces: Surfaces, mesh: Meshing = grid_mesh, diagonal: DiagonalRegion | None = None) -> tuple[Sheet, ...]:
    """One sheet: a row a family, a column a coordinate. Of more than half a circle of phases a sheet a family, a row a half."""
    named = by_name(surfaces)
    first = next(iter(named.values()))
    halves = _halves(first.coordinates[-1], list(first.grid.axes.values())[-1])
    *_, last = names = first.coordinates
    views: list[dict[str, Any]] = [{"part": half, "coordinate": name, "bar": name == last} for half in halves for name in names]
    of = partial(partial, projections, mesh=mesh, diagonal=diagonal)
    panels = {
        family: tuple(of(surface, **view) for view in views if _has_states(surface, view["part"]))
        for family, surface in named.items()
    }
    if len(halves) == 1:
        return (Sheet("projections", sum(panels.values(), ()), 2, 0.84, legend=True),)
    return tuple(Sheet(file_of("projections", family), each, 2, 0.84, legend=True) for family, each in panels.items())


def _halves(name: str, axis: Axis) -> list[Part]:
    """The parts of an axis between multiples of pi, if it is one of an angle that spans more than pi; else all of it."""
    cuts = np.pi * np.arange(np.ceil(axis.low / np.pi + 1e-6), np.ceil(axis.high / np.pi - 1e-6))
    if not is_angle(name) or axis.high - axis.low <= np.pi * (1 + 1e-6):
        return [(axis.low, axis.high)]
    ends = [axis.low, *cuts.tolist(), axis.high]
    return list(pairwise(ends))


def _has_states(surface: Surface, part: Part) -> bool:
    """Whether a surface has states in a part of the last coordinate, or none at all, of which an empty picture is drawn."""
    last, (low, high) = surface.start[:, -1], part
    return not len(last) or bool(((last >= low - 1e-9) & (last <= high + 1e-9)).any())


def projections(
    surface: Surface,
    ax: Axes,
    coordinate: str = "",
    part: Part | None = None,
    bar: bool = True,
    mesh: Meshing = grid_mesh,
    diagonal: DiagonalRegion | None = None,
) -> Axes:
    """The next value of a coordinate against its present one, a strand for each value of the other, coloured by the phase.

    That is the last coordinate, of which a `part` may be chosen; `bar` is the scale of its colours. Strands end at the edges of
    the map's smooth pieces. Stars are the states on the strands near the diagonals of all coordinates (eq. r1uniond), if
    these are given: filled red on gentle slopes, hollow brown on steep ones.
    """
    i = position(surface.coordinates, coordinate or surface.coordinates[0])
    name = surface.coordinates[i]
    axes = list(surface.grid.axes.values())
    low, high = part or (axes[-1].low, axes[-1].high)
    mask = (surface.start[:, -1] >= low - 1e-9) & (surface.start[:, -1] <= high + 1e-9)
    held = _held(surface.start[mask, 1 - i])
    scale = ScalarMappable(Normalize(low, high), _COLOURS)
    facets = mesh(surface)
    strands = np.concatenate([np.zeros((0, 2, 2, 2)), *(facets.cut(1 - i, value) for value in held)])
    _lines(ax, strands[..., i], strands[:, :, 0, -1].mean(axis=1), scale)
    ends = (low, high) if i == len(axes) - 1 else (axes[i].low, axes[i].high)
    top = TWO_PI if is_angle(name) else 1.05 * float(surface.image[:, i].max(initial=ends[1]))
    ax.set(xlim=ends, ylim=(min(0.0, ends[0]), top))
    identity(ax, *ends).set_label("_")
    if diagonal is not None and mask.any():
        _stars(diagonal, surface, mask & np.isin(surface.start[:, 1 - i], held), ax, i)
        if ax.get_legend_handles_labels()[0]:
            ax.legend()
    if bar:
        _bar(ax, surface, scale)
    ax.set_title(surface.name)
    return dress(ax, (name, "k"), (name, "k+1"))


def _lines(ax: Axes, segments: Floats, phase: Floats, scale: ScalarMappable) -> None:
    """Segments (S, 2, 2) with a phase each, of those on the scale all of one shade as one path."""
    low, high = scale.get_clim()
    edges = np.linspace(low - 1e-9, high + 1e-9, _SHADES + 1)
    number = np.digitize(phase, edges) - 1
    shades = [k for k in range(_SHADES) if (number == k).any()]
    ends = [segments[number == k].reshape(-1, 2) for k in shades]
    paths = [Path(each, np.tile([Path.MOVETO, Path.LINETO], len(each) // 2)) for each in ends]
    look: dict[str, Any] = {"cmap": scale.cmap, "norm": scale.norm, "lw": 1.0, "capstyle": "round", "zorder": 3}
    lines = PathCollection(paths, array=(edges[:-1] + edges[1:])[shades] / 2, facecolors="none", rasterized=True, **look)
    lines.set_transform(ax.transData)
    ax.add_collection(lines)


def _bar(ax: Axes, surface: Surface, scale: ScalarMappable) -> None:
    """The scale of the colours beside the picture."""
    bar = cast(Figure, ax.get_figure(root=True)).colorbar(scale, cax=ax.inset_axes((1.04, 0, 0.05, 1)))
    bar.set_label(label(surface.coordinates[-1], "k"))
    if surface.coordinates.angles[-1]:
        angle_ticks(bar.ax.yaxis, float(np.ptp(scale.get_clim())))


def _held(values: Floats) -> Floats:
    """At most so many of the values of the other coordinate at which there are states."""
    there = np.unique(values)
    return there[np.unique(np.linspace(0, len(there) - 1, _STRANDS).round().astype(np.intp))] if len(there) else there


def _stars(diagonal: DiagonalRegion, surface: Surface, mask: NDArray[np.bool_], ax: Axes, i: int) -> None:
    """Stars on the strands near both diagonals: filled on gentle slopes, hollow on steep ones and next to an edge."""
    near = mask & near_diagonal(surface.returns, diagonal.delta)
    gentle = (np.abs(own_slopes(surface)) <= (diagonal.slope or GENTLE)).all(axis=1)
    for chosen, colour, fill, text in ((near & gentle, BLACK, RED, "gentle"), (near & ~gentle, BROWN, "white", "steep")):
        if chosen.any():
            look: dict[str, Any] = {"mfc": fill, "mec": colour, "mew": 0.5, "ms": 6, "markevery": 0.03, "zorder": 4}
            ax.plot(surface.start[chosen, i], surface.image[chosen, i], "*", label=f"near both diagonals, {text}", **look)
