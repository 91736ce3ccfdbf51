"""Formulas in many digits as functions of python-flint's balls, in a tenth of the time of mpmath."""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath as mp
import sympy as sp
from flint import arb, arb_mat, ctx

FUNCTIONS = ("exp", "cos", "sin", "cosh", "sinh", "sqrt", "log")


def number(value: Any) -> arb:
    """A ball of a number of Python, of mpmath, or of one that sympy writes as sign, mantissa and exponent."""
    if isinstance(value, int | float):
        return arb(value)
    sign, mantissa, exponent, _ = value if isinstance(value, tuple) else mp.mpf(value)._mpf_
    return arb(-int(mantissa) if sign else int(mantissa)) * arb(2) ** int(exponent)


def in_balls(arguments: Sequence[sp.Symbol], formulas: Any) -> Callable[..., Any]:
    """A function of balls, in the precision of `flint.ctx` when it is called."""

    def of(name: str) -> Callable[[Any], arb]:
        function = getattr(arb, name)
        return lambda x: function(x if isinstance(x, arb) else arb(x))

    with ctx.workdps(100):
        names = {"mpf": number, "pi": arb.pi(), **{name: of(name) for name in FUNCTIONS}}
        return sp.lambdify(arguments, formulas, [names, "mpmath"], cse=True)


def root(equations: Callable[..., Sequence[arb]], start: Sequence[Any]) -> list[arb]:
    """Where as many equations as unknowns vanish to 30 digits, by Newton's method from a start, with differences."""
    x, h = [number(value) for value in start], arb(2) ** -80
    off = equations(*x)
    while not all(abs(value) < 1e-30 for value in off):
        moved = [equations(*x[:k], x[k] + h, *x[k + 1 :]) for k in range(len(x))]
        slopes = [[(after[i] - before) / h for after in moved] for i, before in enumerate(off)]
        step = arb_mat(slopes).solve(arb_mat([[value] for value in off]))
        x = [(value - step[k, 0]).mid() for k, value in enumerate(x)]
        off = equations(*x)
    return x
