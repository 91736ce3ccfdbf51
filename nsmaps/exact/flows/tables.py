"""From the sum of exponentials of a flight to the table of the engine: rates, coefficients, walls and impact laws in numbers."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any

import mpmath as mp
import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.exponentials import DIGITS, Expansion, Sum, functional, rates_of
from nsmaps.exact.flows.formulas import (
    V,
    Z,
    check_flight,
    check_symbols,
    checked_acceleration,
    displacement_at,
    impact_law,
    in_symbols,
    is_linear,
)
from nsmaps.exact.flows.laws import law_address
from nsmaps.exact.flows.source import period_of, walls_of
from nsmaps.exact.systems.files import place_of

if TYPE_CHECKING:
    from nsmaps.exact.systems.system import ImpactSystem

CANCELS = mp.mpf("0.1")  #: two terms with nearly equal rates are chained if they cancel to less than this share of them
NEAR = mp.mpf("0.1")  #: and if their rates differ by less than this share
SLOW = mp.mpf("0.02")  #: a damped wave whose frequency is below this share of its rate forms a pair, as next to critical damping
ONE_AT_A_TIME = Lock()  #: mpmath has one precision for all threads
FLIGHTS = 4096  #: number of flights that are remembered, about 1 kB each
ORDERS = range(2, 6)  #: time derivatives of the displacement at the start: acceleration to crackle


@dataclass(frozen=True, slots=True)
class Rate:
    """A rate with its complex coefficients by the features, of exp(rate s) or of the function of a chain, see `layout`."""

    rate: Any
    coefficients: list[Any]
    power: int = 0
    difference: Any = 0
    linked: bool = False  #: to the next

    @property
    def chained(self) -> bool:
        """True if it is more than a plain exponential."""
        return self.linked or self.power > 0


def rates_and_powers(total: Sum, harmonics: int) -> tuple[list[Rate], list[list[Any]]]:
    """The plain rates, then the chained ones; and the coefficients of s^n/n! from n = 2 on."""
    powers, plain, chains = list[list[Any]](), list[Rate](), list[Rate]()
    for rate, degree in rates_of(total):
        rows = [[x * mp.factorial(n) for x in functional(total, rate, n, harmonics)] for n in range(degree + 1)]
        if rate == 0:
            powers = rows[2:]
        elif degree:
            chains += [Rate(rate, row, n, linked=n < degree) for n, row in enumerate(rows)]
        elif 0 < mp.im(rate) < SLOW * abs(rate):
            chains += _slow_wave(rate, rows[0])
        else:
            plain.append(Rate(rate, rows[0]))
    return [*_paired(plain), *chains], powers


def _slow_wave(rate: Any, row: list[Any]) -> list[Rate]:
    """A damped wave by exp(a s) cos(k s) and exp(a s) sin(k s)/k, the divided difference of the rates a + i k and a - i k."""
    real, imaginary = _real(row)
    k = mp.im(rate)
    return [Rate(rate, real, linked=True), Rate(mp.conj(rate), [x * k for x in imaginary], 1, mp.mpc(0, -2 * k))]


def _paired(plain: list[Rate]) -> list[Rate]:
    """Rates that nearly agree and whose terms cancel, as pairs with a divided difference; the others come first."""
    left, pairs = list(plain), []
    for one in plain:
        for other in plain:
            if one in left and other in left and one is not other and _cancel(one, other):
                left.remove(one)
                left.remove(other)
                delta = other.rate - one.rate
                both = [x + y for x, y in zip(one.coefficients, other.coefficients, strict=True)]
                pairs += [Rate(one.rate, both, linked=True)]
                pairs += [Rate(other.rate, [y * delta for y in other.coefficients], 1, delta)]
    return left + pairs


def _cancel(one: Rate, other: Rate) -> bool:
    if abs(one.rate - other.rate) > NEAR * max(abs(one.rate), abs(other.rate)):
        return False
    pairs = zip(one.coefficients, other.coefficients, strict=True)
    return any(abs(x + y) < CANCELS * max(abs(x), abs(y)) for x, y in pairs if max(abs(x), abs(y)) > 0)


def rows_at_start(rates: list[Rate], powers: list[list[Any]], count: int) -> list[list[Any]]:
    """Acceleration, jerk, snap and crackle at the start by the features, with the contribution of the velocity itself."""
    rows = []
    for order in ORDERS:
        row = list(powers[order - 2]) if order - 2 < len(powers) else [mp.mpc(0)] * count
        for one, before in zip(rates, [None, *rates], strict=False):
            value = _at_zero(one, before, order)
            row = [x + value * c for x, c in zip(row, one.coefficients, strict=True)]
        rows.append([mp.re(x) for x in row])
    return rows


def _at_zero(one: Rate, before: Rate | None, order: int) -> Any:
    """The derivative of this order at zero of exp(rate s), of s^n exp(rate s)/n! or of a divided difference."""
    if not one.power:
        return one.rate**order
    if one.difference:
        assert before is not None
        return sum(one.rate**k * before.rate ** (order - 1 - k) for k in range(order))
    return mp.binomial(order, one.power) * one.rate ** (order - one.power) if order >= one.power else mp.mpc(0)


def packed(rates: list[Rate], powers: list[list[Any]], harmonics: int, parameters: list[float]) -> Floats:
    """The table of a flight, its head filled except for walls and laws."""
    rates = sorted(rates, key=lambda one: one.chained)
    count, simple = at.features(harmonics), sum(not one.chained for one in rates)
    sizes = [len(powers) * count, 2 * len(rates), 2 * len(rates) * count, at.CHAIN * (len(rates) - simple), 4 * count]
    begins = at.HEAD + np.cumsum([0, *sizes])
    table = np.zeros(int(begins[-1]) + len(parameters) + 1)
    growing = max([float(mp.re(one.rate)) for one in rates], default=0.0)
    local = growing > 0 or len(powers) > 1 or simple < len(rates)
    table[at.HARMONICS : at.WIDE + 1] = harmonics, len(powers), simple, len(rates) - simple, local, _reach(rates), not local
    table[at.AT_POWERS : at.AT_PARAMETERS + 1] = begins
    table[at.DAMPED] = any(row[2] != 0 for row in [*powers, *(one.coefficients for one in rates)])
    table[at.FLIGHT_SIZE] = at.POLYNOMIAL + len(powers) + 2 * len(rates) + 1
    fill = [
        [float(mp.re(x)) for row in powers for x in row],
        [float(part) for one in rates for part in (one.rate.real, one.rate.imag)],
    ]
    fill.append([float(x) for one in rates for row in _real(one.coefficients) for x in row])
    fill.append(
        [x for one in rates[simple:] for x in (one.power, float(mp.re(one.difference)), float(mp.im(one.difference)), one.linked)]
    )
    fill.append([float(x) for row in rows_at_start(rates, powers, count) for x in row])
    for begin, values in zip(begins, [*fill, parameters], strict=True):
        table[begin : begin + len(values)] = values
    return table


def _reach(rates: list[Rate]) -> float:
    """The time over which bounds on flights that grow are taken: growth by a factor e."""
    growing = max([float(mp.re(one.rate)) for one in rates], default=0.0)
    fastest = max([float(abs(one.rate)) for one in rates], default=1.0)
    return 1 / growing if growing > 0 else 10 / fastest


def _real(row: list[Any]) -> tuple[list[Any], list[Any]]:
    return [mp.re(x) for x in row], [-mp.im(x) for x in row]


@dataclass(frozen=True, eq=False)
class Formulas:
    """The formulas of a system's class, or their derivatives by its parameters, from which tables are computed."""

    symbols: tuple[sp.Symbol, ...]  #: of the parameters, followed for derivatives by their rates of change
    displacement: Expansion
    numbers: list[sp.Expr]  #: places of the upper and lower wall, radians of phase a unit of time, longest flight
    laws: list[sp.Expr]  #: speed after an impact on the lower wall and on the upper, by V
    sides: tuple[bool, bool, bool]  #: True if there is an upper wall, a lower one, if the base wall is the upper one
    acceleration: sp.Expr | None = None  #: by S (the time), Z and W, of flights without a closed form, whose displacement is zero

    @cached_property
    def compute(self) -> Callable[..., Any]:
        """The numbers, then the factors of linear laws."""
        factors = [sp.diff(law, V) if is_linear(law) else sp.S.Zero for law in self.laws]
        return sp.lambdify(self.symbols, [*self.numbers, *factors], "mpmath")

    @cached_property
    def curved(self) -> list[tuple[int, sp.Expr]]:
        """Laws that are not linear and their derivatives, each with its place in the table."""
        laws = [(k, law) for k, law in enumerate(self.laws) if not is_linear(law)]
        return [(at.LAW + k, law) for k, law in laws] + [(at.LAW_SLOPE + k, sp.diff(law, V)) for k, law in laws]

    @cached_property
    def flown(self) -> list[bool]:
        """Whether the flight depends on each parameter; walls and laws may depend on the others."""
        free = self.displacement.formula.free_symbols
        return [symbol in free for symbol in self.symbols]

    def table(self, values: list[float]) -> Floats:
        """The table at these values of the parameters, shape (M,)."""
        with ONE_AT_A_TIME, mp.workdps(DIGITS):
            table = _flight(self, tuple(x if flown else 0.0 for x, flown in zip(values, self.flown, strict=True))).copy()
            numbers = [float(x) for x in self.compute(*map(mp.mpf, values))]
        begin = int(table[at.AT_PARAMETERS])
        table[begin : begin + len(values)] = values
        table[[at.TOP, at.BOTTOM, at.PHASE_RATE, at.HORIZON, at.RESTITUTION, at.RESTITUTION + 1]] = numbers
        table[[at.HAS_UP, at.HAS_DOWN, at.BASE_UP]] = self.sides
        for place, law in self.curved:
            table[place] = law_address(law, V, self.symbols)
        return table

    def along(self, names: tuple[str, ...]) -> "Formulas":
        """The derivatives of all formulas along a direction; the rates of change of the parameters follow them as parameters."""
        return _along(self, names)


@lru_cache(maxsize=FLIGHTS)
def _flight(formulas: Formulas, values: tuple[float, ...]) -> Floats:
    """The table without walls, laws and parameters, at values of the parameters on which flights depend, 0 for the others."""
    total = formulas.displacement.at(list(values))
    harmonics = max([1, *(abs(term.harmonic) for term in total)])
    return packed(*rates_and_powers(total, harmonics), harmonics, list(values))


@lru_cache(maxsize=64)
def _along(formulas: Formulas, names: tuple[str, ...]) -> Formulas:
    ways = tuple(sp.Symbol(f"_way_{name}", real=True) for name in names)
    pairs = list(zip(formulas.symbols, ways, strict=True))

    def moved(expr: sp.Expr) -> sp.Expr:
        return sp.Add(*(way * sp.diff(expr, symbol) for symbol, way in pairs))

    symbols = formulas.symbols + ways
    displacement = Expansion(moved(formulas.displacement.formula), symbols)
    numbers, laws = ([moved(x) for x in exprs] for exprs in (formulas.numbers, formulas.laws))
    return Formulas(symbols, displacement, numbers, laws, formulas.sides)


def written(cls: "type[ImpactSystem]") -> tuple[Any, ...]:
    """All of a class that flights depend on."""
    return cls, cls.horizon, cls.walls, cls.period, cls.displacement, cls.acceleration, cls.rebound


def formulas_of(system: "ImpactSystem") -> Formulas:
    """The formulas of a system's class and of its fields that are not numbers; they are checked on first use.

    Raises:
        SystemDefinitionError: the formulas cannot become a flight whose rates have bounds; states which and why.
    """
    cls, numbers = type(system), system.parameter_names()
    fixed = {name: getattr(system, name) for name in cls.model_fields if name not in numbers}
    key = *written(cls), *sorted((name, repr(value)) for name, value in fixed.items())
    if key not in KNOWN:
        with refused(cls):
            KNOWN[key] = _formulas(cls, fixed)
    return KNOWN[key]


@contextmanager
def refused(cls: "type[ImpactSystem]") -> Iterator[None]:
    """Refuse a class by a SystemDefinitionError that states where its flight is written, whatever fails in its formulas."""
    try:
        yield
    except SystemDefinitionError:
        raise
    except Exception as error:  # errors of sympy in formulas of an unforeseen form
        why, place = f"{type(error).__name__}: {error}", place_of(cls, cls.flight())
        raise SystemDefinitionError(f"the formulas of {cls.__name__} cannot be turned into a flow ({why}){place}") from error


def table_of(system: "ImpactSystem") -> Floats:
    """The table of a system for its parameters. Raises as `formulas_of` does."""
    formulas, cls = formulas_of(system), type(system)
    with refused(cls):
        try:
            return formulas.table(list(system.parameters.values()))
        except SystemDefinitionError as error:
            place = place_of(cls, "displacement")
            raise SystemDefinitionError(f"{cls.__name__}.displacement cannot be a flight: {error}{place}") from error


KNOWN: dict[Any, Formulas] = {}  #: by class, its fields that are not numbers, and its formulas


def _formulas(cls: "type[ImpactSystem]", fixed: dict[str, Any]) -> Formulas:
    symbolic, symbols = in_symbols(cls, fixed)
    period = period_of(symbolic)
    if period.is_number and not period.is_positive:
        raise SystemDefinitionError(f"{cls.__name__}.period is {period}; expected: a positive number{place_of(cls, 'period')}")
    given, acceleration, sides = sp.S.Zero, None, [wall.side for wall in walls_of(symbolic).values()]
    try:
        if cls.flight() == "acceleration":
            acceleration = checked_acceleration(symbolic, period, symbols)
        else:
            given = displacement_at(symbolic, period) - Z
            check_flight(cls.__name__, given + Z, period, symbols)
    except SystemDefinitionError as error:
        raise SystemDefinitionError(f"{error}{place_of(cls, cls.flight())}") from error
    places, laws = impact_law(symbolic)
    laws.reverse()  # the lower wall first
    check_symbols(cls.__name__, [*places, *laws, period], set(symbols.values()))
    numbers = [*places, 2 * sp.pi / period, int(symbolic.horizon) * period]
    known, order = tuple(symbols.values()), (1 in sides, -1 in sides, sides[0] == 1)
    return Formulas(known, Expansion(given, known), numbers, laws, order, acceleration)
