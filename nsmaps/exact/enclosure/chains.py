"""Rates that are equal or nearly so, in balls: as `nsmaps.exact.engine.chains`."""

from nsmaps.exact.enclosure.balls import NOTHING, ONE, badd, ball_in, bmul, bsub, met, rounded
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.layout import AT_CHAINS, AT_RATES, CHAIN, CHAINED, SIMPLE


@inlined
def next_rate(alpha, omega, of_this, of_last):
    """The rate in time of a chained function: the rate times it, and the function before it; complex balls."""
    x, y = of_this
    return (
        badd(bsub(bmul(alpha, x), bmul(omega, y)), of_last[0]),
        badd(badd(bmul(alpha, y), bmul(omega, x)), of_last[1]),
    )


@inner
def applied_chains(p, c, k):
    """What of `applied` the chained rates give, whose coefficients begin at k."""
    t, b = p.table, p.basis
    plain, rates = int(t[SIMPLE]), int(t[AT_RATES])
    d, v, a, j = NOTHING, NOTHING, NOTHING, NOTHING
    zero = (NOTHING, NOTHING)
    less, value, first, second = zero, zero, zero, zero
    for i in range(int(t[CHAINED])):
        at, rate = 2 + 8 * (plain + i), rates + 2 * (plain + i)
        alpha, omega, x, y = rounded(t[rate]), rounded(t[rate + 1]), ball_in(c, k), ball_in(c, k + 2)
        begins = t[int(t[AT_CHAINS]) + CHAIN * i] == 0.0
        if begins:
            less, value, first, second = zero, zero, zero, zero
        d = badd(d, met(x, y, ball_in(b, at), ball_in(b, at + 2)))
        here = ball_in(b, at + 4), ball_in(b, at + 6)
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
