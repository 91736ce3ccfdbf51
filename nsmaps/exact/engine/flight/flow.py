"""The flight of a table: coefficients, displacement and its rates.

A flight starts on a wall at phase phi (radians) and place `z` with velocity `w`; `at` is the `Phase` there, and `s` the time
since then. A `Flow` holds the table of its system and the coefficients of the flight (see `layout`).
"""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.flight.chains import chains
from nsmaps.exact.engine.flight.layout import (
    ACCELERATION,
    AT_PARAMETERS,
    AT_POWERS,
    AT_RATES,
    AT_START,
    AT_TERMS,
    BASE_UP,
    BEGIN,
    BOTTOM,
    CHAINED,
    COSINE,
    CRACKLE,
    DRIFT,
    HARMONICS,
    HAS_DOWN,
    HAS_UP,
    HORIZON,
    JERK,
    LAW,
    LAW_SLOPE,
    ONE,
    PHASE_RATE,
    PLACE,
    POLYNOMIAL,
    POP,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SINE,
    SNAP,
    SPEED,
    START_ACCELERATION,
    START_CRACKLE,
    START_JERK,
    START_SNAP,
    TOP,
    VELOCITY,
)
from nsmaps.exact.engine.flight.motion import Motion, pair, plus
from nsmaps.exact.engine.flight.remainders import remainders, wave
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import call_law


class Flow(NamedTuple):
    """The table of a system and the coefficients of the current flight."""

    table: Any
    flight: Any


@inlined
def wall_places(p):
    """Displacement of the upper and of the lower wall."""
    return p.table[TOP], p.table[BOTTOM]


@inlined
def wall_place(p, up):
    """Displacement of the upper or of the lower wall."""
    return p.table[TOP] if up else p.table[BOTTOM]


@inlined
def walls_of(p):
    """Three truth values: an upper wall exists, a lower wall exists, the base wall is the upper one."""
    return p.table[HAS_UP] > 0.0, p.table[HAS_DOWN] > 0.0, p.table[BASE_UP] > 0.0


@inlined
def on_top(p):
    """True if the base wall is the upper one."""
    return p.table[BASE_UP] > 0.0


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
    return call_law(int(p.table[LAW + k]), v, values), call_law(int(p.table[LAW_SLOPE + k]), v, values)


class Phase(NamedTuple):
    """A phase of the forcing."""

    phi: float  #: in [0, 2 pi)
    less: float  #: its cosine minus one
    sine: float


@inlined
def angle(phi):
    """A phase in [0, 2 pi) with its cosine and sine."""
    less, sine, _ = wave(phi)
    return Phase(phi, less, sine)


@inlined
def width_of(t):
    """The number of features in which a row is linear."""
    return COSINE + 2 * int(t[HARMONICS])


@inlined
def linear(t, row, at, z, w):
    """The value of a row that is linear in the features."""
    total = t[row + ONE] + t[row + PLACE] * z + t[row + VELOCITY] * w
    total = total + t[row + COSINE] * (1.0 + at.less) + t[row + SINE] * at.sine
    for m in range(2, int(t[HARMONICS]) + 1):
        less, sine, _ = wave(m * at.phi)
        of_cosine, of_sine = pair(t, row + COSINE, m - 1)
        total += of_cosine * (1.0 + less) + of_sine * sine
    return total


@inlined
def by_phase(t, row, at):
    """The derivative by the phase of a row that is linear in the features."""
    total = t[row + SINE] * (1.0 + at.less) - t[row + COSINE] * at.sine
    for m in range(2, int(t[HARMONICS]) + 1):
        less, sine, _ = wave(m * at.phi)
        of_cosine, of_sine = pair(t, row + COSINE, m - 1)
        total += m * (of_sine * (1.0 + less) - of_cosine * sine)
    return total


@inner
def begin(p, at, z, w):
    """Write the coefficients of the flight that starts here, and the bounds on its rates if they hold for all times."""
    t, c = p.table, p.flight
    width, powers, plain = width_of(t), int(t[POWERS]), int(t[SIMPLE])
    begins, terms, row = int(t[AT_POWERS]), int(t[AT_TERMS]), POLYNOMIAL
    c[SPEED], c[JERK], c[SNAP], c[CRACKLE], c[POP], c[ACCELERATION], c[DRIFT] = w, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        c[BEGIN + n] = linear(t, int(t[AT_START]) + n * width, at, z, w)
    for n in range(powers):
        c[row + n] = linear(t, begins + n * width, at, z, w)
    row += powers
    for j in range(plain + int(t[CHAINED])):
        a, b = linear(t, terms + 2 * j * width, at, z, w), linear(t, terms + (2 * j + 1) * width, at, z, w)
        re, im = row + 2 * j, row + 2 * j + 1
        c[re], c[im] = a, b
        alpha, omega = pair(t, int(t[AT_RATES]), j)
        rate = math.hypot(alpha, omega)
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
    return c[START_ACCELERATION], c[START_JERK], c[START_SNAP], c[START_CRACKLE]


@inlined
def of_wave(omega, x, y, remainder_re, remainder_im, sine):
    """Contribution of a rate i omega to a motion, by cos - 1, sin - omega s and sin."""
    d = x * remainder_re + y * remainder_im
    x, y = omega * y, -omega * x
    v = x * remainder_re + y * sine
    cosine = 1.0 + remainder_re
    x, y = omega * y, -omega * x
    a = x * cosine + y * sine
    x, y = omega * y, -omega * x
    j = x * cosine + y * sine
    square = -omega * omega
    return Motion(d, v, a, j, square * a, square * j)


@inlined
def of_rate(alpha, omega, x, y, remainder):
    """Contribution of any rate, by the remainders of its exponential."""
    remainder_re, remainder_im, real, imaginary = remainder
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
    return Motion(d, v, a, j, k, x * real + y * imaginary)


@inner
def evaluate(p, s):
    """The motion at time s."""
    t, c = p.table, p.flight
    motion = polynomial(p, s)
    plain, rates, row = int(t[SIMPLE]), int(t[AT_RATES]), POLYNOMIAL + int(t[POWERS])
    for i in range(plain):
        alpha, omega = pair(t, rates, i)
        x, y = pair(c, row, i)
        remainder = remainders(alpha, omega, s)
        if alpha == 0.0:
            motion = plus(motion, of_wave(omega, x, y, remainder.two_re, remainder.two_im, remainder.one_im))
        else:
            motion = plus(motion, of_rate(alpha, omega, x, y, remainder))
    if t[CHAINED] > 0.0:
        motion = plus(motion, chains(p, s))
    return motion


@inlined
def polynomial(p, s):
    """The part of `evaluate` that is polynomial in s."""
    n, c = int(p.table[POWERS]), p.flight
    if n == 0:
        return Motion(c[SPEED] * s, c[SPEED], 0.0, 0.0, 0.0, 0.0)
    if n == 1:
        b = c[POLYNOMIAL]
        return Motion(s * (c[SPEED] + s * (0.5 * b)), c[SPEED] + s * b, b, 0.0, 0.0, 0.0)
    d, v, a, j, k, q = c[SPEED] * s, c[SPEED], 0.0, 0.0, 0.0, 0.0
    power, l1, l2, l3, l4, l5 = s, 1.0, 0.0, 0.0, 0.0, 0.0  # s^m/m! and the five previous ones
    for m in range(n):
        power, l1, l2, l3, l4, l5 = power * s / (m + 2), power, l1, l2, l3, l4
        x = c[POLYNOMIAL + m]
        d, v, a, j, k, q = d + x * power, v + x * l1, a + x * l2, j + x * l3, k + x * l4, q + x * l5
    return Motion(d, v, a, j, k, q)


@inner
def acceleration_at_rest(p, at, z):
    """Acceleration of a ball held at rest at z, its time derivative, and a bound on its second derivative for all phases."""
    t = p.table
    row, rate, bound = int(t[AT_START]), t[PHASE_RATE], 0.0
    for m in range(1, int(t[HARMONICS]) + 1):
        cosine, sine = pair(t, row + COSINE, m - 1)
        bound += math.hypot(cosine, sine) * (m * rate) ** 2
    return linear(t, row, at, z, 0.0), rate * by_phase(t, row, at), bound
