"""From the sum of exponentials of a flight to its rates and coefficients, and these in the table of the engine."""

import math
import operator
from dataclasses import dataclass
from itertools import chain

import numpy as np
import sympy as sp
from flint import acb

from nsmaps.arrays import Floats
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.balls import Number, Program, is_zero
from nsmaps.exact.flows.exponentials import Sum

CANCELLATION = 0.1  #: two terms with nearly equal rates are chained if they cancel to less than this share of them
NEAR_RATES = 0.1  #: and if their rates differ by less than this share
SLOW_WAVE = 0.02  #: a damped wave whose frequency is below this share of its rate forms a pair, as next to critical damping
VELOCITY = 2  #: its place among the features
ORDERS = range(2, 6)  #: time derivatives of the displacement at the start: acceleration to crackle
GROWTH, DECAY = 1.0, 10.0  #: of the exponents of the fastest rate: the reach of bounds on flights that grow, and on others

Row = list[Number]  #: by the features


@dataclass(frozen=True, slots=True)
class Rate:
    """A rate with its complex coefficients by the features, of exp(rate s) or of the function of a chain, see `layout`."""

    rate: Number
    coefficients: Row
    power: int = 0
    difference: Number | None = None
    linked: bool = False  #: to the next

    @property
    def chained(self) -> bool:
        """True if it is more than a plain exponential."""
        return self.linked or self.power > 0


def rates_and_powers(program: Program, total: Sum, harmonics: int) -> tuple[list[Rate], list[Row]]:
    """The plain rates, then the chained ones; and the coefficients of s^n/n! from n = 2 on."""
    powers, plain, chains = list[Row](), list[Rate](), list[Rate]()
    for place, found in coefficients(program, total, harmonics).items():
        rows = [[program.number(math.factorial(n)) * x for x in row] for n, row in enumerate(found)]
        rate = Number(program, place)
        first, *higher = rows
        if not place:
            powers = rows[2:]
        elif higher:
            chains += [Rate(rate, row, n, linked=n < len(higher)) for n, row in enumerate(rows)]
        elif program.decide(is_slow, rate):
            chains += slow_wave(rate, first)
        else:
            plain.append(Rate(rate, first))
    return [*pair_rates(program, plain), *chains], powers


def coefficients(program: Program, total: Sum, harmonics: int) -> dict[int, list[Row]]:
    """By the rates with Im >= 0: the coefficients C of each power of s, in s^power Re(C exp(rate s)), by the features."""
    found: dict[int, list[Row]] = {}
    for term, value in total.items():
        sign = program.decide(sign_of_frequency, Number(program, term.rate))
        if sign < 0:
            continue
        rows, m = found.setdefault(term.rate, []), term.harmonic
        rows += [[program.number(0)] * at.features(harmonics) for _ in range(len(rows), term.power + 1)]
        row, whole = rows[term.power], program.number(1 + sign) * value
        if m == 0:
            place = "zw".find(term.state) + 1 if term.state else 0
            row[place] = row[place] + whole
        else:
            cosine, sine = 2 * abs(m) + 1, 2 * abs(m) + 2
            row[cosine] = row[cosine] + whole
            row[sine] = row[sine] + whole * program.number(sp.I if m > 0 else -sp.I)
    return found


def sign_of_frequency(rate: acb) -> int:
    """The sign of the imaginary part, 0 for a real number."""
    return 0 if rate.imag.contains(0) else 1 if rate.imag > 0 else -1


def is_slow(rate: acb) -> bool:
    """Whether a wave is slow beside its decay or growth."""
    return bool(0 < complex(rate).imag < SLOW_WAVE * abs(complex(rate)))


def grows(rate: acb) -> bool:
    """Whether an exponential function grows."""
    return bool(rate.real > 0)


def near(x: acb, y: acb) -> bool:
    """Whether two numbers differ by a small share."""
    return bool(abs(complex(x - y)) <= NEAR_RATES * max(abs(complex(x)), abs(complex(y))))


def cancel(x: acb, y: acb) -> bool:
    """Whether the sum of two numbers is small beside them."""
    return bool(abs(complex(x + y)) < CANCELLATION * max(abs(complex(x)), abs(complex(y))))


def size(x: acb) -> acb:
    """The absolute value."""
    return acb(abs(x))


def slow_wave(rate: Number, row: Row) -> list[Rate]:
    """A damped wave by exp(a s) cos(k s) and exp(a s) sin(k s)/k, the divided difference of the rates a + i k and a - i k."""
    other = rate.of(acb.conjugate)
    sines = [rate.imag() * x.of(operator.neg).imag() for x in row]
    return [Rate(rate, [x.real() for x in row], linked=True), Rate(other, sines, 1, other - rate)]


def pair_rates(program: Program, plain: list[Rate]) -> list[Rate]:
    """Rates that nearly agree and whose terms cancel, as pairs with a divided difference; the others come first."""
    single, pairs = list(plain), []
    for one in plain:
        for other in plain:
            if one in single and other in single and one is not other and cancelling(program, one, other):
                single.remove(one)
                single.remove(other)
                delta = other.rate - one.rate
                both = [x + y for x, y in zip(one.coefficients, other.coefficients, strict=True)]
                pairs += [Rate(one.rate, both, linked=True)]
                pairs += [Rate(other.rate, [delta * x for x in other.coefficients], 1, delta)]
    return single + pairs


def cancelling(program: Program, one: Rate, other: Rate) -> bool:
    """Whether two rates are near each other, and terms of them cancel."""
    pairs = zip(one.coefficients, other.coefficients, strict=True)
    return program.decide(near, one.rate, other.rate) and any(program.decide(cancel, x, y) for x, y in pairs)


def rows_at_start(program: Program, rates: list[Rate], powers: list[Row], count: int) -> list[Row]:
    """Acceleration, jerk, snap and crackle at the start by the features, with the contribution of the velocity itself."""
    rows, none = [], [program.number(0)] * count
    for order, row in zip(ORDERS, [*powers, *[none] * len(ORDERS)], strict=False):
        for one, before in zip(rates, [None, *rates], strict=False):
            value = at_zero(program, one, before, order)
            row = [x + value * c for x, c in zip(row, one.coefficients, strict=True)]
        rows.append(row)
    return rows


def at_zero(program: Program, one: Rate, before: Rate | None, order: int) -> Number:
    """The derivative of this order at zero of exp(rate s), of s^n exp(rate s)/n! or of a divided difference."""
    if one.difference is None:
        share = math.comb(order, one.power)
        return program.number(share) * power(one.rate, order - one.power) if share else program.number(0)
    assert before is not None
    first, *others = (power(one.rate, k) * power(before.rate, order - 1 - k) for k in range(order))
    return sum(others, start=first)


def power(x: Number, n: int) -> Number:
    """The n-th power."""
    return power(x, n - 1) * x if n else x.program.number(1)


def table_of_flight(program: Program, total: Sum, parameters: int) -> tuple[list[Number], tuple[Floats, int, float]]:
    """The numbers of the table of a flight behind its head, then sizes of rates, and the table without them.

    The table is filled except for walls and laws, the number of the first ones, and the reach in units of the largest size.

    The reach, the time over which bounds on flights that grow are taken, is that of growth by a factor e.
    """
    harmonics = max([1, *(abs(term.harmonic) for term in total)])
    rates, powers = rates_and_powers(program, total, harmonics)
    rates.sort(key=lambda one: one.chained)
    count, simple = at.features(harmonics), sum(not one.chained for one in rates)
    entries = [
        list(chain(*powers)),
        list(chain(*((one.rate, one.rate.imag()) for one in rates))),
        list(chain(*(terms_of(one) for one in rates))),
        list(chain(*(of_chain(program, one) for one in rates[simple:]))),
        list(chain(*rows_at_start(program, rates, powers, count))),
    ]
    begins = at.HEAD + np.cumsum([0, *map(len, entries)])
    table, numbers = np.zeros(at.HEAD + sum(map(len, entries)) + parameters + 1), list(chain(*entries))
    growing = any(program.decide(grows, one.rate) for one in rates)
    local = growing or len(powers) > 1 or simple < len(rates)
    table[at.HARMONICS : at.WIDE + 1] = harmonics, len(powers), simple, len(rates) - simple, local, 0, not local
    table[at.AT_POWERS : at.AT_PARAMETERS + 1] = begins
    table[at.DAMPED] = any(not program.decide(is_zero, row[VELOCITY]) for row in [*powers, *(one.coefficients for one in rates)])
    table[at.FLIGHT_SIZE] = at.POLYNOMIAL + len(powers) + 2 * len(rates) + 1
    sizes = [one.rate if growing else one.rate.of(size) for one in rates]
    return numbers + sizes, (table, len(numbers), GROWTH if growing else DECAY)


def terms_of(one: Rate) -> Row:
    """The coefficients of a rate: their real parts, then the imaginary ones with the other sign."""
    return [*one.coefficients, *(x.of(operator.neg).imag() for x in one.coefficients)]


def of_chain(program: Program, one: Rate) -> Row:
    """What the table has of a chained rate."""
    difference = one.difference or program.number(0)
    return [program.number(one.power), difference, difference.imag(), program.number(int(one.linked))]
