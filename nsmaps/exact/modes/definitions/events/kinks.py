"""Kinks: functions such as Abs and Max whose argument moves, written with a symbol for the sign of this argument.

What is left is smooth in the states: Abs(u) is s u with s = 1 where u is positive and -1 where it is negative.
"""

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

from nsmaps.errors import SystemDefinitionError

BY_SIGN: dict[Any, Callable[..., sp.Expr]] = {
    sp.Abs: lambda sign, argument: sign * argument,
    sp.sign: lambda sign, _: sign,
    sp.Heaviside: lambda sign, _: (1 + sign) / 2,
}
KINKS = *BY_SIGN, sp.Max, sp.Min, sp.Piecewise
INEQUALITIES = sp.Gt, sp.Ge, sp.Lt, sp.Le
JOINED: dict[Any, Callable[..., sp.Expr]] = {
    sp.And: sp.Mul,
    sp.Or: lambda *parts: 1 - sp.Mul(*(1 - part for part in parts)),
    sp.Not: lambda part: 1 - part,
}  #: conditions, by numbers that are one where they hold


class Kinks:
    """The arguments of the kinks in the formulas of a class, and for each the symbol of its sign."""

    def __init__(self) -> None:
        self.signs: dict[sp.Expr, sp.Symbol] = {}

    def smooth(self, expr: sp.Expr, moving: set[sp.Symbol]) -> sp.Expr:
        """A formula with signs in place of kinks whose arguments depend on what moves.

        Raises:
            SystemDefinitionError: a `Piecewise` has no last piece, or a condition that is not an inequality.
        """
        if not (expr.has(*KINKS) and expr.free_symbols & moving):
            return expr
        if expr.func == sp.Piecewise:
            return self._pieces(expr.args, moving)
        parts = [self.smooth(part, moving) for part in expr.args]
        if expr.func == sp.Max:
            return self._largest(parts)
        if expr.func == sp.Min:
            return -self._largest([-part for part in parts])
        if expr.func not in BY_SIGN:
            return expr.func(*parts)
        argument, *_ = parts
        return BY_SIGN[expr.func](self.sign_of(argument), argument)

    def sign_of(self, argument: sp.Expr) -> sp.Expr:
        """The sign of an argument; those that differ by a number share its symbol."""
        factor, formula = argument.as_coeff_Mul()
        if formula.could_extract_minus_sign():
            factor, formula = -factor, -formula
        symbol = self.signs.setdefault(formula, sp.Symbol(f"_s_{len(self.signs)}", real=True))
        return symbol if factor > 0 else -symbol

    def arguments_in(self, symbols: set[sp.Symbol]) -> dict[sp.Expr, sp.Symbol]:
        """The arguments of the signs among some symbols, and of those in these arguments."""
        found = {argument: sign for argument, sign in self.signs.items() if sign in symbols}
        more = symbols.union(*(argument.free_symbols for argument in found))
        return found if more & set(self.signs.values()) <= symbols else self.arguments_in(more)

    def _largest(self, parts: Sequence[sp.Expr]) -> sp.Expr:
        """The largest of some parts: each times one where it is not less than any other, and zero elsewhere."""
        return sp.Add(*(sp.Mul(one, *(self._above(one - other) for other in parts if other is not one)) for one in parts))

    def _above(self, difference: sp.Expr) -> sp.Expr:
        """One where a difference is positive, zero where it is negative."""
        return (1 + self.sign_of(difference)) / 2

    def _pieces(self, pieces: Sequence[tuple[sp.Expr, sp.Basic]], moving: set[sp.Symbol]) -> sp.Expr:
        (formula, condition), *others = pieces
        value = self.smooth(formula, moving)
        if condition == sp.true:
            return value
        if not others:
            raise SystemDefinitionError("has a `Piecewise` without a last piece; expected: one for all other states, (..., True)")
        holds = self._holds(condition, moving)
        return holds * value + (1 - holds) * self._pieces(others, moving)

    def _holds(self, condition: sp.Basic, moving: set[sp.Symbol]) -> sp.Expr:
        """One where a condition of a piece holds, zero elsewhere."""
        if not condition.free_symbols & moving:
            return sp.Piecewise((1, condition), (0, True))
        if condition.func in INEQUALITIES:
            return self._above(self.smooth(condition.gts - condition.lts, moving))
        if condition.func in JOINED:
            return JOINED[condition.func](*(self._holds(part, moving) for part in condition.args))
        raise SystemDefinitionError(f"has a `Piecewise` with the condition {condition}; expected: inequalities, and And, Or, Not")
