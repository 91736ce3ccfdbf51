"""Arithmetic terms of conditions over boxes of states, in intervals that hold the rounded value and the exact one."""

import ast
from collections.abc import Callable
from itertools import product

import numpy as np

from nsmaps.exact.impacts import TWO_PI, Floats
from nsmaps.reduced.reader import Reader

Interval = tuple[Floats, Floats]  #: lower and upper ends, shape (N,); both NaN where the value may be none or infinite
ROUNDING = 2.0**-50  #: relative: more than any operation or function errs by
TINY = 1e-300  #: the same about zero


def enclosed(reader: Reader, node: ast.expr, boxes: Floats) -> Interval:
    """The values of a term that the reader accepts, at the states of boxes (N, n, 2)."""
    value = reader.term(node)
    if isinstance(value, float):
        return np.full(len(boxes), value), np.full(len(boxes), value)
    match node:
        case ast.Name(id=name):
            low, high = boxes[:, reader.column[name]].T
            return low, high
        case ast.UnaryOp(op=op, operand=operand):
            low, high = enclosed(reader, operand, boxes)
            return (-high, -low) if isinstance(op, ast.USub) else (low, high)
        case ast.BinOp(op=op, left=left, right=right):
            with np.errstate(all="ignore"):
                return _outward(*BINARY[type(op)](enclosed(reader, left, boxes), enclosed(reader, right, boxes)))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            with np.errstate(all="ignore"):
                return _outward(*FUNCTIONS[name](*enclosed(reader, argument, boxes)))
    raise AssertionError(f"{ast.dump(node)} was not accepted")


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


BINARY: dict[type[ast.AST], Callable[[Interval, Interval], Interval]] = {
    ast.Add: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    ast.Sub: lambda a, b: (a[0] - b[1], a[1] - b[0]),
    ast.Mult: lambda a, b: _corners(np.multiply, a, b),
    ast.Div: _quotient,
    ast.Pow: _power,
}
FUNCTIONS: dict[str, Callable[[Floats, Floats], Interval]] = {
    "sqrt": lambda low, high: (np.sqrt(low), np.sqrt(high)),
    "exp": lambda low, high: (np.exp(low), np.exp(high)),
    "log": lambda low, high: (np.log(low), np.log(high)),
    "sin": lambda low, high: _wave(np.sin, np.pi / 2, low, high),
    "cos": lambda low, high: _wave(np.cos, 0.0, low, high),
}
