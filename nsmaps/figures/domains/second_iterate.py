"""Second-iterate maps against the diagonal, whose fixed points bound the domain: fig. highorderiterate."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.figures.data import DOMAINS, SECOND_ITERATE, position, section
from nsmaps.figures.domains.envelopes import cycle, frame, headline, shown
from nsmaps.figures.domains.looks import heading
from nsmaps.figures.lines import window
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, ORANGE, dress

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.study.result import StudyResult


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: the first and the last update as rows, coordinates as columns."""
    name, domain = _domain(result)
    rows, columns = shown(domain), min(len(domain.coordinates), 2)
    panels = tuple(partial(second_iterate, result, coordinate=c, update=u) for u in rows for c in domain.coordinates)
    return (Sheet("second_iterate", panels, columns, 0.74, title=heading(name, domain), legend=True),)


def second_iterate(result: "StudyResult", ax: Axes, coordinate: str = "", update: int = -1) -> Axes:
    """One coordinate two steps on, at one update of the auxiliary maps, by position (eq. auxv2nd, auxphi2nd).

    The lower map of the upper one has the fixed point p, the upper of the lower one q; where part 2 of the Statement
    applies, the worst case of each over the interval that begins or ends at the value (eq. WCSsecond-v, -phi). At the last
    update, where the coordinate's maps are closed forms, the polynomial of eq. seconditerativev is dashed over them; its share
    beyond the box is stated.
    """
    polynomial, domain = SECOND_ITERATE.of(result, "second_iterate"), _domain(result)[1]
    i = position(domain.coordinates, coordinate or domain.coordinates[0])
    name, step = domain.coordinates[i], domain.updates[update]
    x, lower, upper = (getattr(step.envelopes[i], part) for part in ("x", "lower", "upper"))
    worst = step.part[i] == 2
    first = _worst(x, lower, upper) if worst else _after(x, lower, upper)
    second = _worst(x, upper, lower, -1) if worst else _after(x, upper, lower)
    for curve, colour, text in ((first, BLUE, "lower of upper map"), (second, ORANGE, "upper of lower map")):
        if np.isfinite(curve).any():
            ax.plot(x, curve, color=colour, lw=1.3, label=text)
    closed = step.envelopes[i].kind == "closed form"
    if str(polynomial.variable) == name and step is domain.updates[-1] and closed:
        values = np.polynomial.polynomial.polyval(x, np.array(polynomial.alpha, float))
        inside = (values >= x[0]) & (values <= x[-1])
        out = "" if inside.all() else f", {100 * (1 - inside.mean()):.0f} % of it beyond the box"
        ax.plot(x, values, color="black", lw=1, ls="--", label=f"polynomial, degree {len(polynomial.alpha) - 1}{out}")
    if not any(_meets(x, curve) for curve in (first, second)):
        ax.text(0.5, 0.05, "no fixed point in the box", transform=ax.transAxes, ha="center", va="bottom")
    if step.forward_invariant:
        cycle(ax, step.worst[-1, i])
    bottom, top = window(x[0], x[-1], np.concatenate([x, *(np.ravel(line.get_ydata()) for line in ax.lines)]), 1.0)
    frame(ax, x, np.array([bottom, top]))
    ax.set_title(f"update {step.number}, worst case" if worst and step.forward_invariant else headline(step, i))
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+2"))


def _domain(result: "StudyResult") -> tuple[str, "AttractingDomain"]:
    """The domain between whose bounds the study takes the second iterate, with its name."""
    name = section(result.study.second_iterate, "second_iterate").domain
    return name, DOMAINS.of(result, "second_iterate")[name]


def _meets(x: Floats, curve: Floats) -> bool:
    """Whether a curve given at x, NaN where it leads out, touches the diagonal."""
    difference = curve - x
    near = np.abs(difference) <= 1e-9 * np.ptp(x)
    return bool((near | np.append(difference[1:] * difference[:-1] < 0, False)).any())


def _after(x: Floats, second: Floats, first: Floats) -> Floats:
    """The second curve of the first, both given at x, shape (m,); NaN where the first leads out of x."""
    return np.asarray(np.interp(first, x, second, left=np.nan, right=np.nan))


def _worst(x: Floats, second: Floats, first: Floats, sign: int = 1) -> Floats:
    """The worst case of the second curve between x and the worst case of the first over [x, its end]; with sign -1 downwards.

    Upwards the interval of x ends at the box's upper end, the first curve is taken at its largest and the second at its least.
    """
    turned, least, largest = sign * x[::sign], sign * second[::sign], sign * first[::sign]
    values = []
    for k, end in enumerate(np.maximum.accumulate(largest[::-1])[::-1]):  # the largest first image from each x on
        between = least[k : max(k + 1, int(np.searchsorted(turned, end)))]
        values.append(min(between.min(), np.interp(max(end, turned[k]), turned, least)))
    return sign * np.array(values)[::sign]
