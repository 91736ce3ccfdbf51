"""Basins of attraction over a grid: where each start ends up, and after how many returns."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.basins import BasinBoundary, Basins
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.figures.attractors.poincare import name_of
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.parts import plane
from nsmaps.figures.style import BLACK, BLUE, BROWN, GREEN, MAGENTA, ORANGE, SKY, dress, tint

COLOURS = (SKY, ORANGE, GREEN, MAGENTA, BLUE, BROWN)  #: of attractors, by their number
FILLS = {SKY: 0.8, ORANGE: 0.42, GREEN: 0.36}  #: of white in the colours of basins, so that they differ in lightness, too
_MARKS = "oDs^vP"
_SHOWN = (0.02, 0.95)  #: quantiles of the counts of returns, the ends of their colours
_DECADE = 10  #: counts of returns that differ by more than this factor are shown on a logarithmic scale
_KINDS = {-1: ("unresolved", "0.6"), -2: ("ended", "0.15")}


Found = Basins | Mapping[str, Basins]  #: of one map, or of several by title, the exact one first


def sheets(found: Found | BasinBoundary, same: Ints | None = None) -> tuple[Sheet, ...]:
    """One sheet of two panels for each map.

    Args:
        same: for each attractor of the second map the index of that of the first which it is on, or -1; its colour is the same.
    """
    if isinstance(found, BasinBoundary):
        return (Sheet("boundary", (partial(basins, found),), 1, legend=True),)
    several = found if isinstance(found, Mapping) else {"": found}
    if any(each.grid is None for each in several.values()):
        return ()
    panels = list[Panel]()
    for (title, each), numbers in zip(several.items(), (None, same), strict=False):
        panels += [partial(basins, each, title=title, same=numbers), partial(arrival, each, title=title)]
    return (Sheet("basins", tuple(panels), 2, 0.85, legend=True),)


def basins(found: Basins | BasinBoundary, ax: Axes, title: str = "", same: Ints | None = None) -> Axes:
    """A colour for each basin, its attractor marked on it; what came to none is grey, what ended is black.

    Of a boundary its points are dots.

    Args:
        title: of the map.
        same: for each attractor the number that gives its colour, or -1 for another one; its index if omitted.
    """
    if isinstance(found, BasinBoundary):
        ax.plot(*found.points.T[:2], ".", color=BLACK, ms=2, label="boundary of basins")
        ax.legend()
        return dress(ax, (found.coordinates[0], ""), (found.coordinates[1], ""))
    same = np.arange(len(found.attractors)) if same is None else same
    places = [int(number) if number >= 0 else -1 - k for k, number in enumerate(same.tolist())]
    present = [k for k in (*range(len(found.attractors)), *_KINDS) if (found.label == k).any()]
    colours = [_KINDS[k][1] if k < 0 else basin_colour(COLOURS[places[k] % len(COLOURS)]) for k in present]
    numbers = np.select([found.label == k for k in present], range(len(present)), 0)
    _paint(ax, found, numbers, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(present) - 0.5)
    handles, shown = list[Artist](), plane(_grid(found))
    for k, colour in zip(present, colours, strict=True):
        name = _KINDS[k][0] if k < 0 else f"{_motion(found.attractors[k])}"
        name = f"{title.removesuffix(' map')}, {name}" if title else name
        handles.append(Patch(fc=colour, ec="0.3", label=f"{name}: {100 * np.mean(found.label == k):.3g} %"))
        if k >= 0:
            states, many = found.attractors[k].states, found.attractors[k].period == 0
            face = COLOURS[places[k] % len(COLOURS)]
            look = {"mfc": face, "mec": "black", "mew": 0.15 if many else 0.9, "ms": 2.2 if many else 7}
            ax.plot(*states[:, shown].T, _MARKS[places[k] % len(_MARKS)], ls="", **look)  # type: ignore[arg-type]
    if len(found.attractors):
        handles.append(Line2D([], [], marker="o", mfc="white", mec=BLACK, mew=0.9, ls="", label="states of the attractors"))
    ax.legend(handles=handles)
    return _dressed(ax, found, title)


def basin_colour(colour: str) -> tuple[float, float, float]:
    """The colour of the basin of an attractor of a colour."""
    return tint(colour, FILLS.get(colour, 0.0))


def _motion(attractor: Attractor) -> str:
    """What an attractor is called: its motion and its period in returns."""
    period = f", period {attractor.period}" if attractor.period else ""
    return name_of(attractor).removesuffix(period) + period


def arrival(found: Basins, ax: Axes, title: str = "") -> Axes:
    """Returns to arrive at the attractor; white where a start did not."""
    shown = np.where(found.label >= 0, found.arrival, np.nan).astype(float)
    some = np.maximum(shown[np.isfinite(shown)], 1)
    if not len(some):
        ax.text(0.5, 0.5, "no start arrives", ha="center", va="center", transform=ax.transAxes)
        return _dressed(ax, found, title)
    low, high = (max(1.0, float(end)) for end in np.quantile(some, _SHOWN))
    scale = LogNorm(low, high) if high > _DECADE * low else Normalize(low, high)
    mesh = _paint(ax, found, np.maximum(shown, 1), cmap="cividis", norm=scale)
    figure = ax.get_figure()
    assert figure is not None
    ticks: dict[str, Any] = {"ticks": LogLocator(subs=(1, 2, 5)), "format": "%d"} if isinstance(scale, LogNorm) else {}
    beyond = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    ends = beyond[bool(some.min() < low), bool(some.max() > high)]
    figure.colorbar(mesh, ax=ax, label="returns to arrive", extend=ends, **ticks).minorticks_off()
    return _dressed(ax, found, title)


def _paint(ax: Axes, found: Basins, values: Floats, **look: Any) -> Any:
    """The values at the states of the grid as coloured cells."""
    sides, shown = _sides(found), values.reshape(tuple(axis.points for axis in _grid(found).varying.values()))
    for k in np.flatnonzero(_turns(found)):  # half of the first cell is at the end of the turn
        sides[k, 1] += np.ptp(sides[k]) / shown.shape[k]
        shown = np.concatenate([shown, np.take(shown, [0], axis=k)], axis=k)
    (left, right), (low, high) = sides.tolist()
    return ax.imshow(
        shown.T, origin="lower", extent=(left, right, low, high), aspect="auto", interpolation="nearest", zorder=0, **look
    )


def _sides(found: Basins) -> Floats:
    """The outer sides of the cells around the states of the grid, shape (2, 2)."""
    axes = list(_grid(found).varying.values())
    half = [(axis.high - axis.low) / (axis.points - 1) / 2 for axis in axes]
    return np.array([[axis.low - h, axis.high + h] for axis, h in zip(axes, half, strict=True)])


def _turns(found: Basins) -> NDArray[np.bool_]:
    """Which of the two coordinates are angles of a whole turn, without its last state, which is its first."""
    names = [found.coordinates[k] for k in plane(_grid(found))]
    spans = np.ptp(_sides(found), axis=1)
    return np.array([is_angle(name) for name in names]) & (np.abs(spans / TWO_PI - 1) < 1e-9)


def _dressed(ax: Axes, found: Basins, title: str) -> Axes:
    names = [found.coordinates[k] for k in plane(_grid(found))]
    ends = [(axis.low, axis.high) for axis in _grid(found).varying.values()]
    for k in np.flatnonzero(_turns(found)):
        ends[k] = ends[k][0], ends[k][0] + TWO_PI
    ax.set(xlim=ends[0], ylim=ends[1])
    ax.set_title(title, loc="right")
    return dress(ax, (names[0], ""), (names[1], ""))


def _grid(found: Basins) -> Grid:
    """The grid of starts; NsmapsError where there is none."""
    if found.grid is None:
        raise NsmapsError("the starts of these basins are not on a grid; expected: basins of a Grid, which can be drawn")
    return found.grid
