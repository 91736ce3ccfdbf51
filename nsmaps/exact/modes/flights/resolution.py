"""Whether the Taylor series of a step is the flight: its rates against the equations of motion.

They are compared at the end of the step. A series at one place shows all of a polynomial, a sine or a cosine, but nothing of a
steep part that is flat there, as tanh(v/eps), sqrt(v**2 + eps**2) or the well exp(-(x/eps)**2). With such functions the
comparison is made at instants of the step too, and between them the arguments may change by no more than the length over which a
function changes.
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_reset
from nsmaps.exact.modes.flights.laws import (
    ARGUMENT,
    VALUE,
    WEIGHTS,
    part_place,
    rate_place,
    size_column,
    size_place,
    slope_column,
    slope_place,
)
from nsmaps.exact.modes.tables.memory import INTERVALS, ONLY
from nsmaps.exact.modes.tables.taylor import DEGREE
from nsmaps.exact.taylor.kinds import ARCS, EDGE, EDGES, ERF, EXP, NO_KIND, ORIGIN, TANH

RESIDUAL = 1e-12  # of a rate's terms that a series may leave, and of what its truncation leaves
TRUNCATION = 1e-13  # of a state, a step
ROUNDING = 32 * 2.0**-53  # of states and phase, by which a rate may change
LEAST = 1e-290  # of a value, with a margin: smaller ones have fewer digits, as tails of exp
BEND = 8.0  # divisor of the second difference of three instants: how far a parabola is from its chord
START, HALF = 0, INTERVALS // 2  # numbers of the instants at the start and in the middle of a step
NEAR = 1.0  # radians of phase, in which half a step shows what depends on it
NEGLIGIBLE = 1e-15  # of the terms of a rate or of a function that is watched


@inner
def change_of(kind, low, high):
    """How much a function changes while its argument passes from low to high, if it may be flat."""
    if kind == EXP:
        return math.exp(high) - math.exp(low)
    if kind == TANH:
        return math.tanh(high) - math.tanh(low)
    if kind == ERF:
        return math.erf(high) - math.erf(low)
    return math.inf


@inner
def scale_between(kind, low, high):
    """The length of an argument between low and high over which a function of this kind changes: to its nearest singularity."""
    nearest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    if kind == ORIGIN:
        return nearest
    if kind == ARCS:
        return math.sqrt(1.0 + nearest * nearest)
    if kind == EDGES:
        return 1.0 - max(abs(low), abs(high))
    if kind == EDGE:
        return low - 1.0
    return 1.0


@inner
def compare_rates(p, mode, h, i, w):
    """Write what the law of the rates gives at an instant of a step, and how far it is from the rates of the series."""
    q, own, tau = w.piece, p.own, i / INTERVALS
    if i % HALF != 0:
        for j in range(own):
            value, rate = q.local[j, DEGREE], 0.0
            for k in range(DEGREE - 1, -1, -1):
                rate = rate * tau + value
                value = value * tau + q.local[j, k]
            q.states[i, j], q.speeds[i, j] = value, rate
    write_law(p, mode, q.phase[ONLY] + p.rate * h * tau, i, w)
    for j in range(own):
        q.misfits[i, j] = abs(q.inside[i, rate_place(p, j)] - q.speeds[i, j] / h)


@inner
def write_law(p, mode, phase, i, w):
    """Write what the law of the rates gives at an instant of a step, of which the states are known."""
    q = w.piece
    call_reset(p.rates[mode], phase, q.states[i].ctypes.data, p.parameters.ctypes.data, q.inside[i].ctypes.data)


@inner
def is_watched(p, mode, i):
    """Whether a function of a mode depends on a derived state; others are only computed at the ends of pieces."""
    total, following = 0.0, mode + 1
    for f in range(p.watched[mode], p.watched[following]):
        total += abs(p.functions[f, i])
    return total > 0.0


@inner
def fits_derived_states(p, mode, h, w):
    """Whether the series of derived states watched are their formulas at the end of the step, where own states are known."""
    q, own = w.piece, p.own
    if len(p.nonlinear) == 0 or p.derived == 0:
        return True
    phase, end = q.phase[ONLY] + p.rate * h, q.states[INTERVALS]
    call_reset(p.derived, phase, end.ctypes.data, p.parameters.ctypes.data, q.derived.ctypes.data)
    fit = True
    for r in range(len(q.derived)):
        value, noise = q.states[INTERVALS, own + r], abs(q.derived[r, slope_column(own)]) * (abs(q.phase[ONLY]) + p.rate * h)
        for j in range(own):
            noise += abs(q.derived[r, slope_column(j)]) * q.spans[j]
        size = q.derived[r, size_column(p)] + q.spans[own + r]
        near = abs(value - q.derived[r, VALUE]) <= RESIDUAL * size + ROUNDING * noise + LEAST
        fit = fit and (near or not is_watched(p, mode, own + r))
    call_reset(p.derived, q.phase[ONLY], w.z.ctypes.data, p.parameters.ctypes.data, q.derived.ctypes.data)
    return fit


@inner
def fits_rate(p, a, instants, h, w):
    """Whether the rate of an own state is that of its series, at some instants of the step."""
    q, own = w.piece, p.own
    size, truncation = 0.0, TRUNCATION * q.spans[a] / h
    for i in instants:
        size = max(size, q.inside[i, size_place(p, a)])
    for i in instants:
        if q.misfits[i, a] <= RESIDUAL * size + truncation:
            continue
        noise = abs(q.inside[i, slope_place(p, a, own)]) * (abs(q.phase[ONLY]) + p.rate * h)
        for j in range(own):
            noise += abs(q.inside[i, slope_place(p, a, j)]) * q.spans[j]
        if not q.misfits[i, a] <= RESIDUAL * size + truncation + ROUNDING * noise:
            return False
    return True


@inner
def second_difference(u, first, pitch, c):
    """The size of the second difference of a column at three rows with a pitch, from a first on."""
    middle, last = first + pitch, first + 2 * pitch
    return abs(u[first, c] - 2.0 * u[middle, c] + u[last, c])


@inner
def shows_part(p, k, kind, pitch, h, w):
    """Whether a function with flat parts, number k, changes between instants with a pitch by no more than it shows there."""
    q, own = w.piece, p.own
    u, c, weights = q.inside, part_place(p, k) + ARGUMENT, part_place(p, k) + WEIGHTS
    for i in range(0, INTERVALS, pitch):
        end, last = i + pitch, INTERVALS - 2 * pitch
        bend = max(second_difference(u, max(i - pitch, 0), pitch, c), second_difference(u, min(i, last), pitch, c)) / BEND
        low, high = min(u[i, c], u[end, c]) - bend, max(u[i, c], u[end, c]) + bend
        if not high - low <= scale_between(kind, low, high):
            if pitch > 1:
                return False
            change = change_of(kind, low, high)
            for a in range(own):
                weight = max(abs(u[i, weights + a]), abs(u[end, weights + a]))
                size = max(u[i, size_place(p, a)], u[end, size_place(p, a)]) + q.spans[a] / h
                if weight > 0.0 and not weight * change <= NEGLIGIBLE * size:
                    return False
            share = max(u[i, weights + own], u[end, weights + own])
            if share > 0.0 and not share * change <= NEGLIGIBLE:
                return False
    return True


@inner
def flat_parts(p, mode):
    """The number of functions with flat parts in a mode."""
    count = 0
    while count < p.kinds.shape[1] and p.kinds[mode, count] != NO_KIND:
        count += 1
    return count


@inner
def fits(p, mode, h, instants, w):
    """Whether rates of own states and derived states are those of their series, at some instants up to the end of the step."""
    for i in instants:
        compare_rates(p, mode, h, i, w)
    fit = fits_derived_states(p, mode, h, w)
    for a in range(p.own):
        fit = fit and fits_rate(p, a, instants, h, w)
    return fit


@inner
def is_resolved(p, mode, h, w):
    """Whether the series of a piece is the flight over its step h.

    With functions that may be flat, the middle and the ends are looked at first, if they are near enough to show what depends on
    the phase, and all instants where an argument changes between these by more than the function shows.
    """
    parts = flat_parts(p, mode)
    if parts == 0:
        return fits(p, mode, h, range(INTERVALS, INTERVALS + 1, 1), w)
    pitch = HALF if p.rate * h <= NEAR else 1
    while fits(p, mode, h, range(0, INTERVALS + 1, pitch), w):
        shown = True
        for k in range(parts):
            shown = shown and shows_part(p, k, p.kinds[mode, k], pitch, h, w)
        if shown or pitch == 1:
            return shown
        pitch = 1
    return False
