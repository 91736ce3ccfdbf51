"""Errors of polynomials near the diagonals against their order, for several delta: table TableDeltaErr."""

from collections.abc import Sequence
from functools import partial
from typing import Literal

import numpy as np
from matplotlib.axes import Axes

from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import LOOKS, symbol
from nsmaps.reduced.fit.filter_errors import NearDiagonals

Statistic = Literal["r2", "sse"]


def sheets(found: NearDiagonals | Sequence[NearDiagonals]) -> tuple[Sheet, ...]:
    """One sheet: 1 - R2 above the sums of squared errors, coordinates as columns."""
    coordinates = ([found] if isinstance(found, NearDiagonals) else found)[0].surface.coordinates
    rows: tuple[Statistic, ...] = ("r2", "sse")
    panels = tuple(partial(orders, found, coordinate=name, statistic=row) for row in rows for name in coordinates)
    return (Sheet("orders", panels, len(coordinates), 0.72, legend=True),)


def orders(found: NearDiagonals | Sequence[NearDiagonals], ax: Axes, coordinate: str = "", statistic: Statistic = "r2") -> Axes:
    """1 - R2 or SSE of one coordinate, logarithmic, against the order of the polynomial, a line a delta.

    Orders stand by their number of terms. Near one R2 itself shows nothing, so that what it lacks of one is drawn.
    """
    near = [found] if isinstance(found, NearDiagonals) else found
    i = position(near[0].surface.coordinates, coordinate or near[0].surface.coordinates[0])
    name = near[0].surface.coordinates[i]
    names = sorted(near[0].maps, key=lambda order: len(near[0].maps[order].exponents[i]))
    for k, one in enumerate(near):
        reports = [one.maps[order].report for order in names]
        values = [1 - report.r2[i] if statistic == "r2" else report.sse[i] for report in reports if report]
        colour, dashes, marker = LOOKS[k % len(LOOKS)]
        text = rf"$\delta = {one.delta:g}$ ({len(one.surface.start)} states)"
        ax.plot(range(len(names)), np.abs(values), color=colour, ls=dashes, marker=marker, ms=3.6, label=text)
    ax.set_yscale("log")
    ax.set_xticks(range(len(names)), names)
    ax.set_xlabel("polynomials")
    ax.set_xlim(-0.3, len(names) - 0.7)
    ax.grid(axis="y", color="0.9", zorder=0)
    ax.legend()
    image = symbol(name, "k+1")
    ax.set_ylabel(f"$1 - R^2$ of {image}" if statistic == "r2" else f"SSE of {image}")
    return ax
