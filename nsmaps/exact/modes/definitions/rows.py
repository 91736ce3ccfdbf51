"""Rows: expressions as coefficients of the states and a remainder, with the operations that modes and events are derived by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, S, check_form, trials

DIGITS = 30  #: in which expressions are compared
NEAR = 1e-12  #: relative: values at trial parameters that differ by less are the same


@dataclass(frozen=True)
class Row:
    """An expression as the coefficients of the states, and a remainder, which may depend on the phase.

    While formulas are read the remainder may also hold a nonlinear function of the states, which `variables` are then.
    """

    coefficients: tuple[sp.Expr, ...]
    remainder: sp.Expr
    variables: tuple[sp.Symbol, ...] = ()  #: of the states where the remainder is nonlinear, () in an affine row

    @property
    def timed(self) -> bool:
        """Whether it is free of the states."""
        return not any(self.coefficients) and not self.remainder.has(*self.variables)

    def by(self, parameter: sp.Symbol) -> "Row":
        """Its derivative by a parameter, at a fixed phase."""
        return Row(tuple(sp.diff(c, parameter) for c in self.coefficients), sp.diff(self.remainder, parameter), self.variables)

    def subs(self, values: Mapping[sp.Symbol, Any]) -> "Row":
        """The row where symbols other than those of the states have values."""
        if not values:
            return self
        if self.variables:
            return row_of(self.of(self.variables).subs(values), self.variables)
        return Row(tuple(c.subs(values) for c in self.coefficients), self.remainder.subs(values))

    def times(self, factor: sp.Expr) -> "Row":
        """The row times a factor that is free of the states."""
        return Row(tuple(factor * c for c in self.coefficients), factor * self.remainder, self.variables)

    def __neg__(self) -> "Row":
        return self.times(sp.S.NegativeOne)

    def __add__(self, other: "Row") -> "Row":
        sums = tuple(a + b for a, b in zip(self.coefficients, other.coefficients, strict=True))
        variables = self.variables or other.variables
        total = Row(sums, self.remainder + other.remainder, variables)
        return row_of(total.of(variables), variables) if variables else total

    def at(self, states: "Sequence[Row]") -> "Row":
        """The row where the states are rows themselves."""
        variables = next((row.variables for row in (self, *states) if row.variables), ())
        if variables:
            values = [row.of(variables) for row in states]
            return row_of(self.of(variables).subs(dict(zip(variables, values, strict=True)), simultaneous=True), variables)
        total = Row(tuple(sp.S.Zero for _ in self.coefficients), self.remainder)
        for coefficient, state in zip(self.coefficients, states, strict=True):
            total = total + state.times(coefficient)
        return Row(tuple(map(sp.cancel, total.coefficients)), sp.expand(total.remainder))

    def rate(self, rates: "Sequence[Row]", phase_rate: sp.Expr) -> "Row":
        """The rate of the row where the states have these rates."""
        turning = phase_rate * sp.diff(self.remainder, PHI)
        variables = next((row.variables for row in (self, *rates) if row.variables), ())
        if variables:
            slopes = [c + sp.diff(self.remainder, y) for c, y in zip(self.coefficients, variables, strict=True)]
            return row_of(sp.Add(turning, *(c * row.of(variables) for c, row in zip(slopes, rates, strict=True))), variables)
        moved = self.at(rates)
        return Row(moved.coefficients, sp.expand(moved.remainder - self.remainder + turning))

    def of(self, variables: Sequence[sp.Expr]) -> sp.Expr:
        """The expression that the row stands for."""
        return sp.Add(*(c * y for c, y in zip(self.coefficients, variables, strict=True)), self.remainder)


def row_of(expr: sp.Expr, variables: tuple[sp.Symbol, ...]) -> Row:
    """An expression as a row: its affine terms as such, and the others as a nonlinear remainder."""
    affine = affine_row(expr, variables)
    if affine is not None:
        return affine
    rows = [(term, affine_row(term, variables)) for term in sp.Add.make_args(expr)]
    known = Row(tuple(sp.S.Zero for _ in variables), sp.Add(*(term for term, row in rows if row is None)), variables)
    for row in (row for _, row in rows if row is not None):
        sums = tuple(a + b for a, b in zip(known.coefficients, row.coefficients, strict=True))
        known = Row(sums, known.remainder + row.remainder, variables)
    return known


def affine_row(expr: sp.Expr, variables: tuple[sp.Symbol, ...]) -> Row | None:
    """An expression as an affine row; None where it is not affine in the states, or where no sum of harmonics adds to it."""
    bound = {*variables, PHI}
    slopes = [sp.diff(expr, y) for y in variables]
    if any(c.free_symbols & bound and _varies(c, bound) for c in slopes):
        return None
    coefficients = tuple(sp.simplify(c) if c.free_symbols & bound else c for c in slopes)
    if any(c.free_symbols & bound for c in coefficients):
        return None
    remainder = sp.expand(expr.subs(dict.fromkeys(variables, 0)))
    return Row(coefficients, remainder) if is_sum_of_waves(remainder) else None


def _varies(expr: sp.Expr, bound: set[sp.Symbol]) -> bool:
    """Whether an expression surely changes with symbols: it does at some trial values."""
    first, *others = trials(expr)
    values = [first | {x: value for x, value in at.items() if x in bound} for at in (first, *others)]
    number, *numbers = (sp.N(expr.subs(at), DIGITS) for at in values)
    return all(x.is_finite for x in (number, *numbers)) and any(abs(x - number) > NEAR * (1 + abs(x)) for x in numbers)


def is_sum_of_waves(expr: sp.Expr) -> bool:
    """Whether a function of the phase is a sum of finitely many harmonics, by its form."""
    try:
        check_form(expr.subs(PHI, S))
    except SystemDefinitionError:
        return False
    return True


def equal(one: Row, other: Row) -> bool:
    """Whether two functions are the same."""
    return not _differ(one, other) and all(a == b or sp.simplify(a - b) == 0 for a, b in _pairs(one, other))


@lru_cache(maxsize=1024)  # asked again for each part of a divided mode
def factor_of(one: Row, other: Row) -> sp.Expr | None:
    """The factor free of states and phase by which a function is another one that is not zero; None where there is none."""
    quotient = next((a / b for a, b in _pairs(one, other) if b != 0), None)
    if quotient is None or _differ(one, other.times(quotient)):
        return None
    factor = sp.simplify(quotient)
    if factor.has(PHI, *one.variables, *other.variables) or not equal(one, other.times(factor)):
        return None
    return factor


def _pairs(one: Row, other: Row) -> list[tuple[sp.Expr, sp.Expr]]:
    """The coefficients and remainders of two rows, side by side."""
    return [*zip(one.coefficients, other.coefficients, strict=True), (one.remainder, other.remainder)]


def _differ(one: Row, other: Row) -> bool:
    """Whether two functions surely differ: at trial values they do, which is much faster than to simplify a difference."""
    for a, b in _pairs(one, other):
        if a != b:
            values, *_ = trials(a, b)
            x, y = (sp.N(expr.subs(values), DIGITS) for expr in (a, b))
            if x.is_finite and y.is_finite and abs(x - y) > NEAR * (1 + abs(x)):
                return True
    return False


def same_row(state: int, n: int) -> Row:
    """The row of a state itself, by its position among n."""
    return Row(tuple(sp.Integer(k == state) for k in range(n)), sp.S.Zero)


def zero_row(n: int) -> Row:
    """The row of zero over n states."""
    return Row((sp.S.Zero,) * n, sp.S.Zero)


def vanishes(expr: sp.Expr) -> bool:
    """Whether an expression is zero at all trial values."""
    return all(abs(sp.N(expr.subs(at), DIGITS)) <= NEAR for at in trials(expr))
