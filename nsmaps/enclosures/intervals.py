"""Arithmetic over boxes of states, in intervals that hold the rounded value and the exact one."""

from collections.abc import Callable
from itertools import product

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI

Interval = tuple[Floats, Floats]  #: lower and upper ends, shape (N,); both NaN where the value may be none or infinite
EPS = 2.0**-52  #: twice the unit roundoff: a reserve of one half, for terms of second order
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


def function(name: str, *arguments: Interval) -> Interval:
    """The values of one of the functions that conditions may call."""
    with np.errstate(all="ignore"):
        return EXACT[name](*arguments) if name in EXACT else _outward(*FUNCTIONS[name](*arguments[0]))


def difference(a: Interval, b: Interval) -> Interval:
    """The values of a - b: its sign is that of the comparison, also in floats."""
    with np.errstate(all="ignore"):
        return _outward(a[0] - b[1], a[1] - b[0])


def _outward(low: Floats, high: Floats) -> Interval:
    """Ends moved outwards, none across zero: a rounded value has the sign of the exact one."""
    known = np.isfinite(low) & np.isfinite(high)
    below, above = low - ROUNDING * np.abs(low) - TINY, high + ROUNDING * np.abs(high) + TINY
    below, above = np.where(low >= 0, np.maximum(below, 0), below), np.where(high <= 0, np.minimum(above, 0), above)
    return np.where(known, below, np.nan), np.where(known, above, np.nan)


def _corners(operation: Callable[[Floats, Floats], Floats], a: Interval, b: Interval) -> Interval:
    """The extremes of an operation that is monotone in each operand; NaN where a corner is."""
    values = np.stack([operation(x, y) for x, y in product(a, b)])
    return values.min(axis=0), values.max(axis=0)


def _quotient(a: Interval, b: Interval) -> Interval:
    low, high = _corners(np.divide, a, b)
    zero = (b[0] <= 0) & (b[1] >= 0)
    return np.where(zero, np.nan, low), np.where(zero, np.nan, high)


def _power(a: Interval, b: Interval) -> Interval:
    """Of a base that is positive, or zero with a positive exponent, or of whole exponents that are one number."""
    low, high = _corners(np.power, a, b)
    whole = (b[0] == b[1]) & (np.round(b[0]) == b[0]) & (np.abs(b[0]) < 2**31)
    zero = (a[0] <= 0) & (a[1] >= 0)
    low = np.where(zero & (np.mod(b[0], 2) == 0) & (b[0] > 0), 0.0, low)
    known = (a[0] > 0) | ((a[0] == 0) & (b[0] > 0)) | (whole & ~(zero & (b[0] < 0)))
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def _wave(function: Callable[[Floats], Floats], top: float, low: Floats, high: Floats) -> Interval:
    """Sine and cosine, which are largest at `top` and whole turns from there, smallest half a turn beyond."""
    slack = 1e-14 * (1 + np.abs(low) + np.abs(high))

    def meets(at: float) -> Floats:
        return np.asarray(np.ceil((low - slack - at) / TWO_PI) <= np.floor((high + slack - at) / TWO_PI))

    ends = np.stack([function(low), function(high)])
    least = np.where(meets(top + np.pi), -1.0, ends.min(axis=0))
    return least, np.where(meets(top), 1.0, ends.max(axis=0))


def _tangent(low: Floats, high: Floats) -> Interval:
    """None where a pole may lie between the ends."""
    slack = 1e-14 * (1 + np.abs(low) + np.abs(high))
    poles = np.ceil((low - slack) / np.pi - 0.5) <= np.floor((high + slack) / np.pi - 0.5)
    return np.where(poles, np.nan, np.tan(low)), np.tan(high)


def _absolute(a: Interval) -> Interval:
    low, high = np.abs(a[0]), np.abs(a[1])
    return np.where((a[0] <= 0) & (a[1] >= 0), 0.0, np.minimum(low, high)), np.maximum(low, high)


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
    "tan": _tangent,
    "asin": lambda low, high: (np.arcsin(low), np.arcsin(high)),
    "acos": lambda low, high: (np.arccos(high), np.arccos(low)),
    "atan": lambda low, high: (np.arctan(low), np.arctan(high)),
    "sinh": lambda low, high: (np.sinh(low), np.sinh(high)),
    "cosh": lambda low, high: (np.cosh(_absolute((low, high))[0]), np.cosh(_absolute((low, high))[1])),
    "tanh": lambda low, high: (np.tanh(low), np.tanh(high)),
}
EXACT: dict[str, Callable[..., Interval]] = {
    "abs": _absolute,
    "sign": lambda a: (np.sign(a[0]), np.sign(a[1])),
    "floor": lambda a: (np.floor(a[0]), np.floor(a[1])),
    "min": lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    "max": lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
}  #: functions that do not round
