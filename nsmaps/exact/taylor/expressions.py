"""Formulas of sympy as expressions of heyoka, which is imported when one is first asked for."""

import math
from collections.abc import Mapping, Sequence
from functools import reduce
from importlib import import_module
from operator import mul
from typing import Any

import sympy as sp

from nsmaps.errors import NsmapsError, SystemDefinitionError

STEPPED = sp.Abs, sp.sign, sp.Max, sp.Min, sp.Heaviside  #: of parameters alone: kinks in the states are gone by then
RELATIONS = {sp.Gt: "gt", sp.Ge: "gte", sp.Lt: "lt", sp.Le: "lte", sp.Eq: "eq", sp.Ne: "neq"}
JUNCTIONS = {sp.And: "logical_and", sp.Or: "logical_or"}


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
    return _translate(formula, dict(known), heyoka())


def _translate(formula: sp.Expr, known: dict[sp.Expr, Any], hy: Any) -> Any:
    """The expression of a formula, kept in `known` for where the formula is met again."""
    if formula not in known:
        known[formula] = _build(formula, known, hy)
    return known[formula]


def _build(formula: sp.Expr, known: dict[sp.Expr, Any], hy: Any) -> Any:
    if formula.is_number:
        return hy.expression(float(formula))
    if isinstance(formula, STEPPED):
        return _translate(formula.rewrite(sp.Piecewise), known, hy)
    if isinstance(formula, sp.Piecewise):
        return _choice(formula.args, known, hy)
    if formula.is_Pow and formula.exp.is_Integer:
        product = reduce(mul, [_translate(formula.base, known, hy)] * abs(int(formula.exp)))
        return product if formula.exp > 0 else hy.expression(1.0) / product
    arguments = [sp.Dummy() for _ in formula.args]
    parts = [_translate(part, known, hy) for part in formula.args]
    try:
        return hy.from_sympy(formula.func(*arguments), dict(zip(arguments, parts, strict=True)))
    except (TypeError, ValueError) as error:
        name = formula.func.__name__
        raise SystemDefinitionError(
            f"{name}(...) has no Taylor series that can be followed; expected: powers, roots, exp, log, sin, cos, tan, sinh, "
            "cosh, tanh, their inverses and erf"
        ) from error


def _choice(pieces: Sequence[tuple[sp.Expr, sp.Basic]], known: dict[sp.Expr, Any], hy: Any) -> Any:
    """The first of the pieces whose condition holds; NaN where there is none."""
    found = hy.expression(math.nan)
    for formula, condition in reversed(pieces):
        value = _translate(formula, known, hy)
        found = value if condition == sp.true else hy.select(_condition(condition, known, hy), value, found)
    return found


def _condition(condition: sp.Basic, known: dict[sp.Expr, Any], hy: Any) -> Any:
    """A condition on parameters as an expression that is zero where it does not hold."""
    if (name := RELATIONS.get(condition.func)) is not None:
        return getattr(hy, name)(*(_translate(side, known, hy) for side in condition.args))
    parts = [_condition(part, known, hy) for part in condition.args]
    if (name := JUNCTIONS.get(condition.func)) is not None:
        return getattr(hy, name)(parts)
    (part,) = parts
    return hy.eq(part, hy.expression(0.0))  # Not
