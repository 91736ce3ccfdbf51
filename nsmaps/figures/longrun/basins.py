"""Basins of attraction over a grid: where each start ends up, and after how many returns."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from nsmaps.arrays import Floats
from nsmaps.figures.data import BASINS, plane
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, dress, tint

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.attractor import Attractor
    from nsmaps.dynamics.attractors.basins import Basins
    from nsmaps.exact.surfaces.surface import Grid
    from nsmaps.study.result import StudyResult

COLOURS = (SKY, ORANGE, GREEN, MAGENTA, BLUE, RED)  #: of attractors, by their number
_MARKS = "oDs^vP"
_DECADE = 10  #: counts of returns that differ by more than this factor are shown on a logarithmic scale
_KINDS = {-1: ("unresolved", "0.6"), -2: ("ended", "0.15")}


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet of two panels, and two more of the composite map where the study has its basins."""
    maps = ("exact",) if result.reduced_basins is None else ("exact", "composite")
    panels = [partial(panel, result, of=of) for of in maps for panel in (basins, arrival)]
    return (Sheet("basins", tuple(panels), 2, 0.85, legend=True),)


def _of(result: "StudyResult", of: str) -> "Basins":
    """The basins of a map."""
    exact = BASINS.of(result, "basins")
    return exact if of == "exact" or result.reduced_basins is None else result.reduced_basins


def basins(result: "StudyResult", ax: Axes, of: str = "exact") -> Axes:
    """A colour for each basin, its attractor marked on it; what came to none is grey, what ended is black."""
    found = _of(result, of)
    same = result.same_attractor if of == "composite" and result.same_attractor is not None else np.arange(len(found.attractors))
    places = [int(number) if number >= 0 else -1 - k for k, number in enumerate(same.tolist())]
    present = [k for k in (*range(len(found.attractors)), *_KINDS) if (found.label == k).any()]
    colours = [_KINDS[k][1] if k < 0 else tint(COLOURS[places[k] % len(COLOURS)], 0.35) for k in present]
    numbers = np.select([found.label == k for k in present], range(len(present)), 0)
    _paint(ax, result, numbers, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(present) - 0.5)
    handles, shown = [], plane(_grid(result))
    for k, colour in zip(present, colours, strict=True):
        name = _KINDS[k][0] if k < 0 else f"{_motion(found.attractors[k])}"
        name = name if result.reduced_basins is None else f"{of}, {name}"
        handles.append(Patch(fc=colour, ec="0.3", label=f"{name}: {100 * np.mean(found.label == k):.3g} %"))
        if k >= 0:
            states, many = found.attractors[k].states, found.attractors[k].period == 0
            face = COLOURS[places[k] % len(COLOURS)]
            look = {"mfc": face, "mec": "black", "mew": 0.15 if many else 0.9, "ms": 2.2 if many else 7}
            ax.plot(*states[:, shown].T, _MARKS[places[k] % len(_MARKS)], ls="", **look)  # type: ignore[arg-type]
    ax.legend(handles=handles)
    return _titled(_dressed(ax, result), result, of)


def _titled(ax: Axes, result: "StudyResult", of: str) -> Axes:
    """The name of the map above a panel, where there are two."""
    if result.reduced_basins is not None:
        ax.set_title("composite map" if of == "composite" else result.system.map_name, loc="right")
    return ax


def _motion(attractor: "Attractor") -> str:
    """What an attractor is called: its motion and its period in returns."""
    period = f", period {attractor.period}" if attractor.period else ""
    return attractor.label.removesuffix(period) + period


def arrival(result: "StudyResult", ax: Axes, of: str = "exact") -> Axes:
    """Returns to arrive at the attractor; white where a start did not."""
    found = _of(result, of)
    shown = np.where(found.label >= 0, found.arrival, np.nan).astype(float)
    some = np.maximum(shown[np.isfinite(shown)], 1)
    if not len(some):
        ax.text(0.5, 0.5, "no start arrives", ha="center", va="center", transform=ax.transAxes)
        return _titled(_dressed(ax, result), result, of)
    scale = LogNorm(some.min(), some.max()) if some.max() > _DECADE * some.min() else None
    mesh = _paint(ax, result, np.maximum(shown, 1) if scale else shown, cmap="cividis", norm=scale)
    figure = ax.get_figure()
    assert figure is not None
    ticks: dict[str, Any] = {"ticks": LogLocator(subs=(1, 2, 5)), "format": "%d"} if scale else {}
    figure.colorbar(mesh, ax=ax, label="returns to arrive", **ticks).minorticks_off()
    return _titled(_dressed(ax, result), result, of)


def _paint(ax: Axes, result: "StudyResult", values: Floats, **look: Any) -> Any:
    """The values at the states of the grid as coloured cells."""
    x, y = (axis.values() for axis in _grid(result).varying.values())
    return ax.pcolormesh(x, y, values.reshape(len(x), len(y)).T, shading="nearest", rasterized=True, **look)


def _dressed(ax: Axes, result: "StudyResult") -> Axes:
    found = BASINS.of(result, "basins")
    first, second = _grid(result).varying.values()
    ax.set(xlim=(first.low, first.high), ylim=(second.low, second.high))
    x, y = (found.coordinates[k] for k in plane(_grid(result)))
    return dress(ax, (x, ""), (y, ""))


def _grid(result: "StudyResult") -> "Grid":
    """The grid of starts."""
    grid = BASINS.of(result, "basins").grid
    assert grid is not None
    return grid
