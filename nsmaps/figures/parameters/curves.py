"""Bifurcation curves of periodic orbits in the plane of two parameters, with their points of codimension two."""

from functools import partial

from matplotlib.axes import Axes

from nsmaps.dynamics.curves.curve import BifurcationCurve
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import Sheet
from nsmaps.figures.parameters.stability import draw_curves
from nsmaps.figures.style import dress


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
