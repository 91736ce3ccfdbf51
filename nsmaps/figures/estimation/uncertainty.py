"""The distributions of quantities of a system whose parameters are uncertain, and what they are due to."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.estimation.uncertainty import Uncertainty
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREY, ORANGE, label

BINS = 24


def sheets(found: Uncertainty) -> tuple[Sheet, ...]:
    """One sheet: the distribution of each quantity, and its Sobol indices where they were computed."""
    panels = [partial(uncertainty, found, number=k) for k in range(len(found.quantities))]
    if found.first_order is not None:
        panels += [partial(indices, found, number=k) for k in range(len(found.quantities))]
    return (Sheet("uncertainty", tuple(panels), min(len(panels), 2)),)


def uncertainty(found: Uncertainty, ax: Axes, number: int = 0) -> Axes:
    """The distribution of one quantity, with its median and the interval of 90 %."""
    values = found.values[:, number]
    ax.hist(values[np.isfinite(values)], bins=BINS, color=BLUE, alpha=0.6)
    for k, dashes in ((0, ":"), (2, "-"), (4, ":")):
        ax.axvline(found.quantiles[k, number], color=GREY, lw=0.8, ls=dashes)
    ax.set_xlabel(found.quantities[number])
    ax.set_ylabel("draws")
    return ax


def indices(found: Uncertainty, ax: Axes, number: int = 0) -> Axes:
    """The Sobol indices of one quantity: of first order, and total."""
    places = np.arange(len(found.names))
    for table, shift, colour, name in ((found.first_order, -0.2, BLUE, "first order"), (found.total_order, 0.2, ORANGE, "total")):
        if table is not None:
            ax.bar(places + shift, table[number], 0.38, color=colour, label=name)
    ax.set_xticks(places, [label(name) for name in found.names])
    ax.set_ylabel(f"Sobol index of {found.quantities[number]}")
    ax.legend()
    return ax
