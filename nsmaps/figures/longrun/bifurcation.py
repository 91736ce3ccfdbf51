"""Bifurcation diagrams: figs. bifexact and bifapprox, a panel for each coordinate, the maps beside each other."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.exact.words import LONGER
from nsmaps.figures.data import BIFURCATION, section
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREY, dress, family_colours

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
    from nsmaps.study.result import StudyResult

_DOTS: dict[str, Any] = {"ms": 2.6, "mew": 0, "rasterized": True}
_ROOM = 0.017  #: of the width of a panel that a letter of the name of a motion needs
_UPRIGHT = 0.024  #: of the width of a panel that a name needs that is written upwards
_VALUES = 4  #: of the parameter that a window with a name has; beside a doubling, motions that have not converged pass for chaos
_COLUMNS, _LETTERS = 5, 34  #: of words in the legend: columns, and letters that a row has room for
_TIGHT: dict[str, Any] = {"handletextpad": 0.0, "columnspacing": 0.7, "borderaxespad": 0.0, "borderpad": 0.0}


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: a row a map, a column a coordinate."""
    diagrams = BIFURCATION.of(result, "bifurcation")
    coordinates = range(len(next(iter(diagrams.values())).coordinates))
    panels = tuple(partial(bifurcation, result, of=of, coordinate=i) for of in diagrams for i in coordinates)
    return (Sheet("bifurcation", panels, len(coordinates)),)


def bifurcation(result: "StudyResult", ax: Axes, of: str = "exact", coordinate: int = 0) -> Axes:
    """One coordinate of the attractors over the parameter, coloured by the word of the return to each state, further ones grey.

    Motions n:m/pT of the first orbit are named above where their interval has the room; grey bands: values without an attractor.
    """
    diagrams = BIFURCATION.of(result, "bifurcation")
    diagram = diagrams[of]
    words, values = diagram.words, np.broadcast_to(diagram.values[:, np.newaxis, np.newaxis], diagram.codes.shape)
    every = {word for each in diagrams.values() for word in np.unique(each.words).tolist() if word}
    colours = family_colours(sorted((word for word in every if LONGER not in word), key=len))
    shown = np.isfinite(diagram.states[..., coordinate])
    present = np.unique(words[shown]).tolist()
    named = [word for word in present if colours.get(word, GREY) != GREY]
    for word in named:
        own = shown & (words == word)
        ax.plot(values[own], diagram.states[..., coordinate][own], ".", color=colours[word], label=word, **_DOTS)
    if more := len(present) - len(named):
        own = shown & ~np.isin(words, named)
        ax.plot(values[own], diagram.states[..., coordinate][own], ".", color=GREY, label=f"{more} more words", **_DOTS)
    ax.set_xlim(diagram.values.min(), diagram.values.max())
    _name_motions(ax, diagram)
    if shown.any():
        columns = max(1, min(_COLUMNS, _LETTERS // (2 + max(map(len, named), default=0))))
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.1), frameon=False, markerscale=4, ncols=columns, **_TIGHT)
    else:
        ax.text(0.5, 0.5, "no attractor", transform=ax.transAxes, ha="center")
    parameter = section(result.study.bifurcation, "bifurcation").parameter
    ax.set_title(f"{of} map", loc="right")
    return dress(ax, (parameter, ""), (diagram.coordinates[coordinate], "k"))


def _name_motions(ax: Axes, diagram: "Bifurcation") -> None:
    """The names of motions along the upper edge, lines where they change, bands where there is no attractor."""
    order = np.argsort(diagram.values)
    labels, values = diagram.labels[order, 0], diagram.values[order]
    middles = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    edges = np.flatnonzero(labels[1:] != labels[:-1]) + 1
    low, high = ax.get_ylim()
    tall = 0.1
    for first, last in zip([0, *edges], [*edges, len(labels)], strict=True):
        left, right = middles[first], middles[last]
        share = (right - left) / np.ptp(values)
        if not labels[first]:
            ax.axvspan(left, right, color="0.92", lw=0)
        elif share > _UPRIGHT and last - first >= _VALUES:
            upright = share <= _ROOM * len(labels[first])
            tall = max(tall, (0.03 + 0.025 * len(labels[first])) * upright)
            ax.axvline(right, color="0.8", lw=0.4, zorder=0)
            look: dict[str, Any] = {"ha": "center", "va": "top", "rotation": 90 * upright}
            ax.text((left + right) / 2, 0.985, labels[first], transform=ax.get_xaxis_transform(), **look)
    ax.set_ylim(low, high + tall * (high - low))
