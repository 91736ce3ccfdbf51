"""Manifolds of saddles in the state space, over the basins or the words where the result has them."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.figures.data import MANIFOLDS
from nsmaps.figures.lines import cut
from nsmaps.figures.longrun.basins import basins
from nsmaps.figures.page import Sheet
from nsmaps.figures.returns.words import words
from nsmaps.figures.style import BLACK, BLUE, RED, dress

if TYPE_CHECKING:
    from nsmaps.dynamics.manifolds.manifold import Manifold
    from nsmaps.study.result import StudyResult

_LOOKS = {"unstable": (RED, "-"), "stable": (BLUE, "-")}


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet of one panel."""
    return (Sheet("manifolds", (lambda ax: manifolds(result, ax),), 1, 0.85, legend=True),)


def manifolds(result: "StudyResult", ax: Axes) -> Axes:
    """The pieces of the unstable manifolds (red) and of the stable ones (blue), the saddles marked; angles in one turn."""
    found = [each for some in MANIFOLDS.of(result, "manifolds").values() for each in some]
    if result.basins is not None:
        basins(result, ax)
    elif result.surfaces:
        words(result, ax)
    below = ax.get_legend_handles_labels()[0] if ax.get_legend() is None else list(ax.get_legend().legend_handles)  # type: ignore[union-attr]
    limits = (ax.get_xlim(), ax.get_ylim()) if below else None
    for each in found:
        colour, line = _LOOKS[each.which]
        for piece in each.lines:
            shown = _within_a_turn(each, piece)
            ax.plot(shown[:, 0], shown[:, 1], line, color=colour, lw=0.8)
    for each in found:
        ax.plot(*each.saddle.T, "X", color=BLACK, ms=5, mec="white", mew=0.6, ls="")
    handles = [Line2D([], [], color=_LOOKS[which][0], lw=1.2, label=f"{which} manifold") for which in _named(found)]
    saddle = Line2D([], [], marker="X", color=BLACK, ls="", label="saddle")
    ax.legend(handles=[*below, *handles, saddle])
    if limits:
        ax.set(xlim=limits[0], ylim=limits[1])
    x, y = found[0].coordinates
    return dress(ax, (x, ""), (y, ""))


def _named(found: "list[Manifold]") -> list[str]:
    """The kinds of manifolds that are drawn."""
    return list(dict.fromkeys(each.which for each in found))


def _within_a_turn(each: "Manifold", piece: Floats) -> Floats:
    """The states of a piece with their angles in one turn, interrupted where they leave it."""
    shown = each.coordinates.wrap(piece)
    for k in np.flatnonzero(each.coordinates.angles):
        broken = np.isnan(cut(shown[:, k], TWO_PI / 2))
        shown[broken] = np.nan
    return shown
