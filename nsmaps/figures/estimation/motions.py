"""The motions of a record at draws of the parameters, with the nearest events."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.estimation.classification import Motions
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, GREY, MOTIONS, label

BINS = 16


def sheets(found: Motions) -> tuple[Sheet, ...]:
    """One sheet with a panel a parameter."""
    panels = tuple(partial(motions, found, number=k) for k in range(len(found.names)))
    return (Sheet("motions", panels, min(len(panels), 2)),)


def motions(found: Motions, ax: Axes, number: int = 0) -> Axes:
    """The draws of one parameter by the motion that the record ends on, and the nearest events as lines."""
    name, values = found.names[number], found.draws[:, number]
    kinds = list(found.shares)
    parts = [values[found.labels == kind] for kind in kinds]
    colours = [MOTIONS[k % len(MOTIONS)] for k in range(len(kinds))]
    names = [f"{kind}: {100 * found.shares[kind]:.0f} %" for kind in kinds]
    ax.hist(parts, bins=np.histogram_bin_edges(values, BINS).tolist(), stacked=True, color=colours, label=names)
    reach = np.ptp(values)
    for kind, at in zip(
        *(each[found.margins.parameter == name] for each in (found.margins.kind, found.margins.value)), strict=True
    ):
        if abs(at - values.mean()) < 3 * reach:
            ax.axvline(at, color=BLACK, lw=0.8, ls="--")
            ax.annotate(kind, (at, 0.98), xycoords=("data", "axes fraction"), rotation=90, ha="right", va="top", color=GREY)
    ax.set_xlabel(label(name))
    ax.set_ylabel("draws")
    ax.legend()
    return ax
