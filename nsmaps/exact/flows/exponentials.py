"""Sums of s^k exp(lambda s) whose coefficients are linear in the state and periodic in the phase, in many digits.

Every flight in closed form must be such a sum. A formula is decomposed at given values of its parameters, in balls of many
digits, so that cancellation within the formula costs no digits of the coefficients.
"""

from functools import lru_cache, partial
from typing import NamedTuple

import sympy as sp
from flint import acb

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.balls import Number, Program, equal, is_zero
from nsmaps.exact.flows.formulas import PHI, S, W, Z
from nsmaps.exact.flows.source import FORCING

STATE = {Z: "z", W: "w"}
HALF = sp.S.Half
WAVES = {sp.cos: (HALF, HALF), sp.sin: (-HALF * sp.I, HALF * sp.I)}  #: shares of exp(i x) and exp(-i x)
GROWTHS = {sp.exp: (sp.S.One, sp.S.Zero), sp.cosh: (HALF, HALF), sp.sinh: (HALF, -HALF)}  #: shares of exp(x) and exp(-x)


class Term(NamedTuple):
    """The index of a coefficient of s^power exp(rate s) exp(i harmonic phase) phase^degree, times the place, velocity or 1."""

    power: int
    rate: int  #: its place in the program
    harmonic: int
    degree: int
    state: str


FREE = Term(0, 0, 0, 0, "")
TIME, PHASE = FREE._replace(power=1), FREE._replace(degree=1)
UNITS = {S: TIME, PHI: PHASE, **{symbol: FREE._replace(state=name) for symbol, name in STATE.items()}}
Sum = dict[Term, Number]


class Decomposition:
    """Formulas decomposed into numbers of a program."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.known: dict[sp.Expr, Sum] = {}

    def sum(self, formula: sp.Expr) -> Sum:
        """The sum that a formula is, in which equal rates are united and terms that cancel are removed.

        Raises:
            SystemDefinitionError: the formula is not such a sum; states which part of it is not.
        """
        rates, total, number = [0], Sum(), partial(Number, self.program)
        for term, x in self.expansion(formula).items():
            own, decide = number(term.rate), self.program.decide
            same = next((rate for rate in rates if rate == term.rate or decide(equal, number(rate), own)), None)
            if same is None:
                rates.append(same := term.rate)
            self._add(total, term._replace(rate=same), x)
        return {term: x for term, x in total.items() if not self.program.decide(is_zero, x)}

    def expansion(self, expr: sp.Expr) -> Sum:
        """The sum that a formula is."""
        if expr not in self.known:
            self.known[expr] = self._expand(expr)
        return self.known[expr]

    def _expand(self, expr: sp.Expr) -> Sum:
        if expr.free_symbols.isdisjoint(UNITS):  # of neither time, phase nor state
            return {FREE: self.program.number(expr)}
        if expr in UNITS:
            return {UNITS[expr]: self.program.number(1)}
        if expr.is_Add or expr.is_Mul:
            free, others = split(expr)
            parts = [*map(self.expansion, others), {FREE: self.program.number(free)}]
            return self._sum_of(parts) if expr.is_Add else self._product_of(parts, expr)
        if expr.is_Pow and expr.exp.is_Integer and expr.exp > 0:
            return self._product_of([self.expansion(expr.base)] * int(expr.exp), expr)
        if expr.func in WAVES or expr.func in GROWTHS:
            (argument,) = expr.args
            return self._exponential(expr, self.expansion(argument))
        raise SystemDefinitionError(
            f"{text_of(expr)} cannot be followed in time; expected: powers of t and sin, cos, exp, sinh, cosh of A + k t, linear "
            "in hit.z and hit.w"
        )

    def _add(self, total: Sum, term: Term, x: Number) -> None:
        total[term] = total[term] + x if term in total else x

    def _sum_of(self, parts: list[Sum]) -> Sum:
        total = Sum()
        for part in parts:
            for term, x in part.items():
                self._add(total, term, x)
        return total

    def _product_of(self, parts: list[Sum], expr: sp.Expr) -> Sum:
        total, *others = parts
        for part in others:
            product = Sum()
            for a, x in total.items():
                for b, y in part.items():
                    if a.state and b.state:
                        raise SystemDefinitionError(f"{text_of(expr)} is not linear in hit.z and hit.w; expected: a sum")
                    rate = Number(self.program, a.rate) + Number(self.program, b.rate)
                    harmonic, degree = a.harmonic + b.harmonic, a.degree + b.degree
                    self._add(product, Term(a.power + b.power, rate.place, harmonic, degree, a.state + b.state), x * y)
            total = product
        return total

    def _exponential(self, expr: sp.Expr, argument: Sum) -> Sum:
        """exp, sin, cos, sinh or cosh of an argument that must be linear in time, with whole turns of the phase."""
        program, linear, wave = self.program, (FREE, TIME, PHASE), expr.func in WAVES
        if not all(program.decide(is_zero, x) for term, x in argument.items() if term not in linear):
            raise SystemDefinitionError(f"{text_of(expr)} has an argument that is not linear in time; expected: A + k t")
        at, rate, turn = (argument.get(term, program.number(0)) for term in linear)
        harmonic = program.decide(whole, turn)
        if harmonic is None or (harmonic != 0 and not wave):
            raise SystemDefinitionError(f"{text_of(expr)} is not the same after one `period` of the forcing; {FORCING}")
        shares, unit = (WAVES[expr.func], sp.I) if wave else (GROWTHS[expr.func], sp.S.One)
        total = Sum()
        for sign, share in zip((1, -1), map(program.number, shares), strict=True):
            if share.place:
                way = program.number(sign * unit)
                self._add(total, Term(0, (way * rate).place, sign * harmonic, 0, ""), share * (way * at).exp())
        return total


def text_of(expr: sp.Expr) -> str:
    """An expression in the author's names for time, place and velocity after an impact."""
    names = {Z: sp.Symbol("hit.z"), W: sp.Symbol("hit.w"), S: sp.Symbol("s"), PHI: sp.Symbol("phi")}
    return str(sp.sstr(expr.xreplace(names))).replace("_p_", "")


@lru_cache(maxsize=4096)
def split(expr: sp.Expr) -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """The part of a sum or product that is free of time, phase and state, and the other terms or factors."""
    free, others = expr.as_independent(*UNITS, as_Add=expr.is_Add)
    return free, others.args if isinstance(others, expr.func) else (others,)


def whole(x: acb) -> int | None:
    """The integer that a number is, or None."""
    found = x.unique_fmpz()
    return None if found is None else int(found)
