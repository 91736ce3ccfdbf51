"""Zeros of a test function along a curve that is continued: places of bifurcations and other events."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Curve, P, correct, tangent

PRECISION = 1e-13  #: share of the arclength, to which a zero is located
ASIDE = 1e-2  #: share of a step, from the place where two curves cross to the points beside it
ESTIMATED = 4.0  #: times the difference of two extrapolations: their error, as there are few digits beside a crossing
BLURRED = 1e-9  #: error of the last unknown, above which Newton's method may have led to another curve beside the zero
APART = (10.0, 3.0, 1.0)  #: multiples of it that are tried, of which those are taken that agree best


@dataclass(frozen=True, slots=True)
class Zero(Generic[P]):
    """A zero of a test function along a curve."""

    arclength: float  #: from the start of the step
    point: P  #: the nearest point of the curve that was found
    y: Floats  #: the unknowns at the zero, shape (m + 1,): those of `point`, unless two curves cross there
    error: Floats  #: of these unknowns, shape (m + 1,): the last points on either side are as near; estimated where curves cross


@dataclass(frozen=True, slots=True)
class _Sample(Generic[P]):
    """A point of the curve with the test's value."""

    arclength: float
    value: float
    point: P


class _Missing(Exception):
    """Newton's method fails at an arclength."""


def locate(
    curve: Curve[P],
    start: P,
    direction: Floats,
    length: float,
    test: Callable[[P, Floats], float],
    crossing: bool = False,
) -> Zero[P] | None:
    """The place, within a length from a point of a curve in a direction, at which a test of point and unit tangent is zero.

    Brent's method is used. Where Newton's method fails, or leads to another curve, as where two cross, the unknowns are
    extrapolated to the zero from four points beside it, as at a known `crossing`, where points found next to the zero may
    be on either curve. None where the test has one sign, or the points are not found.
    """
    from scipy.optimize import brentq

    known: list[_Sample[P]] = []

    def value(arclength: float) -> float:
        point = correct(curve, start.y + arclength * direction, direction)
        if point is None:
            raise _Missing(arclength)
        known.append(_Sample(arclength, test(point, tangent(point, direction)), point))
        return known[-1].value

    try:
        brentq(value, 0.0, length, xtol=PRECISION, rtol=1e-14)
    except _Missing as missing:
        return _crossing(curve, value, known, missing.args[0], length)
    except ValueError:  # the test has the same sign at both ends
        return None
    nearest = min(known, key=lambda sample: abs(sample.value))
    beyond = (sample for sample in known if sample.value * nearest.value < 0)
    other = min(beyond, key=lambda sample: abs(sample.arclength - nearest.arclength), default=nearest)
    error = np.abs(curve.difference(other.point.y, nearest.point.y)) + PRECISION
    found = Zero(nearest.arclength, nearest.point, nearest.point.y, error)
    crossed = _crossing(curve, value, known, nearest.arclength, length) if crossing or error[-1] > BLURRED else None
    return found if crossed is None or (error[-1] < crossed.error[-1] and not crossing) else crossed


def _crossing(
    curve: Curve[P], value: Callable[[float], float], known: list[_Sample[P]], arclength: float, length: float
) -> Zero[P] | None:
    """As `locate`, where Newton's method fails because two curves cross: from two points on either side of the crossing."""
    found = list[Zero[P]]()
    for share in APART:
        try:
            for k in (-1, 1, -2, 2):
                value(arclength + k * share * ASIDE * length)
        except _Missing:
            continue
        beside = known[-4:]
        base, tests = beside[0].point.y, [sample.value for sample in beside]
        rows = np.array([[*curve.difference(sample.point.y, base), sample.arclength] for sample in beside])
        at, error = np.array([extrapolated(tests, column) for column in rows.T]).T
        arclength = float(np.clip(at[-1], 0, length))
        found.append(Zero(arclength, beside[0].point, base + at[:-1], ESTIMATED * error[:-1]))
    return min(found, key=lambda zero: float(zero.error.max()), default=None)  # all unknowns betray a point of the other curve


def extrapolated(tests: list[float], values: Floats) -> tuple[float, float]:
    """The value where a test is zero, by the polynomial through all pairs, and its difference from that without the last pair."""
    best, other = (float(np.polynomial.Polynomial.fit(tests[:n], values[:n], n - 1)(0.0)) for n in (len(tests), len(tests) - 1))
    return best, abs(best - other)
