"""Intervals of a parameter one above the other: where attractors coexist, and the steps of a rotation number."""

from functools import partial
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from nsmaps.dynamics.attractors.coexistence import Coexistence
from nsmaps.dynamics.rotation.staircase import Staircase
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, HALO, MAGENTA, ORANGE, RED, label

_COLOURS = (BLUE, ORANGE, GREEN, MAGENTA, RED)
_LETTER = 0.008  #: of the width of a panel, which a letter takes at least


def sheets(found: Coexistence | Staircase) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("spans", (partial(spans, found),), 1, 0.6, share=0.8),)


def spans(found: Coexistence | Staircase, ax: Axes) -> Axes:
    """The intervals of a parameter with one attractor, a row each, with its name, or with one rotation number, at its height."""
    if isinstance(found, Staircase):
        rows = [(each.low.value, each.high.value, float(each.rotation), str(each.rotation), 0) for each in found.plateaux]
        title = "rotation number"
    else:
        rows = [(each.low, each.high, each.attractor + 1.0, each.label, each.attractor) for each in found.spans]
        title = "attractor"
        ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    low, high = min((row[0] for row in rows), default=0.0), max((row[1] for row in rows), default=1.0)
    for left, right, height, name, number in rows:
        ax.plot([left, right], [height] * 2, color=_COLOURS[number % len(_COLOURS)], lw=2, solid_capstyle="butt")
        if right - left >= _LETTER * len(name) * (high - low):
            look: dict[str, Any] = {"ha": "center", "va": "bottom", "xytext": (0, 2), "textcoords": "offset points"}
            ax.annotate(name, ((left + right) / 2, height), path_effects=HALO, **look)
    ax.margins(y=0.12)
    ax.set_xlabel(label(found.parameter) if found.parameter else "parameter")
    ax.set_ylabel(title)
    return ax
