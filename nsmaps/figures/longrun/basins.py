"""Basins of attraction over a grid: where each start ends up, and after how many returns."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from nsmaps.arrays import Floats, Ints
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.basins import BasinBoundary, Basins
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.parts import plane
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, dress, tint

COLOURS = (SKY, ORANGE, GREEN, MAGENTA, BLUE, RED)  #: of attractors, by their number
_MARKS = "oDs^vP"
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
    colours = [_KINDS[k][1] if k < 0 else tint(COLOURS[places[k] % len(COLOURS)], 0.35) for k in present]
    numbers = np.select([found.label == k for k in present], range(len(present)), 0)
    _paint(ax, found, numbers, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(present) - 0.5)
    handles, shown = [], plane(_grid(found))
    for k, colour in zip(present, colours, strict=True):
        name = _KINDS[k][0] if k < 0 else f"{_motion(found.attractors[k])}"
        name = f"{title.removesuffix(' map')}, {name}" if title else name
        handles.append(Patch(fc=colour, ec="0.3", label=f"{name}: {100 * np.mean(found.label == k):.3g} %"))
        if k >= 0:
            states, many = found.attractors[k].states, found.attractors[k].period == 0
            face = COLOURS[places[k] % len(COLOURS)]
            look = {"mfc": face, "mec": "black", "mew": 0.15 if many else 0.9, "ms": 2.2 if many else 7}
            ax.plot(*states[:, shown].T, _MARKS[places[k] % len(_MARKS)], ls="", **look)  # type: ignore[arg-type]
    ax.legend(handles=handles)
    return _dressed(ax, found, title)


def _motion(attractor: Attractor) -> str:
    """What an attractor is called: its motion and its period in returns."""
    period = f", period {attractor.period}" if attractor.period else ""
    return attractor.label.removesuffix(period) + period


def arrival(found: Basins, ax: Axes, title: str = "") -> Axes:
    """Returns to arrive at the attractor; white where a start did not."""
    shown = np.where(found.label >= 0, found.arrival, np.nan).astype(float)
    some = np.maximum(shown[np.isfinite(shown)], 1)
    if not len(some):
        ax.text(0.5, 0.5, "no start arrives", ha="center", va="center", transform=ax.transAxes)
        return _dressed(ax, found, title)
    scale = LogNorm(some.min(), some.max()) if some.max() > _DECADE * some.min() else None
    mesh = _paint(ax, found, np.maximum(shown, 1) if scale else shown, cmap="cividis", norm=scale)
    figure = ax.get_figure()
    assert figure is not None
    ticks: dict[str, Any] = {"ticks": LogLocator(subs=(1, 2, 5)), "format": "%d"} if scale else {}
    figure.colorbar(mesh, ax=ax, label="returns to arrive", **ticks).minorticks_off()
    return _dressed(ax, found, title)


def _paint(ax: Axes, found: Basins, values: Floats, **look: Any) -> Any:
    """The values at the states of the grid as coloured cells."""
    x, y = (axis.values() for axis in _grid(found).varying.values())
    return ax.pcolormesh(x, y, values.reshape(len(x), len(y)).T, shading="nearest", rasterized=True, **look)


def _dressed(ax: Axes, found: Basins, title: str) -> Axes:
    first, second = _grid(found).varying.values()
    ax.set(xlim=(first.low, first.high), ylim=(second.low, second.high))
    ax.set_title(title, loc="right")
    x, y = (found.coordinates[k] for k in plane(_grid(found)))
    return dress(ax, (x, ""), (y, ""))


def _grid(found: Basins) -> Grid:
    """The grid of starts; NsmapsError where there is none."""
    if found.grid is None:
        raise NsmapsError("the starts of these basins are not on a grid; expected: basins of a Grid, which can be drawn")
    return found.grid
