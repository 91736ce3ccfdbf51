"""Formulas in many digits as functions of python-flint's balls, in a tenth of the time of mpmath."""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath as mp
import sympy as sp
from flint import arb, ctx

FUNCTIONS = ("exp", "cos", "sin", "cosh", "sinh", "sqrt", "log")


def number(value: Any) -> arb:
    """A ball of a number of Python, of mpmath, or of one that sympy writes as sign, mantissa and exponent."""
    sign, mantissa, exponent, _ = value if isinstance(value, tuple) else mp.mpf(value)._mpf_
    return arb(-int(mantissa) if sign else int(mantissa)) * arb(2) ** int(exponent)


def in_balls(arguments: Sequence[sp.Symbol], formulas: Any) -> Callable[..., Any]:
    """A function of balls, in the precision of `flint.ctx` when it is called."""

    def of(name: str) -> Callable[[Any], arb]:
        return lambda x: getattr(x if isinstance(x, arb) else arb(x), name)()

    with ctx.workdps(100):
        names = {"mpf": number, "pi": arb.pi(), **{name: of(name) for name in FUNCTIONS}}
        return sp.lambdify(arguments, formulas, [names, "mpmath"], cse=True)
