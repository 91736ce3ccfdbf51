"""Sums of s^k exp(lambda s) whose coefficients are linear in the state and periodic in the phase, in many digits.

Every flight in closed form must be such a sum. A formula is decomposed at given values of its parameters, in
multiple precision, so that cancellation within the formula costs no digits of the coefficients.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import mpmath as mp
import sympy as sp
from mpmath import libmp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, S, W, Z
from nsmaps.exact.flows.numbers import NOTHING, ONE, UNIT, Finish, Number, Recorded, constant
from nsmaps.exact.flows.recording import DIGITS, PRECISION, Real, decide
from nsmaps.exact.flows.ways import FORCING

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


FREE = Term(0, NOTHING, 0, 0, "")
TIME, PHASE = FREE._replace(power=1), FREE._replace(degree=1)
UNITS = {S: TIME, PHI: PHASE, **{symbol: FREE._replace(state=name) for symbol, name in STATE.items()}}
Sum = dict[Term, Any]


@dataclass(frozen=True, eq=False)
class Expansion:
    """A formula prepared for decomposition: the parts that become numbers with the parameters are computed together."""

    formula: sp.Expr
    parameters: tuple[sp.Symbol, ...]
    latest: list[tuple[list[float], Sum]] = field(default_factory=list)  #: values of those in the formula, and its sum

    @cached_property
    def parts(self) -> dict[sp.Expr, int]:
        """The parts that become numbers."""
        parts: dict[sp.Expr, int] = {}
        _collect(self.formula, parts)
        return parts

    @cached_property
    def fixed(self) -> list[bool]:
        """Whether each of them is the same at all values of the parameters."""
        return [not part.free_symbols for part in self.parts]

    @cached_property
    def used(self) -> list[bool]:
        """Whether each parameter is in the formula."""
        return [symbol in self.formula.free_symbols for symbol in self.parameters]

    @cached_property
    def compute(self) -> Callable[..., Any]:
        """The numbers that the parts become."""
        return sp.lambdify(self.parameters, list(self.parts), "mpmath", cse=True)

    @cached_property
    def sums(self) -> Recorded:
        """The sums by these numbers."""
        return Recorded(self._sum, self.fixed)

    def numbers(self, values: Sequence[float]) -> list[Any]:
        """The parts at these values of the parameters."""
        with mp.workdps(DIGITS):
            return [mp.mpmathify(x) + 0 for x in self.compute(*map(mp.mpf, values))]

    def expanded(self, numbers: list[Number]) -> Sum:
        """The sum at these numbers.

        Raises:
            SystemDefinitionError: the formula is not such a sum; states which part of it is not.
        """
        return merged(_expand(self.formula, {part: {FREE: numbers[i]} for part, i in self.parts.items()}))

    def at(self, values: list[float]) -> Sum:
        """The sum at these values of the parameters, in numbers of mpmath. Raises as `expanded` does."""
        needed = [x for x, used in zip(values, self.used, strict=True) if used]
        if not self.latest or self.latest[0][0] != needed:
            self.latest[:] = [(needed, self.sums(self.numbers(values)))]
        return self.latest[0][1]

    def _sum(self, numbers: list[Number]) -> tuple[list[Real], Finish]:
        total = self.expanded(numbers)

        def finish(found: list[Any]) -> Sum:
            pairs = [mp.make_mpc(pair) for pair in zip(found[::2], found[1::2], strict=True)]
            return {term._replace(rate=pairs[2 * k]): pairs[2 * k + 1] for k, term in enumerate(total)}

        return [part for term, x in total.items() for number in (term.rate, x) for part in number.parts], finish


def _shown(expr: sp.Expr) -> str:
    """An expression in the author's names for time, place and velocity after an impact."""
    names = {Z: sp.Symbol("hit.z"), W: sp.Symbol("hit.w"), S: sp.Symbol("s"), PHI: sp.Symbol("phi")}
    return str(sp.sstr(expr.xreplace(names))).replace("_p_", "")


def _timed(expr: sp.Expr) -> bool:
    return expr.has(S, PHI, Z, W)


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
        return {UNITS[expr]: ONE}
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
                term = Term(
                    a.power + b.power, (a.rate + b.rate).alike(), a.harmonic + b.harmonic, a.degree + b.degree, a.state + b.state
                )
                product[term] = product[term] + x * y if term in product else x * y
        total = product
    return total


def _exponential(expr: sp.Expr, argument: Sum) -> Sum:
    """exp, sin, cos, sinh or cosh of an argument that must be linear in time, with whole turns of the phase."""
    linear = FREE, TIME, PHASE
    others = [x for term, x in argument.items() if term not in linear]
    if any(not decide(_negligible, *x.parts, *(p for y in argument.values() for p in y.parts)) for x in others):
        raise SystemDefinitionError(f"{_shown(expr)} has an argument that is not linear in time; expected: A + k t")
    at, rate, turn = (argument.get(term, NOTHING) for term in linear)
    wave = type(expr) in WAVES
    harmonic, whole = decide(_whole, *turn.parts)
    if not whole or (harmonic and not wave):
        raise SystemDefinitionError(f"{_shown(expr)} is not the same after one `period` of the forcing; {FORCING}")
    unit, (first, second) = (UNIT, WAVES[type(expr)]) if wave else (ONE, GROWTHS[type(expr)])
    half = ONE if second == 0 else constant(mp.mpc(0, -0.5)) if second < 0 and wave else constant(0.5)
    total: Sum = {}
    for sign, share in ((1, first), (-1, second)):
        if share:
            way = unit if sign > 0 else -unit
            term = Term(0, (way * rate).alike(), sign * harmonic, 0, "")
            value = (half if share > 0 else -half) * (way * at).exp()
            total[term] = total[term] + value if term in total else value
    return total


def merged(total: Sum) -> Sum:
    """A sum in which equal rates are united and terms that cancel are removed."""
    alike: dict[Any, list[Term]] = defaultdict(list)  # of each term without its rate those met, of rates that differ
    found: dict[Term, list[Number]] = defaultdict(list)
    for term, value in total.items():
        others = alike[term.power, term.harmonic, term.degree, term.state]
        same = next((other for other in others if equal(other.rate, term.rate)), term)
        if same is term:
            others.append(term)
        found[same].append(value)
    sums = {term: _added_up(values) for term, values in found.items()}
    return {
        term: x
        for term, x in sums.items()
        if not decide(_negligible, *x.parts, *(p for y in found[term] for p in y.parts if len(found[term]) > 1))
    }


def _added_up(values: list[Number]) -> Number:
    return sum(values[1:], start=values[0])


def _negligible(re: Any, im: Any, *others: Any) -> bool:
    """Whether a number is zero, or of less than a share of the size of the largest of others."""
    if re == libmp.fzero == im:
        return True
    if not others:
        return False
    sizes = [libmp.mpf_hypot(*pair, PRECISION) for pair in zip(others[::2], others[1::2], strict=True)]
    share = libmp.mpf_mul(NEGLIGIBLE._mpf_, max(sizes, key=mp.make_mpf), PRECISION)
    return libmp.mpf_le(libmp.mpf_hypot(re, im, PRECISION), share)


def _whole(re: Any, im: Any) -> tuple[int, bool]:
    """The integer next to a number, and whether it is that number."""
    with mp.workprec(PRECISION):
        turn, harmonic = mp.make_mpc((re, im)), int(libmp.to_int(re, libmp.round_nearest))
        return harmonic, bool(abs(turn - harmonic) <= NEGLIGIBLE * (1 + abs(turn)))


def equal(a: Number, b: Number) -> bool:
    """Whether two rates are equal."""
    return a == b or bool(decide(_equal, a.rounded(), b.rounded(), *a.parts, *b.parts))


def _equal(x: complex, y: complex, *parts: Any) -> bool:
    if abs(x - y) > DISTINCT * max(abs(x), abs(y)):
        return False
    with mp.workprec(PRECISION):
        a, b = mp.make_mpc(parts[:2]), mp.make_mpc(parts[2:])
        return bool(a == b or abs(a - b) <= NEGLIGIBLE * max(abs(a), abs(b)))


def rates_of(total: Sum) -> Iterator[tuple[Number, int]]:
    """The rates with Im >= 0 and the highest power of s of each."""
    powers: dict[Number, int] = {}
    for term in total:
        rate = term.rate.conjugate() if decide(_negative, term.rate.im) else term.rate
        same = next((r for r in powers if equal(r, rate)), rate)
        powers[same] = max(powers.get(same, 0), term.power)
    yield from powers.items()


def _negative(x: Any) -> bool:
    return bool(x[0])


def functional(total: Sum, rate: Number, power: int, harmonics: int) -> list[Number]:
    """The complex coefficients C of 1, z, w and of cos and sin of each multiple of the phase, of s^power Re(C exp(rate s))."""
    row = [NOTHING] * (3 + 2 * harmonics)
    double = ONE if decide(_zero, rate.im) else constant(2)
    for term, value in total.items():
        if term.power == power and equal(term.rate, rate):
            value, m = value * double, term.harmonic
            if m == 0:
                place = "zw".find(term.state) + 1 if term.state else 0
                row[place] = row[place] + value
            else:
                row[2 * abs(m) + 1] = row[2 * abs(m) + 1] + value
                row[2 * abs(m) + 2] = row[2 * abs(m) + 2] + value * (UNIT if m > 0 else -UNIT)
    return row


def _zero(x: Any) -> bool:
    return bool(x == libmp.fzero)
