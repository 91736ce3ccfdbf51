"""Sums of s^k exp(lambda s) whose coefficients are linear in the state and periodic in the phase, in many digits.

Every flight in closed form must be such a sum. A formula is decomposed at given values of its parameters, in
multiple precision, so that cancellation within the formula costs no digits of the coefficients.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import mpmath as mp
import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, S, W, Z

DIGITS = 60  #: of the decomposition
NEGLIGIBLE = mp.mpf(10) ** -45  #: remainder of terms that cancel, relative to their sizes
DISTINCT = 1e-9  #: a relative difference of rates that floats show too
STATE = {Z: "z", W: "w"}
WAVES = {sp.cos: (1, 1), sp.sin: (1, -1)}
GROWTHS = {sp.exp: (1, 0), sp.cosh: (1, 1), sp.sinh: (1, -1)}  #: halves of exp(x) and exp(-x), except for exp itself


class Term(NamedTuple):
    """The index of a coefficient of s^power exp(rate s) exp(i harmonic phase) phase^degree, times the place, velocity or 1."""

    power: int
    rate: Any
    harmonic: int
    degree: int
    state: str

    def __hash__(self) -> int:
        """With the rate's numbers as mpmath has them: objects of mpmath take longer to hash and to compare."""
        return hash((self.power, self.rate._mpc_, self.harmonic, self.degree, self.state))


ONE = Term(0, mp.mpc(0), 0, 0, "")
TIME, PHASE = ONE._replace(power=1), ONE._replace(degree=1)
UNITS = {S: TIME, PHI: PHASE, **{symbol: ONE._replace(state=name) for symbol, name in STATE.items()}}
Sum = dict[Term, Any]


@dataclass(frozen=True, slots=True)
class Expansion:
    """A formula prepared for decomposition: the parts that become numbers with the parameters are computed together.

    Sums of parts are kept from one decomposition to the next, for those in which no parameter changes.
    """

    formula: sp.Expr
    parameters: tuple[sp.Symbol, ...]
    numbers: dict[sp.Expr, int] = field(default_factory=dict)
    compute: list[Callable[..., Any]] = field(default_factory=list)
    latest: list[tuple[list[float], dict[sp.Expr, Sum], Sum]] = field(default_factory=list)  #: values, sums of parts, the sum

    def at(self, values: list[float]) -> Sum:
        """The sum at these values of the parameters.

        Raises:
            SystemDefinitionError: the formula is not such a sum; states which part of it is not.
        """
        if not self.compute:
            _collect(self.formula, self.numbers)
            self.compute.append(sp.lambdify(self.parameters, list(self.numbers), "mpmath", cse=True))
        known: dict[sp.Expr, Sum] = {}
        if self.latest:
            before, sums, total = self.latest[0]
            changed = {symbol for symbol, x, y in zip(self.parameters, before, values, strict=True) if x != y}
            if changed.isdisjoint(_symbols(self.formula)):
                return total
            known = {part: found for part, found in sums.items() if changed.isdisjoint(_symbols(part))}
        with mp.workdps(DIGITS):
            numbers = [mp.mpmathify(x) + 0 for x in self.compute[0](*map(mp.mpf, values))]
            known |= {part: {ONE: numbers[i]} for part, i in self.numbers.items()}
            total = merged(_expand(self.formula, known))
        self.latest[:] = [(list(values), known, total)]
        return total


def _shown(expr: sp.Expr) -> str:
    """An expression in the author's names for time, place and velocity after an impact."""
    names = {Z: sp.Symbol("hit.z"), W: sp.Symbol("hit.w"), S: sp.Symbol("s"), PHI: sp.Symbol("phi")}
    return str(sp.sstr(expr.xreplace(names))).replace("_p_", "")


def _timed(expr: sp.Expr) -> bool:
    return expr.has(S, PHI, Z, W)


@lru_cache(maxsize=4096)
def _symbols(expr: sp.Expr) -> set[sp.Symbol]:
    return expr.free_symbols


@lru_cache(maxsize=4096)
def _split(expr: sp.Expr) -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """The part of a sum or product that is free of time, phase and state, and the other terms or factors."""
    free, timed = expr.as_independent(S, PHI, Z, W, as_Add=expr.is_Add)
    return free, timed.args if isinstance(timed, expr.func) else (timed,)


def _collect(expr: sp.Expr, numbers: dict[sp.Expr, int]) -> None:
    """Number the largest parts that are free of time, phase and state."""
    if not _timed(expr):
        numbers.setdefault(expr, len(numbers))
    elif expr.is_Add or expr.is_Mul:
        free, others = _split(expr)
        if free != (0 if expr.is_Add else 1):
            numbers.setdefault(free, len(numbers))
        for part in others:
            _collect(part, numbers)
    else:
        for part in expr.args:
            _collect(part, numbers)


def _expand(expr: sp.Expr, known: dict[sp.Expr, Sum]) -> Sum:
    """The sum that an expression is; `known` has those of some parts, and then of all that were met."""
    if expr not in known:
        known[expr] = _expanded(expr, known)
    return known[expr]


def _expanded(expr: sp.Expr, known: dict[sp.Expr, Sum]) -> Sum:
    if expr in UNITS:
        return {UNITS[expr]: mp.mpf(1)}
    if expr.is_Add or expr.is_Mul:
        free, others = _split(expr)
        parts = [_expand(part, known) for part in others]
        parts += [known[free]] if free in known else []
        return _added(parts) if expr.is_Add else _multiplied(parts, expr)
    if expr.is_Pow and expr.exp.is_Integer and expr.exp > 0:
        return _multiplied([_expand(expr.base, known)] * int(expr.exp), expr)
    if type(expr) in WAVES or type(expr) in GROWTHS:
        return _exponential(expr, _expand(expr.args[0], known))
    raise SystemDefinitionError(
        f"{_shown(expr)} cannot be followed in time; expected: powers of t and sin, cos, exp, sinh, cosh of A + k t, linear in "
        "hit.z and hit.w"
    )


def _added(parts: list[Sum]) -> Sum:
    total: Sum = {}
    for part in parts:
        for term, value in part.items():
            total[term] = total[term] + value if term in total else value
    return total


def _multiplied(parts: list[Sum], expr: sp.Expr) -> Sum:
    total = parts[0]
    for part in parts[1:]:
        product: Sum = {}
        for a, x in total.items():
            for b, y in part.items():
                if a.state and b.state:
                    raise SystemDefinitionError(f"{_shown(expr)} is not linear in hit.z and hit.w")
                rate = a.rate + b.rate if a.rate and b.rate else a.rate or b.rate
                term = Term(a.power + b.power, rate, a.harmonic + b.harmonic, a.degree + b.degree, a.state + b.state)
                product[term] = product[term] + x * y if term in product else x * y
        total = product
    return total


def _exponential(expr: sp.Expr, argument: Sum) -> Sum:
    """exp, sin, cos, sinh or cosh of an argument that must be linear in time, with whole turns of the phase."""
    linear = ONE, TIME, PHASE
    others = {term: x for term, x in argument.items() if term not in linear}
    if any(abs(x) > NEGLIGIBLE * max(map(abs, argument.values())) for x in others.values()):
        raise SystemDefinitionError(f"{_shown(expr)} has an argument that is not linear in time; expected: A + k t")
    at, rate, turn = (argument.get(term, mp.mpf(0)) for term in linear)
    wave = type(expr) in WAVES
    harmonic = int(mp.nint(mp.re(turn)))
    if abs(turn - harmonic) > NEGLIGIBLE * (1 + abs(turn)) or (harmonic and not wave):
        raise SystemDefinitionError(f"{_shown(expr)} is not the same after one `period` of the forcing")
    unit, (first, second) = (mp.mpc(0, 1), WAVES[type(expr)]) if wave else (mp.mpf(1), GROWTHS[type(expr)])
    half = mp.mpf(1) if second == 0 else 1 / (2 * unit) if second < 0 and wave else mp.mpf("0.5")
    total: Sum = defaultdict(mp.mpf)
    for sign, share in ((1, first), (-1, second)):
        if share:
            term = Term(0, mp.mpc(sign * unit * rate) if rate else ONE.rate, sign * harmonic, 0, "")
            total[term] += share * half * mp.exp(sign * unit * at)
    return dict(total)


def merged(total: Sum) -> Sum:
    """A sum in which equal rates are united and terms that cancel are removed."""
    alike: dict[Any, list[Term]] = defaultdict(list)  # of each term without its rate those met, of rates that differ
    found: dict[Term, Any] = {}
    sizes: dict[Term, Any] = {}
    for term, value in total.items():
        others = alike[term.power, term.harmonic, term.degree, term.state]
        same = next((other for other in others if _equal(other.rate, term.rate)), term)
        if same is term:
            others.append(term)
        found[same] = found.get(same, mp.mpf(0)) + value
        sizes[same] = max(sizes.get(same, mp.mpf(0)), abs(value))
    return {term: value for term, value in found.items() if abs(value) > NEGLIGIBLE * sizes[term]}


def _equal(a: Any, b: Any) -> bool:
    x, y = complex(a), complex(b)
    if abs(x - y) > DISTINCT * max(abs(x), abs(y)):
        return False
    return bool(a == b or abs(a - b) <= NEGLIGIBLE * max(abs(a), abs(b)))


def rates_of(total: Sum) -> Iterator[tuple[Any, int]]:
    """The rates with Im >= 0 and the highest power of s of each."""
    powers: dict[Any, int] = {}
    for term in total:
        rate = mp.mpc(mp.re(term.rate), abs(mp.im(term.rate)))
        same = next((r for r in powers if _equal(r, rate)), rate)
        powers[same] = max(powers.get(same, 0), term.power)
    yield from powers.items()


def functional(total: Sum, rate: Any, power: int, harmonics: int) -> list[Any]:
    """The complex coefficients C of 1, z, w and of cos and sin of each multiple of the phase, of s^power Re(C exp(rate s))."""
    row = [mp.mpc(0)] * (3 + 2 * harmonics)
    double = 1 if mp.im(rate) == 0 else 2
    for term, value in total.items():
        if term.power == power and _equal(term.rate, rate):
            value, m = value * double, term.harmonic
            if m == 0:
                row["zw".find(term.state) + 1 if term.state else 0] += value
            else:
                row[2 * abs(m) + 1] += value
                row[2 * abs(m) + 2] += value * mp.mpc(0, 1 if m > 0 else -1)
    return row
