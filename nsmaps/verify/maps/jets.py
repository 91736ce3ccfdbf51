"""Values and derivatives of formulas over boxes, in Arb balls."""

import ast
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

from flint import arb

from nsmaps.verify.formula import UnprovedError

MOST_POWER = 64
Sum = tuple[tuple[str, int], ...]  #: terms, as text, with the whole numbers by which they are multiplied


class Jet(NamedTuple):
    """A value, and its derivatives by the coordinates, for all states of a box."""

    value: arb
    slopes: tuple[arb, ...]


class Known(NamedTuple):
    """What the conditions of pieces say of states: sums that are zero or above, and sums that are above zero."""

    least: frozenset[Sum] = frozenset()
    above: frozenset[Sum] = frozenset()


def constant(x: arb, n: int) -> Jet:
    """A number, of which the n derivatives are zero."""
    return Jet(x, (arb(0),) * n)


def jet_of(node: ast.expr, values: Mapping[str, Jet], known: Known) -> Jet:
    """A formula over a box."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return constant(arb(number), len(next(iter(values.values())).slopes))
        case ast.Name(id=name):
            return values[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            x = jet_of(operand, values, known)
            return Jet(-x.value, tuple(-slope for slope in x.slopes))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return jet_of(operand, values, known)
        case ast.BinOp(op=ast.Pow(), left=left, right=right):
            return _power(jet_of(left, values, known), right, jet_of(right, values, known))
        case ast.BinOp(op=operation, left=left, right=right):
            return _of_two(operation, jet_of(left, values, known), jet_of(right, values, known))
        case ast.Call(func=ast.Name(id="sqrt"), args=[argument]):
            return _root(jet_of(argument, values, known), sum_of(argument) in known.least)
        case ast.Call(func=ast.Name(id="min" | "max" as name), args=[first, *others]):
            found = jet_of(first, values, known)
            for other in others:
                found = _extreme(1 if name == "max" else -1, found, jet_of(other, values, known))
            return found
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            x = jet_of(argument, values, known)
            value, slope = FUNCTIONS[name](x.value)
            return Jet(value, tuple(slope * each for each in x.slopes))
    raise ValueError(f"{ast.unparse(node)!r} is not a number")


def _of_two(operation: ast.operator, x: Jet, y: Jet) -> Jet:
    match operation:
        case ast.Add():
            return Jet(x.value + y.value, tuple(a + b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Sub():
            return Jet(x.value - y.value, tuple(a - b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Mult():
            return Jet(x.value * y.value, tuple(a * y.value + x.value * b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Div():
            value = x.value / y.value
            return Jet(value, tuple((a - value * b) / y.value for a, b in zip(x.slopes, y.slopes, strict=True)))
    raise ValueError(f"an operation {type(operation).__name__} of numbers")


def _power(x: Jet, node: ast.expr, exponent: Jet) -> Jet:
    """A whole power of any number, or a constant power of a positive one."""
    whole = exponent.value.unique_fmpz() if exponent.value.is_exact() else None
    if whole is not None and abs(whole) <= MOST_POWER:
        k = int(whole)
        return Jet(x.value**k, tuple(k * x.value ** (k - 1) * slope if k else arb(0) for slope in x.slopes))
    if not x.value > 0:
        raise UnprovedError(f"a power {ast.unparse(node)} of a number that is not shown to be above zero")
    value, n = x.value**exponent.value, exponent.value
    slow, rise = n * x.value ** (n - 1), value * x.value.log()
    return Jet(value, tuple(slow * a + rise * b for a, b in zip(x.slopes, exponent.slopes, strict=True)))


def _root(x: Jet, known: bool) -> Jet:
    """A square root, of which it may be known that its argument is not below zero."""
    if x.value > 0:
        root = x.value.sqrt()
        return Jet(root, tuple(slope / (2 * root) for slope in x.slopes))
    if not known:
        raise UnprovedError(f"the square root of {x.value}, which is not shown to be above zero")
    return Jet(arb(0).union(abs(x.value).upper().sqrt()), tuple(arb("nan") if slope != 0 else slope for slope in x.slopes))


def _extreme(sign: int, x: Jet, y: Jet) -> Jet:
    """The larger of two numbers (sign 1), or the smaller (-1)."""
    if sign * x.value > sign * y.value:
        return x
    if sign * y.value > sign * x.value:
        return y
    value = x.value.max(y.value) if sign > 0 else x.value.min(y.value)
    return Jet(value, tuple(a.union(b) for a, b in zip(x.slopes, y.slopes, strict=True)))


def _size(x: arb) -> tuple[arb, arb]:
    """The absolute value."""
    return abs(x), arb(1) if x > 0 else arb(-1) if x < 0 else arb(0, 1)


def _sign(x: arb) -> tuple[arb, arb]:
    """The sign of a number that is shown not to be zero."""
    if not (x > 0 or x < 0 or x == 0):
        raise UnprovedError(f"the sign of {x}")
    return x.sgn(), arb(0)


def _floor(x: arb) -> tuple[arb, arb]:
    """The whole part, if it is shown to be one."""
    whole = x.floor().unique_fmpz()
    if whole is None:
        raise UnprovedError(f"the whole part of {x}")
    return arb(whole), arb(0)


FUNCTIONS: dict[str, Callable[[arb], tuple[arb, arb]]] = {  #: the value and the derivative
    "sqrt": lambda x: (x.sqrt(), 1 / (2 * x.sqrt())),
    "sin": lambda x: (x.sin(), x.cos()),
    "cos": lambda x: (x.cos(), -x.sin()),
    "tan": lambda x: (x.tan(), 1 + x.tan() ** 2),
    "asin": lambda x: (x.asin(), (1 - x * x).rsqrt()),
    "acos": lambda x: (x.acos(), -(1 - x * x).rsqrt()),
    "atan": lambda x: (x.atan(), 1 / (1 + x * x)),
    "sinh": lambda x: (x.sinh(), x.cosh()),
    "cosh": lambda x: (x.cosh(), x.sinh()),
    "tanh": lambda x: (x.tanh(), 1 - x.tanh() ** 2),
    "exp": lambda x: (x.exp(), x.exp()),
    "log": lambda x: (x.log(), 1 / x),
    "abs": _size,
    "sign": _sign,
    "floor": _floor,
}


@lru_cache(maxsize=1024)
def sum_of(node: ast.expr) -> Sum:
    """A formula as a sum of terms."""
    terms: dict[str, int] = {}

    def add(node: ast.expr, sign: int) -> None:
        match node:
            case ast.BinOp(op=ast.Add() | ast.Sub() as operation, left=left, right=right):
                add(left, sign)
                add(right, sign if isinstance(operation, ast.Add) else -sign)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                add(operand, -sign)
            case ast.Constant(value=0):
                pass
            case _:
                terms[ast.dump(node)] = terms.get(ast.dump(node), 0) + sign

    add(node, 1)
    return tuple(sorted((term, count) for term, count in terms.items() if count))
