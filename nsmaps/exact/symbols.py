"""The algebra of flights: an expression in time split into factors free of time and remainders without cancellation.

With s the time since the impact, each sin, cos and exp of (A + k s) is split by angle addition into a factor free of s and the
remainders C = cos(k s) - 1, R = sin(k s) - k s, E = exp(k s) - 1 - k s, so that what is small is computed small. Rates follow by
the chain rule, with N = sin(k s) and X = exp(k s) - 1. Products of exp, sinh and cosh are written as one of each before: what
grows is never multiplied by what decays. exp(a s) sinh(k s) has remainders of its own, that of exp(a s) cosh(k s) is that of
exp((a + k) s) less these: k may be small or large.
"""

from dataclasses import dataclass, field

import sympy as sp

from nsmaps.errors import SystemDefinitionError

S = sp.Symbol("_s", real=True)


Sums = dict[tuple[sp.Expr, sp.Expr, bool], sp.Expr]


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
class Twin:
    """The remainders of two rates, a + k and a - k: N = exp(a s) sinh(k s), R = N - k s."""

    k: sp.Expr
    upper: Growth  #: of the rate a + k
    lower: sp.Expr  #: the rate a - k
    n: sp.Symbol
    r: sp.Symbol


@dataclass(frozen=True, slots=True)
class Flow:
    """A flight as a polynomial in s and the remainders of its waves, growths and twins."""

    waves: list[Wave] = field(default_factory=list)
    growths: list[Growth] = field(default_factory=list)
    twins: list[Twin] = field(default_factory=list)
    factors: dict[sp.Symbol, tuple[type, sp.Expr]] = field(default_factory=dict)  #: exp, sinh and cosh of s, not yet multiplied
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

    def twin(self, a: sp.Expr, k: sp.Expr) -> Twin:
        """The twin of the rates a + k and a - k, made when first met."""
        upper = self.growth(_simple(a + k))
        for twin in self.twins:
            if twin.upper is upper and sp.simplify(twin.k - k) == 0:
                return twin
        i = len(self.twins)
        self.twins.append(Twin(k, upper, _simple(a - k), sp.Symbol(f"_m{i}", real=True), sp.Symbol(f"_t{i}", real=True)))
        return self.twins[-1]

    @property
    def generators(self) -> list[sp.Symbol]:
        """s and all remainders."""
        waves, growths = (g for w in self.waves for g in (w.c, w.n, w.r)), (g for q in self.growths for g in (q.x, q.e))
        return [S, *waves, *growths, *(g for twin in self.twins for g in (twin.n, twin.r))]

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
        """The frequencies of the waves, the rates of the growths and half the differences of the twins' rates."""
        return [*(w.k for w in self.waves), *(q.k for q in self.growths), *(twin.k for twin in self.twins)]

    def split(self, expr: sp.Expr) -> sp.Expr:
        """The expression, of a form that was checked, with every function of s split into factors free of s and remainders."""
        expr = self._split(expr)
        if not self.factors:
            return expr
        sums: Sums = {}
        for exponents, c in sp.Poly(sp.expand(expr), *self.factors).terms():
            for key, share in self._product(exponents).items():
                sums[key] = sums.get(key, sp.S.Zero) + c * share
        return sp.Add(*(c * self._exponential(*key) for key, c in sums.items() if sp.expand(c) != 0))

    def _split(self, expr: sp.Expr) -> sp.Expr:
        """See `split`; exp, sinh and cosh of s are left as `factors`."""
        if expr == S:
            return expr
        if not expr.has(S):
            return self.name(expr)
        if isinstance(expr, (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh)):
            return self._add_angles(type(expr), expr.args[0].subs(S, 0), _simple(sp.diff(expr.args[0], S)))
        if expr.is_Add or expr.is_Mul:
            free, timed = expr.as_independent(S, as_Add=expr.is_Add)
            parts = timed.args if isinstance(timed, expr.func) else (timed,)
            return expr.func(self.name(free), *(self._split(a) for a in parts))
        return self._split(expr.base) ** expr.exp

    def _add_angles(self, kind: type, a: sp.Expr, k: sp.Expr) -> sp.Expr:
        if kind is sp.exp:
            return self.name(sp.exp(a)) * self._factor(sp.exp, k)
        if kind in (sp.sinh, sp.cosh):
            sinh_a, cosh_a = self.name(sp.sinh(a)), self.name(sp.cosh(a))
            sinh, cosh = self._factor(sp.sinh, k), self._factor(sp.cosh, k)
            return sinh_a * cosh + cosh_a * sinh if kind is sp.sinh else cosh_a * cosh + sinh_a * sinh
        sign = -1 if k.could_extract_minus_sign() else 1
        wave = self.wave(sign * k)
        sine, cosine = sign * (self.name(wave.k) * S + wave.r), 1 + wave.c
        sin_a, cos_a = self.name(sp.sin(a)), self.name(sp.cos(a))
        return sin_a * cosine + cos_a * sine if kind is sp.sin else cos_a * cosine - sin_a * sine

    def _factor(self, kind: type, k: sp.Expr) -> sp.Symbol:
        """A symbol for a function of k s, the same for the same."""
        known = {meant: symbol for symbol, meant in self.factors.items()}
        symbol = known.get((kind, k), sp.Symbol(f"_f{len(self.factors)}", real=True))
        self.factors[symbol] = (kind, k)
        return symbol

    def _product(self, exponents: tuple[int, ...]) -> Sums:
        """Powers of the `factors`, multiplied: a sum of single exp(a s) cosh(k s) and exp(a s) sinh(k s)."""
        sums = {(sp.S.Zero, sp.S.Zero, False): sp.S.One}
        for (kind, rate), n in zip(self.factors.values(), exponents, strict=True):
            if kind is sp.exp:
                sums = {(_simple(a + n * rate), k, odd): c for (a, k, odd), c in sums.items()}
            for _ in range(0 if kind is sp.exp else n):
                sums = _times(sums, rate, kind is sp.sinh)
        return sums

    def _exponential(self, a: sp.Expr, k: sp.Expr, odd: bool) -> sp.Expr:
        """exp(a s) cosh(k s), or sinh where it is odd, in remainders."""
        upper = _simple(a + k)
        growth = self.growth(upper) if upper != 0 else None
        whole = 1 + self.name(upper) * S + growth.e if growth else sp.S.One
        if k == 0:
            return sp.S.Zero if odd else whole
        sinh = self.name(k) * S + self.twin(a, k).r
        return sinh if odd else whole - sinh

    def rate(self, expr: sp.Expr) -> sp.Expr:
        """The time derivative of a polynomial in s and the remainders."""
        total = sp.diff(expr, S)
        for w in self.waves:
            k = self.name(w.k)
            total += sp.diff(expr, w.c) * -k * w.n + sp.diff(expr, w.n) * k * (1 + w.c) + sp.diff(expr, w.r) * k * w.c
        for q in self.growths:
            k = self.name(q.k)
            total += sp.diff(expr, q.e) * k * q.x + sp.diff(expr, q.x) * k * (1 + q.x)
        for twin in self.twins:
            k, fall = self.name(twin.k), self.name(twin.lower) * twin.n
            total += sp.diff(expr, twin.r) * (fall + k * twin.upper.x) + sp.diff(expr, twin.n) * (fall + k * (1 + twin.upper.x))
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
        for twin in self.twins:
            a, k = (along(twin.upper.k) + along(twin.lower)) / 2, along(twin.k)
            less, more = sp.diff(expr, twin.r), sp.diff(expr, twin.n)
            by_k = (less + more) * (twin.upper.x - twin.n) + more
            total += S * (self.restore(less + more) * twin.n * a + self.restore(by_k) * k)
        return total

    def terms(self, expr: sp.Expr) -> dict[tuple[int, ...], sp.Expr]:
        """The coefficients of a polynomial in s and the remainders, free of s, by exponents."""
        poly = sp.Poly(sp.expand(expr), *self.generators)
        return dict(poly.terms()) if poly.as_expr() != 0 else {}

    def monomial(self, exponents: tuple[int, ...]) -> sp.Expr:
        """The product of the generators to these exponents."""
        return sp.Mul(*(g**e for g, e in zip(self.generators, exponents, strict=True)))


def _times(sums: Sums, rate: sp.Expr, odd: bool) -> Sums:
    """A sum of exp(a s) cosh(k s) and exp(a s) sinh(k s), by (a, k, is it sinh), times cosh or sinh of rate s."""
    product: Sums = {}
    for (a, k, was_odd), c in sums.items():
        both = [(rate, c)] if k == 0 else [(k + rate, c / 2), (k - rate, -c / 2 if odd else c / 2)]
        for other, part in both:
            key = a, _simple(other), was_odd != odd
            product[key] = product.get(key, sp.S.Zero) + part
    return product


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


def factored(expr: sp.Expr) -> sp.Expr:
    """The expression with what stands under its square roots, and its differences of constants, as products.

    (z - 1) (z + 1) keeps the digits that z^2 - 1 loses where z is near 1.
    """
    roots = {root: sp.factor(root.base) ** root.exp for root in expr.atoms(sp.Pow) if abs(root.exp) == sp.S.Half}
    pairs = {two: sp.factor(two) for two in expr.atoms(sp.Add) if len(two.args) == 2 and any(a.is_number for a in two.args)}
    return expr.xreplace({x: product for x, product in (pairs | roots).items() if not x.has(S)})


def _simple(rate: sp.Expr) -> sp.Expr:
    """A frequency or a rate, simplified."""
    return factored(sp.simplify(rate))
