"""After how many returns each cell's states have all left its region, and what stays, with the periodic points known there."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.figures.cells.morse import show
from nsmaps.figures.data import TRANSIENT
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREEN, RED, dress, tint

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

MOST = 12  #: steps with a shade of their own; more have that of the last


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: steps to leave the region, and beside them steps to arrive, where the study has a closed set to arrive in."""
    made = TRANSIENT.of(result, "transient")
    panels = [partial(transient, result)] + ([partial(transient, result, arrives=True)] if made.arrived is not None else [])
    return (Sheet("transient", tuple(panels), len(panels), (6.8, 5.2)),)


def transient(result: "StudyResult", ax: Axes, arrives: bool = False) -> Axes:
    """Cells by the number of returns within which all their states have left their region, or with `arrives` have arrived.

    Red is what of which it is not shown; green, what has arrived from the start; crosses are known periodic points.
    """
    made = TRANSIENT.of(result, "transient")
    steps = made.left if not arrives or made.arrived is None else made.arrived
    steps = np.where((made.region < 0) & (steps != 0), -2, steps)
    most = int(min(max(steps.max(), 1), MOST))
    greens = tint(GREEN, 0.3), tint(RED, 0.25)
    blues: list[tuple[float, ...]] = [tuple(shade) for shade in colormaps["Blues"](np.linspace(0.15, 0.95, most))]
    number = np.select([steps == -1, steps == 0, steps > 0], [1, 0 if arrives else -1, 1 + np.minimum(steps, most)], -1)
    show(ax, made.cells, number, [*greens, *blues])
    _borders(ax, made.cells.window, made.region.reshape(made.cells.shape))
    points = made.points
    ax.plot(*points.T, "x", ms=6, mew=1.4, color="k", label="periodic points")
    if steps.max() > 0:
        scale = ScalarMappable(BoundaryNorm(np.arange(most + 1) + 0.5, most), ListedColormap(blues))
        bar = ax.figure.colorbar(scale, ax=ax, ticks=np.arange(1, most + 1))
        more = f" ({most}: or more)" if steps.max() > most else ""
        bar.set_label(f"returns until {'arrived' if arrives else 'left'}" + more)
    patches = [Patch(color=greens[1], label="not shown"), Patch(color=greens[0], label="target")]
    handles: list[Artist] = [*patches[: 1 + (arrives and bool((number == 0).any()))], *(ax.lines if len(points) else ())]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    ax.set(xlim=made.cells.window[0], ylim=made.cells.window[1])
    return dress(ax, (made.cells.coordinates[0], "k"), (made.cells.coordinates[1], "k"))


def _borders(ax: Axes, window: NDArray[np.float64], region: NDArray[np.int64]) -> None:
    """Lines between the regions."""
    x, y = (low + (high - low) * (np.arange(m) + 0.5) / m for (low, high), m in zip(window, region.shape, strict=True))
    for k in np.unique(region[region >= 0]):
        area = region == k
        if not area.all():
            ax.contour(x, y, area.T, levels=[0.5], colors="0.25", linewidths=0.7)
