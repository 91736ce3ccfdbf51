"""The regions that the general algorithm found, over the state space: as fig. regions, with the names R_{n.m} of section 4.1."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.exact.surfaces.surface import Grid
from nsmaps.figures.composite.areas import name_area, outline, paint, pieces_on
from nsmaps.figures.data import PARTITION, SURFACES
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREY, dress, family_colours, tint

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_ABOVE = 5  #: entries of a legend above the picture; one of more stands beside it


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("partition", (partial(partition, result),), 1, 0.80),)


def partition(result: "StudyResult", ax: Axes) -> Axes:
    """The state space by region: attracting ones blue, transient ones in the colour of their word, with lines between them."""
    found = PARTITION.of(result, "partition")
    grid = next(iter(SURFACES.of(result, "partition").values())).grid
    pieces = found.composite.pieces
    number = pieces_on(found.composite, grid)
    words = list(dict.fromkeys(piece.word for piece in pieces if piece.word))
    colours = {"attracting": tint(BLUE, 0.45)} | {word: tint(c, 0.75) for word, c in family_colours(words).items()}
    order = {name: k for k, name in enumerate(colours)}
    kinds = [order.get("attracting" if piece.name in found.attracting else piece.word, -1) for piece in pieces]
    kind = np.array([*kinds, -1])[number]
    paint(ax, grid, kind, list(colours.values()))
    names = {row.name.partition(".")[0]: row.name[1:] for row in found.table()}
    for k, piece in enumerate(pieces):
        _name(ax, grid, (number == k).reshape(grid.shape), names.get(piece.name, ""))
    shown = {name: colour for name, colour in colours.items() if (kind == order[name]).any()}
    handles = [Patch(color=colour, label=name) for name, colour in shown.items() if colour != tint(GREY, 0.75)]
    if more := len(shown) - len(handles):
        handles.append(Patch(color=tint(GREY, 0.75), label=f"{more} more words"))
    beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": len(handles)}
    ax.legend(handles=handles, frameon=False, **(beside if len(handles) > _ABOVE else above))
    return dress(ax, (found.composite.coordinates[0], "k"), (found.composite.coordinates[1], "k"))


def _name(ax: Axes, grid: Grid, area: NDArray[np.bool_], name: str) -> None:
    """An outline around an area, and its name in it if there is room."""
    outline(ax, grid, area, color="0.25", lw=0.4)
    name_area(ax, grid, area, rf"$\mathcal{{R}}_{{{name}}}$", (10, 7))
