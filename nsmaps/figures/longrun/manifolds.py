"""Manifolds of saddles in the state space, over what a panel shows already, such as basins."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.dynamics.manifolds.manifold import Manifold
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.lines import cut
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, HALO, RED, dress

_LOOKS = {"unstable": (RED, 0.9), "stable": (BLACK, 1.0)}  #: colour and width
_AROUND = 0.05  #: of the sides of the picture, on either side of the saddle that is enlarged

Below = Callable[[Axes], Axes]


def sheets(found: Manifold | Sequence[Manifold], below: Below | None = None) -> tuple[Sheet, ...]:
    """One sheet of one panel; `below` draws what lies below the manifolds."""
    return (Sheet("manifolds", (partial(_panel, found, below),), 1, 0.85, legend=True),)


def _panel(found: Manifold | Sequence[Manifold], below: Below | None, ax: Axes) -> Axes:
    """The manifolds, and enlarged the saddle farthest from the frame that has both a stable and an unstable one."""
    found = [found] if isinstance(found, Manifold) else list(found)
    manifolds(found, below(ax) if below else ax)
    of = {which: np.concatenate([each.saddle for each in found if each.which == which] or [np.empty((0, 2))]) for which in _LOOKS}
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    both = of["stable"][np.isin(of["stable"], of["unstable"]).all(axis=1)]
    if len(both):
        shares = (both - low) / (high - low)
        at = both[np.minimum(shares, 1 - shares).min(axis=1).argmax()]
        window = at + np.array([[-1], [1]]) * _AROUND * (high - low)
        inset(ax, window, lambda inner: manifolds(found, below(inner) if below else inner))
    return ax


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
            halo = HALO if each.which == "stable" else ()
            ax.plot(*_within_a_turn(each, piece).T, color=colour, lw=width, path_effects=halo)
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
