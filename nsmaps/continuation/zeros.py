"""Zeros of a test function along a curve that is continued: places of bifurcations and other events."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Curve, P, correct, tangent

PRECISION = 1e-13  #: share of the arclength, to which a zero is located


@dataclass(frozen=True, slots=True)
class Zero(Generic[P]):
    """A zero of a test function along a curve."""

    arclength: float  #: from the start of the step
    point: P  #: the nearest point of the curve that was found
    error: Floats  #: of its unknowns, shape (m + 1,): the last points on either side are as near


def locate(curve: Curve[P], start: P, direction: Floats, length: float, test: Callable[[P, Floats], float]) -> Zero[P] | None:
    """The place, within a length from a point of a curve in a direction, at which a test of point and unit tangent is zero.

    Brent's method is used. None where the test has one sign, or points are not found.
    """
    from scipy.optimize import brentq

    known: list[tuple[float, float, P]] = []

    def value(arclength: float) -> float:
        point = correct(curve, start.y + arclength * direction, direction)
        if point is None:
            raise ValueError("Newton's method fails at an arclength")
        known.append((arclength, test(point, tangent(point, direction)), point))
        return known[-1][1]

    try:
        brentq(value, 0.0, length, xtol=PRECISION, rtol=1e-14)
    except ValueError:  # a point is missing, or the test has the same sign at both ends
        return None
    s, nearest, point = min(known, key=lambda sample: abs(sample[1]))
    beyond = (sample for sample in known if sample[1] * nearest < 0)
    other = min(beyond, key=lambda sample: abs(sample[0] - s), default=(s, nearest, point))[2]
    return Zero(s, point, np.abs(curve.difference(other.y, point.y)) + PRECISION)


def extrapolated(tests: list[float], values: Floats) -> tuple[float, float]:
    """The value where a test is zero, by the polynomial through all pairs, and its difference from that without the last pair.

    Tests are distinct. The polynomial is that of Lagrange, which is as accurate for tests of very different sizes.
    """
    best, other = (_at_zero(np.array(tests[:n]), values[:n]) for n in (len(tests), len(tests) - 1))
    return best, abs(best - other)


def _at_zero(tests: Floats, values: Floats) -> float:
    """The value at the test 0 of the polynomial through pairs, shape (n,) each."""
    others = [np.delete(tests, k) for k in range(len(tests))]
    return float(sum(value * np.prod(each / (each - test)) for value, test, each in zip(values, tests, others, strict=True)))
