"""The regions that the general algorithm found, over the state space: as fig. regions, with the attracting ones framed."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.exact.surfaces.surface import Grid
from nsmaps.figures.composite.areas import borders, colours_over, draw_borders, finer, name_area, paint, piece_borders, pieces_on
from nsmaps.figures.composite.regions import window_of
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, dress, fill_of, piece_label
from nsmaps.reduced.partition.result import PartitionResult

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair


def sheets(found: PartitionResult, grid: Grid | None = None, orbits: "Sequence[OrbitPair]" = ()) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("partition", (partial(partition, found, grid=grid, orbits=orbits),), 1, 0.66, legend=True),)


def partition(found: PartitionResult, ax: Axes, grid: Grid | None = None, orbits: "Sequence[OrbitPair]" = ()) -> Axes:
    """The state space by region, in the colours and with the names of the other figures, attracting regions in a thick frame.

    Where there are several words, each region is named with its own. The window is that of the grid, or else holds the data of
    all fits.
    """
    grid = finer(grid or window_of(found.composite))
    composite, pieces = found.composite, found.composite.pieces
    number = pieces_on(composite, grid)
    paint(ax, grid, number, [fill_of(colour) for colour in colours_over(composite, grid, orbits)])
    draw_borders(ax, piece_borders(composite, grid))
    attracts = np.array([*(piece.name in found.attracting for piece in pieces), False])
    draw_borders(ax, borders(grid, attracts[number], lambda states: attracts[composite.piece_once(states)]), BLACK, 1.4)
    words = list(dict.fromkeys(piece.word for piece in pieces if piece.word))
    for k, piece in enumerate(pieces):
        area, name = (number == k).reshape(grid.shape), piece_label(piece.name)
        both = f"{name}\n{piece.word}" if len(words) > 1 and piece.word else name
        name_area(ax, grid, area, both) or name_area(ax, grid, area, name)
    frame = Patch(fc="none", ec=BLACK, lw=1.4, label="attracting")
    word = [Patch(fc="none", ec="none", label=f"every word is {words[0]}")] if len(words) == 1 else []
    ax.legend(handles=[frame] * bool(attracts[number].any()) + word)
    return dress(ax, (composite.coordinates[0], "k"), (composite.coordinates[1], "k"))
