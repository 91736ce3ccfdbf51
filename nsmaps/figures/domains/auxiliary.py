"""The families of curves between the upper and lower map of each coordinate, and the first steps between: fig. illauximaps."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.auxiliary.worst_case import Update
from nsmaps.figures.domains.envelopes import bounding, frame, headline, worst_case, worst_steps
from nsmaps.figures.domains.looks import Domains, by_name, heading
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import invariant_or_first, position
from nsmaps.figures.style import BLUE, GREEN, ORANGE, dress, tint

_GREYS = ("0.82", "0.35")  #: of the curves for the least and the largest of the others
_EXTREMES = (("P", "Q"), ("R", "O"))  #: names of the largest of the upper and the least of the lower map, a coordinate
_END = 0.03  #: of the box, within which a point is at its end
_PAPER = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.7}  #: behind names, which stay text
_APART = 12  #: the marks of a curve


def sheets(domains: Domains) -> tuple[Sheet, ...]:
    """A sheet a domain that is forward invariant, the first's named `auxiliary`: families above first intervals."""
    pages = []
    for k, (name, domain) in enumerate(invariant_or_first(by_name(domains)).items()):
        names = domain.coordinates
        panels = tuple(partial(of, domain, coordinate=c) for of in (auxiliary, first_interval) for c in names)
        file = file_of("auxiliary", name if k else "")
        pages.append(Sheet(file, panels, min(len(names), 2), 0.76, title=heading(name, domain), legend=True))
    return tuple(pages)


def auxiliary(domain: AttractingDomain, ax: Axes, coordinate: str = "", update: int = 0) -> Axes:
    """The upper and lower map of one coordinate at one update, by position, and the family of curves that they bound."""
    step, i = domain.updates[update], position(domain.coordinates, coordinate or domain.coordinates[0])
    envelope = step.envelopes[i]
    others = "the other" if len(domain.coordinates) == 2 else "all others"
    last = len(envelope.family) - 1
    for j, curve in enumerate(envelope.family):
        grey = f"{np.interp(j, [0, last], [float(g) for g in _GREYS]):.2f}"
        text = {0: f"{others} at its least", last: f"{others} at its largest"}.get(j)
        ax.plot(envelope.x, curve, color=grey, lw=0.7, label=text)
    return _between(ax, domain, step, i, "D")


def first_interval(domain: AttractingDomain, ax: Axes, coordinate: str = "", update: int = 0) -> Axes:
    """The steps of the worst case of one coordinate from the box of one update, by position (eq. WCScobweb-v, -phi), dotted.

    P and Q, of the second coordinate R and O, are where the upper map is largest and the lower one least over the box (eq. WCS1);
    if the box is forward invariant, the interval between their images is green.
    """
    step, i = domain.updates[update], position(domain.coordinates, coordinate or domain.coordinates[0])
    if step.forward_invariant:
        ax.axvspan(*step.worst[1, i], color=tint(GREEN, 0.75), lw=0, zorder=0, label="first interval")
    ax.plot(*worst_steps(step, i), color="black", lw=0.9, ls=":", zorder=5, label=worst_case(domain))
    _between(ax, domain, step, i)
    for name, end in zip(_EXTREMES[i] if i < len(_EXTREMES) else (), (1, 0), strict=False):
        _name(ax, name, float(step.at[0, i, end].mean()), float(step.worst[1, i, end]), step.box[i])
    ax.set_title(headline(step, i))
    return ax


def _name(ax: Axes, name: str, x: float, y: float, ends: Floats) -> None:
    """A point with its name: outwards beside one at an end of the box, else above or below it, towards the middle of the axes."""
    if not np.isfinite([x, y]).all():
        return
    ax.plot(x, y, "o", color="black", ms=3.2, zorder=8)
    side = np.sign(x - ends.mean()) if np.abs(x - ends).min() <= _END * np.ptp(ends) else 0
    up = 1 if y < np.mean(ax.get_ylim()) else -1
    place: dict[str, Any] = {"xytext": (4 * side, 0), "ha": "right" if side < 0 else "left", "va": "center"}
    if not side:
        place = {"xytext": (4, 4 * up), "ha": "left", "va": "bottom" if up > 0 else "top"}
    ax.annotate(f"${name}$", (x, y), textcoords="offset points", zorder=9, bbox=_PAPER, **place)


def _between(ax: Axes, domain: AttractingDomain, step: Update, i: int, mark: str = "") -> Axes:
    """The upper and the lower map of one coordinate, with marks if one is given, the limits and the names of the axes."""
    envelope, name = step.envelopes[i], domain.coordinates[i]
    lower, upper = envelope.lower, envelope.upper
    look: dict[str, Any] = {"lw": 1.4, "marker": mark, "ms": 2.8, "markevery": max(1, len(envelope.x) // _APART), "zorder": 4}
    for curve, colour, letter in ((upper, BLUE, "U"), (lower, ORANGE, "L")):
        ax.plot(envelope.x, curve, color=colour, label=bounding(letter, domain), **look)
    frame(ax, envelope.x, np.concatenate([lower, upper, step.worst[:, i].ravel()]))
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+1"))
