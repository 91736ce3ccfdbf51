"""Derivatives of the flights of a block by phase and speed at the start, as `derivatives.py` has them of one flight."""

from nsmaps.exact.engine.blocks.block import harmonic, phases
from nsmaps.exact.engine.blocks.rows import AT, PITCH, TERMS
from nsmaps.exact.engine.flight.flow import of_rate, of_wave, rebound, width_of
from nsmaps.exact.engine.flight.layout import (
    AT_POWERS,
    AT_RATES,
    AT_TERMS,
    COSINE,
    HARMONICS,
    LAW,
    POWERS,
    RESTITUTION,
    SIMPLE,
    SINE,
    VELOCITY,
)
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.flight.remainders import remainders, wave
from nsmaps.exact.engine.jit import inlined, inner


@inner
def phase_row(p, t, n, row, into):
    """Write derivatives by the phase, as `by_phase` of `flow.py`."""
    f = p.table
    c, s = f[row + COSINE], f[row + SINE]
    for k in range(n):
        t[into + k] = s * (1.0 + t[AT.less + k]) - c * t[AT.sine + k]
    for m in range(2, int(f[HARMONICS]) + 1):
        (c, s), less = pair(f, row + COSINE, m - 1), harmonic(p, m)
        for k in range(n):
            t[into + k] += m * (s * (1.0 + t[less + k]) - c * t[less + PITCH + k])


@inner
def varies(f, row, width):
    """True if a linear row of the table depends on the velocity or the phase at the start."""
    found = False
    for i in range(row + VELOCITY, row + width):
        found = found or f[i] != 0.0
    return found


@inner
def tangents_of_power(p, t, n):
    """Add to `tangents` the part that is quadratic in time."""
    f = p.table
    row = int(f[AT_POWERS])
    y = f[row + VELOCITY]
    phase_row(p, t, n, row, AT.spare)
    for k in range(n):
        s, x = t[AT.now + k], t[AT.spare + k]
        half = s * (s / 2)
        t[AT.by_phase + k] += x * half
        t[AT.by_speed + k] += y * half
        t[AT.by_phase_1 + k] += x * s
        t[AT.by_speed_1 + k] += y * s


@inner
def tangents(p, t, n):
    """Write velocity and acceleration at `now + step`, the new `now`, and the derivatives by phase and velocity of the start.

    As `evaluate` and `tangent_at` of `flow.py`. The rows of the phase hold since the start of the flight, those of its
    multiples do not.
    """
    f = p.table
    width, terms = width_of(f), int(f[AT_TERMS])
    if f[HARMONICS] > 1.0:
        phases(p, t, n)
    for k in range(n):
        s, x = t[AT.now + k] + t[AT.step + k], t[AT.steady + k]
        t[AT.now + k], t[AT.step + k], t[AT.motion_1 + k], t[AT.motion_2 + k] = s, 0.0, t[AT.velocity + k] + s * x, x
        t[AT.by_phase + k], t[AT.by_speed + k], t[AT.by_phase_1 + k], t[AT.by_speed_1 + k] = 0.0, s, 0.0, 1.0
    if f[POWERS] > 0.0 and varies(f, int(f[AT_POWERS]), width):
        tangents_of_power(p, t, n)
    for i in range(int(f[SIMPLE])):
        one, two, row = terms + 2 * i * width, terms + (2 * i + 1) * width, TERMS + 2 * i * PITCH
        (alpha, omega), x_w, y_w = pair(f, int(f[AT_RATES]), i), f[one + VELOCITY], f[two + VELOCITY]
        phase_row(p, t, n, one, AT.spare)
        phase_row(p, t, n, two, AT.spare_1)
        if alpha == 0.0:
            for k in range(n):
                remainder, sine, other = wave(omega * t[AT.now + k])
                add_tangent(t, k, of_wave(omega, t[row + k], t[row + PITCH + k], remainder, other, sine))
                x, y = t[AT.spare + k], t[AT.spare_1 + k]
                t[AT.by_phase + k] += x * remainder + y * other
                t[AT.by_speed + k] += x_w * remainder + y_w * other
                t[AT.by_phase_1 + k] += omega * y * remainder + -omega * x * sine
                t[AT.by_speed_1 + k] += omega * y_w * remainder + -omega * x_w * sine
        else:
            for k in range(n):
                all_of = remainders(alpha, omega, t[AT.now + k])
                add_tangent(t, k, of_rate(alpha, omega, t[row + k], t[row + PITCH + k], all_of))
                remainder, other, real, imaginary = all_of
                x, y = t[AT.spare + k], t[AT.spare_1 + k]
                t[AT.by_phase + k] += x * remainder + y * other
                t[AT.by_speed + k] += x_w * remainder + y_w * other
                t[AT.by_phase_1 + k] += (alpha * x + omega * y) * real + (alpha * y - omega * x) * imaginary
                t[AT.by_speed_1 + k] += (alpha * x_w + omega * y_w) * real + (alpha * y_w - omega * x_w) * imaginary


@inlined
def add_tangent(t, k, more):
    """Add the contribution of a rate to velocity and acceleration."""
    t[AT.motion_1 + k], t[AT.motion_2 + k] = t[AT.motion_1 + k] + more.velocity, t[AT.motion_2 + k] + more.acceleration


@inner
def slopes(p, t, n, up):
    """Write the derivatives of the impact law at these speeds."""
    law = 1 if up else 0
    if p.table[LAW + law] == 0.0:
        r = p.table[RESTITUTION + law]
        for k in range(n):
            t[AT.motion_3 + k] = r
    else:
        for k in range(n):
            _, t[AT.motion_3 + k] = rebound(p, up, t[AT.speed + k])
