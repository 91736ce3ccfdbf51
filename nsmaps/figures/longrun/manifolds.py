"""Manifolds of saddles in the state space, over what a panel shows already, such as basins."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.dynamics.manifolds.manifold import Manifold
from nsmaps.figures.lines import cut
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, HALO, RED, dress

_LOOKS = {"unstable": (RED, 0.8), "stable": (BLACK, 1.0)}  #: colour and width


def sheets(found: Manifold | Sequence[Manifold], below: Callable[[Axes], Axes] | None = None) -> tuple[Sheet, ...]:
    """One sheet of one panel; `below` draws what lies below the manifolds."""
    return (Sheet("manifolds", (partial(_panel, found, below),), 1, 0.85, legend=True),)


def _panel(found: Manifold | Sequence[Manifold], below: Callable[[Axes], Axes] | None, ax: Axes) -> Axes:
    return manifolds(found, below(ax) if below else ax)


def manifolds(found: Manifold | Sequence[Manifold], ax: Axes) -> Axes:
    """The pieces of the unstable manifolds (red) and of the stable ones (black), the saddles marked; angles in one turn.

    An Axes on which something is drawn keeps its limits, and the entries of its legend.
    """
    found = [found] if isinstance(found, Manifold) else list(found)
    legend = ax.get_legend()
    below = ax.get_legend_handles_labels()[0] if legend is None else list(legend.legend_handles)
    limits = (ax.get_xlim(), ax.get_ylim()) if ax.has_data() else None
    for each in found:
        for piece in each.lines:
            colour, width = _LOOKS[each.which]
            ax.plot(*_within_a_turn(each, piece).T, color=colour, lw=width, path_effects=HALO)
    for each in found:
        ax.plot(*each.saddle.T, "X", color="white", ms=5.5, mec=BLACK, mew=0.8, ls="", zorder=4)
    kinds = dict.fromkeys(each.which for each in found)
    handles = [Line2D([], [], color=_LOOKS[which][0], lw=1.2, label=f"{which} manifold") for which in kinds]
    saddle = Line2D([], [], marker="X", color="white", mec=BLACK, mew=0.8, ls="", label="saddle")
    ax.legend(handles=[*below, *handles, saddle])
    if limits:
        ax.set(xlim=limits[0], ylim=limits[1])
    x, y = found[0].coordinates
    return dress(ax, (x, ""), (y, ""))


def _within_a_turn(each: Manifold, piece: Floats) -> Floats:
    """The states of a piece with their angles in one turn, interrupted where they leave it."""
    shown = each.coordinates.wrap(piece)
    for k in np.flatnonzero(each.coordinates.angles):
        broken = np.isnan(cut(shown[:, k], TWO_PI / 2))
        shown[broken] = np.nan
    return shown
