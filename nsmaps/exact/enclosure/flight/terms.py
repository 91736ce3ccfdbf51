"""Contributions of powers of time, of rates, and of equal or nearly equal rates to a motion, in balls: see `engine.layout`."""

from nsmaps.exact.enclosure.arithmetic.balls import NOTHING, ONE, UNIT, badd, ball_in, bmul, bneg, bplus, met, rounded
from nsmaps.exact.enclosure.arithmetic.elementary import bgrowth, bwave
from nsmaps.exact.engine.flight.layout import AT_CHAINS, AT_RATES, CHAIN, CHAINED, SIMPLE
from nsmaps.exact.engine.jit import inlined, inner


@inlined
def polynomial(t, k, n, s):
    """The part of `applied` that is polynomial in s."""
    if n == 1:
        x = ball_in(t, k)
        if x[0] == 0.0 and x[1] == 0.0:
            return NOTHING, NOTHING, NOTHING, NOTHING
        v = bmul(x, s)
        return bmul(v, (0.5 * s[0], 0.5 * s[1])), v, x, NOTHING
    d, v, a, j = NOTHING, NOTHING, NOTHING, NOTHING
    power, before, last, first = s, ONE, NOTHING, NOTHING  # s^m/m! and the previous ones
    for m in range(2, n + 2):
        x = ball_in(t, k)
        k += 2
        power, before, last, first = bmul(bmul(power, s), (1.0 / m, UNIT)), power, before, last
        d, v, a, j = bplus(d, x, power), bplus(v, x, before), bplus(a, x, last), bplus(j, x, first)
    return d, v, a, j


@inlined
def ball_remainders(alpha, omega, s):
    """For x = (alpha + i omega) s the real and imaginary parts of exp x - 1 - x and of exp x - 1."""
    if alpha[0] == 0.0 and alpha[1] == 0.0:
        less, sine, remainder = bwave(bmul(omega, s))
        return less, remainder, less, sine
    x, e = bgrowth(bmul(alpha, s))
    if omega[0] == 0.0 and omega[1] == 0.0:
        return e, NOTHING, x, NOTHING
    turn = bmul(omega, s)
    less, sine, remainder = bwave(turn)
    whole = badd(ONE, x)
    return bplus(e, whole, less), met(x, whole, turn, remainder), bplus(x, whole, less), bmul(whole, sine)


@inlined
def turned_by(alpha, omega, x, y):
    """The coefficients of the time derivative of a function with the coefficients x, y: of x Re + y Im."""
    return met(alpha, omega, x, y), met(alpha, omega, y, bneg(x))


@inlined
def add_wave(total, omega, x, y, here, turn, orders):
    """Add the contribution of a rate i omega to displacement and its first rates: see `applied`."""
    d, v, a, j = total
    less, sine = turn
    odd = met(y, bneg(x), less, sine)
    d, v = badd(d, met(x, y, here[0], here[1])), bplus(v, omega, odd)
    if orders > 1:
        square = bneg(bmul(omega, omega))
        a = bplus(a, square, met(x, y, badd(ONE, less), sine))
        if orders > 2:
            j = bplus(j, bmul(square, omega), badd(odd, y))
    return d, v, a, j


@inlined
def add_rate(total, alpha, omega, x, y, here, growth, orders):
    """As `add_wave`, for any rate."""
    d, v, a, j = total
    real, imaginary = growth
    d = badd(d, met(x, y, here[0], here[1]))
    x, y = turned_by(alpha, omega, x, y)
    v = badd(v, met(x, y, real, imaginary))
    if orders > 1:
        real = badd(ONE, real)
        x, y = turned_by(alpha, omega, x, y)
        a = badd(a, met(x, y, real, imaginary))
        if orders > 2:
            x, y = turned_by(alpha, omega, x, y)
            j = badd(j, met(x, y, real, imaginary))
    return d, v, a, j


@inlined
def next_rate(alpha, omega, of_this, of_last):
    """The time derivative of a chained function: the rate times it, plus the previous function; complex balls."""
    x, y = of_this
    return badd(met(alpha, omega, x, bneg(y)), of_last[0]), badd(met(alpha, omega, y, x), of_last[1])


@inner
def applied_chains(p, k):
    """The contribution to `applied` of the chained rates, whose coefficients begin at k."""
    t = p.table
    plain, rates = int(t[SIMPLE]), int(t[AT_RATES])
    d, v, a, j = NOTHING, NOTHING, NOTHING, NOTHING
    zero = (NOTHING, NOTHING)
    less, value, first, second = zero, zero, zero, zero
    for i in range(int(t[CHAINED])):
        at, rate = p.basis + 2 + 8 * (plain + i), rates + 2 * (plain + i)
        alpha, omega, x, y = rounded(t[rate]), rounded(t[rate + 1]), ball_in(t, k), ball_in(t, k + 2)
        begins = t[int(t[AT_CHAINS]) + CHAIN * i] == 0.0
        if begins:
            less, value, first, second = zero, zero, zero, zero
        d = badd(d, met(x, y, ball_in(t, at), ball_in(t, at + 2)))
        here = ball_in(t, at + 4), ball_in(t, at + 6)
        rise = next_rate(alpha, omega, here, less)
        v = badd(v, met(x, y, rise[0], rise[1]))
        whole = (badd(ONE, here[0]), here[1]) if begins else here
        one = next_rate(alpha, omega, whole, value)
        two = next_rate(alpha, omega, one, first)
        three = next_rate(alpha, omega, two, second)
        a, j = badd(a, met(x, y, two[0], two[1])), badd(j, met(x, y, three[0], three[1]))
        less, value, first, second = here, whole, one, two
        k += 4
    return d, v, a, j
