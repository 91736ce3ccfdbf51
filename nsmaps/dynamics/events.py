"""Where along the curve of a periodic orbit a multiplier passes the unit circle, or the orbit ceases to be."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nsmaps.dynamics.arclength import Curve, Place
from nsmaps.dynamics.motion import differences
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.impacts import Floats

DOUBLING, FOLD, BRANCH_POINT, TORUS = "period doubling", "fold", "branch point", "Neimark-Sacker"
HALVING = "period halving"
GRAZING, DOMAIN = "grazing", "end of the valid domain"
FINEST = 1e-13  #: of the arclength, to which an event is located
AROUND = 1e-3  #: of a step, next to where two branches cross
ROUNDING = 1e-13  #: of the largest multiplier, below which another is not known
CONSERVED = 1e-9  #: a test that stays within this is zero but for rounding, as of area where a map preserves it
COARSEST = 1e-8  #: of the range of the parameter, to which an event must be located


@dataclass(frozen=True, slots=True, eq=False)
class Event:
    """What happens to a periodic orbit at a value of the parameter.

    A `period doubling`, `fold` (the branch turns back in the parameter), `branch point` (a multiplier passes 1 elsewhere),
    `Neimark-Sacker` (a pair leaves the unit circle), `period halving` (a doubled cycle ends on the one it came from), `grazing`
    (an impact speed or a clearance falls to zero and the words change) or `end of the valid domain` (there is no map beyond).
    """

    kind: str
    parameter: float
    precision: float  #: of the parameter, as estimated from the last steps towards it
    orbit: PeriodicOrbit  #: there; of a grazing or the domain's end, the last one before it
    detail: str = ""  #: which margin falls to zero, why there is no map, or that an event was passed but not located

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Of the orbit, shape (n,)."""
        return self.orbit.multipliers


def _known(place: Place) -> NDArray[np.complex128]:
    """The multipliers, zero for those that are rounding of the largest: as of a long cycle deep in chaos, told as any number."""
    values = place.orbit.multipliers
    return np.where(np.abs(values) > ROUNDING * np.abs(values[0]), values, 0)


def _doubling(place: Place, _: Floats) -> float:
    return float(np.prod(1 + _known(place)).real)


def _fold(_: Place, along: Floats) -> float:
    return float(along[-1])


def _one(place: Place, _: Floats) -> float:
    return float(np.prod(1 - _known(place)).real)


def _torus(place: Place, _: Floats) -> float:
    """The product of (a b - 1) over pairs of multipliers."""
    values = _known(place)
    i, j = np.triu_indices(len(values), 1)
    return float(np.prod(values[i] * values[j] - 1).real)


Test = Callable[[Place, Floats], float]
TESTS: dict[str, Test] = {DOUBLING: _doubling, FOLD: _fold, BRANCH_POINT: _one, TORUS: _torus}


def between(curve: Curve, at: Place, along: Floats, new: Place, turned: Floats, h: float, kinds: Collection[str]) -> list[Event]:
    """The events of these kinds between two neighbouring places of a curve, h apart, with the curve's directions at both.

    In order; where a doubled cycle ends on the one it came from is told always.
    """
    found: list[tuple[float, Event]] = []
    ends = {kind: (test(at, along), test(new, turned)) for kind, test in TESTS.items()}
    passed = {kind for kind, (a, b) in ends.items() if (a * b < 0 or a != 0 == b) and max(abs(a), abs(b)) > CONSERVED}
    if FOLD in passed:
        passed.discard(BRANCH_POINT)
        if swapped(curve, at, new):
            passed = {HALVING}
    for kind in passed & {*kinds, HALVING}:
        if kind == HALVING:
            known = halving(curve, at, h)
        elif ends[kind][1] == 0:
            known = h, new, float(FINEST * curve.unit + np.spacing(abs(new.value)))
        else:
            known = located(curve, at, along, h, TESTS[kind])
        s, place, precision = known or (h, new, abs(new.value - at.value))
        if kind != TORUS or np.abs(place.orbit.multipliers.imag).max() > 0:  # else two real ones whose product is one
            detail = "" if known else "not located: somewhere in the step before this orbit"
            found.append((s, Event(kind, place.value, precision, place.orbit, detail)))
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def located(curve: Curve, at: Place, along: Floats, h: float, test: Test) -> tuple[float, Place, float] | None:
    """The arclength within h of a place at which a test passes zero, the place there, and the precision of its parameter.

    By Brent's method; None where the curve is not found on the way.
    """
    from scipy.optimize import brentq

    known: list[tuple[float, float, Place]] = []

    def passed(s: float) -> float:
        place = curve.solve(at.y + s * along, along)
        if place is None:
            raise _Lost(s)
        tangent = place.tangent
        known.append((s, test(place, tangent * np.copysign(1.0, tangent @ along)), place))
        return known[-1][1]

    try:
        brentq(passed, 0.0, h, xtol=FINEST, rtol=1e-14)
    except _Lost as lost:
        return _crossing(curve, passed, known, lost.args[0], h)
    except ValueError:  # no zero after all
        return None
    (s, rest, place), (_, other, near) = sorted(known, key=lambda row: abs(row[1]))[:2]
    slope = (near.value - place.value) / (other - rest) if other != rest else 0.0
    precision = float(abs(rest * slope) + FINEST * curve.unit + np.spacing(abs(place.value)))
    return (s, place, precision) if precision <= COARSEST * curve.unit else None


class _Lost(Exception):
    """Newton's method fails at an arclength."""


def _crossing(
    curve: Curve, passed: Callable[[float], float], known: list[tuple[float, float, Place]], s: float, h: float
) -> tuple[float, Place, float] | None:
    """As `located`, where the method fails because two branches cross: from four places around the crossing."""
    try:
        for k in (-1, 1, -2, 2):
            passed(s + k * AROUND * h)
    except _Lost:
        return None
    value, precision = at_zero([test for _, test, _ in known[-4:]], [place.value for *_, place in known[-4:]])
    return (s, replace(known[-4][2], value=value), precision) if precision <= COARSEST * curve.unit else None


def at_zero(tests: list[float], values: list[float]) -> tuple[float, float]:
    """The value where a test is zero, by the polynomial through all pairs, and how far it is from that without the last."""
    best, other = (float(np.polynomial.Polynomial.fit(tests[:n], values[:n], n - 1)(0.0)) for n in (len(tests), len(tests) - 1))
    return best, abs(best - other)


def swapped(curve: Curve, at: Place, new: Place) -> bool:
    """Whether the halves of a cycle change places between neighbours on its branch."""
    q = curve.period
    rolled = replace(new.orbit.returns, start=np.roll(new.orbit.states, q // 2, axis=0))
    other = replace(new, orbit=PeriodicOrbit(rolled, curve.tolerance, curve.scale))
    return q % 2 == 0 and curve.apart(at, other) < (1 + AROUND) * curve.apart(at, new)  # or are one, where they change places


def halving(curve: Curve, at: Place, h: float) -> tuple[float, Place, float] | None:
    """Where, within h of a place, a cycle has half its period, as of `located`: at a doubling of the cycle of half the period."""
    half = replace(curve, period=curve.period // 2)
    first, second = np.split(at.orbit.states, 2)
    middle = first + differences(second, first, at.orbit.returns.coordinates) / 2
    here = half.solve(half.y(middle, at.value), np.append(np.zeros(middle.size), 1.0))
    if here is None:
        return None
    along = here.tangent
    before = half.solve(here.y - h * along, along)
    return located(half, before, along, 2 * h, TESTS[DOUBLING]) if before else None
