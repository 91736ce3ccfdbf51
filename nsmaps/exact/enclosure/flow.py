"""A flight by its table, in balls: what `nsmaps.exact.engine.flow` computes, over sets of states and of times.

Of the numbers of a table it is known that they are rounded once (`table.py` computes them in many digits): they are balls of that
radius. What a rate's function is at a time is written once, by `at_time`, and then met with the coefficients of as many flights
as are asked for.
"""

from typing import Any, NamedTuple

from nsmaps.exact.enclosure.balls import (
    NOTHING,
    ONE,
    UNIT,
    badd,
    ball_in,
    between,
    bgrowth,
    bmul,
    bneg,
    bsub,
    bwave,
    high,
    low,
    met,
    put_ball,
    rounded,
)
from nsmaps.exact.enclosure.chains import applied_chains
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import written
from nsmaps.exact.engine.layout import (
    AT_CHAINS,
    AT_PARAMETERS,
    AT_POWERS,
    AT_RATES,
    AT_TERMS,
    BALL_LAW,
    BOTTOM,
    CHAIN,
    CHAINED,
    DAMPED,
    HARMONICS,
    LAW,
    PHASE_RATE,
    POWERS,
    RESTITUTION,
    SIMPLE,
    TOP,
)

PLAIN, BY_PHASE, TWICE, BY_SPEED = range(
    4
)  #: the coefficients of a flight, and their derivatives by phase, twice, and by velocity


class BallFlow(NamedTuple):
    """A table, the coefficients of two sets of flights, and the functions of all rates at one time."""

    table: Any
    one: Any
    whole: Any
    basis: Any


@inlined
def ball_places(p):
    """Displacement of the upper and of the lower wall."""
    return rounded(p.table[TOP]), rounded(p.table[BOTTOM])


@inlined
def ball_rate(p):
    """Radians of phase a unit of time."""
    return rounded(p.table[PHASE_RATE])


@inner
def ball_rebound(p, up, v):
    """Speed after an impact of speed v on the upper (or lower) wall, and its first and second derivative."""
    t, k = p.table, 1 if up else 0
    if t[LAW + k] == 0.0:
        r = rounded(t[RESTITUTION + k])
        return bmul(r, v), r, NOTHING
    values = t.ctypes.data + 8 * int(t[AT_PARAMETERS])
    out = p.basis  # free to be used: it is written anew for every time
    written(int(t[BALL_LAW + k]), v[0], v[1], values, out.ctypes.data)
    return ball_in(out, 0), ball_in(out, 2), ball_in(out, 4)


@inlined
def linear_ball(t, row, at, z, w, derivative):
    """The value of a row that is linear in the features, or its first or second derivative by the phase."""
    total = NOTHING
    if derivative == 0:
        total = rounded(t[row])
        if t[row + 1] != 0.0:
            total = badd(total, bmul(rounded(t[row + 1]), z))
        if t[row + 2] != 0.0:
            total = badd(total, bmul(rounded(t[row + 2]), w))
    for m in range(1, int(t[HARMONICS]) + 1):
        x, y = t[row + 2 * m + 1], t[row + 2 * m + 2]
        if x == 0.0 and y == 0.0:
            continue
        less, sine = at[1], at[2]
        if m > 1:
            less, sine, _ = bwave(bmul((float(m), 0.0), at[0]))
        cosine = badd(ONE, less)
        if derivative == 1:
            x, y, cosine, sine = m * y, -m * x, cosine, sine
        elif derivative == 2:
            x, y = -m * m * x, -m * m * y
        total = badd(total, badd(bmul(rounded(x), cosine), bmul(rounded(y), sine)))
    return total


@inlined
def section(t, which):
    """Where coefficients of a kind begin, each ball two numbers."""
    return which * 2 * (int(t[POWERS]) + 2 * (int(t[SIMPLE]) + int(t[CHAINED])))


@inner
def ball_begin(p, c, at, z, w, kinds):
    """Write the coefficients of flights from phases `at`, place z and velocities w, and so many of their derivatives by phase."""
    t = p.table
    width, powers = 3 + 2 * int(t[HARMONICS]), int(t[POWERS])
    rows = powers + 2 * (int(t[SIMPLE]) + int(t[CHAINED]))
    for kind in range(kinds + 1):
        row, k = int(t[AT_POWERS]), section(t, kind)
        for i in range(rows):
            if i == powers:
                row = int(t[AT_TERMS])
            put_ball(c, k, linear_ball(t, row, at, z, w, kind))
            row, k = row + width, k + 2
    if t[DAMPED] > 0.0:
        row, k = int(t[AT_POWERS]), section(t, BY_SPEED)
        for i in range(rows):
            if i == powers:
                row = int(t[AT_TERMS])
            put_ball(c, k, rounded(t[row + 2]))
            row, k = row + width, k + 2


@inlined
def ball_remainders(alpha, omega, s):
    """For x = (alpha + i omega) s the real and imaginary parts of exp x - 1 - x and of exp x - 1."""
    if alpha[0] == 0.0 and alpha[1] == 0.0:
        less, sine, rest = bwave(bmul(omega, s))
        return less, rest, less, sine
    x, e = bgrowth(bmul(alpha, s))
    if omega[0] == 0.0 and omega[1] == 0.0:
        return e, NOTHING, x, NOTHING
    turn = bmul(omega, s)
    less, sine, rest = bwave(turn)
    whole = badd(ONE, x)
    return badd(e, bmul(whole, less)), badd(bmul(x, turn), bmul(whole, rest)), badd(x, bmul(whole, less)), bmul(whole, sine)


@inner
def at_time(p, s):
    """Write the time s, then of each rate's function what is left without its tangent and its value at zero, as complex balls."""
    t, b = p.table, p.basis
    plain, rates, chains = int(t[SIMPLE]), int(t[AT_RATES]), int(t[AT_CHAINS])
    put_ball(b, 0, s)
    for i in range(plain + int(t[CHAINED])):
        power, alpha, omega = 0, rounded(t[rates + 2 * i]), rounded(t[rates + 2 * i + 1])
        if i >= plain:
            at = chains + CHAIN * (i - plain)
            power = int(t[at])
            if power > 0:  # a divided difference is s exp(rate s) of a rate between the two
                alpha = between(
                    min(low(alpha), low(bsub(alpha, rounded(t[at + 1])))), max(high(alpha), high(bsub(alpha, rounded(t[at + 1]))))
                )
                omega = between(
                    min(low(omega), low(bsub(omega, rounded(t[at + 2])))), max(high(omega), high(bsub(omega, rounded(t[at + 2]))))
                )
        x, y, real, imaginary = ball_remainders(alpha, omega, s)
        if power > 0:
            x, y, factor = bmul(s, real), bmul(s, imaginary), s
            real, imaginary = badd(s, x), y
            for m in range(2, power + 1):
                factor = bmul(bmul(real, s), (1.0 / m, UNIT))
                imaginary = bmul(bmul(imaginary, s), (1.0 / m, UNIT))
                real, x, y = factor, factor, imaginary
        k = 2 + 8 * i
        put_ball(b, k, x)
        put_ball(b, k + 2, y)
        put_ball(b, k + 4, real)
        put_ball(b, k + 6, imaginary)


@inlined
def turned_by(alpha, omega, x, y):
    """The coefficients of the rate in time of a function with the coefficients x, y: of x Re + y Im."""
    if alpha[0] == 0.0:
        return bmul(omega, y), bneg(bmul(omega, x))
    return badd(bmul(alpha, x), bmul(omega, y)), bsub(bmul(alpha, y), bmul(omega, x))


@inner
def applied(p, c, which, orders):
    """Displacement and its first rates, as many as `orders` and at most three, of coefficients of a kind: see `PLAIN`."""
    t, b = p.table, p.basis
    n, plain = int(t[POWERS]), int(t[SIMPLE])
    k, rates, s = section(t, which), int(t[AT_RATES]), ball_in(p.basis, 0)
    d, v, a, j = NOTHING, NOTHING, NOTHING, NOTHING
    power, before, last, first = s, ONE, NOTHING, NOTHING  # s^m/m!, and those before it
    for m in range(2, n + 2):
        x = ball_in(c, k)
        k += 2
        if n == 1:
            if x[0] != 0.0 or x[1] != 0.0:
                v = bmul(x, s)
                d, a = bmul(v, (0.5 * s[0], 0.5 * s[1])), x
            break
        power, before, last, first = bmul(bmul(power, s), (1.0 / m, UNIT)), power, before, last
        d, v, a, j = badd(d, bmul(x, power)), badd(v, bmul(x, before)), badd(a, bmul(x, last)), badd(j, bmul(x, first))
    for i in range(plain):
        at = 2 + 8 * i
        alpha, omega, x, y = rounded(t[rates + 2 * i]), rounded(t[rates + 2 * i + 1]), ball_in(c, k), ball_in(c, k + 2)
        d = badd(d, met(x, y, ball_in(b, at), ball_in(b, at + 2)))
        real, imaginary = ball_in(b, at + 4), ball_in(b, at + 6)
        x, y = turned_by(alpha, omega, x, y)
        v = badd(v, met(x, y, real, imaginary))
        if orders > 1:
            real = badd(ONE, real)
            x, y = turned_by(alpha, omega, x, y)
            a = badd(a, met(x, y, real, imaginary))
            if orders > 2:
                x, y = turned_by(alpha, omega, x, y)
                j = badd(j, met(x, y, real, imaginary))
        k += 4
    if t[CHAINED] > 0.0:
        more = applied_chains(p, c, k)
        d, v, a, j = badd(d, more[0]), badd(v, more[1]), badd(a, more[2]), badd(j, more[3])
    return d, v, a, j


@inlined
def ball_motion(p, c, w, orders):
    """Displacement since the start and its first rates at the time of `at_time`, from the velocities w: see `applied`."""
    d, v, a, j = applied(p, c, PLAIN, orders)
    return badd(bmul(w, ball_in(p.basis, 0)), d), badd(w, v), a, j


@inlined
def by_speed(p, c, orders):
    """Displacement, velocity and acceleration at the time of `at_time` by the velocity of the start."""
    s = ball_in(p.basis, 0)
    if p.table[DAMPED] == 0.0:
        return s, ONE, NOTHING
    d, v, a, _ = applied(p, c, BY_SPEED, orders)
    return badd(s, d), badd(ONE, v), a


@inlined
def ball_tangent(p, c, orders):
    """Displacement, velocity and, where `orders` is two, acceleration by the phase and by the velocity of the start."""
    d, v, a, _ = applied(p, c, BY_PHASE, orders)
    d_w, v_w, a_w = by_speed(p, c, orders)
    return d, d_w, v, v_w, a, a_w


@inlined
def ball_bends(p, c):
    """Displacement and velocity at the time of `at_time` by the phase twice; by velocity they are linear."""
    d, v, _, _ = applied(p, c, TWICE, 1)
    return d, v
