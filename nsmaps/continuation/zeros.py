"""Zeros of a test function along a curve that is continued: places of bifurcations and other events."""

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, isnan
from typing import Generic

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Curve, P, correct, tangent

PRECISION = 1e-13  #: share of the arclength, to which a zero is located
RELATIVE, MOST_STEPS = 8.881784197001252e-16, 100  #: of Brent's method: share of a zero to which it is sought, most values taken


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
    known: list[tuple[float, float, P]] = []

    def value(arclength: float) -> float:
        point = correct(curve, start.y + arclength * direction, direction)
        if point is None:
            raise ValueError("Newton's method fails at an arclength")
        known.append((arclength, test(point, tangent(point, direction)), point))
        return known[-1][1]

    try:
        brent(value, 0.0, length, PRECISION, rtol=1e-14)
    except ValueError:  # a point is missing, or the test has the same sign at both ends
        return None
    s, nearest, point = min(known, key=lambda sample: abs(sample[1]))
    beyond = (sample for sample in known if sample[1] * nearest < 0)
    other = min(beyond, key=lambda sample: abs(sample[0] - s), default=(s, nearest, point))[2]
    return Zero(s, point, np.abs(curve.difference(other.y, point.y)) + PRECISION)


def brent(function: Callable[[float], float], low: float, high: float, xtol: float, rtol: float = RELATIVE) -> float:
    """A zero of a function between two numbers, at which its signs differ, to `xtol` and a share of it.

    Brent's method (Algorithms for minimization without derivatives, 1973, chapter 4) in the steps of `scipy.optimize.brentq`, the
    import of which takes as long as some hundred values of a test.

    Raises:
        ValueError: both signs are the same, or a value is NaN.
        ArithmeticError: it does not converge.
    """

    def value(x: float) -> float:
        if isnan(y := function(x)):
            raise ValueError(f"the function value at x={x} is NaN")
        return y

    before, x = float(low), float(high)
    f_before, f = value(before), value(x)
    if f_before == 0:
        return before
    if f and copysign(1.0, f_before) == copysign(1.0, f):
        raise ValueError("the function has the same sign at both ends")
    other = f_other = last = step = 0.0
    for _ in range(MOST_STEPS):
        if f_before and f and copysign(1.0, f_before) != copysign(1.0, f):
            other, f_other, last, step = before, f_before, x - before, x - before
        if abs(f_other) < abs(f):
            before, x, other, f_before, f, f_other = x, other, x, f, f_other, f
        least, half = (xtol + rtol * abs(x)) / 2, (other - x) / 2
        if f == 0 or abs(half) < least:
            return x
        tried = _interpolated(before, x, other, f_before, f, f_other) if abs(last) > least and abs(f) < abs(f_before) else None
        good = tried is not None and 2 * abs(tried) < min(abs(last), 3 * abs(half) - least)
        last, step = (step, tried) if good and tried is not None else (half, half)
        before, f_before = x, f
        x += step if abs(step) > least else least if half > 0 else -least
        f = value(x)
    raise ArithmeticError(f"Brent's method has not converged after {MOST_STEPS} steps; the last one leads to {x}")


def _interpolated(before: float, x: float, other: float, f_before: float, f: float, f_other: float) -> float | None:
    """The step to the zero of a line through two points, or of an inverse parabola through three; None if that is not defined."""
    if before == other:
        return -f * (x - before) / (f - f_before)
    slope, steep = (f_before - f) / (before - x), (f_other - f) / (other - x)
    divisor = steep * slope * (f_other - f_before)
    return -f * (f_other * steep - f_before * slope) / divisor if divisor else None


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
