"""Contributions of powers of time, of rates, and of equal or nearly equal rates to a motion, in balls: see `engine.layout`.

And bounds on the time derivatives of sets of flights, for all times.
"""

import math
from typing import NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import (
    ONE,
    UNIT,
    ZERO,
    Ball,
    badd,
    ball_in,
    ball_of,
    bdot,
    bhalf,
    bmul,
    bneg,
    bplus,
    four_balls,
    size,
    two_balls,
)
from nsmaps.exact.enclosure.arithmetic.elementary import bgrowth, bwave
from nsmaps.exact.engine.flight.layout import AT_CHAINS, AT_RATES, CHAIN, CHAIN_POWER, CHAINED, DIFFERENCE_RE, POWERS, SIMPLE
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.flight.remainders import Remainders
from nsmaps.exact.engine.jit import inlined, inner

RATE_BEGIN, RATE_SIZE = 2, 8  #: behind the ball of the time: the four balls of the remainders of each rate


class Motion(NamedTuple):
    """Displacement since the start of a flight and its derivatives by the time."""

    d: Ball
    v: Ball
    a: Ball
    j: Ball


REST = Motion(ZERO, ZERO, ZERO, ZERO)


@inlined
def rate_of(t, i):
    """Real and imaginary part of the rate i of a table."""
    re, im = pair(t, int(t[AT_RATES]), i)
    return ball_of(re), ball_of(im)


@inlined
def remainders_in(p, i):
    """The remainders of the rate i at the time of `at_time`."""
    return Remainders(*four_balls(p.table, p.basis + RATE_BEGIN + RATE_SIZE * i))


@inlined
def polynomial(t, k, n, s):
    """The part of a motion that is polynomial in s, with n coefficients from place k on."""
    if n == 1:
        x = ball_in(t, k)
        if x.centre == 0.0 and x.radius == 0.0:
            return REST
        v = bmul(x, s)
        return Motion(bmul(v, bhalf(s)), v, x, ZERO)
    d, v, a, j = REST
    power, before, last, first = s, ONE, ZERO, ZERO  # s^m/m! and the previous ones
    for m in range(2, n + 2):
        x = ball_in(t, k)
        k += 2
        power, before, last, first = bmul(bmul(power, s), Ball(1.0 / m, UNIT)), power, before, last
        d, v, a, j = bplus(d, x, power), bplus(v, x, before), bplus(a, x, last), bplus(j, x, first)
    return Motion(d, v, a, j)


@inlined
def ball_remainders(rate, s):
    """The remainders of exp x for x = rate s."""
    alpha, omega = rate
    if alpha.centre == 0.0 and alpha.radius == 0.0:
        less, sine, remainder = bwave(bmul(omega, s))
        return Remainders(less, remainder, less, sine)
    x, e = bgrowth(bmul(alpha, s))
    if omega.centre == 0.0 and omega.radius == 0.0:
        return Remainders(e, ZERO, x, ZERO)
    turn = bmul(omega, s)
    less, sine, remainder = bwave(turn)
    whole = badd(ONE, x)
    return Remainders(bplus(e, whole, less), bdot(x, whole, turn, remainder), bplus(x, whole, less), bmul(whole, sine))


@inlined
def derive_coefficients(rate, x, y):
    """The coefficients of the time derivative of a function with the coefficients x, y: of x Re + y Im."""
    re, im = rate
    return bdot(re, im, x, y), bdot(re, im, y, bneg(x))


@inlined
def add_wave(total, omega, coefficients, here, orders):
    """Add the contribution of a rate i omega, with its remainders, to a motion, up to so many derivatives."""
    (d, v, a, j), (x, y) = total, coefficients
    odd = bdot(y, bneg(x), here.one_re, here.one_im)
    d, v = badd(d, bdot(x, y, here.two_re, here.two_im)), bplus(v, omega, odd)
    if orders > 1:
        square = bneg(bmul(omega, omega))
        a = bplus(a, square, bdot(x, y, badd(ONE, here.one_re), here.one_im))
        if orders > 2:
            j = bplus(j, bmul(square, omega), badd(odd, y))
    return Motion(d, v, a, j)


@inlined
def add_rate(total, rate, coefficients, here, orders):
    """As `add_wave`, for any rate."""
    (d, v, a, j), (x, y) = total, coefficients
    real, imaginary = here.one_re, here.one_im
    d = badd(d, bdot(x, y, here.two_re, here.two_im))
    x, y = derive_coefficients(rate, x, y)
    v = badd(v, bdot(x, y, real, imaginary))
    if orders > 1:
        real = badd(ONE, real)
        x, y = derive_coefficients(rate, x, y)
        a = badd(a, bdot(x, y, real, imaginary))
        if orders > 2:
            x, y = derive_coefficients(rate, x, y)
            j = badd(j, bdot(x, y, real, imaginary))
    return Motion(d, v, a, j)


@inlined
def next_function(rate, this, last):
    """The time derivative of a chained function: the rate times it, plus the previous function; complex balls."""
    (alpha, omega), (x, y), (re, im) = rate, this, last
    return badd(bdot(alpha, omega, x, bneg(y)), re), badd(bdot(alpha, omega, y, x), im)


@inlined
def weigh(coefficients, function):
    """The contribution x Re + y Im of a function with the coefficients x, y."""
    (x, y), (real, imaginary) = coefficients, function
    return bdot(x, y, real, imaginary)


@inner
def add_chains(p, k):
    """The contribution to a motion of the chained rates, whose coefficients begin at k."""
    t = p.table
    plain = int(t[SIMPLE])
    d, v, a, j = REST
    zero = (ZERO, ZERO)
    less, value, first, second = zero, zero, zero, zero
    for i in range(int(t[CHAINED])):
        rate, coefficients, remainders = rate_of(t, plain + i), two_balls(t, k), remainders_in(p, plain + i)
        begins = t[int(t[AT_CHAINS]) + CHAIN * i + CHAIN_POWER] == 0.0
        if begins:
            less, value, first, second = zero, zero, zero, zero
        d = badd(d, weigh(coefficients, (remainders.two_re, remainders.two_im)))
        here = remainders.one_re, remainders.one_im
        v = badd(v, weigh(coefficients, next_function(rate, here, less)))
        whole = (badd(ONE, remainders.one_re), remainders.one_im) if begins else here
        one = next_function(rate, whole, value)
        two = next_function(rate, one, first)
        a, j = badd(a, weigh(coefficients, two)), badd(j, weigh(coefficients, next_function(rate, two, second)))
        less, value, first, second = here, whole, one, two
        k += 4
    return Motion(d, v, a, j)


@inner
def ball_bounds(p, c):
    """Bounds on |jerk| and |snap| of flights for all times, with coefficients from index c; infinite for flights that grow."""
    t = p.table
    n, plain, k, rates = int(t[POWERS]), int(t[SIMPLE]), c, int(t[AT_RATES])
    jerk, snap = (math.inf, math.inf) if n > 1 else (0.0, 0.0)
    k += 2 * n
    b0, b1, b2, b3 = 0.0, 0.0, 0.0, 0.0
    for i in range(plain + int(t[CHAINED])):
        (alpha, omega), power = pair(t, rates, i), 0
        speed = math.sqrt(alpha**2 + omega**2)
        if i >= plain:
            at = int(t[AT_CHAINS]) + CHAIN * (i - plain)
            power = int(t[at + CHAIN_POWER])
            alpha = max(alpha, alpha - t[at + DIFFERENCE_RE])
        if power == 0:
            b0, b1, b2, b3 = 0.0, 0.0, 0.0, 0.0
        greatest = math.inf if alpha > 0.0 or (power > 0 and alpha == 0.0) else 1.0
        for m in range(1, power + 1):  # s^n exp(alpha s)/n! is greatest at s = -n/alpha
            greatest *= power / (math.e * -alpha * m) if alpha < 0.0 else 1.0
        x, y = size(ball_in(t, k)), size(ball_in(t, k + 2))
        weight = math.sqrt(x * x + y * y)
        first = speed * greatest + b0
        second = speed * first + b1
        third = speed * second + b2
        jerk, snap = jerk + weight * third, snap + weight * (speed * third + b3)
        b0, b1, b2, b3 = greatest, first, second, third
        k += 4
    return jerk, snap
