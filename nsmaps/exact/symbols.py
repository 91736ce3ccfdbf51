"""The algebra of flights: an expression in time split into factors free of time and remainders without cancellation.

With s the time since the impact, each sin, cos and exp of (A + k s) is split by angle addition into a factor free of s and the
remainders C = cos(k s) - 1, R = sin(k s) - k s, E = exp(k s) - 1 - k s, so that what is small is computed small. Rates follow by
the chain rule, with N = sin(k s) and X = exp(k s) - 1.
"""

from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from nsmaps.errors import SystemDefinitionError

S = sp.Symbol("_s", real=True)


@dataclass(frozen=True, slots=True)
class Wave:
    """The remainders of one frequency: C = cos - 1, N = sin, R = sin - k s."""

    k: sp.Expr
    c: sp.Symbol
    n: sp.Symbol
    r: sp.Symbol


@dataclass(frozen=True, slots=True)
class Growth:
    """The remainders of one exponential rate: X = exp - 1, E = exp - 1 - k s."""

    k: sp.Expr
    x: sp.Symbol
    e: sp.Symbol


@dataclass(frozen=True, slots=True)
class Flow:
    """A flight as a polynomial in s and the remainders of its waves and growths."""

    waves: list[Wave] = field(default_factory=list)
    growths: list[Growth] = field(default_factory=list)
    names: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)  #: of what is free of s, kept whole through the algebra

    def wave(self, k: sp.Expr) -> Wave:
        """The wave of frequency k, made when first met."""
        for wave in self.waves:
            if wave.k == k or sp.simplify(wave.k - k) == 0:
                return wave
        i = len(self.waves)
        self.waves.append(Wave(k, *(sp.Symbol(f"_{letter}{i}", real=True) for letter in "cnr")))
        return self.waves[-1]

    def growth(self, k: sp.Expr) -> Growth:
        """The growth of rate k, made when first met."""
        for growth in self.growths:
            if growth.k == k or sp.simplify(growth.k - k) == 0:
                return growth
        i = len(self.growths)
        self.growths.append(Growth(k, *(sp.Symbol(f"_{letter}{i}", real=True) for letter in "xe")))
        return self.growths[-1]

    @property
    def generators(self) -> list[sp.Symbol]:
        """s and all remainders."""
        return [S, *(g for w in self.waves for g in (w.c, w.n, w.r)), *(g for q in self.growths for g in (q.x, q.e))]

    def name(self, expr: sp.Expr) -> sp.Expr:
        """A symbol for an expression that is free of s, so that nothing expands it; numbers and symbols are their own."""
        if expr.is_number or expr.is_Symbol:
            return expr
        return self.names.setdefault(expr, sp.Symbol(f"_a{len(self.names)}", real=True))

    def restore(self, expr: sp.Expr) -> sp.Expr:
        """The expression with what was named put back."""
        return expr.xreplace({name: meant for meant, name in self.names.items()})

    @property
    def frequencies(self) -> list[sp.Expr]:
        """The frequencies of the waves and the rates of the growths."""
        return [*(w.k for w in self.waves), *(q.k for q in self.growths)]

    def split(self, expr: sp.Expr) -> sp.Expr:
        """The expression, of a form that was checked, with every function of s split into factors free of s and remainders."""
        if expr == S:
            return expr
        if not expr.has(S):
            return self.name(expr)
        if isinstance(expr, (sp.sin, sp.cos, sp.exp)):
            return self._add_angles(type(expr), expr.args[0].subs(S, 0), sp.simplify(sp.diff(expr.args[0], S)))
        if isinstance(expr, (sp.sinh, sp.cosh)):
            return self.split(expr.rewrite(sp.exp))
        if expr.is_Add or expr.is_Mul:
            free, timed = expr.as_independent(S, as_Add=expr.is_Add)
            parts = timed.args if isinstance(timed, expr.func) else (timed,)
            return expr.func(self.name(free), *(self.split(a) for a in parts))
        return self.split(expr.base) ** expr.exp

    def _add_angles(self, kind: type, a: sp.Expr, k: sp.Expr) -> sp.Expr:
        if kind is sp.exp:
            growth = self.growth(k)
            return self.name(sp.exp(a)) * (1 + growth.k * S + growth.e)
        sign = -1 if k.could_extract_minus_sign() else 1
        wave = self.wave(sign * k)
        sine, cosine = sign * (wave.k * S + wave.r), 1 + wave.c
        sin_a, cos_a = self.name(sp.sin(a)), self.name(sp.cos(a))
        return sin_a * cosine + cos_a * sine if kind is sp.sin else cos_a * cosine - sin_a * sine

    def rate(self, expr: sp.Expr) -> sp.Expr:
        """The time derivative of a polynomial in s and the remainders."""
        total = sp.diff(expr, S)
        for w in self.waves:
            total += sp.diff(expr, w.c) * -w.k * w.n + sp.diff(expr, w.n) * w.k * (1 + w.c) + sp.diff(expr, w.r) * w.k * w.c
        for q in self.growths:
            total += sp.diff(expr, q.e) * q.k * q.x + sp.diff(expr, q.x) * q.k * (1 + q.x)
        return total

    def moved(self, expr: sp.Expr, way: dict[sp.Symbol, sp.Symbol]) -> sp.Expr:
        """The derivative by symbols along a way, at a fixed s, of such a polynomial; what was named is put back."""

        def along(expr: sp.Expr) -> sp.Expr:
            return sp.Add(*(rate * sp.diff(expr, symbol) for symbol, rate in way.items()))

        total = along(self.restore(expr))
        for w in self.waves:
            by_angle = sp.diff(expr, w.n) * (1 + w.c) - sp.diff(expr, w.c) * w.n + sp.diff(expr, w.r) * w.c
            total += self.restore(by_angle) * S * along(w.k)
        for q in self.growths:
            total += self.restore(sp.diff(expr, q.e) * q.x + sp.diff(expr, q.x) * (1 + q.x)) * S * along(q.k)
        return total

    def terms(self, expr: sp.Expr) -> dict[tuple[int, ...], sp.Expr]:
        """The coefficients of a polynomial in s and the remainders, free of s, by exponents."""
        poly = sp.Poly(sp.expand(expr), *self.generators)
        return dict(poly.terms()) if poly.as_expr() != 0 else {}

    def monomial(self, exponents: tuple[int, ...]) -> sp.Expr:
        """The product of the generators to these exponents."""
        return sp.Mul(*(g**e for g, e in zip(self.generators, exponents, strict=True)))

    def bound(self, expr: sp.Expr, horizon: sp.Expr) -> sp.Expr:
        """A bound on |expr| for s in [0, horizon]: sines and cosines of one frequency collected into one amplitude."""
        sine = {w: sp.Symbol(f"_sin{i}") for i, w in enumerate(self.waves)}
        cosine = {w: sp.Symbol(f"_cos{i}") for i, w in enumerate(self.waves)}
        power = {q: sp.Symbol(f"_exp{i}") for i, q in enumerate(self.growths)}
        plain = {w.c: cosine[w] - 1 for w in self.waves} | {w.n: sine[w] for w in self.waves}
        plain |= {w.r: sine[w] - w.k * S for w in self.waves}
        plain |= {q.x: power[q] - 1 for q in self.growths} | {q.e: power[q] - 1 - q.k * S for q in self.growths}
        others = [S, *power.values()]
        poly = sp.Poly(sp.expand(expr.subs(plain)), *others, *sine.values(), *cosine.values())
        n, m = len(self.waves), len(others)
        amplitudes: dict[tuple[Any, ...], list[sp.Expr]] = {}
        for exponents, coefficient in poly.terms():
            trig = exponents[m:]
            single = sum(trig) == 1
            key = (exponents[:m], trig.index(1) % n if single else trig)
            amplitudes.setdefault(key, []).append(self.restore(coefficient))
        total = sp.S.Zero
        for (exponents, _), coefficients in amplitudes.items():
            rate = sp.Add(*(q.k * e for q, e in zip(self.growths, exponents[1:], strict=True)))
            total += _largest(exponents[0], rate, horizon) * _length(coefficients)
        return total


def check_form(expr: sp.Expr) -> None:
    """Refuse an expression that `Flow.split` cannot split; what is simple takes no simplification."""
    if expr == S or not expr.has(S):
        return
    if isinstance(expr, (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh)):
        k = sp.diff(expr.args[0], S)
        if k.has(S) and sp.simplify(k).has(S):
            raise SystemDefinitionError(f"{expr} has an argument that is not linear in time; only A + k t is accepted")
    elif expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Integer and expr.exp > 0):
        for part in expr.args:
            check_form(part)
    else:
        raise SystemDefinitionError(
            f"{sp.sstr(expr)} cannot be followed in time; accepted: powers of t and sin, cos, exp, sinh, cosh of A + k t"
        )


def along_phase(expr: sp.Expr, phase: sp.Symbol, period: sp.Expr) -> list[sp.Expr]:
    """An expression in the phase, its rate in time, and a bound on its second rate over a period of the forcing."""
    rate, flow = 2 * sp.pi / period, Flow()
    later = expr.subs(phase, rate * S)
    check_form(later)
    return [expr, rate * sp.diff(expr, phase), flow.bound(flow.rate(flow.rate(flow.split(later))), period)]


def _largest(power: int, rate: sp.Expr, horizon: sp.Expr) -> sp.Expr:
    """The largest s**power exp(rate s) for s in [0, horizon]: at its maximum, s = -power/rate, if that comes before the end."""
    if power == 0:
        return sp.exp(sp.Max(0, rate) * horizon)
    s = power / sp.Max(-rate, power / horizon)
    return s**power * sp.exp(rate * s)


def _length(parts: list[sp.Expr]) -> sp.Expr:
    """The Euclidean length of the coefficients of sine and cosine."""
    if len(parts) == 1:
        return sp.Abs(parts[0])
    square = sp.expand(sum(part**2 for part in parts))
    if sp.count_ops(square) < 200:
        square = sp.factor(sp.trigsimp(square))
    return sp.sqrt(square)
