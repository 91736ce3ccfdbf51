"""Formulas of sympy as expressions of heyoka, which is imported when one is first asked for."""

from collections.abc import Mapping
from functools import reduce
from importlib import import_module
from operator import mul
from typing import Any

import sympy as sp
from sympy.core.relational import Relational

from nsmaps.errors import NsmapsError, SystemDefinitionError

LARGEST = sp.Max, sp.Min  #: of parameters alone, as Abs and sign: kinks in the states are gone by then


def heyoka() -> Any:
    """The package heyoka. NsmapsError, which names the extra, where it is not installed."""
    try:
        return import_module("heyoka")
    except ImportError as error:
        raise NsmapsError(
            "a system whose rates or guards are not linear needs heyoka, which is not installed; expected: pip install "
            "'nsmaps[ode]' (Linux), or conda install heyoka.py"
        ) from error


def expression(formula: sp.Expr, known: Mapping[sp.Symbol, Any]) -> Any:
    """A formula as heyoka's expression, whole powers as products, whose series exist at zero too.

    Raises:
        NsmapsError: heyoka is not installed.
        SystemDefinitionError: a part of the formula has no Taylor series, or heyoka knows none.
    """
    return _translated(formula, dict(known), heyoka())


def _translated(formula: sp.Expr, known: dict[sp.Expr, Any], hy: Any) -> Any:
    """The expression of a formula, kept in `known` for where the formula is met again."""
    if formula not in known:
        known[formula] = _built(formula, known, hy)
    return known[formula]


def _built(formula: sp.Expr, known: dict[sp.Expr, Any], hy: Any) -> Any:
    if formula.is_number:
        return hy.expression(float(formula))
    if isinstance(formula, LARGEST):
        return _translated(formula.rewrite(sp.Abs), known, hy)
    if isinstance(formula, sp.Abs | sp.sign):
        (part,) = (_translated(part, known, hy) for part in formula.args)
        size = hy.sqrt(part * part)
        return size if isinstance(formula, sp.Abs) else part / size
    if formula.is_Pow and formula.exp.is_Integer:
        product = reduce(mul, [_translated(formula.base, known, hy)] * abs(int(formula.exp)))
        return product if formula.exp > 0 else hy.expression(1.0) / product
    arguments = [sp.Dummy() for _ in formula.args]
    parts = [_translated(part, known, hy) for part in formula.args]
    try:
        return hy.from_sympy(formula.func(*arguments), dict(zip(arguments, parts, strict=True)))
    except (TypeError, ValueError) as error:
        name = "Piecewise" if isinstance(formula, Relational) else formula.func.__name__
        raise SystemDefinitionError(
            f"{name}(...) has no Taylor series that can be followed; expected: powers, roots, exp, log, sin, cos, tan, sinh, "
            "cosh, tanh, their inverses and erf"
        ) from error
