"""Equal or nearly equal rates: powers times exponentials, and divided differences of two exponentials; see `layout`."""

from nsmaps.exact.engine.constants import NO_DIFFERENCE
from nsmaps.exact.engine.flight.layout import (
    AT_CHAINS,
    AT_RATES,
    CHAIN,
    CHAIN_POWER,
    CHAINED,
    DIFFERENCE_IM,
    DIFFERENCE_RE,
    POLYNOMIAL,
    POWERS,
    SIMPLE,
)
from nsmaps.exact.engine.flight.motion import Motion, pair
from nsmaps.exact.engine.flight.remainders import remainders
from nsmaps.exact.engine.jit import inner


@inner
def chain_at(p, i, s):
    """The function of a chained rate at s, the same without its value at zero, and without its tangent there."""
    t = p.table
    at = int(t[AT_CHAINS]) + CHAIN * i
    power, difference = int(t[at + CHAIN_POWER]), complex(t[at + DIFFERENCE_RE], t[at + DIFFERENCE_IM])
    alpha, omega = pair(t, int(t[AT_RATES]), int(t[SIMPLE]) + i)
    rate = complex(alpha, omega) - difference
    remainder, other, real, imaginary = remainders(rate.real, rate.imag, s)
    if power == 0:
        return complex(1.0 + real, imaginary), complex(real, imaginary), complex(remainder, other)
    y, growing = s, complex(real, imaginary)
    if power == 1:
        excess = mean_excess(difference * s)
        y, remainder = s * (1.0 + growing) * (1.0 + excess), s * (growing * (1.0 + excess) + excess)
        return y, y, remainder
    for m in range(2, power + 1):
        y *= s / m
    return y * (1.0 + growing), y * (1.0 + growing), y * (1.0 + growing)


@inner
def mean_excess(x):
    """(exp x - 1)/x - 1 for a complex number x."""
    if abs(x) < NO_DIFFERENCE:
        return 0.5 * x
    remainder, other, _, _ = remainders(x.real, x.imag, 1.0)
    return complex(remainder, other) / x


@inner
def chains(p, s):
    """The contribution of the chained rates to `evaluate`: a function's derivative is rate times it plus the previous one."""
    t, c = p.table, p.flight
    plain, n = int(t[SIMPLE]), int(t[CHAINED])
    row, rates = POLYNOMIAL + int(t[POWERS]), int(t[AT_RATES])
    d, v, a, j, k, q = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    zero = complex(0.0, 0.0)
    y0, y1, y2, y3, y4, less = zero, zero, zero, zero, zero, zero
    for i in range(n):
        alpha, omega = pair(t, rates, plain + i)
        x, y = pair(c, row, plain + i)
        rate, factor = complex(alpha, omega), complex(x, -y)
        if t[int(t[AT_CHAINS]) + CHAIN * i] == 0.0:
            y0, y1, y2, y3, y4, less = zero, zero, zero, zero, zero, zero
        value, from_zero, remainder = chain_at(p, i, s)
        first = rate * value + y0
        second = rate * first + y1
        third = rate * second + y2
        fourth = rate * third + y3
        d += (factor * remainder).real
        v += (factor * (rate * from_zero + less)).real
        a += (factor * second).real
        j += (factor * third).real
        k += (factor * fourth).real
        q += (factor * (rate * fourth + y4)).real
        y0, y1, y2, y3, y4, less = value, first, second, third, fourth, from_zero
    return Motion(d, v, a, j, k, q)
