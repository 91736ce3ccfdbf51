"""Error against time of the map that a partition made, beside the time of the exact map."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREY, ORANGE, RED
from nsmaps.reduced.validation.speed import Speed


def sheets(
    speed: Speed, errors: Mapping[str, float] | None = None, tolerance: float | None = None, title: str = "exact map"
) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    of = partial(speed_error, speed, errors=errors, tolerance=tolerance, title=title)
    return (Sheet("speed_error", (of,), 1, 0.6 if errors else 0.35, legend=True),)


def speed_error(
    speed: Speed,
    ax: Axes,
    errors: Mapping[str, float] | None = None,
    tolerance: float | None = None,
    title: str = "exact map",
) -> Axes:
    """The largest errors at held-out states against the time a state, with the tolerance and the exact map's time as lines.

    Errors of closed forms are shown by the role of their pieces, those of strips by the distance of the states from an edge.
    Left of the exact map's time a map is worth its error. The exact map has none here: it is what the others are held against.
    Without errors both times are bars.
    """
    if errors is None or tolerance is None:
        return _bars(speed, ax, title)
    errors = {label: error for label, error in errors.items() if np.isfinite(error) and error > 0}
    looks = ((BLUE, "o"), (RED, "s"))
    for (label, error), (colour, marker) in zip(errors.items(), looks, strict=False):
        ax.plot([speed.composite], [error], marker, color=colour, ms=5.4, ls="none", label=label, zorder=3)
    ax.axvline(speed.exact, color=ORANGE, lw=1.2, label=f"time of the {title}")
    ax.axhline(tolerance, color=GREY, ls="--", label="tolerance")
    times, levels = (speed.composite, speed.exact), (tolerance, *errors.values())
    ax.set(xscale="log", yscale="log", xlim=(min(times) / 3, 3 * max(times)), ylim=(min(levels) / 5, 5 * max(levels)))
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter("{x:g}")
    ax.grid(color="0.9", zorder=0)
    ax.legend()
    ax.set(xlabel="processor time per state (ns)", ylabel="largest error\n(of a speed, or rad)")
    return ax


def _bars(speed: Speed, ax: Axes, title: str) -> Axes:
    """The times of both maps."""
    times = {title: speed.exact, "composite map": speed.composite}
    ax.barh(list(times), list(times.values()), color=[ORANGE, BLUE], height=0.55)
    for place, time in enumerate(times.values()):
        ax.annotate(f"{time:.3g} ns", (time, place), xytext=(3, 0), textcoords="offset points", va="center")
    ax.set_xlim(0, 1.2 * max(times.values()))
    ax.set_xlabel("processor time per state (ns)")
    return ax
