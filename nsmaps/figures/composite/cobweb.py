"""Cobwebs of the composite map, a picture a coordinate: fig. glosmallic."""

import re
from collections.abc import Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.composite.areas import colours_over, pieces_on
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.lines import diagonal, ended, finite_states, last_tenth, staircase, window
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import position as place
from nsmaps.figures.style import HALO, MAGENTA, REST, dress, fill_of, piece_label
from nsmaps.reduced.composite.composite import CompositeMap, Piece

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair
    from nsmaps.dynamics.orbit import Orbit

_FINER = 10  #: parts of a cell of the grid in which the edges and the extremes of pieces are looked for
_REACH = 0.3  #: of the picture, beyond which images are cut off
_MOST = (10, 90)  #: per cent of the outline of an area that the picture holds, for fits may run away at an end


def sheets(composite: CompositeMap, grid: Grid, orbits: "Sequence[OrbitPair]") -> tuple[Sheet, ...]:
    """A sheet an orbit, the first's named `cobweb`, the second's `cobweb-2`, with a panel a coordinate."""
    drawn, of = [], partial(cobweb, composite, grid=grid, orbits=orbits)
    for k in range(len(orbits)):
        panels = tuple(partial(of, coordinate=c, number=k) for c in composite.coordinates)
        drawn.append(Sheet(file_of("cobweb", str(k + 1) if k else ""), panels, min(len(panels), 2), 0.85, legend=True))
    return tuple(drawn)


def cobweb(
    composite: CompositeMap, ax: Axes, grid: Grid, orbits: "Sequence[OrbitPair]", coordinate: str = "", number: int = 0
) -> Axes:
    """The cobweb of one coordinate of a composite orbit, with its last tenth in magenta; of one that ends, a cross at its end.

    A piece whose map is separable in this coordinate is a curve; of any other the area of its images is shaded, pale where the
    orbit does not visit it. An attractor that is small is enlarged in an inset. The picture holds the grid,
    the orbit and the curves as far as they stay near; what lies farther out is cut off.
    """
    i = place(composite.coordinates, coordinate or composite.coordinates[0])
    orbit, colours = composite_orbit(orbits, number), colours_over(composite, grid, orbits)
    states = finite_states(orbit)
    values, visited = states[:, i], np.unique(composite.piece_of(states[:-1]))
    draw_pieces(composite, ax, i, grid, colours, visited)
    ax.plot(*staircase(values), color="0.2", lw=0.8, zorder=4, path_effects=HALO, label="composite orbit")
    dots: dict[str, Any] = {"mfc": MAGENTA, "mec": "black", "mew": 0.5, "zorder": 6}
    low, high = ax.get_xlim()
    lasts = not ended(orbit)
    if lasts:
        _ends(ax, values)
    elif low <= values[-1] <= high:
        ax.plot(values[-1:], values[-1:], "X", ms=5.4, label="end", **dots)
    ax.plot(values[:1], values[:1], "o", mfc="white", mec="black", mew=0.8, ms=4.2, zorder=6, label="start")
    look(ax, values, composite.coordinates[i])
    ends = last_tenth(values)
    span = ax.get_xlim()

    def enlarged(inner: Axes) -> None:
        draw_pieces(composite, inner, i, grid, colours, visited)
        diagonal(inner, *span)
        _ends(inner, values)

    if lasts:
        inset(ax, np.column_stack([ends[:-1], ends[1:]]), enlarged)
    return ax


def _ends(ax: Axes, values: Floats) -> None:
    """The last tenth of a cobweb."""
    ends = last_tenth(values)
    ax.plot(*staircase(ends), "-", color=MAGENTA, lw=0.8, zorder=5)
    ax.plot(ends[:-1], ends[1:], "o", mfc=MAGENTA, mec="black", mew=0.5, ms=3.3, zorder=6, label="last tenth")


def composite_orbit(pairs: "Sequence[OrbitPair]", number: int = 0) -> "Orbit":
    """One orbit of the composite map, by position, or the error that says what to name."""
    if not 0 <= number < len(pairs):
        raise NsmapsError(f"there is no orbit {number + 1}; the result has {len(pairs)}")
    orbit = pairs[number].composite
    if orbit is None:
        raise NsmapsError("the figure 'cobweb' needs the orbit of the composite map; expected in the study: 'composite'")
    return orbit


def look(ax: Axes, values: Floats, name: str) -> Axes:
    """Limits, legend and labels; the limits hold the grid's interval of the coordinate and the orbit, and images near it."""
    angle = is_angle(name)
    interval = ax.get_xlim()
    lines = [np.ravel(line.get_ydata()) for line in ax.lines if line.get_label() != "_"]
    low, high = window(*interval, values, 1.0 if angle else _REACH)
    diagonal(ax, low, high)
    bottom, top = window(low, high, np.concatenate(lines), _REACH)
    for area in ax.collections:
        if area.get_label() != "_" and area.get_paths():
            ends = np.nanpercentile(np.concatenate([np.asarray(path.vertices)[:, 1] for path in area.get_paths()]), _MOST)
            bottom, top = window(bottom, top, ends, _REACH)
    whole = angle and interval[1] - interval[0] >= TWO_PI * (1 - 1e-9)
    margin = 0.0 if whole else 0.03 * (top - bottom)
    ax.set(xlim=(low, high), ylim=interval if whole else (bottom - margin, top + margin))
    handles, names = ax.get_legend_handles_labels()
    numbers = [re.match(r"\$\\mathcal\{R\}_\{(\d+)", name) for name in names]
    order = sorted(range(len(names)), key=lambda k: int(found[1]) if (found := numbers[k]) else np.inf)
    ax.legend([handles[k] for k in order], [names[k] for k in order])
    return dress(ax, (name, "k"), (name, "k+1"))


def draw_pieces(
    composite: CompositeMap, ax: Axes, i: int, grid: Grid, colours: Sequence[str], visited: Ints | None = None
) -> dict[int, list[Line2D | PolyCollection]]:
    """The images of every piece over a grid, against coordinate i; what was drawn, by the piece's number.

    With the numbers of those that are `visited` the areas of all others are pale. An angle is not wrapped, so that an area
    across the seam is not the whole circle: it is drawn on each turn.
    """
    if visited is not None:
        shown = [k in visited or _separable(piece, i) for k, piece in enumerate(composite.pieces)]
        colours = [colour if seen else REST for colour, seen in zip(colours, shown, strict=True)]
    axes = tuple(grid.axes.values())
    x = axes[i].values()
    ax.set_xlim(x[0], x[-1])
    angle = composite.coordinates.angles[i]
    drawn: dict[int, list[Line2D | PolyCollection]] = {}
    for k, (low, high, share) in _images(composite, axes, i).items():
        piece = composite.pieces[k]
        middle = TWO_PI * np.round((np.nanmedian(low + high) - x[0] - x[-1]) / 2 / TWO_PI) if angle else 0.0
        text = "_" if colours[k] == REST else piece_label(piece.name)
        # what is small, or visited, lies on top of what is large, or is not
        flat, above = _separable(piece, i), 2 - share - (colours[k] == REST)
        drawn[k] = [_draw(ax, x, low - middle, high - middle, flat, colours[k], text, above)]
        if angle:
            drawn[k] += [
                _draw(ax, x, low - middle + t, high - middle + t, flat, colours[k], "_", above) for t in (-TWO_PI, TWO_PI)
            ]
    if others := [k for k in drawn if colours[k] == REST]:
        ax.fill_between([], [], color=REST, lw=0, label="other pieces" if visited is not None else f"{len(others)} more pieces")
    return drawn


def _draw(
    ax: Axes, x: Floats, low: Floats, high: Floats, flat: bool, colour: str, text: str, above: float
) -> Line2D | PolyCollection:
    """The images of one piece: a line if they are those of one coordinate, else the area between them."""
    if flat:
        return ax.plot(x, low, color=colour, lw=1.3, label=text, zorder=1 + above)[0]
    return ax.fill_between(x, low, high, color=fill_of(colour), lw=0, label=text, zorder=above)


@lru_cache(maxsize=8)  # the panels of all orbits show the same
def _images(composite: CompositeMap, axes: tuple[Axis, ...], i: int) -> dict[int, tuple[Floats, Floats, float]]:
    """Of each piece that has states over the axes, by number: the extremes of its images, and its share of the states.

    The least and the largest at each point of coordinate i over all others, NaN where it has none, each of shape (m,).
    """
    grid = Grid(axes={str(k): axis for k, axis in enumerate(axes)})
    states, number, row = grid.states(), pieces_on(composite, grid), np.indices(grid.shape)[i].ravel()
    share = np.bincount(number + 1, minlength=len(composite.pieces) + 1)[1:] / len(number)
    shown = [int(k) for k in np.flatnonzero(share)]
    images = _of_pieces(composite, states, number, i)
    between, of = _between(grid, number, _extreme(grid.shape, number, images, shown, i), i)
    inner = composite.piece_once(between)
    images = np.concatenate([images, _of_pieces(composite, between, inner, i)])
    number, row = np.concatenate([number, inner]), np.concatenate([row, row[of]])
    ranges = {}
    for k in shown:
        own, (low, high) = number == k, np.full((2, grid.shape[i]), np.nan)
        np.fmin.at(low, row[own], images[own])
        np.fmax.at(high, row[own], images[own])
        ranges[k] = low, high, float(share[k])
    return ranges


def _of_pieces(composite: CompositeMap, states: Floats, number: Ints, i: int) -> Floats:
    """Coordinate i of the images of states (N, n) by their pieces, not wrapped, NaN where there is none, shape (N,)."""
    images = np.full(len(states), np.nan)
    for k in np.unique(number[number >= 0]):
        images[number == k] = composite.pieces[k].map(states[number == k])[:, i]
    return images


def _extreme(shape: tuple[int, ...], number: Ints, images: Floats, pieces: list[int], i: int) -> NDArray[np.bool_]:
    """Which grid points have the least or the largest image of their piece at their value of coordinate i, shape (N,)."""
    place = np.moveaxis(np.arange(len(number)).reshape(shape), i, 0).reshape(shape[i], -1)
    chosen = np.zeros(len(number), bool)
    for k in pieces:
        for rows in (np.where(number == k, sign * images, np.inf)[place] for sign in (1, -1)):
            chosen[np.take_along_axis(place, rows.argmin(axis=1)[:, np.newaxis], axis=1)] = True
    return chosen


def _between(grid: Grid, number: Ints, extreme: NDArray[np.bool_], i: int) -> tuple[Floats, Ints]:
    """States between the grid points beside which a piece ends or is extreme, not along coordinate i; the point before each."""
    place, states = np.arange(grid.size).reshape(grid.shape), grid.states()
    shares = np.arange(1, _FINER)[:, np.newaxis, np.newaxis] / _FINER
    parts = []
    for k in np.delete(np.arange(place.ndim), i):
        before, after = (np.delete(place, end, axis=k).ravel() for end in (-1, 0))
        asked = (number[before] != number[after]) | extreme[before] | extreme[after]
        before, after = before[asked], after[asked]
        parts.append((states[before] + shares * (states[after] - states[before]), np.tile(before, _FINER - 1)))
    return np.concatenate([each.reshape(-1, place.ndim) for each, _ in parts]), np.concatenate([of for _, of in parts])


def _separable(piece: Piece, i: int) -> bool:
    """Whether the image of coordinate i depends on coordinate i alone."""
    return not np.delete(piece.map.depends(piece.map.coordinates[i]), i).any()
