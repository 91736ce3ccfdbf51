"""The families of curves between the upper and lower map of each coordinate, and their worst case: fig. illauximaps."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.figures.data import ENVELOPED, held, position
from nsmaps.figures.domains.envelopes import bounding, frame, headline, outer, worst_case, worst_steps
from nsmaps.figures.domains.looks import heading
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.style import BLUE, GREEN, ORANGE, dress, tint

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_GREYS = ("0.82", "0.35")  #: of the curves for the least and the largest of the others


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """A sheet a domain that is forward invariant, the first's named `auxiliary`, with a panel a coordinate."""
    drawn = []
    for k, (name, domain) in enumerate(held(ENVELOPED.of(result, "auxiliary")).items()):
        panels = tuple(partial(auxiliary, result, coordinate=c, domain=name) for c in domain.coordinates)
        file = file_of("auxiliary", name if k else "")
        drawn.append(Sheet(file, panels, min(len(panels), 2), 0.76, title=heading(name, domain), legend=True))
    return tuple(drawn)


def auxiliary(result: "StudyResult", ax: Axes, coordinate: str = "", update: int = 0, domain: str = "") -> Axes:
    """The upper and lower map of one coordinate at one update, by position, and the family of curves that they bound.

    Dotted are the steps of the worst case from the update's box (eq. WCScobweb-v, -phi); if that is forward invariant, the first
    interval is green.
    """
    named = ENVELOPED.of(result, "auxiliary")
    chosen = named[domain or next(iter(held(named)))]
    i = position(chosen.coordinates, coordinate or chosen.coordinates[0])
    step, name = chosen.updates[update], chosen.coordinates[i]
    envelope = step.envelopes[i]
    others = "the other" if len(chosen.coordinates) == 2 else "all others"
    last = len(envelope.family) - 1
    for j, curve in enumerate(envelope.family):
        grey = f"{np.interp(j, [0, last], [float(g) for g in _GREYS]):.2f}"
        text = {0: f"{others} at its least", last: f"{others} at its largest"}.get(j)
        ax.plot(envelope.x, curve, color=grey, lw=0.7, label=text)
    lower, upper = outer(chosen, step, i)
    for curve, colour, letter in ((upper, BLUE, "U"), (lower, ORANGE, "L")):
        ax.plot(envelope.x, curve, color=colour, lw=1.4, zorder=4, label=bounding(letter, chosen))
    if step.forward_invariant:
        ax.axvspan(*step.worst[1, i], color=tint(GREEN, 0.75), lw=0, zorder=0, label="first interval")
    ax.plot(*worst_steps(step, i), color="black", lw=0.9, ls=":", zorder=5, label=worst_case(chosen))
    frame(ax, envelope.x, np.concatenate([lower, upper, step.worst[:, i].ravel()]))
    ax.set_title(headline(step, i))
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+1"))
