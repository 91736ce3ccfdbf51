"""The size of the attracting domain against the update: fig. cobweb12d35_updates, Auximapsd30_updates, Auximapsd26."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from nsmaps.figures.data import DOMAINS, position
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import LOOKS, symbol, with_unit

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_DECADES = 30.0  #: sizes that differ by more than this factor are shown on a logarithmic scale


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: a panel a coordinate."""
    coordinates = next(iter(DOMAINS.of(result, "domain_size").values())).coordinates
    panels = tuple(partial(domain_size, result, coordinate=name, legend=name == coordinates[-1]) for name in coordinates)
    return (Sheet("domain_size", panels, len(panels), 0.59),)


def domain_size(result: "StudyResult", ax: Axes, coordinate: str = "", legend: bool = True) -> Axes:
    """The width of every domain in one coordinate after each update; the box it started from is update 0.

    The legend of all panels of the sheet is beside the last. A map with several domains is labelled by their names in the
    study. A hollow marker: the worst case of the next update leaves this box, so that its width is not a bound.
    """
    named = DOMAINS.of(result, "domain_size")
    first = next(iter(named.values()))
    i = position(first.coordinates, coordinate or first.coordinates[0])
    everything = np.concatenate([domain.sizes[:, i] for domain in named.values()])
    positive = everything[np.isfinite(everything) & (everything > 0)]
    maps = [domain.of for domain in named.values()]
    for k, (key, domain) in enumerate(named.items()):
        colour, dashes, marker = LOOKS[k % len(LOOKS)]
        sizes = domain.sizes[:, i]
        width = max(9 - 3 * k, 4)  # a later one on top of an earlier one hides it not
        text = domain.of if maps.count(domain.of) == 1 else key
        look: dict[str, Any] = {"color": colour, "ls": dashes, "marker": marker, "ms": width}
        look["label"] = text + ("" if domain.forward_invariant else ", not forward invariant")
        if len(sizes) == 1:  # a box that is not forward invariant at once
            look |= {"ls": "", "mfc": "white"}
        elif not domain.forward_invariant:
            ax.plot([len(sizes) - 1], sizes[-1:], marker, mfc="white", mec=colour, ms=width, zorder=3)
        ax.plot(np.arange(len(sizes)), sizes, **look)
    if len(positive) and positive.max() > _DECADES * positive.min():
        ax.set_yscale("log")
    else:
        ax.set_ylim(0, None)
    ax.set_xlim(-0.4, max(1, *(len(domain.sizes) - 1 for domain in named.values())) + 0.4)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.grid(axis="y", color="0.9")
    if legend:
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    name = first.coordinates[i]
    ax.set(xlabel="update $N$", ylabel=with_unit(f"width in {symbol(name)}", name))
    return ax
