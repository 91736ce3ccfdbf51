"""The pieces of the composite map by name, as areas of the state space: fig. regions, panel (b)."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.figures.composite.areas import colours_of, finer, paint_pieces, pieces_on
from nsmaps.figures.data import COMPOSITE, SURFACES
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import REST, dress, fill_of, piece_label

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("regions", (partial(regions, result),), 1, 0.66, legend=True),)


def regions(result: "StudyResult", ax: Axes) -> Axes:
    """Each state in the colour of the first piece that holds it (eq. compositemapM), lines between pieces.

    The window is that of the grid. The legend has their words and shares of the window, and that of what is in no piece.
    """
    composite = COMPOSITE.of(result, "regions")
    grid = finer(next(iter(SURFACES.of(result, "regions").values())).grid)
    paint_pieces(ax, result, "regions", grid)
    number = pieces_on(composite, grid)
    colours = colours_of(result, "regions")
    handles = []
    for k, (piece, colour) in enumerate(zip(composite.pieces, colours, strict=True)):
        own = number == k
        if not own.any() or colour == REST:
            continue
        text = f"{piece_label(piece.name)}{f', {piece.word}' if piece.word else ''}: {100 * own.mean():.3g} %"
        handles.append(Patch(fc=fill_of(colour), ec="0.25", lw=0.5, label=text))
    resets = np.isin(number, [k for k, colour in enumerate(colours) if colour == REST])
    if resets.any():
        text = f"{len(np.unique(number[resets]))} more: {100 * resets.mean():.3g} %"
        handles.append(Patch(fc=REST, ec="0.25", lw=0.5, label=text))
    if np.any(number < 0):
        handles.append(Patch(fc="none", ec="0.6", hatch="////", lw=0, label=f"in no piece: {100 * np.mean(number < 0):.3g} %"))
    ax.legend(handles=handles)
    return dress(ax, (composite.coordinates[0], "k"), (composite.coordinates[1], "k"))
