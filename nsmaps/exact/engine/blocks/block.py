"""A block of flights, a column each: the computations of `flow.py` in loops over all columns, the same results, bit for bit."""

import math

from nsmaps.exact.engine.blocks.rows import AT, PITCH, TERMS
from nsmaps.exact.engine.constants import OUTWARD
from nsmaps.exact.engine.flight.flow import of_rate, of_wave, rebound, width_of
from nsmaps.exact.engine.flight.layout import (
    AT_POWERS,
    AT_RATES,
    AT_START,
    AT_TERMS,
    COSINE,
    HARMONICS,
    LAW,
    ONE,
    PLACE,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SINE,
    VELOCITY,
)
from nsmaps.exact.engine.flight.motion import Motion, pair
from nsmaps.exact.engine.flight.remainders import remainders, wave
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import PHASE, SPEED, is_state, phase_after
from nsmaps.exact.engine.steps import Gap


@inlined
def write_gap(t, k, gap):
    """Write a gap and its time derivatives."""
    t[AT.gap + k], t[AT.gap_1 + k], t[AT.gap_2 + k], t[AT.gap_3 + k], t[AT.gap_4 + k], t[AT.gap_5 + k] = gap


@inlined
def read_gap(t, k):
    """The gap that `write_gap` wrote."""
    return Gap(t[AT.gap + k], t[AT.gap_1 + k], t[AT.gap_2 + k], t[AT.gap_3 + k], t[AT.gap_4 + k], t[AT.gap_5 + k])


@inlined
def motion_of(t, k):
    """The motion of a flight."""
    d, v, a = t[AT.motion + k], t[AT.motion_1 + k], t[AT.motion_2 + k]
    return Motion(d, v, a, t[AT.motion_3 + k], t[AT.motion_4 + k], t[AT.motion_5 + k])


@inlined
def harmonic(p, m):
    """The row of the cosine minus one of m times the phase, m > 1; its sine is in the next row. They are not preserved."""
    return TERMS + 2 * (int(p.table[SIMPLE]) + m - 2) * PITCH


@inner
def phases(p, t, n):
    """Write sines and cosines of the phases and of their multiples."""
    for k in range(n):
        t[AT.less + k], t[AT.sine + k], _ = wave(t[AT.phase + k])
    for m in range(2, int(p.table[HARMONICS]) + 1):
        row = harmonic(p, m)
        for k in range(n):
            t[row + k], t[row + PITCH + k], _ = wave(m * t[AT.phase + k])


@inner
def linear_row(p, t, n, row, z, into):
    """Write a row that is linear in the features, as `linear` of `flow.py`, for all columns."""
    f = p.table
    one, c, s, of_w = f[row + ONE] + f[row + PLACE] * z, f[row + COSINE], f[row + SINE], f[row + VELOCITY]
    if of_w == 0.0:
        for k in range(n):
            t[into + k] = one + c * (1.0 + t[AT.less + k]) + s * t[AT.sine + k]
    else:
        for k in range(n):
            t[into + k] = one + of_w * t[AT.velocity + k] + c * (1.0 + t[AT.less + k]) + s * t[AT.sine + k]
    for m in range(2, int(f[HARMONICS]) + 1):
        (c, s), less = pair(f, row + COSINE, m - 1), harmonic(p, m)
        for k in range(n):
            t[into + k] += c * (1.0 + t[less + k]) + s * t[less + PITCH + k]


@inner
def begin_block(p, t, n, z):
    """Write coefficients and bounds of the flights that start now, as `begin` of `flow.py`, and rates to scratch rows."""
    f = p.table
    width, terms = width_of(f), int(f[AT_TERMS])
    phases(p, t, n)
    for order in range(4):
        linear_row(p, t, n, int(f[AT_START]) + order * width, z, AT.motion_2 + order * PITCH)
    for k in range(n):
        t[AT.steady + k] = 0.0
    if f[POWERS] > 0.0:
        linear_row(p, t, n, int(f[AT_POWERS]), z, AT.steady)
    for k in range(n):
        t[AT.jerk + k], t[AT.snap + k], t[AT.pop + k], t[AT.acceleration + k], t[AT.drift + k] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(int(f[SIMPLE])):
        row = TERMS + 2 * i * PITCH
        linear_row(p, t, n, terms + 2 * i * width, z, row)
        linear_row(p, t, n, terms + (2 * i + 1) * width, z, row + PITCH)
        alpha, omega = pair(f, int(f[AT_RATES]), i)
        rate = math.hypot(alpha, omega)
        cubed = rate**3
        for k in range(n):
            x, y = t[row + k], t[row + PITCH + k]
            drift = math.sqrt(x * x + y * y) * rate
            cube = drift * rate * rate
            t[AT.drift + k] += drift
            t[AT.acceleration + k] += drift * rate
            t[AT.jerk + k] += cube
            t[AT.snap + k] += cube * rate
            t[AT.pop + k] += cube * cubed
    for k in range(n):
        t[AT.jerk + k] *= OUTWARD
        t[AT.snap + k] *= OUTWARD
        t[AT.pop + k] *= OUTWARD


@inner
def write_motion(p, t, n):
    """Write the motion of flights at `now`, as `evaluate` of `flow.py`: for each rate all columns in parallel."""
    f = p.table
    for k in range(n):
        s, w, x = t[AT.now + k], t[AT.velocity + k], t[AT.steady + k]
        t[AT.motion + k], t[AT.motion_1 + k], t[AT.motion_2 + k] = s * (w + s * (0.5 * x)), w + s * x, x
        t[AT.motion_3 + k], t[AT.motion_4 + k], t[AT.motion_5 + k] = 0.0, 0.0, 0.0
    for i in range(int(f[SIMPLE])):
        row = TERMS + 2 * i * PITCH
        alpha, omega = pair(f, int(f[AT_RATES]), i)
        if alpha == 0.0:
            for k in range(n):
                less, sine, remainder = wave(omega * t[AT.now + k])
                add_motion(t, k, of_wave(omega, t[row + k], t[row + PITCH + k], less, remainder, sine))
        else:
            for k in range(n):
                add_motion(t, k, of_rate(alpha, omega, t[row + k], t[row + PITCH + k], remainders(alpha, omega, t[AT.now + k])))


@inlined
def add_motion(t, k, more):
    """Add the contribution of a rate to a motion."""
    d, d1, d2 = t[AT.motion + k] + more.displacement, t[AT.motion_1 + k] + more.velocity, t[AT.motion_2 + k] + more.acceleration
    t[AT.motion + k], t[AT.motion_1 + k], t[AT.motion_2 + k] = d, d1, d2
    d, d1, d2 = t[AT.motion_3 + k] + more.jerk, t[AT.motion_4 + k] + more.snap, t[AT.motion_5 + k] + more.crackle
    t[AT.motion_3 + k], t[AT.motion_4 + k], t[AT.motion_5 + k] = d, d1, d2


@inlined
def size_of(t, k, s):
    """A bound on the sum of the absolute values of the terms of a displacement, as in `limits`."""
    part = min(0.5 * s * t[AT.acceleration + k], 2.0 * t[AT.drift + k])
    return s * (abs(t[AT.velocity + k]) + 0.5 * s * abs(t[AT.steady + k]) + part)


@inner
def to_front(p, t, n, first, end, steps):
    """Move open columns to the front, in the rows from first to before end; returns their number.

    If `steps` is not zero, the rows of steps from there on and those of the coefficients are moved too.
    """
    k, last = 0, n - 1
    terms_end = TERMS + 2 * int(p.table[SIMPLE]) * PITCH if steps > 0 else 0
    while True:
        while k <= last and t[AT.open + k] > 0.0:
            k += 1
        while k <= last and not t[AT.open + last] > 0.0:
            last -= 1
        if k > last:
            return k
        for row in range(first, end, PITCH):
            t[row + k], t[row + last] = t[row + last], t[row + k]
        for row in range(steps, terms_end, PITCH):
            t[row + k], t[row + last] = t[row + last], t[row + k]
        k += 1
        last -= 1


@inner
def leave_to_scalar(t, n):
    """Leave columns to `first_return`."""
    for k in range(n):
        t[AT.needs_scalar + k] = 1.0


@inner
def write_rebounds(p, t, n, up, into):
    """The velocities just after impacts of these speeds."""
    law = 1 if up else 0
    if p.table[LAW + law] == 0.0:
        r = p.table[RESTITUTION + law]
        for k in range(n):
            t[AT.velocity + k] = -into * (r * t[AT.speed + k])
    else:
        for k in range(n):
            u, _ = rebound(p, up, t[AT.speed + k])
            t[AT.velocity + k] = -into * u


@inner
def write_starts(p, t, n, first, start, with_derivative):
    """Fill the table with n states, from number `first` on; with their derivatives if `with_derivative`."""
    for k in range(n):
        v, phi = start[first + k, SPEED], start[first + k, PHASE]
        t[AT.orbit + k], t[AT.time + k], t[AT.speed + k] = first + k, 0.0, v
        t[AT.phase + k], t[AT.turns + k] = phase_after(p, phi, 0.0)
        t[AT.needs_scalar + k] = 0.0 if is_state(v, phi) else 1.0
    if with_derivative:
        for k in range(n):
            t[AT.d_vv + k], t[AT.d_vp + k], t[AT.d_pv + k], t[AT.d_pp + k] = 1.0, 0.0, 0.0, 1.0
