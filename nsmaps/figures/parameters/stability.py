"""Stability diagrams: the period or the motion that attracts over two parameters, with the curves on which it changes."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.dynamics.motion import CHAOS, QUASI_PERIODIC, UNRESOLVED, kind_of
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, MOTIONS, OPEN, OTHERS, QUASI, dress

if TYPE_CHECKING:
    from collections.abc import Mapping

    from nsmaps.dynamics.curves.curve import BifurcationCurve
    from nsmaps.dynamics.diagrams.stability import StabilityDiagram

    Curves = Mapping[str, BifurcationCurve]

_OTHER, _NONE = "other", "no attractor"
_WITHOUT = {CHAOS: "chaos", QUASI_PERIODIC: "quasi-periodic", UNRESOLVED: "unresolved"}  #: motions without a period
LINES = ("-", "--", ":", "-.")
MARKS = {"cusp": "^", "fold-flip": "s", "1:1 resonance": "o", "1:2 resonance": "D", "1:3 resonance": "v", "1:4 resonance": "P"}
_LAST = {_OTHER: OTHERS, **dict(zip(_WITHOUT.values(), (BLACK, QUASI, OPEN), strict=True)), _NONE: "#FFFFFF"}


def sheets(result: "StabilityDiagram", curves: "Curves | None" = None, by: str = "motion") -> tuple[Sheet, ...]:
    """One sheet: the motions, with bifurcation curves."""
    return (Sheet("stability", (partial(stability, result, curves=curves, by=by),), 1, 0.6, legend=True),)


def stability(result: "StabilityDiagram", ax: Axes, curves: "Curves | None" = None, by: str = "motion") -> Axes:
    """What attracts over two parameters: a colour for each of the six most frequent motions n:m/pT, or periods in returns.

    Args:
        result: from `stability_diagram`.
        curves: bifurcations in the same parameters by name, drawn over it.
        by: `period` or `motion`.

    Raises:
        NsmapsError: `by` is neither.
    """
    names = _names(result, by)
    kinds, counts = np.unique(names, return_counts=True)
    motions = [kind for _, kind in sorted(zip(-counts, kinds.tolist(), strict=True)) if kind not in _LAST][: len(MOTIONS)]
    motions.sort(key=lambda name: (len(name), name))
    table = dict(zip(motions, MOTIONS, strict=False)) | _LAST
    shown = [name for name in table if name in kinds or (name == _OTHER and set(kinds) - set(table))]
    index = {name: shown.index(name) for name in shown}
    cells = np.vectorize(lambda name: index.get(name, index.get(_OTHER)))(names)
    colours = [table[name] for name in shown]
    norm = BoundaryNorm(np.arange(len(shown) + 1) - 0.5, len(shown))
    ax.pcolormesh(result.along, result.across, cells, cmap=ListedColormap(colours), norm=norm, rasterized=True)
    patches = [Patch(facecolor=table[name], edgecolor="0.5", label=name) for name in shown]
    ax.legend(handles=[*patches, *draw_curves(ax, curves or {})])
    return dress(ax, (result.first, ""), (result.second, ""))


def draw_curves(ax: Axes, curves: "Curves") -> list[Line2D]:
    """Draw curves within the limits of the axes, by name; the lines and marks that a legend names."""
    limits = ax.get_xlim(), ax.get_ylim()
    named: list[Line2D] = []
    for (name, curve), line in zip(curves.items(), LINES * len(curves), strict=False):
        ax.plot(*curve.parameters.T, color="#FFFFFF", lw=1.9)
        named += ax.plot(*curve.parameters.T, line, color=BLACK, lw=0.8, label=name)
    special = [point for curve in curves.values() for point in curve.special]
    for kind in dict.fromkeys(point.kind for point in special):
        places = np.array([point.parameters for point in special if point.kind == kind])
        named += ax.plot(*places.T, MARKS[kind], ms=4, color="#FFFFFF", mec=BLACK, mew=0.8, label=kind)
    ax.set(xlim=limits[0], ylim=limits[1])
    return named


def _names(diagram: "StabilityDiagram", by: str) -> NDArray[np.str_]:
    """What each point is called, shape (W, V)."""
    if by not in ("period", "motion"):
        raise NsmapsError(f"the colours are by {by!r}; expected: 'period' or 'motion'")
    shown = diagram.period.astype(str) if by == "period" else diagram.labels
    without = np.vectorize(lambda name: _WITHOUT.get(kind_of(name), _NONE), otypes=[object])(diagram.labels).astype(str)
    return np.where(diagram.period > 0, shown, np.where(diagram.period == 0, without, _NONE))
