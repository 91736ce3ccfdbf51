"""Formulas of a class of systems with modes, read as rows: what has no Taylor series is refused."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from nsmaps.errors import SystemDefinitionError, check_known
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.flows.laws import replace_functions
from nsmaps.exact.flows.source import DELAY, FORCING
from nsmaps.exact.modes.definitions.events.kinks import KINKS, Kinks
from nsmaps.exact.modes.definitions.rows import NEAR, Row, row_of, same_row

CLOCK = sp.Symbol("_t", real=True)  #: the time in a system without forcing, in which no formula may depend on it
TRIGONOMETRIC = sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan, sp.atan2
HYPERBOLIC = sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.acosh, sp.atanh
RATIOS = {
    sp.cot: lambda x: sp.cos(x) / sp.sin(x),
    sp.sec: lambda x: 1 / sp.cos(x),
    sp.csc: lambda x: 1 / sp.sin(x),
    sp.coth: lambda x: sp.cosh(x) / sp.sinh(x),
    sp.sech: lambda x: 1 / sp.cosh(x),
    sp.csch: lambda x: 1 / sp.sinh(x),
}  #: functions of which heyoka knows the series of both parts
SMOOTH_FUNCTIONS = (*TRIGONOMETRIC, *HYPERBOLIC, sp.exp, sp.log, sp.erf, sp.erfc)  #: of which heyoka knows the series


@dataclass(frozen=True)
class Reader:
    """Reads the formulas of one class."""

    name: str
    parameters: frozenset[sp.Symbol]
    states: Mapping[str, sp.Symbol]
    phase_rate: sp.Expr  #: radians of phase a unit of time
    noise: tuple[str, ...] = ()  #: names of states that no event changes: the noise and its derivatives
    kinks: Kinks = field(default_factory=Kinks)  #: in the formulas that have been read

    @property
    def variables(self) -> tuple[sp.Symbol, ...]:
        """The symbols of the states."""
        return tuple(self.states.values())

    def formula(self, given: Any, what: str) -> sp.Expr:
        """A formula in sympy with known symbols, or a SystemDefinitionError with the reason."""
        try:
            expr = replace_functions(sp.sympify(given, strict=True), RATIOS)
        except sp.SympifyError:
            raise SystemDefinitionError(f"{what} is {given!r:.60}; expected: a formula of sympy or a number") from None
        unknown = expr.free_symbols - self.parameters - set(self.variables) - {PHI}
        if CLOCK in unknown and not expr.has(AppliedUndef):
            raise SystemDefinitionError(
                f"{what} depends on the time, and {self.name} has no `period`; expected: one, or a state of rate 1 as a clock"
            )
        if unknown - {CLOCK}:
            raise SystemDefinitionError(f"{what} has the unknown symbols {', '.join(sorted(map(str, unknown)))}")
        return expr

    def expression(self, given: Any, what: str) -> sp.Expr:
        """A formula as `formula` with signs in place of kinks."""
        try:
            return self.kinks.smooth(self.formula(given, what), {*self.variables, PHI})
        except SystemDefinitionError as error:
            raise error if what in str(error) else SystemDefinitionError(f"{what} {error}") from None

    def row(self, given: Any, what: str) -> Row:
        """A formula as a row, or a SystemDefinitionError with the reason."""
        expr = self.formula(given, what)
        check_smooth(expr, {*self.variables, PHI}, what)
        row = row_of(self.expression(given, what), self.variables)
        check_periodic(expr if row.variables else row.remainder, what)
        return row

    def states_in(self, row: Row) -> set[str]:
        """The names of the states on which a row depends."""
        held = zip(self.states.items(), row.coefficients, strict=True)
        return {name for (name, y), c in held if c != 0 or (row.variables and row.remainder.has(y))}

    def same(self, state: str) -> Row:
        """The row of a state itself."""
        return same_row(list(self.states).index(state), len(self.states))


def text_of(expr: sp.Expr) -> str:
    """An expression in the author's names."""
    return str(expr).replace("_y_", "y.").replace("_p_", "").replace("_phi", "phi")


def check_smooth(expr: sp.Expr, moving: set[sp.Symbol], what: str) -> None:
    """Refuse a formula of which a part has no Taylor series in the symbols that move."""
    if expr.has(AppliedUndef):
        raise SystemDefinitionError(f"{what} is {text_of(expr)}; expected: the states at the time t; {DELAY}")
    for part in sp.preorder_traversal(expr):
        if isinstance(part, sp.Function) and part.free_symbols & moving and not isinstance(part, (*SMOOTH_FUNCTIONS, *KINKS)):
            names = ", ".join(kind.__name__ for kind in (*SMOOTH_FUNCTIONS, *KINKS))
            raise SystemDefinitionError(
                f"{what} is {text_of(expr)}, and {part.func.__name__} has no Taylor series that can be followed; expected: "
                f"powers, roots, and {names}"
            )


def check_periodic(expr: sp.Expr, what: str) -> None:
    """Refuse a formula that is not the same one turn of the phase later."""
    later = expr.subs(PHI, PHI + 2 * sp.pi)
    for values in trials(expr) if expr.has(PHI) else ():
        first, second = (sp.N(one.subs(values), 30) for one in (expr, later))
        if first.is_finite and abs(first - second) > NEAR * (1 + abs(first)):
            raise SystemDefinitionError(
                f"{what} is {text_of(expr)}, which is not the same after one `period` of the forcing; {FORCING}"
            )


def check_names(what: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    """Refuse a name that is not one of the known ones."""
    for name in names:
        check_known(what, name, known, SystemDefinitionError)
