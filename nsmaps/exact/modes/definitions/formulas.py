"""Formulas of a class of systems with modes, read as rows: what is not piecewise linear is refused."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from nsmaps.errors import SystemDefinitionError, near_match
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.flows.ways import DELAY, FORCING, OWN_MAP, other_rate
from nsmaps.exact.modes.definitions.definition import Row

CLOCK = sp.Symbol("_t", real=True)  #: the time in a system without forcing, in which no formula may depend on it
NEAR = 1e-12  #: of values of a formula that are the same, relative


@dataclass(frozen=True)
class Reader:
    """Reads the formulas of one class."""

    name: str
    parameters: frozenset[sp.Symbol]
    states: Mapping[str, sp.Symbol]
    phase_rate: sp.Expr  #: radians of phase a unit of time
    noise: tuple[str, ...] = ()  #: names of states that no event changes: the noise and its derivatives

    def expression(self, given: Any, what: str) -> sp.Expr:
        """A formula in sympy with known symbols, or a SystemDefinitionError with the reason."""
        try:
            expr = sp.sympify(given, strict=True)
        except sp.SympifyError:
            raise SystemDefinitionError(f"{what} is {given!r:.60}; expected: a formula of sympy or a number") from None
        unknown = expr.free_symbols - self.parameters - set(self.states.values()) - {PHI}
        if CLOCK in unknown and not expr.has(AppliedUndef):
            raise SystemDefinitionError(
                f"{what} depends on the time, and {self.name} has no `period`; expected: one, or a state of rate 1 as a clock"
            )
        if unknown - {CLOCK}:
            raise SystemDefinitionError(f"{what} has the unknown symbols {', '.join(sorted(map(str, unknown)))}")
        return expr

    def rate(self, given: Any, what: str) -> Row:
        """A rate as a row, or a SystemDefinitionError with the reason, and with what can be written in its place."""
        expr = self.expression(given, what)
        return self.row(expr, what, other_rate(expr, tuple(self.states.values())))

    def row(self, given: Any, what: str, way: str = OWN_MAP) -> Row:
        """A formula as a row, or a SystemDefinitionError with the reason."""
        expr = self.expression(given, what)
        if expr.has(AppliedUndef):
            raise SystemDefinitionError(f"{what} is {shown(expr)}; expected: the states at the time t; {DELAY}")
        row = self.affine(expr)
        if row is None:
            raise SystemDefinitionError(
                f"{what} is {shown(expr)}; expected: affine in the states, with coefficients free of the time; {way}"
            )
        check_periodic(row.remainder, what)
        return row

    def affine(self, expr: sp.Expr) -> Row | None:
        """A formula as a row, None where it is not affine in the states with coefficients that are free of the time."""
        bound = {*self.states.values(), PHI}
        slopes = [sp.diff(expr, y) for y in self.states.values()]
        coefficients = tuple(sp.simplify(c) if c.free_symbols & bound else c for c in slopes)
        if any(c.free_symbols & bound for c in coefficients):
            return None
        return Row(coefficients, sp.expand(expr.subs(dict.fromkeys(self.states.values(), 0))))

    def same(self, state: str) -> Row:
        """The row of a state itself."""
        return Row(tuple(sp.S.One if name == state else sp.S.Zero for name in self.states), sp.S.Zero)


def shown(expr: sp.Expr) -> str:
    """An expression in the author's names."""
    return str(expr).replace("_y_", "y.").replace("_p_", "").replace("_phi", "phi")


def check_periodic(expr: sp.Expr, what: str) -> None:
    """Refuse a formula that is not the same one turn of the phase later."""
    later = expr.subs(PHI, PHI + 2 * sp.pi)
    for values in trials(expr) if expr.has(PHI) else ():
        first, second = (sp.N(one.subs(values), 30) for one in (expr, later))
        if first.is_finite and abs(first - second) > NEAR * (1 + abs(first)):
            raise SystemDefinitionError(
                f"{what} is {shown(expr)}, which is not the same after one `period` of the forcing; {FORCING}"
            )


def check_names(what: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    """Refuse a name that is not one of the known ones."""
    for name in names:
        if name not in known:
            raise SystemDefinitionError(f"{what} {name!r}; expected: one of {', '.join(known)}{near_match(name, known)}")
