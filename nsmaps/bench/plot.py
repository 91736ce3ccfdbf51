"""The figure of a benchmark: error against time, a line a program."""

import re
from collections.abc import Iterator
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from nsmaps.bench.result import BenchResult, Row
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREEN, GREY, MAGENTA, OLIVE, ORANGE, RED, SKY

_COLOURS = (BLUE, ORANGE, GREEN, RED, MAGENTA, SKY, OLIVE, GREY)
_MARKERS = "osD^vPXphd"
_WIDE = 34  #: letters of a line of the legend, with which it has two columns
FLOOR = 1e-16  #: an error below it is drawn there


def error_against_time(result: BenchResult, ax: Axes) -> Axes:
    """Worst error against time of every program; a bar goes down to the error that 99 % of the returns stay below.

    A hollow marker: the program got a word of the grid or a hard case wrong.
    """
    for k, (family, rows) in enumerate(_families(result)):
        colour = BLACK if family == "nsmaps" else _COLOURS[k % len(_COLOURS)]
        time = np.array([row.microseconds for row in rows])
        worst, common = (np.maximum([getattr(row, name) for row in rows], FLOOR) for name in ("worst", "quantile"))
        right = np.array([row.wrong + row.wrong_hard == 0 for row in rows])
        ax.vlines(time, common, worst, color=colour, lw=0.6)
        ax.plot(time, worst, ":", color=colour, lw=0.6)
        for full in (True, False):
            face = colour if full else "white"
            marker = _MARKERS[k % len(_MARKERS)]
            ax.plot(time[right == full], worst[right == full], marker, mfc=face, mec=colour, ms=4.2, ls="none")
        ax.plot([], [], marker=_MARKERS[k % len(_MARKERS)], color=colour, ls=":", lw=0.6, label=_label(family, rows))
    ax.plot([], [], "|", color="0.3", ms=7.2, label="largest to 99 % of errors")
    ax.plot([], [], "o", mfc="white", mec="0.3", ls="none", label="hollow: not all words right")
    ax.set(xscale="log", yscale="log", xlabel="time (µs a return)", ylabel="error of speed or phase (rad)")
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.grid(color="0.9")
    ax.set_axisbelow(True)
    ax.legend()
    return ax


def _label(family: str, rows: list[Row]) -> str:
    """The program, and its settings as the markers stand from left to right."""
    settings = [row.setting for row in sorted(rows, key=lambda row: row.microseconds) if row.setting]
    text = f"{family}: {', '.join(settings)}" if settings else family
    return fill(re.sub(r"(\d)e-0?(\d+)", r"\1e−\2", text), _WIDE)


def _families(result: BenchResult) -> Iterator[tuple[str, list[Row]]]:
    """The rows that have an error to show, by family."""
    for family in dict.fromkeys(row.family for row in result.rows):
        rows = [row for row in result.rows if row.family == family and np.isfinite(row.worst)]
        if rows:
            yield family, rows


def sheet(result: BenchResult, name: str) -> Sheet:
    """The figure as a sheet, with the programs below it."""
    return Sheet(name, (lambda ax: error_against_time(result, ax),), 1, 0.6, legend=True)


def save(result: BenchResult, path: Path, dpi: float = 300) -> Path:
    """The figure in a file, whose suffix is its format."""
    return sheet(result, path.stem).save(path.parent, (path.suffix.lstrip(".") or "png",), dpi)[0]
