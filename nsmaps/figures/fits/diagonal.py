"""Where the states near the diagonals lie at one value of a parameter, within those at all values: fig. R1compared."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.figures.data import DIAGONAL, position, section
from nsmaps.figures.lines import diagonal as identity
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, dress, symbol, tint

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_SHOWN = 3  #: values of the parameter, at most, where the study names none: the first, the middle and the last


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: values of the parameter as rows, coordinates as columns."""
    region = DIAGONAL.of(result, "diagonal")
    values, asked = np.array([value for value, _ in region.values]), result.study.diagonal
    rows = np.unique(np.ceil(np.linspace(0, len(values) - 1, _SHOWN)).astype(int)).tolist()
    if asked is not None and asked.shown:
        rows = [int(np.argmin(np.abs(values - value))) for value in asked.shown]
    panels = tuple(partial(diagonal, result, coordinate=c, value=row) for row in rows for c in region.coordinates)
    return (Sheet("diagonal", panels, len(region.coordinates), 0.84, legend=True),)


def diagonal(result: "StudyResult", ax: Axes, coordinate: str = "", value: int = 0) -> Axes:
    """Images against starts of the states near the diagonals at one value of the parameter, by position, green.

    Blue below them: those at any value (eq. r1uniond). Dotted: the ratios delta and 1/delta of an image to its start.
    """
    region = DIAGONAL.of(result, "diagonal")
    i = position(region.coordinates, coordinate or region.coordinates[0])
    name, delta, sweep = region.coordinates[i], region.delta, section(result.study.diagonal, "diagonal").sweep
    here = np.column_stack([region.values[value][1][:, i], region.images[value][:, i]])
    starts = [states for _, states in region.values]
    union = np.column_stack([np.concatenate(parts)[:, i] for parts in (starts, region.images)])
    if sweep is not None:
        low, high = sorted((sweep.low, sweep.high))
        _dots(ax, union, tint(BLUE, 0.35), f"{sweep.points} values of {symbol(sweep.parameter)} in [{low:g}, {high:g}]")
        ax.set_title(f"{symbol(sweep.parameter)} = {region.values[value][0]:g}")
    _dots(ax, here, GREEN, "the study's own parameters" if sweep is None else f"one value of {symbol(sweep.parameter)}")
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
