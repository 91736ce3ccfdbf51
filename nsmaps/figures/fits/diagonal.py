"""Where the states near the diagonals lie at one value of a parameter, within those at all values: fig. R1compared."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.figures.lines import diagonal as identity
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import BLUE, GREEN, dress, symbol, tint
from nsmaps.reduced.fit.filter import DiagonalRegion

_SHOWN = 3  #: values of the parameter, at most, where the study names none: the first, the middle and the last


def sheets(region: DiagonalRegion, parameter: str = "", shown: Sequence[float] = ()) -> tuple[Sheet, ...]:
    """One sheet: values of the parameter as rows, coordinates as columns."""
    values = np.array([value for value, _ in region.values])
    rows = np.unique(np.ceil(np.linspace(0, len(values) - 1, _SHOWN)).astype(int)).tolist()
    if shown:
        rows = [int(np.argmin(np.abs(values - value))) for value in shown]
    panels = tuple(
        partial(diagonal, region, coordinate=c, value=row, parameter=parameter) for row in rows for c in region.coordinates
    )
    return (Sheet("diagonal", panels, len(region.coordinates), 0.84, legend=True),)


def diagonal(region: DiagonalRegion, ax: Axes, coordinate: str = "", value: int = 0, parameter: str = "") -> Axes:
    """Images against starts of the states near the diagonals at one value of the parameter, by position, green.

    Blue below them: those at any value (eq. r1uniond). Dotted: the ratios delta and 1/delta of an image to its start.
    """
    i = position(region.coordinates, coordinate or region.coordinates[0])
    name, delta, values = region.coordinates[i], region.delta, [each for each, _ in region.values]
    here = np.column_stack([region.values[value][1][:, i], region.images[value][:, i]])
    starts = [states for _, states in region.values]
    union = np.column_stack([np.concatenate(parts)[:, i] for parts in (starts, region.images)])
    if parameter:
        low, high = min(values), max(values)
        _dots(ax, union, tint(BLUE, 0.35), f"{len(values)} values of {symbol(parameter)} in [{low:g}, {high:g}]")
        ax.set_title(f"{symbol(parameter)} = {values[value]:g}")
    _dots(ax, here, GREEN, f"one value of {symbol(parameter)}" if parameter else "the study's own parameters")
    low, high = _window(union)
    identity(ax, low, high).set(label="_", zorder=4)
    for ratio, text in ((delta, rf"ratio ${delta:g}^{{\pm 1}}$"), (1 / delta, "_")):
        ax.plot([low, high], [ratio * low, ratio * high], color="0.45", lw=0.6, ls=":", label=text, zorder=2)
    ax.set(xlim=(low, high), ylim=(low, high))
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+1"))


def _dots(ax: Axes, points: Floats, colour: Any, text: str) -> None:
    """Points (M, 2), and one larger in the legend."""
    ax.plot(*points.T, "o", ms=1.6, mew=0, color=colour, rasterized=True, zorder=3)
    ax.plot([], [], "s", ms=4.2, mew=0, color=colour, label=text)


def _window(points: Floats) -> tuple[float, float]:
    """An interval a little wider than all starts and images."""
    low, high = points.min(), points.max()
    margin = 0.05 * (high - low)
    return float(low - margin), float(high + margin)
