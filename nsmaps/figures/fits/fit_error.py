"""Where polynomials fitted near the diagonals are off, and by how much, for several delta: fig. comparert."""

from collections.abc import Sequence
from functools import partial
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from nsmaps.arrays import Floats
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import position
from nsmaps.figures.style import dress, symbol
from nsmaps.reduced.fit.filter_errors import NearDiagonals
from nsmaps.reduced.fit.lifts import unwrapped

_DECADES = 4.0  #: of the colours, below the largest error
_MARGIN = 0.06  #: of the picture around the states of the largest delta, in their widths


def sheets(found: NearDiagonals | Sequence[NearDiagonals]) -> tuple[Sheet, ...]:
    """A sheet an order, the first's named `fit_error`: a row a delta, a column a coordinate."""
    near = [found] if isinstance(found, NearDiagonals) else found
    coordinates = near[0].surface.coordinates
    drawn = []
    for k, order in enumerate(near[0].maps):
        file = file_of("fit_error", order if k else "")
        rows = range(len(near))
        panels = tuple(partial(_panel, found, coordinate=c, delta=row, order=order) for row in rows for c in coordinates)
        drawn.append(Sheet(file, panels, len(coordinates), 0.68, title=order))
    return tuple(drawn)


def _panel(found: NearDiagonals | Sequence[NearDiagonals], ax: Axes, coordinate: str, delta: int, order: str) -> Axes:
    """A panel of several, of which those of one column share a scale; where all stand in one column each has its own."""
    place = cast(SubplotSpec, ax.get_subplotspec())
    grid = place.get_gridspec()
    fit_error(found, ax, coordinate, delta, order, bar=grid.ncols == 1)
    column = [each for each in ax.figure.axes if (other := each.get_subplotspec()) and other.colspan == place.colspan]
    if len(column) == grid.nrows and grid.ncols > 1:
        _scale(ax.collections[0], column, coordinate)
    return ax


def _scale(mesh: ScalarMappable, beside: Sequence[Axes], coordinate: str) -> None:
    """The scale of errors beside some panels, one above the other."""
    figure = cast(Figure, beside[0].get_figure(root=True))
    bar = figure.colorbar(mesh, ax=beside, extend="min", aspect=22 * len(beside), fraction=0.1, pad=0.03)
    bar.set_label(rf"$|$error of {symbol(coordinate, 'k+1')}$|$")


def fit_error(
    found: NearDiagonals | Sequence[NearDiagonals],
    ax: Axes,
    coordinate: str = "",
    delta: int = 0,
    order: str = "",
    bar: bool = True,
) -> Axes:
    """The error of one coordinate at every state near the diagonals, each as its cell of the grid, for a delta by position.

    Lighter is a larger error. One logarithmic scale serves all delta, and ends at their largest error; `bar` shows it.
    """
    near = [found] if isinstance(found, NearDiagonals) else found
    order = order or next(iter(near[0].maps))
    one, names = near[delta], near[0].surface.coordinates
    i = position(names, coordinate or names[0])
    largest = max(1e-300, *(_errors(each, order)[:, i].max() for each in near))  # positive also of a fit without any error
    least = largest / 10**_DECADES
    widest = max(near, key=lambda each: each.delta).surface.start
    margin = _MARGIN * np.ptp(widest, axis=0)
    ends = np.stack([widest.min(axis=0) - margin, widest.max(axis=0) + margin], axis=1)
    values = [axis.values() for axis in one.surface.grid.axes.values()]
    seen = [(x >= low) & (x <= high) for x, (low, high) in zip(values, ends, strict=True)]
    shown = one.surface.on_grid(np.maximum(_errors(one, order)[:, i], least))[np.ix_(*seen)].T
    x, y = (x[inside] for x, inside in zip(values, seen, strict=True))
    norm = LogNorm(least, largest)
    mesh = ax.pcolormesh(x, y, shown, shading="nearest", cmap="viridis", norm=norm, rasterized=True)
    ax.set(xlim=ends[0], ylim=ends[1])
    if bar:
        _scale(mesh, [ax], names[i])
    ax.set_title(rf"$\delta = {one.delta:g}$")
    ax.text(0.04, 0.95, f"{len(one.surface.start)} states", va="top", transform=ax.transAxes)
    return dress(ax, (names[0], "k"), (names[1], "k"))


def _errors(near: NearDiagonals, order: str) -> Floats:
    """How far the fit of an order is off at each state, shape (M, n)."""
    start, target = unwrapped(near.surface)
    return np.abs(near.maps[order](start) - target)
