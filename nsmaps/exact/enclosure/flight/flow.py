"""The flight of a table in balls: what `nsmaps.exact.engine.flight.flow` computes, over sets of states and of times.

The numbers of a table are rounded once (`tables.py` computes them in many digits), and are therefore balls of that radius. The
functions of all rates at a time are written once, by `at_time`, and then combined with the coefficients of as many flights as
needed.
"""

from typing import Any, NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import (
    NOTHING,
    ONE,
    UNIT,
    badd,
    ball_in,
    between,
    bmul,
    bneg,
    bplus,
    bsub,
    high,
    low,
    met,
    put_ball,
    rounded,
)
from nsmaps.exact.enclosure.arithmetic.elementary import bwave
from nsmaps.exact.enclosure.flight.terms import add_rate, add_wave, applied_chains, ball_remainders, polynomial
from nsmaps.exact.engine.flight.layout import (
    AT_CHAINS,
    AT_PARAMETERS,
    AT_POWERS,
    AT_RATES,
    AT_START,
    AT_TERMS,
    BALL_LAW,
    BOTTOM,
    CHAIN,
    CHAINED,
    DAMPED,
    HARMONICS,
    LAW,
    PHASE_RATE,
    POLYNOMIAL,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SPEED,
    TOP,
)
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import write_law_ball

PLAIN, BY_PHASE, TWICE, BY_SPEED = range(
    4
)  #: the coefficients of a flight, and their derivatives by phase, twice, and by velocity


class BallFlow(NamedTuple):
    """A table, with room behind it for intermediate results.

    The room holds the coefficients of a flight in floats, those of this flight and of a whole set of flights in balls, and the
    functions of all rates at one time.
    """

    table: Any
    flight: int
    one: int
    whole: int
    basis: int


@inlined
def ball_places(p):
    """Displacement of the upper and of the lower wall."""
    return rounded(p.table[TOP]), rounded(p.table[BOTTOM])


@inlined
def ball_rate(p):
    """Radians of phase per unit of time."""
    return rounded(p.table[PHASE_RATE])


@inner
def ball_rebound(p, up, v):
    """Speed after an impact of speed v on the upper (or lower) wall, and its first and second derivative."""
    t, k = p.table, 1 if up else 0
    if t[LAW + k] == 0.0:
        r = rounded(t[RESTITUTION + k])
        return bmul(r, v), r, NOTHING
    values = t.ctypes.data + 8 * int(t[AT_PARAMETERS])
    out = p.basis  # scratch space: rewritten for every time
    write_law_ball(int(t[BALL_LAW + k]), v[0], v[1], values, t.ctypes.data + 8 * out)
    return ball_in(t, out), ball_in(t, out + 2), ball_in(t, out + 4)


@inlined
def linear_ball(t, row, at, z, w):
    """The value of a row that is linear in the features, and its first and second derivatives by the phase."""
    value, slope, bend = rounded(t[row]), NOTHING, NOTHING
    if t[row + 1] != 0.0:
        value = bplus(value, rounded(t[row + 1]), z)
    if t[row + 2] != 0.0:
        value = bplus(value, rounded(t[row + 2]), w)
    for m in range(1, int(t[HARMONICS]) + 1):
        x, y = rounded(t[row + 2 * m + 1]), rounded(t[row + 2 * m + 2])
        if x[0] == 0.0 and y[0] == 0.0:
            continue
        less, sine = at[1], at[2]
        if m > 1:
            less, sine, _ = bwave(bmul((float(m), 0.0), at[0]))
        cosine = badd(ONE, less)
        here, turned = met(x, y, cosine, sine), met(y, bneg(x), cosine, sine)
        value = badd(value, here)
        if m > 1:
            here, turned = bmul((float(m * m), 0.0), here), bmul((float(m), 0.0), turned)
        slope, bend = badd(slope, turned), bsub(bend, here)
    return value, slope, bend


@inlined
def section(t, which):
    """The index at which coefficients of a kind begin; a ball takes two numbers."""
    return which * 2 * (int(t[POWERS]) + 2 * (int(t[SIMPLE]) + int(t[CHAINED])))


@inner
def ball_begin(p, c, at, z, w):
    """Write the coefficients of flights from phases `at`, place z and velocities w, and their derivatives: see `PLAIN`."""
    t = p.table
    width, powers = 3 + 2 * int(t[HARMONICS]), int(t[POWERS])
    rows = powers + 2 * (int(t[SIMPLE]) + int(t[CHAINED]))
    row, size = int(t[AT_POWERS]), 2 * rows
    for i in range(rows):
        if i == powers:
            row = int(t[AT_TERMS])
        value, slope, bend = linear_ball(t, row, at, z, w)
        put_ball(t, c + 2 * i, value)
        put_ball(t, c + size + 2 * i, slope)
        put_ball(t, c + 2 * size + 2 * i, bend)
        put_ball(t, c + 3 * size + 2 * i, rounded(t[row + 2]))
        row += width


@inner
def centre_begin(p, w):
    """Write the centres of the coefficients of `one` as those of a flight with velocity w: see `evaluate`."""
    t, c = p.table, p.flight
    t[c + SPEED] = w
    for i in range(int(t[POWERS]) + 2 * (int(t[SIMPLE]) + int(t[CHAINED]))):
        t[c + POLYNOMIAL + i] = t[p.one + 2 * i]


@inner
def ball_start(p, at, z, w):
    """Acceleration and jerk at the start."""
    row, width = int(p.table[AT_START]), 3 + 2 * int(p.table[HARMONICS])
    return linear_ball(p.table, row, at, z, w)[0], linear_ball(p.table, row + width, at, z, w)[0]


@inner
def at_time(p, s):
    """Write the time s, and for each rate its function without the value and the tangent at zero, as complex balls."""
    t, b = p.table, p.basis
    plain, rates, chains = int(t[SIMPLE]), int(t[AT_RATES]), int(t[AT_CHAINS])
    put_ball(t, b, s)
    for i in range(plain + int(t[CHAINED])):
        power, alpha, omega = 0, rounded(t[rates + 2 * i]), rounded(t[rates + 2 * i + 1])
        if i >= plain:
            at = chains + CHAIN * (i - plain)
            power = int(t[at])
            if power > 0:  # a divided difference is s exp(rate s) for a rate between the two
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
        k = b + 2 + 8 * i
        put_ball(t, k, x)
        put_ball(t, k + 2, y)
        put_ball(t, k + 4, real)
        put_ball(t, k + 6, imaginary)


@inner
def applied(p, c, which, orders):
    """Displacement and its first `orders` time derivatives, at most three, for coefficients of a kind: see `PLAIN`."""
    t, b = p.table, p.basis
    n, plain = int(t[POWERS]), int(t[SIMPLE])
    k, rates, s = c + section(t, which), int(t[AT_RATES]), ball_in(t, b)
    total = polynomial(t, k, n, s)
    k += 2 * n
    for i in range(plain):
        at = b + 2 + 8 * i
        alpha, omega, x, y = rounded(t[rates + 2 * i]), rounded(t[rates + 2 * i + 1]), ball_in(t, k), ball_in(t, k + 2)
        here, growth = (ball_in(t, at), ball_in(t, at + 2)), (ball_in(t, at + 4), ball_in(t, at + 6))
        if alpha[0] == 0.0:
            total = add_wave(total, omega, x, y, here, growth, orders)
        else:
            total = add_rate(total, alpha, omega, x, y, here, growth, orders)
        k += 4
    if t[CHAINED] > 0.0:
        d, v, a, j = total
        more = applied_chains(p, k)
        return badd(d, more[0]), badd(v, more[1]), badd(a, more[2]), badd(j, more[3])
    return total


@inlined
def ball_motion(p, c, w, orders):
    """Displacement since the start and its first time derivatives at the time of `at_time`, from velocities w: see `applied`."""
    d, v, a, j = applied(p, c, PLAIN, orders)
    return bplus(d, w, ball_in(p.table, p.basis)), badd(w, v), a, j


@inlined
def by_speed(p, c, orders):
    """Derivatives of displacement, velocity and acceleration at the time of `at_time` by the velocity of the start."""
    s = ball_in(p.table, p.basis)
    if p.table[DAMPED] == 0.0:
        return s, ONE, NOTHING
    d, v, a, _ = applied(p, c, BY_SPEED, orders)
    return badd(s, d), badd(ONE, v), a


@inlined
def ball_tangent(p, c, orders):
    """Derivatives of displacement, velocity and, where `orders` is two, acceleration by the phase and by the velocity of the
    start.
    """
    d, v, a, _ = applied(p, c, BY_PHASE, orders)
    d_w, v_w, a_w = by_speed(p, c, orders)
    return d, d_w, v, v_w, a, a_w


@inlined
def ball_bends(p, c):
    """Second derivatives of displacement and velocity at the time of `at_time` by the phase; they are linear in the velocity."""
    d, v, _, _ = applied(p, c, TWICE, 1)
    return d, v
