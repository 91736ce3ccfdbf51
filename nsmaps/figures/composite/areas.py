"""Areas of the state space: cells in colours, the pieces of a composite map, and names where there is room for them."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt, minimum_filter

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.lines import finite_states, last_tenth
from nsmaps.figures.style import HALO, MOST, PIECES, REST, SIZE, extent_of, fill_of, piece_colours, piece_label
from nsmaps.reduced.composite.composite import CompositeMap

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair

_POINTS = 72.0  #: an inch
_PADDING = 1.25  #: of a name's width and height, which must be free
POINTS = 401  #: per axis, so that the cells of a picture are smaller than its lines
_HALVINGS = 12  #: of a cell, after which the edge is known to a thousandth of the line that shows it


def colours_over(composite: CompositeMap, grid: Grid, orbits: "Sequence[OrbitPair]" = ()) -> list[str]:
    """A colour a piece of the composite map, the same in all figures of a result; resets are white.

    Of more than eight pieces with a word, those have a colour in which the orbits end, then the largest; all others are grey.
    """
    pieces = composite.pieces
    fitted = [k for k, piece in enumerate(pieces) if piece.word]
    if len(fitted) <= MOST:
        return piece_colours([piece.name for piece in pieces], [not piece.word for piece in pieces])
    states = grid.states()
    size = np.bincount(composite.piece_once(states) + 1, minlength=len(pieces) + 1)[1:]
    for pair in orbits:
        if pair.composite is not None:
            size[np.setdiff1d(composite.piece_once(last_tenth(finite_states(pair.composite))), [-1])] += len(states)
    first = sorted(sorted(fitted, key=lambda k: -size[k])[:MOST])
    return [PIECES[first.index(k)] if k in first else REST if piece.word else "#FFFFFF" for k, piece in enumerate(pieces)]


def paint_pieces(
    ax: Axes,
    composite: CompositeMap,
    colours: Sequence[str],
    grid: Grid,
    beside: Floats | None = None,
    only: Ints | None = None,
) -> None:
    """The pieces over the window of a grid, with straight edges, named where there is room beside the given points (N, 2).

    Only some have a colour if their numbers are given. Uncovered states are hatched.
    """
    fine = finer(grid)
    number = pieces_on(composite, fine)
    fills = [fill_of(colour if only is None or k in only else "#FFFFFF") for k, colour in enumerate(colours)]
    paint(ax, fine, number, fills)
    draw_borders(ax, piece_borders(composite, fine))
    name_pieces(ax, fine, number, [piece.name for piece in composite.pieces], beside)
    if np.any(number < 0):
        hatch_area(ax, fine, (number < 0).reshape(fine.shape))


def name_pieces(ax: Axes, grid: Grid, number: Ints, names: Sequence[str], beside: Floats | None = None) -> None:
    """Write the names of pieces into what they hold of a grid, by their numbers, where there is room beside points (N, 2)."""
    taken = np.zeros(grid.shape, bool) if beside is None else _near(grid, beside)
    for k, name in enumerate(map(piece_label, names)):
        area = (number == k).reshape(grid.shape)
        name_area(ax, grid, area & ~taken, name) or name_area(ax, grid, area, name)


def hatch_area(ax: Axes, grid: Grid, area: NDArray[np.bool_]) -> None:
    """Hatches over an area, of the grid's shape."""
    first, second = (axis.values() for axis in grid.axes.values())
    hatch = ax.contourf(first, second, area.T, levels=[0.5, 1.5], colors="none", hatches=["////"], zorder=1)
    hatch.set(edgecolor="0.6", linewidth=0)


def finer(grid: Grid) -> Grid:
    """The grid of as many points an axis as a picture has, over the same window."""
    return Grid(axes={name: Axis(low=axis.low, high=axis.high, points=POINTS) for name, axis in grid.axes.items()})


def piece_borders(composite: CompositeMap, grid: Grid) -> Floats:
    """The lines between the pieces over a grid, as segments (M, 2, 2)."""
    return _borders_over(composite, tuple(grid.axes.values()))


@lru_cache(maxsize=4)
def _borders_over(composite: CompositeMap, axes: tuple[Axis, ...]) -> Floats:
    grid = Grid(axes={str(k): axis for k, axis in enumerate(axes)})
    return borders(grid, pieces_on(composite, grid), composite.piece_once)


def borders(grid: Grid, number: Ints, number_of: Callable[[Floats], Ints]) -> Floats:
    """The lines between areas of a plane by number, as segments (M, 2, 2) with their ends bisected between neighbours.

    `number` is that of each state of the grid, shape (N,), `number_of` that of any states (K, 2). In each cell of the grid a line
    joins the two points at which its sides are cut; of three or more each is joined to their mean.
    """
    place, states = np.arange(grid.size).reshape(grid.shape), grid.states()
    sides = [(place[:-1], place[1:]), (place[:, :-1], place[:, 1:])]
    across, along = (_cuts(states, number, before, after, number_of) for before, after in sides)
    corners = np.stack([across[:, :-1], across[:, 1:], along[:-1], along[1:]], axis=2).reshape(-1, 4, 2)
    cut = np.isfinite(corners[..., 0])
    count = cut.sum(axis=1)
    pairs = corners[count == 2][cut[count == 2]].reshape(-1, 2, 2)
    many = count > 2
    middle = np.nanmean(corners[many], axis=1, keepdims=True)
    spokes = np.stack([corners[many], np.broadcast_to(middle, corners[many].shape)], axis=2)
    return np.concatenate([pairs, spokes[cut[many]]])


def _cuts(states: Floats, number: Ints, before: Ints, after: Ints, number_of: Callable[[Floats], Ints]) -> Floats:
    """Where the number changes between neighbours, given by position in shape S: shape (*S, 2), NaN where it does not."""
    cuts = np.full((*before.shape, 2), np.nan)
    changed = number[before] != number[after]
    low, high, here = states[before[changed]], states[after[changed]], number[before[changed]]
    for _ in range(_HALVINGS if len(here) else 0):
        middle = (low + high) / 2
        same = (number_of(middle) == here)[:, np.newaxis]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    cuts[changed] = (low + high) / 2
    return cuts


def draw_borders(ax: Axes, segments: Floats, color: str = "0.25", lw: float = 0.5) -> None:
    """Segments (M, 2, 2) as one collection of lines."""
    ax.add_collection(LineCollection(list(segments), colors=color, linewidths=lw, capstyle="round", zorder=1.5), autolim=False)


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


def name_area(ax: Axes, grid: Grid, area: NDArray[np.bool_], name: str, sizes: tuple[float, ...] = (SIZE,)) -> bool:
    """Write a name into an area, of the grid's shape, in the first type size, in points, that fits; whether one does."""
    axes = np.array([ax.bbox.width, ax.bbox.height]) * _POINTS / ax.figure.dpi
    for size in sizes:
        cells = np.ceil(_PADDING * np.array(extent_of(name, size)) / axes * grid.shape).astype(int) + 1
        middles = minimum_filter(area, size=tuple(cells), mode="constant", cval=False)
        if middles.any():
            x, y = grid.states()[inmost(middles)]
            ax.text(x, y, name, ha="center", va="center", fontsize=size, color="black", zorder=8, path_effects=HALO)
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
