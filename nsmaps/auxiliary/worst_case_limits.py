"""p and q of each coordinate as roots of the second-iterate map, eq. pvqv_modified, pphiqphi_modified and WCSsecond-CD."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.auxiliary.envelope import AuxiliaryMaps
from nsmaps.auxiliary.worst_case import Update
from nsmaps.results import Result, array

Curve = Callable[[Floats], Floats]
ROUNDED = 1e-10  #: by how much iteration and roots of curves that are known to rounding may differ, relative to the start box
POINTS = 201  #: at which changes of sign are sought, over twice the box
RESOLVED = 1e-15  #: share of a root, or of twice the box, to which it is found


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TwoCycle(Result):
    """The limit of the worst case of one coordinate, computed twice: by iteration, and as a root of the second-iterate map."""

    coordinate: str
    iterated: Floats = field(metadata=array("end", "p and q, the limit of the worst-case iteration"))
    roots: Floats = field(metadata=array("end", "p and q as roots; NaN where the second-iterate map has none nearby"))
    places: tuple[str, str]  #: where the lower map is least and the upper one largest on [p, q]: at p, at q, or inside
    slope: float  #: largest absolute slope of the second-iterate map at p and q, zero where it is constant; NaN where not known
    accuracy: float = ROUNDED  #: the accuracy of both, in the coordinate's units

    def summary(self) -> str:
        """The numbers that matter."""
        ends = " and ".join(f"{name} = {value:.8g}" for name, value in zip("pq", self.iterated, strict=True))
        return f"{self.coordinate}: {ends}, slope {self.slope:.3g}, accuracy {self.accuracy:.1g}"

    @property
    def stable(self) -> bool | None:
        """True if the worst case converges to it; None where the slope is not known."""
        return None if math.isnan(self.slope) else self.slope < 1

    @property
    def agree(self) -> bool:
        """Whether iteration and roots differ by no more than the accuracy to which both are known."""
        return bool(np.abs(self.iterated - self.roots).max() <= self.accuracy)


def two_cycles(maps: AuxiliaryMaps, last: Update, accuracy: Floats) -> tuple[TwoCycle, ...]:
    """The limits of the worst case of an update, one a coordinate, with the curves of its auxiliary maps.

    Args:
        accuracy: shape (n,), of the curves; p and q are known to 1 / (1 - slope) of it, as errors of iterates add up.
    """
    return tuple(_two_cycle(maps, k, last, float(accuracy[k])) for k in range(len(last.box)))


def _two_cycle(maps: AuxiliaryMaps, index: int, last: Update, accuracy: float) -> TwoCycle:
    """The equations of p and q follow from where on [p, q] the curves are extreme.

    With the least of the lower map at q and the largest of the upper one at p, p is a root of xi_L(xi_U(p)) = p. An extreme at
    an end of its own makes that a fixed point, as xi_L(p) = p; one inside is a number.
    """
    ends, at = last.worst[-1, index], last.at[-1, index]
    side = float(np.ptp(last.box[index]))
    near = 1e-6 * max(float(np.ptp(ends)), 1e-9 * side)
    places = _place(at[0], ends, near), _place(at[1], ends, near)

    def lower(x: Floats) -> Floats:
        return maps.curves(index, x)[0]

    def upper(x: Floats) -> Floats:
        return maps.curves(index, x)[1]

    reach = last.box[index].mean() + np.array([-1, 1]) * side
    match places:
        case ("q", "p"):
            p = _root(lambda x: lower(upper(x)), ends[0], reach)
            q = float(upper(np.array([p]))[0])
        case (least, largest):
            p = _end(lower, least == "p", ends[0], at[0], reach)
            q = _end(upper, largest == "q", ends[1], at[1], reach)
            p = float(lower(np.array([q]))[0]) if least == "q" else p
            q = float(upper(np.array([p]))[0]) if largest == "p" else q
    slope, name = _slope(lower, upper, places, p, q, 1e-9 * side), last.envelopes[index].coordinate
    return TwoCycle(name, ends, np.array([p, q]), places, slope, accuracy / (1 - slope) if slope < 1 else accuracy)


def _place(at: Floats, ends: Floats, near: float) -> str:
    """Which end of an interval a place is at."""
    return "p" if at[1] <= ends[0] + near else "q" if at[0] >= ends[1] - near else "inside"


def _end(curve: Curve, own: bool, value: float, at: Floats, reach: Floats) -> float:
    """The fixed point of a curve whose extreme is at its own end, or the extreme of one that is inside."""
    return _root(curve, value, reach) if own else float(curve(np.array([at.mean()]))[0])


def _root(function: Curve, near: float, reach: Floats) -> float:
    """The fixed point of a function that is nearest to a value, between the ends of `reach`; NaN if there is none.

    Values on a grid show where it lies, and Brent's method finds it there.
    """
    from scipy.optimize import brentq

    x = np.linspace(reach[0], reach[1], POINTS)
    over = function(x) - x
    changes = np.flatnonzero(over[:-1] * over[1:] <= 0)
    if not len(changes):
        return np.nan
    k = changes[np.argmin(np.abs((x[changes] + x[changes + 1]) / 2 - near))]
    wide = RESOLVED * float(np.ptp(reach))
    try:
        return float(brentq(lambda x: function(np.array([x]))[0] - x, x[k], x[k + 1], xtol=wide, rtol=RESOLVED))
    except ValueError:  # a value is missing between them
        return np.nan


def _slope(lower: Curve, upper: Curve, places: tuple[str, str], p: float, q: float, least: float) -> float:
    def by_difference(curve: Curve, x: float) -> float:
        h = max(1e-4 * (q - p), 1e-6 * max(abs(p), abs(q)), least)
        before, after = curve(np.array([x - h, x + h]))
        return float(after - before) / (2 * h)

    if places == ("q", "p"):
        return abs(by_difference(lower, q) * by_difference(upper, p))
    own = [by_difference(lower, p) ** 2] if places[0] == "p" else []
    return max([*own, by_difference(upper, q) ** 2] if places[1] == "q" else [*own, 0.0])
