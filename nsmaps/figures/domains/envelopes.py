"""Upper and lower maps of each coordinate and the cobwebs between them: fig. cobweb12d35, Auximapsd30, Auximapsd26."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.auxiliary.worst_case import Update
from nsmaps.errors import NsmapsError
from nsmaps.figures.domains.looks import Domains, by_name, heading
from nsmaps.figures.lines import diagonal, last_tenth, staircase
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import invariant_or_first, position
from nsmaps.figures.style import BLUE, OLIVE, ORANGE, RED, YELLOW, dress, tint

_MOVED = 0.01  #: of a box's width, below which its picture is the same
_MARGIN = 0.1  #: of what is drawn, around it


def sheets(domains: Domains) -> tuple[Sheet, ...]:
    """A sheet a domain that is forward invariant, the first's named `envelopes`: first, second and last update as rows."""
    pages = []
    for k, (name, domain) in enumerate(invariant_or_first(by_name(domains)).items()):
        pairs = [(update, coordinate) for update in shown(domain) for coordinate in domain.coordinates]
        panels = tuple(partial(envelopes, domain, coordinate=c, update=u) for u, c in pairs)
        file, columns = file_of("envelopes", name if k else ""), min(len(domain.coordinates), 2)
        pages.append(Sheet(file, panels, columns, 0.74, title=heading(name, domain), legend=True))
    return tuple(pages)


def shown(domain: AttractingDomain) -> list[int]:
    """The positions of the first, the second and the last update; of two whose boxes are alike, the first or else the last."""

    def alike(one: int, other: int) -> bool:
        before, box = domain.updates[one].box, domain.updates[other].box
        return bool((np.abs(box - before) <= _MOVED * np.ptp(before, axis=1, keepdims=True)).all())

    last = len(domain.updates) - 1
    later = [k for k in dict.fromkeys((min(1, last), last)) if not alike(0, k)]
    return [0, *(k for k in later if k == last or not alike(k, last))]


def envelopes(domain: AttractingDomain, ax: Axes, coordinate: str = "", update: int = -1) -> Axes:
    """The upper and lower map of one coordinate at one update, by position (eq. auxv, auxphi).

    Dotted: the worst-case steps from the update's box (eq. WCScobweb-v, -phi); thin: the generic cobweb, its last tenth
    red, if it converges; pale yellow, with stars at its ends p and q: the interval to which the worst case shrinks, if the
    box is forward invariant.
    """
    i = position(domain.coordinates, coordinate or domain.coordinates[0])
    step = _update(domain, update)
    envelope, worst = step.envelopes[i], step.worst[:, i]
    name = domain.coordinates[i]
    if step.forward_invariant:
        ax.axvspan(*worst[-1], fc=tint(YELLOW, 0.8), ec=OLIVE, lw=0.6, ls="--", zorder=0, label="next box")
        generic = step.generic[:, i]
        if abs(generic[-1] - generic[-3]) <= 1e-6 * np.ptp(step.box[i]):
            ax.plot(*staircase(generic), color="0.4", lw=0.4, zorder=4, label="orbit, both maps in turn")
            ax.plot(*staircase(last_tenth(generic)), color=RED, lw=1.1, zorder=6, label="its last tenth")
        cycle(ax, worst[-1])
    lower, upper = envelope.lower, envelope.upper
    ax.fill_between(envelope.x, lower, upper, color=tint(BLUE, 0.85), lw=0, zorder=1)
    ax.plot(envelope.x, upper, color=BLUE, lw=1.3, zorder=3, label=bounding("U", domain))
    ax.plot(envelope.x, lower, color=ORANGE, lw=1.3, zorder=3, label=bounding("L", domain))
    ax.plot(*worst_steps(step, i), color="black", lw=0.8, ls=":", zorder=5, label=worst_case(domain))
    frame(ax, envelope.x, np.concatenate([lower, upper, worst.ravel()]))
    ax.set_title(headline(step, i))
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+1"))


def headline(step: Update, index: int) -> str:
    """The number of an update, and how wide the box is that it leads to, if its own is forward invariant."""
    if not step.forward_invariant:
        return f"update {step.number}: not invariant"
    return f"update {step.number}: width {np.ptp(step.worst[-1, index]):.3g}"


def cycle(ax: Axes, ends: Floats) -> None:
    """Stars on top of all else where p and q, shape (2,), are on the diagonal."""
    ax.plot(ends, ends, "*", color="black", mec="white", mew=0.5, ms=8, zorder=9, label="$p$, $q$")


def _update(domain: AttractingDomain, number: int) -> Update:
    """The update at this position, from the end if negative."""
    if not -len(domain.updates) <= number < len(domain.updates):
        raise NsmapsError(f"there is no update at position {number}; the domain has {len(domain.updates)} updates")
    return domain.updates[number]


def worst_case(domain: AttractingDomain) -> str:
    """What the legend calls the worst case: of a map that encloses images it is itself enclosed, and passes the samples."""
    return "worst case, enclosed" if domain.status == "enclosed" else "worst case"


def worst_steps(step: Update, index: int) -> tuple[Floats, Floats]:
    """The staircase of one coordinate's intervals: from where a curve is extreme up to its extreme, across to the diagonal."""
    x: list[float] = []
    y: list[float] = []
    for places, (lowest, highest) in zip(step.at[:, index].mean(axis=2), step.worst[1:, index], strict=True):
        for at, end in ((places[1], highest), (places[0], lowest)):
            x += [at, at, end, np.nan]
            y += [at, end, end, np.nan]
    return np.array(x), np.array(y)


def frame(ax: Axes, x: Floats, values: Floats) -> None:
    """Limits a tenth beyond the box along the one axis and the finite values along the other, and the diagonal within them."""
    held = np.append(x, values[np.isfinite(values)])
    for low, high, limits in ((x[0], x[-1], ax.set_xlim), (held.min(), held.max(), ax.set_ylim)):
        margin = _MARGIN * (high - low)
        limits(low - margin, high + margin)
    diagonal(ax, *ax.get_xlim())


def bounding(letter: str, domain: AttractingDomain) -> str:
    """The upper map, of the letter U, or the lower one, and that it is of samples where the worst case is enclosed."""
    name = "upper map" if letter == "U" else "lower map"
    return name + (", samples" if domain.status == "enclosed" else "")
