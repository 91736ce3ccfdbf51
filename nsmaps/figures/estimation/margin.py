"""The distance of a motion from the boundary of its basin: points on it, and the least distance at draws of the parameters."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.estimation.margin import BasinDistance
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREY, label

BINS = 16


def sheets(found: BasinDistance) -> tuple[Sheet, ...]:
    """One sheet: the boundary, and the least distances."""
    return (Sheet("margin", (partial(boundary, found), partial(least, found)), 2),)


def boundary(found: BasinDistance, ax: Axes) -> Axes:
    """The motion and the points where directions leave its basin, over the first two coordinates."""
    across = [0, 1] if len(found.state) > 1 else [0, 0]
    x, y = found.points[:, across].T
    for a, b in zip(x, y, strict=True):
        ax.plot([found.state[across[0]], a], [found.state[across[1]], b], color=GREY, lw=0.5)
    ax.plot(x, y, "o", ms=3, mew=0, color=BLUE, label="boundary of the basin")
    ax.plot(*found.state[across], "+", ms=7, color=BLACK, label=found.label)
    ax.set_xlabel(label(found.coordinates[across[0]]))
    ax.set_ylabel(label(found.coordinates[across[1]]))
    ax.legend()
    return ax


def least(found: BasinDistance, ax: Axes) -> Axes:
    """The least distance at the draws, and at the estimate."""
    known = found.least[np.isfinite(found.least)]
    if len(known):
        ax.hist(known, bins=np.histogram_bin_edges(known, BINS).tolist(), color=BLUE)
    ax.axvline(float(found.distances.min()), color=BLACK, lw=0.8, ls="--", label="estimate")
    ax.set_xlabel("least distance, in units of the motion's extent")
    ax.set_ylabel("draws")
    ax.legend()
    return ax
