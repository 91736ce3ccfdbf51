"""The flight of a table in balls: what `nsmaps.exact.engine.flight.flow` computes, over sets of states and of times.

The numbers of a table are rounded once (`tables.py` computes them in many digits), and are therefore balls of that radius. The
functions of all rates at a time are written once, by `at_time`, and then combined with the coefficients of as many flights as
needed.
"""

from typing import Any, NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import (
    ONE,
    UNIT,
    ZERO,
    Ball,
    badd,
    ball_in,
    ball_of,
    bdot,
    bhull,
    bmul,
    bneg,
    bplus,
    bsub,
    exact,
    put_ball,
    put_balls,
    two_balls,
)
from nsmaps.exact.enclosure.arithmetic.elementary import bwave
from nsmaps.exact.enclosure.flight.terms import (
    RATE_BEGIN,
    RATE_SIZE,
    Motion,
    add_chains,
    add_rate,
    add_wave,
    ball_remainders,
    polynomial,
    rate_of,
    remainders_in,
)
from nsmaps.exact.engine.flight.flow import width_of
from nsmaps.exact.engine.flight.layout import (
    AT_CHAINS,
    AT_PARAMETERS,
    AT_POWERS,
    AT_START,
    AT_TERMS,
    BALL_LAW,
    BOTTOM,
    CHAIN,
    CHAIN_POWER,
    CHAINED,
    COSINE,
    DAMPED,
    DIFFERENCE_IM,
    DIFFERENCE_RE,
    HARMONICS,
    LAW,
    PHASE_RATE,
    PLACE,
    POLYNOMIAL,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SPEED,
    TOP,
    VELOCITY,
)
from nsmaps.exact.engine.flight.layout import ONE as CONSTANT
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import write_law_ball

#: the coefficients of a flight, and their derivatives by phase, twice, and by velocity
PLAIN, BY_PHASE, TWICE, BY_SPEED = range(4)
NUMBER = 8  #: bytes of a float


class Tangent(NamedTuple):
    """Derivatives of displacement, velocity and acceleration by the phase and by the velocity of the start."""

    d_phi: Ball
    d_w: Ball
    v_phi: Ball
    v_w: Ball
    a_phi: Ball
    a_w: Ball


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
    return ball_of(p.table[TOP]), ball_of(p.table[BOTTOM])


@inlined
def ball_rate(p):
    """Radians of phase per unit of time."""
    return ball_of(p.table[PHASE_RATE])


@inner
def ball_rebound(p, up, v):
    """Speed after an impact of speed v on the upper (or lower) wall, and its first and second derivative."""
    t, k = p.table, 1 if up else 0
    if t[LAW + k] == 0.0:
        r = ball_of(t[RESTITUTION + k])
        return bmul(r, v), r, ZERO
    values = t.ctypes.data + NUMBER * int(t[AT_PARAMETERS])
    out = p.basis  # scratch space: rewritten for every time
    write_law_ball(int(t[BALL_LAW + k]), v.centre, v.radius, values, t.ctypes.data + NUMBER * out)
    return *two_balls(t, out), ball_in(t, out + 4)


@inlined
def linear_ball(t, row, at, z, w):
    """The value of a row that is linear in the features, and its first and second derivatives by the phase."""
    value, slope, bend = ball_of(t[row + CONSTANT]), ZERO, ZERO
    if t[row + PLACE] != 0.0:
        value = bplus(value, ball_of(t[row + PLACE]), z)
    if t[row + VELOCITY] != 0.0:
        value = bplus(value, ball_of(t[row + VELOCITY]), w)
    for m in range(1, int(t[HARMONICS]) + 1):
        of_cosine, of_sine = pair(t, row + COSINE, m - 1)
        if of_cosine == 0.0 and of_sine == 0.0:
            continue
        x, y, less, sine = ball_of(of_cosine), ball_of(of_sine), at.less, at.sine
        if m > 1:
            less, sine, _ = bwave(bmul(exact(float(m)), at.phi))
        cosine = badd(ONE, less)
        here, derivative = bdot(x, y, cosine, sine), bdot(y, bneg(x), cosine, sine)
        value = badd(value, here)
        if m > 1:
            here, derivative = bmul(exact(float(m * m)), here), bmul(exact(float(m)), derivative)
        slope, bend = badd(slope, derivative), bsub(bend, here)
    return value, slope, bend


@inner
def ball_begin(p, c, at, z, w):
    """Write the coefficients of flights from phases `at`, place z and velocities w, and their derivatives: see `PLAIN`."""
    t = p.table
    width, powers = width_of(t), int(t[POWERS])
    rows = powers + 2 * (int(t[SIMPLE]) + int(t[CHAINED]))
    row, size = int(t[AT_POWERS]), 2 * rows
    for i in range(rows):
        if i == powers:
            row = int(t[AT_TERMS])
        value, slope, bend = linear_ball(t, row, at, z, w)
        put_ball(t, c + 2 * i, value)
        put_ball(t, c + size + 2 * i, slope)
        put_ball(t, c + 2 * size + 2 * i, bend)
        put_ball(t, c + 3 * size + 2 * i, ball_of(t[row + VELOCITY]))
        row += width


@inner
def centre_begin(p, w):
    """Write the centres of the coefficients of `one` as those of a flight with velocity w: see `evaluate`."""
    t, c = p.table, p.flight
    t[c + SPEED] = w
    for i in range(int(t[POWERS]) + 2 * (int(t[SIMPLE]) + int(t[CHAINED]))):
        t[c + POLYNOMIAL + i] = ball_in(t, p.one + 2 * i).centre


@inner
def ball_start(p, at, z, w):
    """Acceleration and jerk at the start."""
    row = int(p.table[AT_START])
    acceleration, _, _ = linear_ball(p.table, row, at, z, w)
    jerk, _, _ = linear_ball(p.table, row + width_of(p.table), at, z, w)
    return acceleration, jerk


@inlined
def chained_rate(t, i, rate):
    """A rate; for a chained one that is not the first also all between it and the previous one, with the power of s before.

    A divided difference is s exp(rate s) for a rate between the two.
    """
    if i < int(t[SIMPLE]):
        return rate, 0
    chain = int(t[AT_CHAINS]) + CHAIN * (i - int(t[SIMPLE]))
    power = int(t[chain + CHAIN_POWER])
    if power == 0:
        return rate, 0
    re, im = rate
    re = bhull(re, bsub(re, ball_of(t[chain + DIFFERENCE_RE])))
    return (re, bhull(im, bsub(im, ball_of(t[chain + DIFFERENCE_IM])))), power


@inner
def at_time(p, s):
    """Write the time s, and for each rate its function without the value and the tangent at zero, as complex balls."""
    t = p.table
    put_ball(t, p.basis, s)
    for i in range(int(t[SIMPLE]) + int(t[CHAINED])):
        rate, power = chained_rate(t, i, rate_of(t, i))
        x, y, real, imaginary = ball_remainders(rate, s)
        if power > 0:
            x, y, factor = bmul(s, real), bmul(s, imaginary), s
            real, imaginary = badd(s, x), y
            for m in range(2, power + 1):
                factor = bmul(bmul(real, s), Ball(1.0 / m, UNIT))
                imaginary = bmul(bmul(imaginary, s), Ball(1.0 / m, UNIT))
                real, x, y = factor, factor, imaginary
        put_balls(t, p.basis + RATE_BEGIN + RATE_SIZE * i, (x, y, real, imaginary))


@inner
def apply_coefficients(p, c, which, orders):
    """Displacement and its first `orders` time derivatives, at most three, for coefficients of a kind: see `PLAIN`."""
    t = p.table
    n, s = int(t[POWERS]), ball_in(t, p.basis)
    k = c + which * 2 * (n + 2 * (int(t[SIMPLE]) + int(t[CHAINED])))  # a ball takes two numbers
    total = polynomial(t, k, n, s)
    k += 2 * n
    for i in range(int(t[SIMPLE])):
        rate, coefficients, here = rate_of(t, i), two_balls(t, k), remainders_in(p, i)
        alpha, omega = rate
        if alpha.centre == 0.0:
            total = add_wave(total, omega, coefficients, here, orders)
        else:
            total = add_rate(total, rate, coefficients, here, orders)
        k += 4
    if t[CHAINED] > 0.0:
        more = add_chains(p, k)
        return Motion(badd(total.d, more.d), badd(total.v, more.v), badd(total.a, more.a), badd(total.j, more.j))
    return total


@inlined
def ball_motion(p, c, w, orders):
    """Displacement since the start and its first time derivatives at `at_time`, from velocities w: see `apply_coefficients`."""
    d, v, a, j = apply_coefficients(p, c, PLAIN, orders)
    return Motion(bplus(d, w, ball_in(p.table, p.basis)), badd(w, v), a, j)


@inlined
def ball_tangent(p, c, orders):
    """Derivatives of displacement, velocity and, where `orders` is two, acceleration by phase and velocity of the start."""
    (d, v, a, _), s = apply_coefficients(p, c, BY_PHASE, orders), ball_in(p.table, p.basis)
    if p.table[DAMPED] == 0.0:
        return Tangent(d, s, v, ONE, a, ZERO)
    d_w, v_w, a_w, _ = apply_coefficients(p, c, BY_SPEED, orders)
    return Tangent(d, badd(s, d_w), v, badd(ONE, v_w), a, a_w)


@inlined
def ball_bends(p, c):
    """Second derivatives of displacement and velocity at the time of `at_time` by the phase; they are linear in the velocity."""
    d, v, _, _ = apply_coefficients(p, c, TWICE, 1)
    return d, v
