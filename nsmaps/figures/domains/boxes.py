"""Attracting domains in the plane of two coordinates: their boxes by update, over the cells of Morse sets, with orbits."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from nsmaps.arrays import Floats
from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.cells.morse import MorseCover
from nsmaps.dynamics.orbit import Orbit
from nsmaps.figures.cells.morse_sets import morse_sets
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.domains.looks import Domains, by_name, heading
from nsmaps.figures.lines import finite_states
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import invariant_or_first
from nsmaps.figures.style import BLACK, ORANGE, dress

_SHADES = (0.05, 0.65)  #: of the first and the last box
_MARGIN = 0.08
_FIRST = 10  #: returns of an orbit that are joined by lines


def sheets(domains: Domains, orbits: Sequence[Orbit] | None = None, cover: MorseCover | None = None) -> tuple[Sheet, ...]:
    """One sheet: a panel for each domain that is forward invariant, or for the first."""
    named = by_name(domains)
    shown = invariant_or_first(named)
    panels = tuple(
        partial(boxes, domain, orbits=orbits, cover=cover, title=heading(name, domain)) for name, domain in shown.items()
    )
    return (Sheet("boxes", panels, min(len(panels), 2), 0.8, legend=True, share=1.0 if len(panels) > 1 else 0.8),)


def boxes(
    domain: AttractingDomain,
    ax: Axes,
    plane: tuple[int, int] = (0, 1),
    orbits: Sequence[Orbit] | None = None,
    cover: MorseCover | None = None,
    title: str = "",
) -> Axes:
    """The box of a domain after each update, the darker the later, in the plane of two coordinates, with the states of orbits.

    An orbit in the start box is in each next box from some return on. A last box that is small is enlarged. Of one coordinate,
    intervals stand one above the other.
    """
    if len(domain.coordinates) == 1:
        return _intervals(domain, ax)
    names = domain.coordinates
    if cover is not None and tuple(cover.coordinates) == tuple(names) and plane == (0, 1):
        morse_sets(cover, ax)
    below = list(legend.legend_handles) if (legend := ax.get_legend()) else []
    start = domain.boxes[0, plane, :]
    states = [finite_states(orbit)[:, plane] for orbit in orbits or ()]
    margin = _MARGIN * np.ptp(start, axis=1)
    ax.set(xlim=start[0] + margin[0] * np.array([-1, 1]), ylim=start[1] + margin[1] * np.array([-1, 1]))
    handles = _draw(ax, domain, plane, states)
    inset(ax, domain.box[plane, :].T, partial(_draw, domain=domain, plane=plane, states=states))
    ax.legend(handles=[*below, *handles])
    ax.set_title(title)
    return dress(ax, (names[plane[0]], "k"), (names[plane[1]], "k"))


def _draw(ax: Axes, domain: AttractingDomain, plane: tuple[int, int], states: Sequence[Floats]) -> list[Artist]:
    """Boxes and orbits; the entries of the legend."""
    last, handles = len(domain.boxes) - 1, list[Artist]()
    for number, box in enumerate(domain.boxes[:, plane, :]):
        (left, right), (low, high) = box
        shade = colormaps["Blues"](np.interp(np.log1p(number), [0, np.log1p(max(last, 1))], _SHADES))
        dashes, width = "-" if domain.forward_invariant else "--", 1.1 if number == last else 0.4
        look: dict[str, Any] = {"fc": shade, "ec": BLACK, "lw": width, "ls": dashes}
        ax.add_patch(Rectangle((left, low), right - left, high - low, zorder=1.5, label="_", **look))
        if number in (0, 1, last):
            name = {0: "start box", 1: "after one update"}.get(number, "last box")
            handles.append(Patch(label=name if number or domain.forward_invariant else f"{name}, not invariant", **look))
    for k, each in enumerate(states):
        ax.plot(*each[:_FIRST].T, color=ORANGE, lw=0.5, zorder=3, label="_")
        handles += ax.plot(*each.T, ".", ms=2.6, mew=0, color=BLACK, zorder=4, label="exact orbits" if not k else "_")[: not k]
    return handles


def _intervals(domain: AttractingDomain, ax: Axes) -> Axes:
    """The intervals of one coordinate over the updates."""
    for number, (low, high) in enumerate(domain.boxes[:, 0]):
        ax.plot([low, high], [number] * 2, "-|", color=BLACK, lw=1.4)
    dress(ax, (domain.coordinates[0], ""), (domain.coordinates[0], ""))
    ax.set_ylabel("update $N$")
    return ax
