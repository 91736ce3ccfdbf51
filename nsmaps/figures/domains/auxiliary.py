"""The families of curves between the upper and lower map of each coordinate, and their worst case: fig. illauximaps."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.figures.data import ENVELOPED, position
from nsmaps.figures.domains.envelopes import bounding, frame, outer, worst_case, worst_steps
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.style import BLUE, GREEN, ORANGE, bare, dress, symbol

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_GREYS = ("0.82", "0.35")  #: of the curves for the least and the largest of the others


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """A sheet a domain, the first's named `auxiliary`: the families of all coordinates, below them their worst case."""
    drawn = []
    for k, (name, domain) in enumerate(ENVELOPED.of(result, "auxiliary").items()):
        file = file_of("auxiliary", name if k else "")
        parts = [(steps, coordinate) for steps in (False, True) for coordinate in domain.coordinates]
        panels = tuple(partial(auxiliary, result, coordinate=c, steps=steps, domain=name) for steps, c in parts)
        drawn.append(Sheet(file, panels, len(domain.coordinates), 0.69))
    return tuple(drawn)


def auxiliary(
    result: "StudyResult", ax: Axes, coordinate: str = "", update: int = 0, domain: str = "", steps: bool = False
) -> Axes:
    """The upper and lower map of one coordinate at one update, by position, and the family of curves that they bound.

    With `steps` the worst case in place of the family: green its first interval, dotted its steps (eq. WCScobweb-v, -phi).
    """
    named = ENVELOPED.of(result, "auxiliary")
    chosen = named[domain or next(iter(named))]
    i = position(chosen.coordinates, coordinate or chosen.coordinates[0])
    step, name = chosen.updates[update], chosen.coordinates[i]
    envelope = step.envelopes[i]
    others = [k for k in range(len(chosen.coordinates)) if k != i]
    if not steps:
        for j, curve in enumerate(envelope.family):
            grey = f"{np.interp(j, [0, len(envelope.family) - 1], [float(g) for g in _GREYS]):.2f}"
            held = ", ".join(f"{symbol(chosen.coordinates[k])} = {envelope.others[j, k]:.3g}" for k in others)
            ax.plot(envelope.x, curve, color=grey, lw=0.7, label=held if j in (0, len(envelope.family) - 1) else None)
    every = max(1, len(envelope.x) // 16)
    lower, upper = outer(chosen, step, i)
    for curve, colour, letter, first in ((upper, BLUE, "U", 0), (lower, ORANGE, "L", every // 2)):
        (line,) = ax.plot(envelope.x, curve, color=colour, lw=1.4, zorder=4, label=bounding(i, letter, chosen))
        line.set(marker="D", markersize=3, markevery=(first, every))
    if steps:
        if step.forward_invariant:
            ax.axvspan(*step.worst[1, i], color=GREEN, alpha=0.25, lw=0, zorder=0, label=rf"$I_{{1{bare(name)}}}$")
        ax.plot(*worst_steps(step, i), color="black", lw=1, ls=":", zorder=5, label=worst_case(chosen))
    frame(ax, envelope.x, np.concatenate([lower, upper, step.worst[:, i].ravel() if steps else []]))
    ax.set_title(
        f"{chosen.of}, update {step.number}: {envelope.kind}" + ("" if step.forward_invariant else ", not forward invariant")
    )
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, handlelength=1.6)
    return dress(ax, (name, "k"), (name, "k+1"))
