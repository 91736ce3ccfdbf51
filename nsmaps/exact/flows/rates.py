"""From the sum of exponentials of a flight to its rates and coefficients, and these in the table of the engine."""

import math
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np
from mpmath import libmp

from nsmaps.arrays import Floats
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.exponentials import Sum, functional, rates_of
from nsmaps.exact.flows.numbers import NOTHING, Finish, Number, constant
from nsmaps.exact.flows.recording import NEAREST, PRECISION, Real, decide

CANCELS = mp.mpf("0.1")  #: two terms with nearly equal rates are chained if they cancel to less than this share of them
NEAR = mp.mpf("0.1")  #: and if their rates differ by less than this share
SLOW = mp.mpf("0.02")  #: a damped wave whose frequency is below this share of its rate forms a pair, as next to critical damping
ORDERS = range(2, 6)  #: time derivatives of the displacement at the start: acceleration to crackle


@dataclass(frozen=True, slots=True)
class Rate:
    """A rate with its complex coefficients by the features, of exp(rate s) or of the function of a chain, see `layout`."""

    rate: Number
    coefficients: list[Number]
    power: int = 0
    difference: Number = NOTHING
    linked: bool = False  #: to the next

    @property
    def chained(self) -> bool:
        """True if it is more than a plain exponential."""
        return self.linked or self.power > 0


def rates_and_powers(total: Sum, harmonics: int) -> tuple[list[Rate], list[list[Number]]]:
    """The plain rates, then the chained ones; and the coefficients of s^n/n! from n = 2 on."""
    powers, plain, chains = list[list[Number]](), list[Rate](), list[Rate]()
    for rate, degree in rates_of(total):
        rows = [_times(constant(math.factorial(n)), functional(total, rate, n, harmonics)) for n in range(degree + 1)]
        if decide(_vanish, *rate.parts):
            powers = rows[2:]
        elif degree:
            chains += [Rate(rate, row, n, linked=n < degree) for n, row in enumerate(rows)]
        elif decide(_slow, *rate.parts):
            chains += _slow_wave(rate, rows[0])
        else:
            plain.append(Rate(rate, rows[0]))
    return [*_paired(plain), *chains], powers


def _times(factor: Number, row: list[Number]) -> list[Number]:
    return [factor * x for x in row]


def _vanish(*parts: Any) -> bool:
    return all(x == libmp.fzero for x in parts)


def _slow(re: Any, im: Any) -> bool:
    with mp.workprec(PRECISION):
        return bool(0 < mp.make_mpf(im) < SLOW * abs(mp.make_mpc((re, im))))


def _slow_wave(rate: Number, row: list[Number]) -> list[Rate]:
    """A damped wave by exp(a s) cos(k s) and exp(a s) sin(k s)/k, the divided difference of the rates a + i k and a - i k."""
    real, imaginary = _real(row)
    difference = rate.conjugate() + -rate
    return [Rate(rate, real, linked=True), Rate(rate.conjugate(), _times(Number(rate.im), imaginary), 1, difference)]


def _paired(plain: list[Rate]) -> list[Rate]:
    """Rates that nearly agree and whose terms cancel, as pairs with a divided difference; the others come first."""
    left, pairs = list(plain), []
    for one in plain:
        for other in plain:
            if one in left and other in left and one is not other and _cancel(one, other):
                left.remove(one)
                left.remove(other)
                delta = other.rate + -one.rate
                both = [x + y for x, y in zip(one.coefficients, other.coefficients, strict=True)]
                pairs += [Rate(one.rate, both, linked=True)]
                pairs += [Rate(other.rate, _times(delta, other.coefficients), 1, delta)]
    return left + pairs


def _cancel(one: Rate, other: Rate) -> bool:
    if not decide(_near, *one.rate.parts, *other.rate.parts):
        return False
    pairs = zip(one.coefficients, other.coefficients, strict=True)
    return any(decide(_smaller, *x.parts, *y.parts) for x, y in pairs)


def _near(*parts: Any) -> bool:
    with mp.workprec(PRECISION):
        x, y = mp.make_mpc(parts[:2]), mp.make_mpc(parts[2:])
        return bool(abs(x - y) <= NEAR * max(abs(x), abs(y)))


def _smaller(*parts: Any) -> bool:
    with mp.workprec(PRECISION):
        x, y = mp.make_mpc(parts[:2]), mp.make_mpc(parts[2:])
        return bool(abs(x + y) < CANCELS * max(abs(x), abs(y)))


def rows_at_start(rates: list[Rate], powers: list[list[Number]], count: int) -> list[list[Number]]:
    """Acceleration, jerk, snap and crackle at the start by the features, with the contribution of the velocity itself."""
    rows = []
    for order in ORDERS:
        row = list(powers[order - 2]) if order - 2 < len(powers) else [NOTHING] * count
        for one, before in zip(rates, [None, *rates], strict=False):
            value = _at_zero(one, before, order)
            row = [x + value * c for x, c in zip(row, one.coefficients, strict=True)]
        rows.append([x.real() for x in row])
    return rows


def _at_zero(one: Rate, before: Rate | None, order: int) -> Number:
    """The derivative of this order at zero of exp(rate s), of s^n exp(rate s)/n! or of a divided difference."""
    if not one.power:
        return one.rate.power(order)
    if one.difference != NOTHING:
        assert before is not None
        return sum((one.rate.power(k) * before.rate.power(order - 1 - k) for k in range(order)), start=NOTHING)
    below = order - one.power
    return constant(math.comb(order, one.power)) * one.rate.power(below) if below >= 0 else NOTHING


def packed(rates: list[Rate], powers: list[list[Number]], harmonics: int, parameters: int) -> tuple[list[Real], Finish]:
    """The numbers of the table of a flight, and what makes it of them, its head filled except for walls and laws.

    Its reach, the time over which bounds on flights that grow are taken, is that of growth by a factor e.
    """
    rates = sorted(rates, key=lambda one: one.chained)
    growing, simple = any(decide(_positive, one.rate.re) for one in rates), sum(not one.chained for one in rates)
    template, begins = _head(rates, powers, harmonics, growing, parameters)
    entries = [
        [x.re for row in powers for x in row],
        [part for one in rates for part in one.rate.parts],
        [x.re for one in rates for row in _real(one.coefficients) for x in row],
        [x for one in rates[simple:] for x in _of_chain(one)],
        [x.re for row in rows_at_start(rates, powers, at.features(harmonics)) for x in row],
    ]
    places = [begin + k for begin, part in zip(begins, entries, strict=False) for k in range(len(part))]
    numbers = [x for part in entries for x in part]
    for place, x in zip(places, numbers, strict=True):
        template[place] = libmp.to_float(x.value, False, NEAREST)
    varied = [k for k, x in enumerate(numbers) if x.tape]
    changing, sizes = [places[k] for k in varied], [one.rate.re if growing else one.rate.size().re for one in rates]

    def finish(found: list[Any]) -> Floats:
        floats, table = [libmp.to_float(x, False, NEAREST) for x in found], template.copy()
        table[changing] = floats[: len(changing)]
        fastest = max(floats[len(changing) :], default=1.0)
        table[at.REACH] = 1 / fastest if growing else 10 / fastest
        return table

    return [*(numbers[k] for k in varied), *sizes], finish


def _head(
    rates: list[Rate], powers: list[list[Number]], harmonics: int, growing: bool, parameters: int
) -> tuple[Floats, list[int]]:
    """A table with all that are not numbers of its flight, and where the kinds of these begin."""
    count, simple = at.features(harmonics), sum(not one.chained for one in rates)
    sizes = [len(powers) * count, 2 * len(rates), 2 * len(rates) * count, at.CHAIN * (len(rates) - simple), 4 * count]
    begins = at.HEAD + np.cumsum([0, *sizes])
    table = np.zeros(int(begins[-1]) + parameters + 1)
    local = growing or len(powers) > 1 or simple < len(rates)
    table[at.HARMONICS : at.WIDE + 1] = harmonics, len(powers), simple, len(rates) - simple, local, 0, not local
    table[at.AT_POWERS : at.AT_PARAMETERS + 1] = begins
    table[at.DAMPED] = any(not decide(_vanish, *row[2].parts) for row in [*powers, *(one.coefficients for one in rates)])
    table[at.FLIGHT_SIZE] = at.POLYNOMIAL + len(powers) + 2 * len(rates) + 1
    return table, begins.tolist()


def _of_chain(one: Rate) -> list[Real]:
    return [constant(one.power).re, *one.difference.parts, constant(int(one.linked)).re]


def _positive(x: Any) -> bool:
    return bool(libmp.mpf_gt(x, libmp.fzero))


def _real(row: list[Number]) -> tuple[list[Number], list[Number]]:
    return [x.real() for x in row], [-x.imag() for x in row]
