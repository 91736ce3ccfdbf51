"""The number of returns after which all states of a cell have left its region, with known periodic points."""

from functools import partial

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

from nsmaps.cells.times import ExitTimes
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.cells.morse_sets import show
from nsmaps.figures.composite.areas import name_pieces
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREEN, RED, dress, tint

MOST = 12  #: numbers of returns with a shade of their own; larger ones have the last shade


def sheets(times: ExitTimes) -> tuple[Sheet, ...]:
    """One sheet: steps to leave the region, and steps to arrive, if the study has a closed target set."""
    panels = [partial(exit_times, times)] + ([partial(exit_times, times, arrives=True)] if times.arrived is not None else [])
    return (Sheet("exit_times", tuple(panels), len(panels), 0.85 if len(panels) > 1 else 0.6, legend=True),)


def exit_times(times: ExitTimes, ax: Axes, arrives: bool = False) -> Axes:
    """Cells by the number of returns within which all their states have left their region, or with `arrives` have arrived.

    Cells for which this is not shown are red, cells that have arrived from the start green; crosses are known periodic points.
    """
    steps = times.left if not arrives or times.arrived is None else times.arrived
    steps = np.where((times.region < 0) & (steps != 0), -2, steps)
    shades = int(min(max(steps.max(), 1), MOST))
    greens = tint(GREEN, 0.35), tint(RED, 0.05)  # which differ in print without colour, too
    blues: list[tuple[float, ...]] = [tuple(shade) for shade in colormaps["Blues"](np.linspace(0.15, 0.95, shades))]
    number = np.select([steps == -1, steps == 0, steps > 0], [1, 0 if arrives else -1, 1 + np.minimum(steps, shades)], -1)
    show(ax, times.cells, number, [*greens, *blues])
    _borders(ax, times)
    points = times.points
    ax.plot(*points.T, "x", ms=3.6, mew=0.8, color="k", label="periodic points")
    if steps.max() > 0:
        scale = ScalarMappable(BoundaryNorm(np.arange(shades + 1) + 0.5, shades), ListedColormap(blues))
        bar = ax.figure.colorbar(scale, ax=ax, ticks=np.arange(1, shades + 1))
        bar.set_label(f"returns until {'arrived' if arrives else 'left'}")
        if steps.max() > shades:
            bar.ax.set_yticklabels([*map(str, range(1, shades)), f"{shades}+"])
    patches = [Patch(color=greens[1], label="not proved"), Patch(color=greens[0], label="target")]
    handles: list[Artist] = [*patches[: 1 + (arrives and bool((number == 0).any()))], *(ax.lines if len(points) else ())]
    ax.legend(handles=handles)
    ax.set(xlim=times.cells.box[0], ylim=times.cells.box[1])
    return dress(ax, (times.cells.coordinates[0], "k"), (times.cells.coordinates[1], "k"))


def _borders(ax: Axes, times: ExitTimes) -> None:
    """Lines between the regions, and their names where there is room."""
    sizes = zip(times.cells.coordinates, times.cells.box, times.cells.shape, strict=True)
    halves = ((name, ends, m, np.ptp(ends) / (2 * m)) for name, ends, m in sizes)
    grid = Grid(axes={name: Axis(low=low + half, high=high - half, points=m) for name, (low, high), m, half in halves})
    x, y = (axis.values() for axis in grid.axes.values())
    if (times.region == times.region[0]).all():
        return
    for k in np.unique(times.region[times.region >= 0]):
        ax.contour(x, y, (times.region == k).reshape(grid.shape).T, levels=[0.5], colors="0.25", linewidths=0.4)
    name_pieces(ax, grid, times.region, times.regions, times.points)
