"""The return surfaces seen in the phase planes of each coordinate: fig. 2Dpi-2pi and 2D0-2pi."""

from functools import partial
from typing import Any, cast

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.exact.impacts import TWO_PI, Angle, Floats
from nsmaps.exact.surface import Surface
from nsmaps.figures.lines import cut, diagonal
from nsmaps.figures.needs import Drawable, position, surfaces_of
from nsmaps.figures.sheet import Sheet
from nsmaps.figures.style import RED, angle_ticks, dress, label
from nsmaps.reduced.diagonal import DiagonalRegion, near_diagonal

_STRANDS = 24  #: lines in a picture, at most
_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0, 0.93, 200)))  #: without the yellow that white swallows
_TIGHT: dict[str, Any] = {"handlelength": 1.4, "columnspacing": 0.9, "handletextpad": 0.4}


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet: a row a family, a column a coordinate."""
    named = surfaces_of(result, "projections")
    coordinates = next(iter(named.values())).coordinates
    panels = tuple(partial(projections, result, family=f, coordinate=c) for f in named for c in coordinates)
    return (Sheet("projections", panels, len(coordinates), (6.0, 4.4)),)


def projections(result: Drawable, ax: Axes, coordinate: str = "", family: str = "") -> Axes:
    """The next value of a coordinate against its present one, a strand for each value of the other coordinate.

    Stars are the states near the diagonals of all coordinates (eq. r1uniond), where the result has looked for them.
    """
    named = surfaces_of(result, "projections")
    surface = named[family or next(iter(named))]
    i = position(surface.coordinates, coordinate or surface.coordinates[0])
    name, other = surface.coordinates[i], surface.coordinates[1 - i]
    x, y = (_strands(surface, column[:, i], 1 - i) for column in (surface.start, surface.image))
    height = np.pi if isinstance(name, Angle) else 0.2 * float(np.ptp(surface.image[:, i]))
    axis, across = (list(surface.grid.axes.values())[k] for k in (i, 1 - i))
    values = across.values()[_chosen(across.points)]
    scale = ScalarMappable(Normalize(values[0], values[-1]), _COLOURS)
    strands = [np.column_stack([one, cut(two, height)]) for one, two in zip(x, y, strict=True)]
    ax.add_collection(LineCollection(strands, array=values, cmap=scale.cmap, norm=scale.norm, lw=1.3, zorder=3))
    top = TWO_PI if isinstance(name, Angle) else 1.05 * float(surface.image[:, i].max(initial=axis.high))
    ax.set(xlim=(axis.low, axis.high), ylim=(min(0.0, axis.low), top))
    diagonal(ax, axis.low, axis.high).set_label("_")
    if result.diagonal is not None:
        _stars(result.diagonal, surface, ax, i)
    bar = cast(Figure, ax.get_figure(root=True)).colorbar(scale, cax=ax.inset_axes((1.03, 0, 0.035, 1)))
    bar.set_label(label(other, "k"))
    if isinstance(other, Angle):
        angle_ticks(bar.ax.yaxis, across.high - across.low)
    handles = [Line2D([], [], color=_COLOURS(0.5), label=surface.name), *ax.get_legend_handles_labels()[0]]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=3, frameon=False, **_TIGHT)
    return dress(ax, (name, "k"), (name, "k+1"))


def _chosen(points: int) -> NDArray[np.intp]:
    """Which values of the other coordinate have a strand."""
    return np.unique(np.linspace(0, points - 1, _STRANDS).round().astype(np.intp))


def _strands(surface: Surface, values: Floats, other: int) -> Floats:
    """Values of the members as rows, one for each chosen value of the other coordinate, NaN between."""
    return np.moveaxis(surface.on_grid(values), other, 0)[_chosen(surface.grid.shape[other])]


def _stars(diagonal: DiagonalRegion, surface: Surface, ax: Axes, i: int) -> None:
    """Stars on the strands near both diagonals: filled within the region that was found, hollow elsewhere."""
    near = near_diagonal(surface.returns, diagonal.delta)
    low, high = np.asarray(diagonal.box).T
    within = ((surface.start >= low) & (surface.start <= high)).all(axis=1)
    for chosen, fill, text in ((near & within, RED, "near diagonals"), (near & ~within, "none", "near, outside the region")):
        x, y = (_strands(surface, np.where(chosen, c[:, i], np.nan), 1 - i) for c in (surface.start, surface.image))
        if np.isfinite(x).any():
            ax.plot(x[np.isfinite(x)], y[np.isfinite(x)], "*", mfc=fill, mec=RED, mew=0.5, ms=6, label=text, zorder=4)
