"""The return surfaces seen in the phase planes of each coordinate: fig. 2Dpi-2pi and 2D0-2pi."""

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.exact.surfaces.surface import Axis, Surface
from nsmaps.figures.data import SURFACES, position
from nsmaps.figures.lines import diagonal, jumps
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.style import BLACK, BROWN, RED, angle_ticks, dress, label
from nsmaps.reduced.fit.filter import DiagonalRegion, near_diagonal, own_slopes

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

Part = tuple[float, float]  #: of the last coordinate, from and to
GENTLE = 1.0  #: the largest slope of red stars where the study sets none
_STRANDS = 24  #: lines in a picture, at most
_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0, 0.93, 200)))  #: without the yellow that white swallows
_TIGHT: dict[str, Any] = {"handlelength": 1.4, "columnspacing": 0.9, "handletextpad": 0.4}


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: a row a family, a column a coordinate. Of more than half a circle of phases a sheet a family, a row a half."""
    named = SURFACES.of(result, "projections")
    first = next(iter(named.values()))
    halves = _halves(first.coordinates[-1], list(first.grid.axes.values())[-1])
    views: list[dict[str, Any]] = [{"part": half, "coordinate": c} for half in halves for c in first.coordinates]
    panels = {family: tuple(partial(projections, result, family=family, **view) for view in views) for family in named}
    if len(halves) == 1:
        return (Sheet("projections", sum(panels.values(), ()), 2, 0.73),)
    return tuple(Sheet(file_of("projections", family), each, 2, 0.73) for family, each in panels.items())


def _halves(name: str, axis: Axis) -> list[Part]:
    """The parts of an axis between multiples of pi, if it is one of an angle that spans more than pi; else all of it."""
    cuts = np.pi * np.arange(np.ceil(axis.low / np.pi + 1e-6), np.ceil(axis.high / np.pi - 1e-6))
    if not is_angle(name) or axis.high - axis.low <= np.pi * (1 + 1e-6):
        return [(axis.low, axis.high)]
    ends = [axis.low, *cuts.tolist(), axis.high]
    return list(pairwise(ends))


def projections(result: "StudyResult", ax: Axes, coordinate: str = "", family: str = "", part: Part | None = None) -> Axes:
    """The next value of a coordinate against its present one, a strand for each value of the other, coloured by the phase.

    That is the last coordinate, of which a `part` may be chosen. Stars are the states on the strands near the diagonals of all
    coordinates (eq. r1uniond), where the result has looked for them: filled red on gentle slopes, hollow brown on steep ones.
    """
    named = SURFACES.of(result, "projections")
    surface = named[family or next(iter(named))]
    i = position(surface.coordinates, coordinate or surface.coordinates[0])
    name = surface.coordinates[i]
    axes = list(surface.grid.axes.values())
    low, high = part or (axes[-1].low, axes[-1].high)
    mask = (surface.start[:, -1] >= low - 1e-9) & (surface.start[:, -1] <= high + 1e-9)
    scale = ScalarMappable(Normalize(low, high), _COLOURS)
    if mask.any():
        _draw(ax, surface, mask, i, scale)
    ends = (low, high) if i == len(axes) - 1 else (axes[i].low, axes[i].high)
    top = TWO_PI if is_angle(name) else 1.05 * float(surface.image[:, i].max(initial=ends[1]))
    ax.set(xlim=ends, ylim=(min(0.0, ends[0]), top))
    diagonal(ax, *ends).set_label("_")
    if result.diagonal is not None and mask.any():
        _stars(result.diagonal, surface, mask, ax, i)
    bar = cast(Figure, ax.get_figure(root=True)).colorbar(scale, cax=ax.inset_axes((1.03, 0, 0.035, 1)))
    bar.set_label(label(surface.coordinates[-1], "k"))
    if surface.coordinates.angles[-1]:
        angle_ticks(bar.ax.yaxis, high - low)
    handles = [Line2D([], [], color=_COLOURS(0.5), label=surface.name), *ax.get_legend_handles_labels()[0]]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=3, frameon=False, **_TIGHT)
    return dress(ax, (name, "k"), (name, "k+1"))


def _draw(ax: Axes, surface: Surface, mask: NDArray[np.bool_], i: int, scale: ScalarMappable) -> None:
    """The strands of one coordinate's next value against its present one."""
    columns = surface.start[:, i], surface.image[:, i], surface.start[:, -1]
    x, y, shade = (_strands(surface, mask, column, 1 - i) for column in columns)
    steps = np.concatenate([_segments(one, two) for one, two in zip(x, y, strict=True)])
    colour = np.concatenate([each[:-1] for each in shade])
    shown = ~np.concatenate([jumps(each, 0.02 * float(np.ptp(surface.image[:, i]))) for each in y])
    look: dict[str, Any] = {"cmap": scale.cmap, "norm": scale.norm, "lw": 1.3, "capstyle": "round", "zorder": 3}
    ax.add_collection(LineCollection(list(steps[shown]), array=colour[shown], rasterized=True, **look))


def _segments(x: Floats, y: Floats) -> Floats:
    """The steps of a line (m,) as segments, shape (m - 1, 2, 2)."""
    points = np.column_stack([x, y])
    return np.stack([points[:-1], points[1:]], axis=1)


def _strands(surface: Surface, mask: NDArray[np.bool_], values: Floats, other: int) -> Floats:
    """Values of the members that are kept as rows, for at most so many values of the other coordinate, NaN between."""
    rows = np.moveaxis(surface.on_grid(np.where(mask, values, np.nan)), other, 0)
    across = list(surface.grid.axes.values())[other].values()
    there = np.flatnonzero(np.isin(across, surface.start[mask, other]))
    return rows[there[np.unique(np.linspace(0, len(there) - 1, _STRANDS).round().astype(np.intp))]]


def _stars(diagonal: DiagonalRegion, surface: Surface, mask: NDArray[np.bool_], ax: Axes, i: int) -> None:
    """Stars on the strands near both diagonals: filled on gentle slopes, hollow on steep ones and next to an edge."""
    near = mask & near_diagonal(surface.returns, diagonal.delta)
    gentle = (np.abs(own_slopes(surface)) <= (diagonal.slope or GENTLE)).all(axis=1)
    for chosen, colour, fill, text in ((near & gentle, BLACK, RED, "gentle"), (near & ~gentle, BROWN, "white", "steep")):
        x, y = (_strands(surface, mask, np.where(chosen, c[:, i], np.nan), 1 - i) for c in (surface.start, surface.image))
        if np.isfinite(x).any():
            look: dict[str, Any] = {"mfc": fill, "mec": colour, "mew": 0.6, "ms": 9.5, "markevery": 0.02, "zorder": 4}
            ax.plot(x[np.isfinite(x)], y[np.isfinite(x)], "*", label=f"near both, {text}", **look)
