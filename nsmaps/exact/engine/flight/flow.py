"""The flight of a table: coefficients, displacement and its rates, their bounds, and derivatives by the state at the start.

A flight starts on a wall at phase phi (radians) and place `z` with velocity `w`; `at` is (phi, cos phi - 1, sin phi), and `s` the
time since then. A `Flow` holds the table of its system and the coefficients of the flight (see `layout`).
"""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.flight.chains import chain_at, chains
from nsmaps.exact.engine.flight.layout import (
    ACCELERATION,
    AT_CHAINS,
    AT_PARAMETERS,
    AT_POWERS,
    AT_RATES,
    AT_START,
    AT_TERMS,
    BASE_UP,
    BEGIN,
    BOTTOM,
    CHAIN,
    CHAINED,
    CRACKLE,
    DRIFT,
    HARMONICS,
    HAS_DOWN,
    HAS_UP,
    HORIZON,
    JERK,
    LAW,
    LAW_SLOPE,
    PHASE_RATE,
    POLYNOMIAL,
    POP,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SNAP,
    SPEED,
    TOP,
)
from nsmaps.exact.engine.flight.remainders import remainders, wave
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import called


class Flow(NamedTuple):
    """The table of a system and the coefficients of the current flight."""

    table: Any
    flight: Any


@inlined
def wall_places(p):
    """Displacement of the upper and of the lower wall."""
    return p.table[TOP], p.table[BOTTOM]


@inlined
def walls_of(p):
    """Three truth values: an upper wall exists, a lower wall exists, the base wall is the upper one."""
    return p.table[HAS_UP] > 0.0, p.table[HAS_DOWN] > 0.0, p.table[BASE_UP] > 0.0


@inlined
def phase_rate(p):
    """Radians of phase per unit of time."""
    return p.table[PHASE_RATE]


@inlined
def horizon(p):
    """The longest flight that is followed, in the system's time."""
    return p.table[HORIZON]


@inlined
def rebound(p, up, v):
    """Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v."""
    k = 1 if up else 0
    r = p.table[RESTITUTION + k]
    if p.table[LAW + k] == 0.0:
        return r * v, r
    values = p.table.ctypes.data + 8 * int(p.table[AT_PARAMETERS])
    return called(int(p.table[LAW + k]), v, values), called(int(p.table[LAW_SLOPE + k]), v, values)


@inlined
def angle(phi):
    """A phase in [0, 2 pi) with its cosine minus one and its sine."""
    less, sine, _ = wave(phi)
    return phi, less, sine


@inlined
def linear(t, row, at, z, w):
    """The value of a row that is linear in the features."""
    total = t[row] + t[row + 1] * z + t[row + 2] * w + t[row + 3] * (1.0 + at[1]) + t[row + 4] * at[2]
    for m in range(2, int(t[HARMONICS]) + 1):
        less, sine, _ = wave(m * at[0])
        total += t[row + 2 * m + 1] * (1.0 + less) + t[row + 2 * m + 2] * sine
    return total


@inlined
def by_phase(t, row, at):
    """The derivative by the phase of a row that is linear in the features."""
    total = t[row + 4] * (1.0 + at[1]) - t[row + 3] * at[2]
    for m in range(2, int(t[HARMONICS]) + 1):
        less, sine, _ = wave(m * at[0])
        total += m * (t[row + 2 * m + 2] * (1.0 + less) - t[row + 2 * m + 1] * sine)
    return total


@inner
def begin(p, at, z, w):
    """Write the coefficients of the flight that starts here, and the bounds on its rates if they hold for all times."""
    t, c = p.table, p.flight
    width, powers, plain = 3 + 2 * int(t[HARMONICS]), int(t[POWERS]), int(t[SIMPLE])
    begins, terms, row = int(t[AT_POWERS]), int(t[AT_TERMS]), POLYNOMIAL
    c[SPEED], c[JERK], c[SNAP], c[CRACKLE], c[POP], c[ACCELERATION], c[DRIFT] = w, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        c[BEGIN + n] = linear(t, int(t[AT_START]) + n * width, at, z, w)
    for n in range(powers):
        c[row + n] = linear(t, begins + n * width, at, z, w)
    row += powers
    for j in range(plain + int(t[CHAINED])):
        a, b = linear(t, terms + 2 * j * width, at, z, w), linear(t, terms + (2 * j + 1) * width, at, z, w)
        c[row + 2 * j], c[row + 2 * j + 1] = a, b
        rate = math.hypot(t[int(t[AT_RATES]) + 2 * j], t[int(t[AT_RATES]) + 2 * j + 1])
        drift = math.sqrt(a * a + b * b) * rate
        cube = drift * rate * rate
        c[DRIFT] += drift
        c[ACCELERATION] += drift * rate
        c[JERK], c[SNAP], c[CRACKLE], c[POP] = (
            c[JERK] + cube,
            c[SNAP] + cube * rate,
            c[CRACKLE] + cube * rate**2,
            c[POP] + cube * rate**3,
        )


@inlined
def start(p):
    """Acceleration, jerk, snap and crackle at the start."""
    c = p.flight
    return c[BEGIN], c[BEGIN + 1], c[BEGIN + 2], c[BEGIN + 3]


@inlined
def of_wave(omega, x, y, remainder_re, remainder_im, sine):
    """Contribution of a rate i omega to displacement, velocity, acceleration, jerk, snap, crackle, by cos - 1, sin - omega s and
    sin.
    """
    d = x * remainder_re + y * remainder_im
    x, y = omega * y, -omega * x
    v = x * remainder_re + y * sine
    cosine = 1.0 + remainder_re
    x, y = omega * y, -omega * x
    a = x * cosine + y * sine
    x, y = omega * y, -omega * x
    j = x * cosine + y * sine
    square = -omega * omega
    return d, v, a, j, square * a, square * j


@inlined
def of_rate(alpha, omega, x, y, remainder_re, remainder_im, real, imaginary):
    """As `of_wave`, for any rate."""
    d = x * remainder_re + y * remainder_im
    x, y = alpha * x + omega * y, alpha * y - omega * x
    v = x * real + y * imaginary
    real += 1.0
    x, y = alpha * x + omega * y, alpha * y - omega * x
    a = x * real + y * imaginary
    x, y = alpha * x + omega * y, alpha * y - omega * x
    j = x * real + y * imaginary
    x, y = alpha * x + omega * y, alpha * y - omega * x
    k = x * real + y * imaginary
    x, y = alpha * x + omega * y, alpha * y - omega * x
    return d, v, a, j, k, x * real + y * imaginary


@inner
def evaluate(p, s):
    """Displacement since the start, velocity, acceleration, jerk, snap and crackle at time s."""
    t, c = p.table, p.flight
    d, v, a, j, k, q = polynomial(p, s)
    plain, rates, row = int(t[SIMPLE]), int(t[AT_RATES]), POLYNOMIAL + int(t[POWERS])
    for i in range(plain):
        alpha, omega, x, y = t[rates + 2 * i], t[rates + 2 * i + 1], c[row + 2 * i], c[row + 2 * i + 1]
        remainder_re, remainder_im, real, imaginary = remainders(alpha, omega, s)
        if alpha == 0.0:
            more = of_wave(omega, x, y, remainder_re, remainder_im, imaginary)
        else:
            more = of_rate(alpha, omega, x, y, remainder_re, remainder_im, real, imaginary)
        d, v, a, j, k, q = d + more[0], v + more[1], a + more[2], j + more[3], k + more[4], q + more[5]
    if t[CHAINED] > 0.0:
        more = chains(p, s)
        d, v, a, j, k, q = d + more[0], v + more[1], a + more[2], j + more[3], k + more[4], q + more[5]
    return d, v, a, j, k, q


@inlined
def polynomial(p, s):
    """The part of `evaluate` that is polynomial in s."""
    n, c = int(p.table[POWERS]), p.flight
    if n == 0:
        return c[SPEED] * s, c[SPEED], 0.0, 0.0, 0.0, 0.0
    if n == 1:
        b = c[POLYNOMIAL]
        return s * (c[SPEED] + s * (0.5 * b)), c[SPEED] + s * b, b, 0.0, 0.0, 0.0
    d, v, a, j, k, q = c[SPEED] * s, c[SPEED], 0.0, 0.0, 0.0, 0.0
    power, last = s, (1.0, 0.0, 0.0, 0.0, 0.0)  # s^m/m! and the five previous ones
    for m in range(2, n + 2):
        power, last = power * s / m, (power, last[0], last[1], last[2], last[3])
        x = c[POLYNOMIAL + m - 2]
        d, v, a, j, k, q = d + x * power, v + x * last[0], a + x * last[1], j + x * last[2], k + x * last[3], q + x * last[4]
    return d, v, a, j, k, q


@inner
def held(p, at, z):
    """Acceleration of a ball held at rest at z, its time derivative, and a bound on its second derivative for all phases."""
    t = p.table
    row, rate, bound = int(t[AT_START]), t[PHASE_RATE], 0.0
    for m in range(1, int(t[HARMONICS]) + 1):
        bound += math.hypot(t[row + 2 * m + 1], t[row + 2 * m + 2]) * (m * rate) ** 2
    return linear(t, row, at, z, 0.0), rate * by_phase(t, row, at), bound


@inlined
def by_feature(t, row, at, feature):
    """The derivative of a row by the phase, feature 0, by the place, 1, or by the velocity, 2."""
    return by_phase(t, row, at) if feature == 0 else t[row + feature]


@inner
def along(p, s, at, feature):
    """The derivatives of displacement and velocity at s by phase, place or velocity of the start: see `by_feature`."""
    t = p.table
    width, powers, plain = 3 + 2 * int(t[HARMONICS]), int(t[POWERS]), int(t[SIMPLE])
    begins, terms, rates = int(t[AT_POWERS]), int(t[AT_TERMS]), int(t[AT_RATES])
    d, v = (s, 1.0) if feature == 2 else (0.0, 0.0)
    power = s
    for n in range(powers):
        x = by_feature(t, begins + n * width, at, feature)
        v += x * power
        power *= s / (n + 2)
        d += x * power
    less, zero = complex(0.0, 0.0), complex(0.0, 0.0)
    for i in range(plain + int(t[CHAINED])):
        x, y = by_feature(t, terms + 2 * i * width, at, feature), by_feature(t, terms + (2 * i + 1) * width, at, feature)
        alpha, omega = t[rates + 2 * i], t[rates + 2 * i + 1]
        if i < plain:
            remainder_re, remainder_im, real, imaginary = remainders(alpha, omega, s)
            d += x * remainder_re + y * remainder_im
            if alpha == 0.0:
                v += omega * y * real + -omega * x * imaginary
            else:
                v += (alpha * x + omega * y) * real + (alpha * y - omega * x) * imaginary
        else:
            less = zero if t[int(t[AT_CHAINS]) + CHAIN * (i - plain)] == 0.0 else less
            _, from_zero, remainder = chain_at(p, i - plain, s)
            d += (complex(x, -y) * remainder).real
            v += (complex(x, -y) * (complex(alpha, omega) * from_zero + less)).real
            less = from_zero
    return d, v


@inner
def tangent_at(p, at, s):
    """d displacement/d phi, d displacement/d w, d velocity/d phi, d velocity/d w at fixed s."""
    d_phi, v_phi = along(p, s, at, 0)
    d_w, v_w = along(p, s, at, 2)
    return d_phi, d_w, v_phi, v_w


@inner
def moves_at(p, moved, at, z, z_moved, w, s):
    """Derivatives of displacement and velocity at fixed s by the parameters, whose table is `moved`, where the place of the start
    varies too.
    """
    begin(moved, at, z, w)
    moved.flight[SPEED] = 0.0  # the velocity of the start does not depend on the parameters here
    d, v, _, _, _, _ = evaluate(moved, s)
    d_z, v_z = along(p, s, at, 1)
    return d + d_z * z_moved, v + v_z * z_moved
