"""Bifurcation curves of periodic orbits in the plane of two parameters, with their points of codimension two."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.dynamics.curves.curve import BifurcationCurve
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, dress

if TYPE_CHECKING:
    from collections.abc import Mapping

    Curves = Mapping[str, BifurcationCurve]

LINES = ("-", "--", ":", "-.")
MARKS = {"cusp": "^", "fold-flip": "s", "1:1 resonance": "o", "1:2 resonance": "D", "1:3 resonance": "v", "1:4 resonance": "P"}


def sheets(found: BifurcationCurve) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("curves", (partial(curves, found),), 1, 0.75, legend=True, share=0.75),)


def curves(found: BifurcationCurve, ax: Axes) -> Axes:
    """One curve by its kind, with marks at its points of codimension two."""
    if not len(found.parameters):
        raise NsmapsError(f"the curve has no orbits: {found.ended[0]}")
    low, high = found.parameters.min(axis=0), found.parameters.max(axis=0)
    margin = 0.06 * (high - low)
    ax.set(xlim=(low[0] - margin[0], high[0] + margin[0]), ylim=(low[1] - margin[1], high[1] + margin[1]))
    ax.legend(handles=draw_curves(ax, {found.kind: found}))
    return dress(ax, (found.names[0], ""), (found.names[1], ""))


def draw_curves(ax: Axes, curves: "Curves") -> list[Line2D]:
    """Draw curves within the limits of the axes, by name; the lines and marks that a legend names."""
    limits = ax.get_xlim(), ax.get_ylim()
    named: list[Line2D] = []
    for (name, curve), line in zip(curves.items(), LINES * len(curves), strict=False):
        ax.plot(*curve.parameters.T, color="#FFFFFF", lw=1.9)
        named += ax.plot(*curve.parameters.T, line, color=BLACK, lw=0.8, label=name)
    special = [point for curve in curves.values() for point in curve.special]
    for kind in dict.fromkeys(point.kind for point in special):
        places = np.array([point.parameters for point in special if point.kind == kind])
        named += ax.plot(*places.T, MARKS[kind], ms=4, color="#FFFFFF", mec=BLACK, mew=0.8, label=kind)
    ax.set(xlim=limits[0], ylim=limits[1])
    return named
