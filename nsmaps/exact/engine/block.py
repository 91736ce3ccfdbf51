"""A block of flights, a column each: the computations of `flow.py` in loops over all columns, the same results, bit for bit."""

import math

from nsmaps.exact.engine.flight.flow import of_rate, of_wave, rebound
from nsmaps.exact.engine.flight.layout import AT_POWERS, AT_RATES, AT_START, AT_TERMS, HARMONICS, LAW, POWERS, RESTITUTION, SIMPLE
from nsmaps.exact.engine.flight.remainders import remainders, wave
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.march import OUTWARD
from nsmaps.exact.engine.returns import is_state, turned

BLOCK = 512  # returns in parallel: few enough to stay in the processor's cache
PITCH = BLOCK + 8  # from row to row: not a power of two, which would map all rows to one part of the cache
# Rows stand at constant places, so that a compiler sees that they do not overlap: a motion and its derivatives, and what is valid
# as long as its object: a return's derivative, waves, the return and last impact, the flight, gap, bounds, steps, coefficients.
D, D1, D2, D3, D4, D5, BY_PHASE, BY_SPEED, BY_PHASE_1, BY_SPEED_1, SPARE, SPARE_1 = range(0, 12 * PITCH, PITCH)
D00, D01, D10, D11, LESS, SINE, RETURN = range(12 * PITCH, 19 * PITCH, PITCH)
WHICH, TIME, TURNS, V, PHI, ODD, OPEN, FLIGHT = range(18 * PITCH, 26 * PITCH, PITCH)
W, TO_UP, S, X, Y, U, B, J, K, Q = range(25 * PITCH, 35 * PITCH, PITCH)
STEADY, JERK, SNAP, POP, ACCELERATION, DRIFT, MARCHED = range(35 * PITCH, 42 * PITCH, PITCH)
LEAST, BEHIND, AIMED = range(41 * PITCH, 44 * PITCH, PITCH)
STEP, LOW, HIGH, RATE, TERMS = range(43 * PITCH, 48 * PITCH, PITCH)


@inlined
def write_gap(t, k, gap):
    """Write a gap and its time derivatives."""
    t[Y + k], t[U + k], t[B + k], t[J + k], t[K + k], t[Q + k] = gap


@inlined
def read_gap(t, k):
    """The gap that `write_gap` wrote."""
    return t[Y + k], t[U + k], t[B + k], t[J + k], t[K + k], t[Q + k]


@inlined
def motion_of(t, k):
    """Displacement, velocity and further time derivatives that `fly_to` wrote."""
    return t[D + k], t[D1 + k], t[D2 + k], t[D3 + k], t[D4 + k], t[D5 + k]


@inlined
def harmonic(p, m):
    """The row of the cosine minus one of m times the phase, m > 1; its sine is in the next row. They are not preserved."""
    return TERMS + 2 * (int(p.table[SIMPLE]) + m - 2) * PITCH


@inner
def phases(p, t, n):
    """Write sines and cosines of the phases and of their multiples."""
    for k in range(n):
        t[LESS + k], t[SINE + k], _ = wave(t[PHI + k])
    for m in range(2, int(p.table[HARMONICS]) + 1):
        row = harmonic(p, m)
        for k in range(n):
            t[row + k], t[row + PITCH + k], _ = wave(m * t[PHI + k])


@inner
def linear_row(p, t, n, row, z, into):
    """Write a row that is linear in the features, as `linear` of `flow.py`, for all columns."""
    f = p.table
    one, c, s = f[row] + f[row + 1] * z, f[row + 3], f[row + 4]
    of_w = f[row + 2]
    if of_w == 0.0:
        for k in range(n):
            t[into + k] = one + c * (1.0 + t[LESS + k]) + s * t[SINE + k]
    else:
        for k in range(n):
            t[into + k] = one + of_w * t[W + k] + c * (1.0 + t[LESS + k]) + s * t[SINE + k]
    for m in range(2, int(f[HARMONICS]) + 1):
        c, s, less = f[row + 2 * m + 1], f[row + 2 * m + 2], harmonic(p, m)
        for k in range(n):
            t[into + k] += c * (1.0 + t[less + k]) + s * t[less + PITCH + k]


@inner
def phase_row(p, t, n, row, into):
    """Write derivatives by the phase, as `by_phase` of `flow.py`."""
    f = p.table
    c, s = f[row + 3], f[row + 4]
    for k in range(n):
        t[into + k] = s * (1.0 + t[LESS + k]) - c * t[SINE + k]
    for m in range(2, int(f[HARMONICS]) + 1):
        c, s, less = f[row + 2 * m + 1], f[row + 2 * m + 2], harmonic(p, m)
        for k in range(n):
            t[into + k] += m * (s * (1.0 + t[less + k]) - c * t[less + PITCH + k])


@inner
def begin_block(p, t, n, z):
    """Write coefficients and bounds of the flights that start now, as `begin` of `flow.py`, and their first rates to scratch
    rows.
    """
    f = p.table
    width, terms = 3 + 2 * int(f[HARMONICS]), int(f[AT_TERMS])
    phases(p, t, n)
    for order in range(4):
        linear_row(p, t, n, int(f[AT_START]) + order * width, z, D2 + order * PITCH)
    for k in range(n):
        t[STEADY + k] = 0.0
    if f[POWERS] > 0.0:
        linear_row(p, t, n, int(f[AT_POWERS]), z, STEADY)
    for k in range(n):
        t[JERK + k], t[SNAP + k], t[POP + k], t[ACCELERATION + k], t[DRIFT + k] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(int(f[SIMPLE])):
        row, rates = TERMS + 2 * i * PITCH, int(f[AT_RATES]) + 2 * i
        linear_row(p, t, n, terms + 2 * i * width, z, row)
        linear_row(p, t, n, terms + (2 * i + 1) * width, z, row + PITCH)
        rate = math.hypot(f[rates], f[rates + 1])
        cubed = rate**3
        for k in range(n):
            x, y = t[row + k], t[row + PITCH + k]
            drift = math.sqrt(x * x + y * y) * rate
            cube = drift * rate * rate
            t[DRIFT + k] += drift
            t[ACCELERATION + k] += drift * rate
            t[JERK + k], t[SNAP + k], t[POP + k] = t[JERK + k] + cube, t[SNAP + k] + cube * rate, t[POP + k] + cube * cubed
    for k in range(n):
        t[JERK + k], t[SNAP + k], t[POP + k] = t[JERK + k] * OUTWARD, t[SNAP + k] * OUTWARD, t[POP + k] * OUTWARD


@inner
def fly_to(p, t, n):
    """Write the motion of flights at S, as `evaluate` of `flow.py`: rate by rate, and for each rate all columns in parallel."""
    f = p.table
    for k in range(n):
        s, w, x = t[S + k], t[W + k], t[STEADY + k]
        t[D + k], t[D1 + k], t[D2 + k], t[D3 + k], t[D4 + k], t[D5 + k] = s * (w + s * (0.5 * x)), w + s * x, x, 0.0, 0.0, 0.0
    for i in range(int(f[SIMPLE])):
        row, rates = TERMS + 2 * i * PITCH, int(f[AT_RATES]) + 2 * i
        alpha, omega = f[rates], f[rates + 1]
        if alpha == 0.0:
            for k in range(n):
                less, sine, remainder = wave(omega * t[S + k])
                add_motion(t, k, of_wave(omega, t[row + k], t[row + PITCH + k], less, remainder, sine))
        else:
            for k in range(n):
                remainder, other, real, imaginary = remainders(alpha, omega, t[S + k])
                add_motion(t, k, of_rate(alpha, omega, t[row + k], t[row + PITCH + k], remainder, other, real, imaginary))


@inlined
def add_motion(t, k, more):
    """Add the contribution of a rate to a motion."""
    t[D + k], t[D1 + k], t[D2 + k] = t[D + k] + more[0], t[D1 + k] + more[1], t[D2 + k] + more[2]
    t[D3 + k], t[D4 + k], t[D5 + k] = t[D3 + k] + more[3], t[D4 + k] + more[4], t[D5 + k] + more[5]


@inlined
def size_of(t, k, s):
    """A bound on the sum of the absolute values of the terms of a displacement, as in `limits`."""
    part = min(0.5 * s * t[ACCELERATION + k], 2.0 * t[DRIFT + k])
    return s * (abs(t[W + k]) + 0.5 * s * abs(t[STEADY + k]) + part)


@inner
def varies(f, row, width):
    """True if a linear row of the table depends on the velocity or the phase at the start."""
    found = False
    for i in range(row + 2, row + width):
        found = found or f[i] != 0.0
    return found


@inner
def tangents_of_power(p, t, n):
    """Add to `tangents` the part that is quadratic in time."""
    f = p.table
    row = int(f[AT_POWERS])
    y = f[row + 2]
    phase_row(p, t, n, row, SPARE)
    for k in range(n):
        s, x = t[S + k], t[SPARE + k]
        half = s * (s / 2)
        t[BY_PHASE + k], t[BY_SPEED + k] = t[BY_PHASE + k] + x * half, t[BY_SPEED + k] + y * half
        t[BY_PHASE_1 + k], t[BY_SPEED_1 + k] = t[BY_PHASE_1 + k] + x * s, t[BY_SPEED_1 + k] + y * s


@inner
def tangents(p, t, n):
    """Write velocity and acceleration at S + STEP, the new S, and the derivatives by phase and velocity of the start.

    As `evaluate` and `tangent_at` of `flow.py`. The rows of the phase hold since the start of the flight, those of its
    multiples do not.
    """
    f = p.table
    width, terms = 3 + 2 * int(f[HARMONICS]), int(f[AT_TERMS])
    if f[HARMONICS] > 1.0:
        phases(p, t, n)
    for k in range(n):
        s, x = t[S + k] + t[STEP + k], t[STEADY + k]
        t[S + k], t[STEP + k], t[D1 + k], t[D2 + k] = s, 0.0, t[W + k] + s * x, x
        t[BY_PHASE + k], t[BY_SPEED + k], t[BY_PHASE_1 + k], t[BY_SPEED_1 + k] = 0.0, s, 0.0, 1.0
    if f[POWERS] > 0.0 and varies(f, int(f[AT_POWERS]), width):
        tangents_of_power(p, t, n)
    for i in range(int(f[SIMPLE])):
        one, two, row = terms + 2 * i * width, terms + (2 * i + 1) * width, TERMS + 2 * i * PITCH
        alpha, omega, x_w, y_w = f[int(f[AT_RATES]) + 2 * i], f[int(f[AT_RATES]) + 2 * i + 1], f[one + 2], f[two + 2]
        phase_row(p, t, n, one, SPARE)
        phase_row(p, t, n, two, SPARE_1)
        if alpha == 0.0:
            for k in range(n):
                remainder, sine, other = wave(omega * t[S + k])
                add_tangent(t, k, of_wave(omega, t[row + k], t[row + PITCH + k], remainder, other, sine))
                x, y = t[SPARE + k], t[SPARE_1 + k]
                t[BY_PHASE + k], t[BY_SPEED + k] = (
                    t[BY_PHASE + k] + (x * remainder + y * other),
                    t[BY_SPEED + k] + (x_w * remainder + y_w * other),
                )
                t[BY_PHASE_1 + k] += omega * y * remainder + -omega * x * sine
                t[BY_SPEED_1 + k] += omega * y_w * remainder + -omega * x_w * sine
        else:
            for k in range(n):
                remainder, other, real, imaginary = remainders(alpha, omega, t[S + k])
                add_tangent(t, k, of_rate(alpha, omega, t[row + k], t[row + PITCH + k], remainder, other, real, imaginary))
                x, y = t[SPARE + k], t[SPARE_1 + k]
                t[BY_PHASE + k], t[BY_SPEED + k] = (
                    t[BY_PHASE + k] + (x * remainder + y * other),
                    t[BY_SPEED + k] + (x_w * remainder + y_w * other),
                )
                t[BY_PHASE_1 + k] += (alpha * x + omega * y) * real + (alpha * y - omega * x) * imaginary
                t[BY_SPEED_1 + k] += (alpha * x_w + omega * y_w) * real + (alpha * y_w - omega * x_w) * imaginary


@inlined
def add_tangent(t, k, more):
    """Add the contribution of a rate to velocity and acceleration."""
    t[D1 + k], t[D2 + k] = t[D1 + k] + more[1], t[D2 + k] + more[2]


@inner
def to_front(p, t, n, first, last, steps):
    """Move open columns to the front, in the rows from first to last; returns their number.

    If `steps` is not zero, the rows of steps from there on and those of the coefficients are moved too.
    """
    k, m = 0, n
    end = TERMS + 2 * int(p.table[SIMPLE]) * PITCH if steps > 0 else 0
    while True:
        while k < m and t[OPEN + k] > 0.0:
            k += 1
        while k < m and not t[OPEN + m - 1] > 0.0:
            m -= 1
        if k >= m:
            return m
        m -= 1
        for row in range(first, last, PITCH):
            t[row + k], t[row + m] = t[row + m], t[row + k]
        for row in range(steps, end, PITCH):
            t[row + k], t[row + m] = t[row + m], t[row + k]
        k += 1


@inner
def give_up(t, n):
    """Leave columns to `first_return`."""
    for k in range(n):
        t[ODD + k] = 1.0


@inner
def leave_wall(p, t, n, up, into):
    """The velocities just after impacts of speeds V."""
    law = 1 if up else 0
    if p.table[LAW + law] == 0.0:
        r = p.table[RESTITUTION + law]
        for k in range(n):
            t[W + k] = -into * (r * t[V + k])
    else:
        for k in range(n):
            t[W + k] = -into * rebound(p, up, t[V + k])[0]


@inner
def slopes(p, t, n, up):
    """Write the derivatives of the impact law at speeds V."""
    law = 1 if up else 0
    if p.table[LAW + law] == 0.0:
        r = p.table[RESTITUTION + law]
        for k in range(n):
            t[D3 + k] = r
    else:
        for k in range(n):
            t[D3 + k] = rebound(p, up, t[V + k])[1]


@inner
def fill(p, t, n, first, start, want):
    """Fill the table with n states, from number `first` on; with their derivatives if `want`."""
    for k in range(n):
        v, phi = start[first + k, 0], start[first + k, 1]
        t[WHICH + k], t[TIME + k], t[V + k] = first + k, 0.0, v
        t[PHI + k], t[TURNS + k] = turned(p, phi, 0.0)
        t[ODD + k] = 0.0 if is_state(v, phi) else 1.0
    if want:
        for k in range(n):
            t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k] = 1.0, 0.0, 0.0, 1.0
