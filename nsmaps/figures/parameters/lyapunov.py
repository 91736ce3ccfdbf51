"""Lyapunov exponents over a parameter, with their errors."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, ORANGE, label

if TYPE_CHECKING:
    from nsmaps.dynamics.lyapunov import LyapunovSweep

_COLOURS = (BLUE, ORANGE, "0.45")


def sheets(result: "LyapunovSweep") -> tuple[Sheet, ...]:
    """One sheet of two panels: per return and per unit of time; of one where a return takes a unit, as those of maps do."""
    kinds = (False,) if np.array_equal(result.exponents, result.per_time, equal_nan=True) else (False, True)
    panels = tuple(partial(lyapunov, result, per_time=per_time) for per_time in kinds)
    return (Sheet("lyapunov", panels, len(panels), legend=True),)


def lyapunov(result: "LyapunovSweep", ax: Axes, per_time: bool = False) -> Axes:
    """The exponents with bands of two standard errors, a colour each; above the line at zero nearby orbits part.

    A mark on the lower edge is an exponent of minus infinity, as of motion that rests or chatters.
    """
    exponents, error = (result.per_time, result.per_time_error) if per_time else (result.exponents, result.error)
    order = np.argsort(result.values)
    x = result.values[order]
    for i in range(exponents.shape[-1]):
        y, spread = (np.where(np.isfinite(table), table, np.nan)[order, ..., i] for table in (exponents, error))
        colour = _COLOURS[i % len(_COLOURS)]
        ax.plot(x, y.reshape(len(x), -1), color=colour, lw=0.7, marker=".", ms=1.8, mew=0)
        ax.plot([], [], color=colour, label=rf"$\lambda_{{{i + 1}}}$")
        for column, wide in zip(y.reshape(len(x), -1).T, spread.reshape(len(x), -1).T, strict=True):
            ax.fill_between(x, column - 2 * wide, column + 2 * wide, color=colour, alpha=0.25, lw=0)
        if len(lowest := x[np.isneginf(exponents[order, ..., i]).reshape(len(x), -1).any(axis=1)]):
            look: dict[str, Any] = {"color": colour, "ms": 2.5, "mew": 0, "clip_on": False, "zorder": 3}
            name = rf"$\lambda_{{{i + 1}}}$: minus infinity"
            ax.plot(lowest, np.zeros(len(lowest)), "v", transform=ax.get_xaxis_transform(), label=name, **look)
    ax.axhline(0, color="black", lw=0.5, zorder=0)
    ax.set_xlim(x[0], x[-1])
    ax.set_xlabel(label(result.parameter))
    ax.set_ylabel(rf"$\lambda$ per {'unit of time' if per_time else 'return'}")
    ax.legend()
    return ax
