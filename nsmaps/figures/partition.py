"""The regions that the general algorithm found, over the state space: as fig. regions, with the names R_{n.m} of section 4.1."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.exact.surface import Grid
from nsmaps.figures.needs import Drawable, partition_of, surfaces_of
from nsmaps.figures.sheet import Sheet
from nsmaps.figures.style import BLUE, dress, family_colours, tint
from nsmaps.figures.words import inmost, paint

SMALL = 0.003  #: share of the picture below which a region is not named


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    partition_of(result, "partition")
    surfaces_of(result, "partition")
    return (Sheet("partition", (partial(partition, result),), 1, (7.0, 5.6)),)


def partition(result: Drawable, ax: Axes) -> Axes:
    """The state space by region: attracting ones blue, transient ones in the colour of their word, with lines between them."""
    made = partition_of(result, "partition")
    grid = next(iter(surfaces_of(result, "partition").values())).grid
    pieces = made.composite.pieces
    number = made.composite.piece_of(grid.states())
    words = list(dict.fromkeys(piece.word for piece in pieces if piece.word))
    colours = {"attracting": tint(BLUE, 0.45)} | {word: tint(c, 0.75) for word, c in family_colours(words).items()}
    order = {name: k for k, name in enumerate(colours)}
    kinds = [order.get("attracting" if piece.name in made.attracting else piece.word, -1) for piece in pieces]
    kind = np.array([*kinds, -1])[number]
    paint(ax, grid, kind, list(colours.values()))
    names = {row.name.partition(".")[0]: row.name[1:] for row in made.table()}
    for k, piece in enumerate(pieces):
        _name(ax, grid, (number == k).reshape(grid.shape), names.get(piece.name, ""))
    handles = [Patch(color=colour, label=name) for name, colour in colours.items() if (kind == order[name]).any()]
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(handles), frameon=False)
    return dress(ax, (made.composite.coordinates[0], "k"), (made.composite.coordinates[1], "k"))


def _name(ax: Axes, grid: Grid, area: NDArray[np.bool_], name: str) -> None:
    """An outline around an area, and its name in it if there is room."""
    if area.any() and not area.all():
        first, second = (axis.values() for axis in grid.axes.values())
        ax.contour(first, second, area.T, levels=[0.5], colors="0.25", linewidths=0.6)
    if area.mean() > SMALL:
        x, y = grid.states()[inmost(area)]
        size = 10 if area.mean() > 3 * SMALL else 7
        ax.text(x, y, rf"$\mathcal{{R}}_{{{name}}}$", ha="center", va="center", fontsize=size, color="0.1", zorder=3)
