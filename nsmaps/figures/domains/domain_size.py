"""The size of the attracting domain against the update: fig. cobweb12d35_updates, Auximapsd30_updates, Auximapsd26."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from nsmaps.figures.domains.looks import Domains, by_name, heading, look_of
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import invariant_or_first, position
from nsmaps.figures.style import symbol, with_unit

_DECADES = 30.0  #: sizes that differ by more than this factor are shown on a logarithmic scale
_DASHES = ("-", "--", "-.", ":")  #: of domains of one kind
_MARKS = ("", "D", "v", "P")  #: of these, after the first, whose mark is that of its kind
_MARGIN = 0.06


def sheets(domains: Domains) -> tuple[Sheet, ...]:
    """One sheet: a panel a coordinate."""
    named = by_name(domains)
    coordinates = next(iter(named.values())).coordinates
    panels = tuple(partial(domain_size, named, coordinate=name) for name in coordinates)
    return (Sheet("domain_size", panels, min(len(panels), 2), 0.8, legend=True),)


def domain_size(domains: Domains, ax: Axes, coordinate: str = "") -> Axes:
    """The width of every forward invariant domain in one coordinate after each update; the box it started from is update 0.

    Where no domain is forward invariant, it is that of the first, whose last width, a hollow mark, bounds nothing.
    """
    named = invariant_or_first(by_name(domains))
    first = next(iter(named.values()))
    i = position(first.coordinates, coordinate or first.coordinates[0])
    everything = np.concatenate([domain.sizes[:, i] for domain in named.values()])
    positive = everything[np.isfinite(everything) & (everything > 0)]
    for k, (key, domain) in enumerate(named.items()):
        colour, marker = look_of(domain)
        sizes, before = domain.sizes[:, i], [look_of(each) for each in list(named.values())[:k]]
        alike = before.count((colour, marker)) % len(_DASHES)
        dashes, marker = _DASHES[alike], _MARKS[alike] or marker
        width, filled = (
            max(7 - 2 * k, 3),
            colour if dashes == "-" else "white",
        )  # a later one on top of an earlier one hides it not
        text = heading(key, domain) + ("" if domain.forward_invariant else ", not forward invariant")
        look: dict[str, Any] = {"color": colour, "ls": dashes if len(sizes) > 1 else "", "marker": marker, "ms": width}
        ax.plot(np.arange(len(sizes)), sizes, mfc=filled if len(sizes) > 1 else "white", label=text, **look)
        if not domain.forward_invariant:
            ax.plot([len(sizes) - 1], sizes[-1:], marker, mfc="white", mec=colour, ms=width, zorder=3)
    if len(positive) and positive.max() > _DECADES * positive.min():
        ax.set_yscale("log")
    else:
        ax.set_ylim(0, 1.1 * max(positive, default=1.0))
    last = max(1, *(len(domain.sizes) - 1 for domain in named.values()))
    ax.set_xlim(-_MARGIN * last, (1 + _MARGIN) * last)
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    ax.grid(axis="y", color="0.9")
    ax.legend()
    name = first.coordinates[i]
    ax.set(xlabel="update $N$", ylabel=with_unit(f"width in {symbol(name)}", name))
    return ax
