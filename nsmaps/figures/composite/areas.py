"""Areas of the state space: cells in colours, the pieces of a composite map, and names where there is room for them."""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.textpath import TextPath
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt, minimum_filter

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.data import COMPOSITE, SURFACES
from nsmaps.figures.lines import finite_states, last_tenth
from nsmaps.figures.style import MOST, PIECES, REST, piece_colours, piece_label, tint
from nsmaps.reduced.composite.composite import CompositeMap

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_POINTS = 72.0  #: an inch
_PADDING = 1.25  #: of a name's width and height, which must be free


def colours_of(result: "StudyResult", figure: str) -> list[str]:
    """A colour a piece of the composite map, the same in all figures of a result; resets are white.

    Of more than eight pieces with a word, those have a colour in which the orbits end, then the largest; all others are grey.
    """
    pieces = COMPOSITE.of(result, figure).pieces
    fitted = [k for k, piece in enumerate(pieces) if piece.word]
    if len(fitted) <= MOST:
        return piece_colours([piece.name for piece in pieces], [not piece.word for piece in pieces])
    number = COMPOSITE.of(result, figure).piece_once
    states = next(iter(SURFACES.of(result, figure).values())).grid.states()
    size = np.bincount(number(states) + 1, minlength=len(pieces) + 1)[1:]
    for pair in result.orbits:
        if pair.composite is not None:
            size[np.setdiff1d(number(last_tenth(finite_states(pair.composite))), [-1])] += len(states)
    first = sorted(sorted(fitted, key=lambda k: -size[k])[:MOST])
    return [PIECES[first.index(k)] if k in first else REST if piece.word else "#FFFFFF" for k, piece in enumerate(pieces)]


def paint_pieces(ax: Axes, result: "StudyResult", figure: str, grid: Grid, beside: Floats | None = None) -> None:
    """The pieces as pale areas, named where there is room, beside the given points (N, 2); uncovered states are hatched."""
    composite = COMPOSITE.of(result, figure)
    number = pieces_on(composite, grid)
    colours = colours_of(result, figure)
    paint(ax, grid, number, [tint(colour, 0.0 if colour == REST else 0.65) for colour in colours])
    taken = np.zeros(grid.shape, bool) if beside is None else _near(grid, beside)
    for k, piece in enumerate(composite.pieces):
        area = (number == k).reshape(grid.shape)
        name_area(ax, grid, area & ~taken, piece_label(piece.name)) or name_area(ax, grid, area, piece_label(piece.name))
        if colours[k] == REST:
            outline(ax, grid, area, color="white", lw=0.7)
    if np.any(number < 0):
        first, second = (axis.values() for axis in grid.axes.values())
        empty = (number < 0).reshape(grid.shape).T
        hatch = ax.contourf(first, second, empty, levels=[0.5, 1.5], colors="none", hatches=["////"], zorder=1)
        hatch.set(edgecolor="0.6", linewidth=0)


def pieces_on(composite: CompositeMap, grid: Grid) -> Ints:
    """The number of the piece of each state of a grid; a last row at 2 pi is the edge of the circle and not phase zero."""
    return _pieces_over(composite, tuple(grid.axes.values()))


@lru_cache(maxsize=4)  # several figures show the same
def _pieces_over(composite: CompositeMap, axes: tuple[Axis, ...]) -> Ints:
    states = Grid(axes={str(k): axis for k, axis in enumerate(axes)}).states()
    below = np.where(composite.coordinates.angles & (states == TWO_PI), np.nextafter(TWO_PI, 0), states)
    number = composite.piece_once(below)
    number.flags.writeable = False
    return number


def outline(ax: Axes, grid: Grid, area: NDArray[np.bool_], color: str, lw: float) -> None:
    """A line around an area, of the grid's shape, where it does not end with the picture."""
    if area.any() and not area.all():
        ax.contour(*(axis.values() for axis in grid.axes.values()), area.T, levels=[0.5], colors=color, linewidths=lw)


def name_area(ax: Axes, grid: Grid, area: NDArray[np.bool_], name: str, sizes: tuple[float, ...] = (12, 9)) -> bool:
    """Write a name into an area, of the grid's shape, in the first type size, in points, that fits; whether one does."""
    axes = np.array([ax.bbox.width, ax.bbox.height]) * _POINTS / ax.figure.dpi
    for size in sizes:
        text = TextPath((0, 0), name, size=size).get_extents()
        cells = np.ceil(_PADDING * np.array([text.width, text.height]) / axes * grid.shape).astype(int) + 1
        middles = minimum_filter(area, size=tuple(cells), mode="constant", cval=False)
        if middles.any():
            x, y = grid.states()[inmost(middles)]
            ax.text(x, y, name, ha="center", va="center", fontsize=size, color="0.15", zorder=3)
            return True
    return False


def paint(ax: Axes, grid: Grid, number: NDArray[np.integer], colours: list[tuple[float, float, float]]) -> None:
    """Cells of the grid in the colour of their number; negative numbers are left white."""
    first, second = (axis.values() for axis in grid.varying.values())
    shown = np.ma.masked_less(number.reshape(len(first), len(second)).T, 0)
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
    """The flat index of the cell farthest from the edge of an area, in steps to neighbours; the middle one of several."""
    distance = distance_transform_cdt(np.pad(area, 1), metric="taxicab")[1:-1, 1:-1]
    farthest = np.flatnonzero(distance == distance.max())
    return int(farthest[len(farthest) // 2])
