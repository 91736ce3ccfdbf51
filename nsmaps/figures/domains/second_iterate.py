"""Second-iterate maps against the diagonal, whose fixed points bound the domain: fig. highorderiterate."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from sympy import sympify

from nsmaps.arrays import Floats
from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.auxiliary.worst_case import Update
from nsmaps.errors import NsmapsError
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.domains.envelopes import frame
from nsmaps.figures.domains.looks import heading
from nsmaps.figures.lines import diagonal, window
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import Bounded, position
from nsmaps.figures.style import BLUE, GREEN, MAGENTA, RED, dress
from nsmaps.symbolic.curve_iterates import SecondIterate

_POINTS = 401  #: of a curve


def sheets(polynomial: SecondIterate, bounded: Bounded | None = None) -> tuple[Sheet, ...]:
    """One sheet with a panel a coordinate of the domain; the polynomial alone where no domain is given."""
    if bounded is None:
        return (Sheet("second_iterate", (partial(second_iterate, polynomial),), 1, 0.75, legend=True, share=0.65),)
    names, title = bounded.domain.coordinates, heading(bounded.name, bounded.domain)
    panels = tuple(partial(second_iterate, polynomial, bounded=bounded, coordinate=name) for name in names)
    return (Sheet("second_iterate", panels, min(len(panels), 2), 0.84, title=title, legend=True),)


def second_iterate(polynomial: SecondIterate, ax: Axes, bounded: Bounded | None = None, coordinate: str = "") -> Axes:
    """One coordinate two steps on, at updates of the auxiliary maps by number, each over its box (eq. auxv2nd, auxphi2nd).

    Without a domain it is the polynomial alone, over its own, with its fixed points.

    In place of an update that was not made the last. The lower
    map of the upper one has the fixed point p; the upper of the lower one, thin, has q. Where part 1 of the Statement does not
    apply it is the worst case of each over the interval that begins or ends at the value (eq. WCSsecond-v, -phi). Where the
    maps of the last update are closed forms, the polynomial of the study is dashed, over all of the widest box. A last box that
    is small is enlarged.
    """
    if bounded is None:
        return _alone(polynomial, ax)
    domain = bounded.domain
    i = position(domain.coordinates, coordinate or domain.coordinates[0])
    named = bounded.updates or (2, len(domain.updates))
    steps = list(dict.fromkeys(domain.updates[min(number, len(domain.updates)) - 1] for number in named))
    colours = dict(zip((step.number for step in steps), cycle((BLUE, RED, GREEN, MAGENTA)), strict=False))
    values = _draw(ax, polynomial, domain, i, steps, colours)
    x = max((step.envelopes[i].x for step in steps), key=np.ptp)
    bottom, top = window(x[0], x[-1], np.concatenate([x, values]), 1.0)
    frame(ax, x, np.array([bottom, top]))
    ax.legend()
    dress(ax, (domain.coordinates[i], "k"), (domain.coordinates[i], "k+2"))
    last = steps[-1]
    small = np.tile(last.box[i][:, None], 2) if last.forward_invariant else np.empty((0, 2))
    span = ax.get_xlim()

    def enlarged(inner: Axes) -> None:
        _draw(inner, polynomial, domain, i, [last], colours)
        diagonal(inner, *span)

    if len(small):
        inset(ax, small, enlarged, above=True)
    return ax


def _alone(polynomial: SecondIterate, ax: Axes) -> Axes:
    """The polynomial over its own domain, with the diagonal and the fixed points there."""
    name = str(polynomial.variable)
    if name not in polynomial.domain or not all(coefficient.is_number for coefficient in map(sympify, polynomial.alpha)):
        raise NsmapsError(f"a second iterate with symbols, or without a domain of {name!r}; expected: numbers, by `at`")
    low, high = polynomial.domain[name]
    x = np.linspace(low, high, _POINTS)
    values = np.polynomial.polynomial.polyval(x, np.array(polynomial.alpha, float))
    ax.plot(x, values, color=BLUE, lw=1.5, label=f"polynomial, degree {len(polynomial.alpha) - 1}")
    points = [point for point in polynomial.fixed_points() if low <= point <= high]
    ax.plot(points, points, "*", color=BLUE, mec="black", mew=0.4, ms=7, zorder=8, label="fixed points")
    diagonal(ax, low, high)
    ax.legend()
    return dress(ax, (name, "k"), (name, "k+2"))


def _draw(
    ax: Axes, polynomial: SecondIterate, domain: AttractingDomain, i: int, steps: Sequence[Update], colours: Mapping[int, str]
) -> Floats:
    """The second iterates of one coordinate at some updates, with their fixed points; the values of the curves."""
    drawn, meets, any_worst = [np.empty(0)], False, False
    for step in steps:
        colour = colours[step.number]
        x, lower, upper = (getattr(step.envelopes[i], part) for part in ("x", "lower", "upper"))
        worst = step.part[i] == 2
        first = _worst(x, lower, upper) if worst else _after(x, lower, upper)
        second = _worst(x, upper, lower, -1) if worst else _after(x, upper, lower)
        ways = (first, 1.5, f"$N = {step.number}$"), (second, 0.6, f"_upper of lower map {step.number}")
        for curve, width, text in ways:
            if np.isfinite(curve).any():
                ax.plot(x, curve, color=colour, lw=width, ls=(0, (5, 1)) if worst else "-", label=text)
                drawn.append(curve[np.isfinite(curve)])
            meets |= _meets(x, curve)
        any_worst |= worst
        if step.forward_invariant:
            ends, last = step.worst[-1, i], step is steps[-1]
            text = "$p$, $q$" if last else "_"
            ax.plot(ends, ends, "*", color=colour, mec="black", mew=0.4, ms=7, zorder=8 + last, label=text)
    _polynomial(ax, polynomial, domain, i, steps)
    ax.plot([], [], color="0.4", lw=0.6, label="upper map after lower map")
    if any_worst:
        ax.plot([], [], color="0.4", lw=1.5, ls=(0, (5, 1)), label="worst case")
    if not meets:
        ax.text(0.5, 0.05, "no fixed point in the box", transform=ax.transAxes, ha="center", va="bottom")
    return np.concatenate(drawn)


def _polynomial(ax: Axes, polynomial: SecondIterate, domain: AttractingDomain, i: int, steps: Sequence[Update]) -> None:
    """The polynomial of the study, of its coordinate, if it is of the last update that is shown."""
    last, closed = steps[-1], steps[-1].envelopes[i].kind == "closed form"
    if str(polynomial.variable) != domain.coordinates[i] or last is not domain.updates[-1] or not closed:
        return
    own, widest = last.envelopes[i].x, max((step.envelopes[i].x for step in steps), key=np.ptp)
    alpha = np.array(polynomial.alpha, float)
    inside = [(own[0] <= value <= own[-1]) for value in np.polynomial.polynomial.polyval(own, alpha)]
    out = "" if all(inside) else f", {100 * (1 - np.mean(inside)):.0f} % of it beyond the box"
    x = np.union1d(own, widest)
    values = np.polynomial.polynomial.polyval(x, alpha)
    far = np.ptp(widest)
    values[(values < widest[0] - far) | (values > widest[-1] + far)] = np.nan
    ax.plot(x, values, color="black", lw=0.8, ls=(0, (3, 2)), zorder=4, label=f"polynomial, degree {len(alpha) - 1}{out}")


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
