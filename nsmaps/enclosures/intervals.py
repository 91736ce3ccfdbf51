"""Arithmetic over boxes of states, in intervals that hold the rounded value and the exact one."""

from collections.abc import Callable
from itertools import product

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI

Interval = tuple[Floats, Floats]  #: lower and upper ends, shape (N,); both NaN where the value may be none or infinite
ROUNDING = 2.0**-50  #: relative: more than any operation or function errs by
TINY = 1e-300  #: the same about zero


def signed(sign: str, term: Interval) -> Interval:
    """The values of a term after a sign."""
    low, high = term
    return (-high, -low) if sign == "-" else (low, high)


def arithmetic(operator: str, left: Interval, right: Interval) -> Interval:
    """The values of two terms joined by +, -, *, / or **."""
    with np.errstate(all="ignore"):
        return _outward(*BINARY[operator](left, right))


def function(name: str, argument: Interval) -> Interval:
    """The values of one of the functions that conditions may call."""
    with np.errstate(all="ignore"):
        return _outward(*FUNCTIONS[name](*argument))


def difference(a: Interval, b: Interval) -> Interval:
    """The values of a - b: its sign is that of the comparison, also in floats."""
    with np.errstate(all="ignore"):
        return _outward(a[0] - b[1], a[1] - b[0])


def _outward(low: Floats, high: Floats) -> Interval:
    known = np.isfinite(low) & np.isfinite(high)
    low, high = low - ROUNDING * np.abs(low) - TINY, high + ROUNDING * np.abs(high) + TINY
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def _corners(operation: Callable[[Floats, Floats], Floats], a: Interval, b: Interval) -> Interval:
    """The extremes of an operation that is monotone in each operand; NaN where a corner is."""
    values = np.stack([operation(x, y) for x, y in product(a, b)])
    return values.min(axis=0), values.max(axis=0)


def _quotient(a: Interval, b: Interval) -> Interval:
    low, high = _corners(np.divide, a, b)
    zero = (b[0] <= 0) & (b[1] >= 0)
    return np.where(zero, np.nan, low), np.where(zero, np.nan, high)


def _power(a: Interval, b: Interval) -> Interval:
    """Of a base that is positive, or of whole exponents that are one number."""
    low, high = _corners(np.power, a, b)
    whole = (b[0] == b[1]) & (np.round(b[0]) == b[0]) & (np.abs(b[0]) < 2**31)
    zero = (a[0] <= 0) & (a[1] >= 0)
    low = np.where(zero & (np.mod(b[0], 2) == 0) & (b[0] > 0), 0.0, low)
    known = (a[0] > 0) | (whole & ~(zero & (b[0] < 0)))
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def _wave(function: Callable[[Floats], Floats], top: float, low: Floats, high: Floats) -> Interval:
    """Sine and cosine, which are largest at `top` and whole turns from there, smallest half a turn beyond."""
    slack = 1e-14 * (1 + np.abs(low) + np.abs(high))

    def meets(at: float) -> Floats:
        return np.asarray(np.ceil((low - slack - at) / TWO_PI) <= np.floor((high + slack - at) / TWO_PI))

    ends = np.stack([function(low), function(high)])
    least = np.where(meets(top + np.pi), -1.0, ends.min(axis=0))
    return least, np.where(meets(top), 1.0, ends.max(axis=0))


BINARY: dict[str, Callable[[Interval, Interval], Interval]] = {
    "+": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "-": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "*": lambda a, b: _corners(np.multiply, a, b),
    "/": _quotient,
    "**": _power,
}
FUNCTIONS: dict[str, Callable[[Floats, Floats], Interval]] = {
    "sqrt": lambda low, high: (np.sqrt(low), np.sqrt(high)),
    "exp": lambda low, high: (np.exp(low), np.exp(high)),
    "log": lambda low, high: (np.log(low), np.log(high)),
    "sin": lambda low, high: _wave(np.sin, np.pi / 2, low, high),
    "cos": lambda low, high: _wave(np.cos, 0.0, low, high),
}
