"""The state space by word and by piece: fig. regions, panels (a) and (b)."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from nsmaps.exact.impacts import Floats
from nsmaps.exact.surface import Grid
from nsmaps.figures.needs import Drawable, composite_of, surfaces_of
from nsmaps.figures.sheet import Sheet
from nsmaps.figures.style import BLUE, dress, family_colours, piece_colours, piece_label, tint

if TYPE_CHECKING:
    from nsmaps.reduced.composite import CompositeMap


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet: the words, and beside them the pieces where there is a composite map."""
    surfaces_of(result, "words")
    panels = [partial(words, result)] + ([partial(pieces, result)] if result.composite else [])
    return (Sheet("words", tuple(panels), len(panels)),)


def words(result: Drawable, ax: Axes) -> Axes:
    """The state space by the family of each start's return; starts in no family stay white.

    The hull of the states near the diagonals, over all values of the swept parameter, is outlined (eq. r1uniond).
    """
    surfaces = surfaces_of(result, "words")
    first = next(iter(surfaces.values()))
    grid = first.grid
    number = np.full(grid.size, -1)
    for k, surface in enumerate(surfaces.values()):
        number[surface.member] = k
    colours = family_colours(list(surfaces))
    paint(ax, grid, number, [tint(colour, 0.25) for colour in colours.values()])
    handles: list[Patch] = [Patch(color=tint(colour, 0.25), label=name) for name, colour in colours.items()]
    if result.diagonal is not None and len(result.diagonal.start):
        (left, right), (low, high) = result.diagonal.box
        outline = Rectangle((left, low), right - left, high - low, fill=False, ec=BLUE, lw=2.2, label="near diagonals")
        ax.add_patch(outline)
        handles.append(outline)
    if (number < 0).any():
        handles.append(Patch(fc="white", ec="0.7", lw=0.8, label="other"))
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(len(handles), 3), frameon=False)
    return dress(ax, (first.coordinates[0], "k"), (first.coordinates[1], "k"))


def pieces(result: Drawable, ax: Axes) -> Axes:
    """The state space by the first piece of the composite map that holds each state (eq. compositemapM)."""
    composite = composite_of(result, "words")
    first = next(iter(surfaces_of(result, "words").values()))
    paint_pieces(ax, composite, first.grid)
    if np.any(composite.piece_of(first.grid.states()) < 0):
        handle = Patch(fc="none", ec="0.6", hatch="////", lw=0, label="in no piece")
        ax.legend(handles=[handle], loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return dress(ax, (first.coordinates[0], "k"), (first.coordinates[1], "k"))


def paint_pieces(ax: Axes, composite: "CompositeMap", grid: Grid, beside: Floats | None = None) -> None:
    """The pieces as pale areas with their names in them, beside the given points (N, 2); uncovered states are hatched."""
    states = grid.states()
    number = composite.piece_of(states)
    colours = piece_colours(*zip(*((piece.name, not piece.word) for piece in composite.pieces), strict=True))
    paint(ax, grid, number, [tint(colour, 0.65) for colour in colours])
    taken = np.zeros(grid.shape, bool) if beside is None else _near(grid, beside)
    for k, piece in enumerate(composite.pieces):
        area = (number == k).reshape(grid.shape)
        if area.any():
            x, y = states[inmost(area & ~taken if (area & ~taken).any() else area)]
            ax.text(x, y, piece_label(piece.name), ha="center", va="center", fontsize=12, color="0.15", zorder=3)
    if np.any(number < 0):
        first, second = (axis.values() for axis in grid.axes.values())
        empty = (number < 0).reshape(grid.shape).T
        hatch = ax.contourf(first, second, empty, levels=[0.5, 1.5], colors="none", hatches=["////"], zorder=1)
        hatch.set(edgecolor="0.6", linewidth=0)


def paint(ax: Axes, grid: Grid, number: NDArray[np.integer], colours: list[tuple[float, float, float]]) -> None:
    """Cells of the grid in the colour of their number; negative numbers are left white."""
    first, second = (axis.values() for axis in grid.axes.values())
    shown = np.ma.masked_less(number.reshape(grid.shape).T, 0)
    top = len(colours) - 0.5
    ax.pcolormesh(first, second, shown, cmap=ListedColormap(colours), vmin=-0.5, vmax=top, rasterized=True, zorder=0)


def _near(grid: Grid, points: Floats, share: float = 0.045) -> NDArray[np.bool_]:
    """The cells within this share of the picture of any of the points (N, 2), shape of the grid."""
    near = np.zeros(grid.shape, bool)
    low, high = (np.array([getattr(axis, end) for axis in grid.axes.values()]) for end in ("low", "high"))
    last = np.array(grid.shape) - 1
    middle = (points - low) / (high - low) * last
    reach = share * last
    for start, stop in zip(*(np.clip(middle + s * reach, 0, last + 1).astype(int) for s in (-1, 1)), strict=True):
        near[tuple(map(slice, start, stop))] = True
    return near


def inmost(area: NDArray[np.bool_]) -> int:
    """The flat index of the cell farthest from the edge of an area: cells are peeled off until none is left."""
    while True:
        padded = np.pad(area, 1)
        left = area & padded[2:, 1:-1] & padded[:-2, 1:-1] & padded[1:-1, 2:] & padded[1:-1, :-2]
        if not left.any():
            inside = np.flatnonzero(area)
            return int(inside[len(inside) // 2])
        area = left
