"""Upper and lower maps of each coordinate and the cobwebs between them: fig. cobweb12d35, Auximapsd30, Auximapsd26."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats
from nsmaps.figures.lines import diagonal, last_tenth, staircase
from nsmaps.figures.needs import Drawable, domains_of, position
from nsmaps.figures.sheet import Sheet, file_of
from nsmaps.figures.style import BLUE, ORANGE, RED, YELLOW, bare, dress, symbol, tint

if TYPE_CHECKING:
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.auxiliary.update import Update


_MOVED = 0.01  #: of a box's width, below which its picture is the same
_GENERIC = {True: "generic", False: "generic: no cycle"}  #: by whether it comes to rest; one that does not fills the picture


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """A sheet a domain, the first's named `envelopes`: first, second and last update as rows, as far as they differ."""
    made = []
    for k, (name, domain) in enumerate(domains_of(result, "envelopes").items()):
        file = file_of("envelopes", name if k else "")
        pairs = [(update, coordinate) for update in shown(domain) for coordinate in domain.coordinates]
        panels = tuple(partial(envelopes, result, coordinate=c, update=u, domain=name) for u, c in pairs)
        made.append(Sheet(file, panels, len(domain.coordinates), (5.8, 4.4)))
    return tuple(made)


def shown(domain: "AttractingDomain") -> list[int]:
    """The positions of the first, the second and the last update; one whose box is that of an earlier one is left out."""
    last = len(domain.updates) - 1
    kept = [0]
    for number in sorted({min(1, last), last} - {0}):
        before, box = (domain.updates[k].box for k in (kept[-1], number))
        if (np.abs(box - before) > _MOVED * np.ptp(before, axis=1, keepdims=True)).any():
            kept.append(number)
    return kept


def envelopes(result: Drawable, ax: Axes, coordinate: str = "", update: int = -1, domain: str = "") -> Axes:
    """The upper and lower map of one coordinate at one update, by position (eq. auxv, auxphi).

    Dotted: the worst-case steps from the update's box (eq. WCScobweb-v, -phi); thin: the generic cobweb, its last tenth
    red, if it comes to rest; yellow, with stars at its ends p and q: the interval to which the worst case shrinks, if the
    box is trapped.
    """
    named = domains_of(result, "envelopes")
    chosen = named[domain or next(iter(named))]
    i = position(chosen.coordinates, coordinate or chosen.coordinates[0])
    step = _update(chosen, update)
    envelope, worst = step.envelopes[i], step.worst[:, i]
    name = chosen.coordinates[i]
    if step.trapped:
        ax.axvspan(*worst[-1], color=tint(YELLOW, 0.4), lw=0, zorder=0, label=rf"$\mathcal{{A}}^{{({step.number + 1})}}$")
        text = f"{symbol('p', bare(name))}, {symbol('q', bare(name))}"
        ax.plot(worst[-1], worst[-1], "*", color="black", mec="white", mew=0.6, ms=13, zorder=7, label=text)
        generic = step.generic[:, i]
        rests = abs(generic[-1] - generic[-3]) <= 1e-6 * np.ptp(step.box[i])
        ax.plot(*staircase(generic if rests else generic[:1]), color="0.4", lw=0.7, zorder=4, label=_GENERIC[rests])
        if rests:
            ax.plot(*staircase(last_tenth(generic)), color=RED, lw=2.2, zorder=6, label="its last 10 %")
    ax.fill_between(envelope.x, envelope.lower, envelope.upper, color=tint(BLUE, 0.85), lw=0, zorder=1)
    ax.plot(envelope.x, envelope.upper, color=BLUE, lw=2.2, zorder=3, label=bounding(i, "U"))
    ax.plot(envelope.x, envelope.lower, color=ORANGE, lw=2.2, zorder=3, label=bounding(i, "L"))
    ax.plot(*worst_steps(step, i), color="black", lw=1.3, ls=":", zorder=5, label="worst case")
    ends = [envelope.x[0], envelope.x[-1], envelope.lower.min(), envelope.upper.max(), worst.min(), worst.max()]
    low, high = float(np.nanmin(ends)), float(np.nanmax(ends))
    margin = 0.03 * (high - low)
    diagonal(ax, low - margin, high + margin)
    ax.set(xlim=(low - margin, high + margin), ylim=(low - margin, high + margin))
    ax.set_title(f"{chosen.of}, update {step.number}" + ("" if step.trapped else ", not trapped"))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, handlelength=1.6)
    return dress(ax, (name, "k"), (name, "k+1"))


def _update(domain: "AttractingDomain", number: int) -> "Update":
    """The update at this position, from the end if negative."""
    if not -len(domain.updates) <= number < len(domain.updates):
        raise NsmapsError(f"there is no update at position {number}; the domain has {len(domain.updates)} updates")
    return domain.updates[number]


def worst_steps(step: "Update", index: int) -> tuple[Floats, Floats]:
    """The staircase of one coordinate's intervals: from where a curve is extreme up to its extreme, across to the diagonal."""
    x: list[float] = []
    y: list[float] = []
    for places, (lowest, highest) in zip(step.at[:, index].mean(axis=2), step.worst[1:, index], strict=True):
        for at, end in ((places[1], highest), (places[0], lowest)):
            x += [at, at, end, np.nan]
            y += [at, end, end, np.nan]
    return np.array(x), np.array(y)


def bounding(index: int, letter: str) -> str:
    r"""The upper or lower map as the paper writes it: xi of the first coordinate, eta of the second.

    >>> bounding(1, "U"), bounding(2, "L")
    ('$\\eta_U$', 'lower map')
    """
    greek = (r"\xi", r"\eta")
    return f"${greek[index]}_{letter}$" if index < 2 else f"{'upper' if letter == 'U' else 'lower'} map"
