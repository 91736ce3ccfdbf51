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
    ends = np.minimum(found.distances, found.reach)[:, None] * found.directions * found.unit
    (x, y), (a, b) = ((*each, 0 * each[0])[:2] for each in (found.state, ends.T))
    ax.plot([x + 0 * a, x + a], [y + 0 * b, y + b], color=GREY, lw=0.5)
    known = np.isfinite(found.distances)
    ax.plot(x + a[known], y + b[known], "o", ms=3, mew=0, color=BLUE, label="boundary of the basin")
    ax.plot(x, y, "+", ms=7, color=BLACK, label=found.label)
    ax.set_xlabel(label(found.coordinates[0]))
    ax.set_ylabel(label(found.coordinates[1]) if len(found.state) > 1 else "")
    ax.legend()
    return ax


def least(found: BasinDistance, ax: Axes) -> Axes:
    """The least distance at the draws, and at the estimate."""
    known = found.least[np.isfinite(found.least)]
    if len(known):
        ax.hist(known, bins=np.histogram_bin_edges(known, BINS).tolist(), color=BLUE)
    center = float(found.distances.min())
    name = "estimate" if np.isfinite(center) else f"estimate: beyond {found.reach:.3g}"
    ax.axvline(min(center, found.reach), color=BLACK, lw=0.8, ls="--", label=name)
    ax.set_xlabel("least distance, in extents")
    ax.set_ylabel("draws")
    ax.legend()
    return ax
