"""Pieces of a Taylor flight: one step of heyoka each, at whose start the series of all features are known to rounding.

heyoka: F. Biscani and D. Izzo, MNRAS 504 (2021) 2614. Steps are chosen by the last two terms of a series, as by A. Jorba and M.
Zou, Experimental Mathematics 14 (2005) 99, section 3.2, but for each row by itself. Times `tau` and `x` within a piece are in
units of its length, other quantities in the units of the system, phases in radians.
"""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import fused, inner
from nsmaps.exact.engine.law import call_step
from nsmaps.exact.modes.flights.laws import size_column
from nsmaps.exact.modes.flights.resolution import HALF, START, is_resolved, is_watched
from nsmaps.exact.modes.tables.memory import INTERVALS, ONLY
from nsmaps.exact.modes.tables.taylor import DEGREE, TERMS

UNIT_EXPONENT = -53.0  # log2 of the unit of rounding
LOG_2 = math.log(2.0)
FRACTION, BIAS, ALL_BUT_SIGN = 2.0**-52, 1023.0, 2**63 - 1  # of a float's bits: unit of the fraction, of the exponent; a mask
CONSTANT, LINEAR, SQUARE = 0, 1, 2  # terms of a series
PHASE = 0  # place in `Piece.settings`
LEADING = 5  # first terms of a series with whose sizes the last ones are compared
FAINT_EXPONENT = math.log2(1e-13)  # of its leading terms: what the last ones of a derivative may be
TURNED = 1.3  # radians over which the series of a wave is exact to rounding, (UNIT 20!)^(1/20)
HUGE = 1e10  # of a state: its power DEGREE + 1, as of the last terms, is near the end of the range of floats
LAST_BUT_ONE = DEGREE - 1  # term of a series
HALVES = 0.5 ** np.arange(DEGREE + 1)  # powers of one half
PARTS = 1.0 / np.maximum(np.arange(DEGREE + 1), 1)  # of one, by whole numbers
RATES = 1.0 * np.arange(DEGREE + 1)  # factors of the terms of a derivative at the end of a step
HALF_RATES = 2.0 * RATES * HALVES  # the same, in its middle
MOST_HALVINGS = 60  # of a step whose series is not the flight


@inner
def expand(step, count, state, series, w):
    """Write the series in time that heyoka's step at an address has of a state, with the first features in memory, so many."""
    q = w.piece
    for j in range(count):
        state[j] = w.z[j]
    q.settings[PHASE], q.time[ONLY], q.halt[ONLY] = q.phase[ONLY], 0.0, 0.0
    call_step(step, state.ctypes.data, q.settings.ctypes.data, q.time.ctypes.data, q.halt.ctypes.data, series.ctypes.data)


@inner
def exponent_of(x):
    """log2 of a size, too small by at most 0.09: the exponent of a float, and its fraction for the logarithm of that."""
    return (np.float64(x).view(np.int64) & ALL_BUT_SIGN) * FRACTION - BIAS


@inner
def exact_exponent(series, first, share, max_exponent):
    """log2, at most `max_exponent`, of the longest step over which series (rows, DEGREE + 1) from a row on are exact but a share.

    The last two terms of each are at most that share, given by its log2, of the largest of its first terms, whatever the units
    and the origin.
    """
    for i in range(first, len(series)):
        max_exponent = row_exponent(series[i], share, max_exponent)
    return max_exponent


@inner
def row_exponent(row, share, max_exponent):
    """As `exact_exponent`, of one row."""
    size = -math.inf
    for j in range(LEADING):
        size = max(size, exponent_of(row[j]) + j * max_exponent)
    for m in range(LAST_BUT_ONE, DEGREE + 1):
        tail = exponent_of(row[m])
        if row[m] != 0.0 and not tail + m * max_exponent <= share + size:
            max_exponent = min(max_exponent, term_exponent(row, m, share - tail))
    return max_exponent


@inner
def term_exponent(row, m, share):
    """log2 of the step at which the term m is the largest of the first ones, as a series of its share in its own size."""
    largest = -math.inf
    for j in range(LEADING):
        if row[j] != 0.0:
            largest = max(largest, (share + exponent_of(row[j])) * PARTS[m - j])
    first = LEADING
    while largest == -math.inf and first < LAST_BUT_ONE:
        largest = (share + exponent_of(row[first])) * PARTS[m - first] if row[first] != 0.0 else largest
        first += 1
    return largest


class Sums(NamedTuple):
    """Sums of the terms of a series behind the first."""

    half: float  #: in the middle of the step
    half_rate: float  #: the same, of its derivative
    end: float  #: at the end of the step
    end_rate: float
    span: float  #: of sizes


@fused
def localize_row(series, powers, local):
    """Write a series in units of a step, of which there are the powers: `Sums`, small terms first."""
    half, half_rate, end, end_rate, span = 0.0, 0.0, 0.0, 0.0, 0.0
    local[CONSTANT] = series[CONSTANT]
    for k in range(DEGREE, CONSTANT, -1):
        term = series[k] * powers[k]
        local[k] = term
        half += HALVES[k] * term
        half_rate += HALF_RATES[k] * term
        end += term
        end_rate += RATES[k] * term
        span += abs(term)
    return Sums(half, half_rate, end, end_rate, span)


@inner
def localize(p, h, w):
    """Write the series of all features in units of a step, and states and their rates in the middle and at its ends."""
    q, n, square, even, odd = w.piece, len(w.piece.state), h * h, 1.0, h
    for k in range(0, DEGREE + 1, 2):
        following = k + 1
        w.powers[k], w.powers[following] = even, odd
        even, odd = even * square, odd * square
    for j in range(n):
        row = localize_row(q.series[j], w.powers, q.local[j])
        first = q.series[j, CONSTANT]
        q.states[START, j], q.states[HALF, j], q.states[INTERVALS, j] = first, first + row.half, first + row.end
        q.speeds[START, j], q.speeds[HALF, j], q.speeds[INTERVALS, j] = q.local[j, LINEAR], row.half_rate, row.end_rate
        q.spans[j], q.tails[j] = abs(first) + row.span, abs(q.local[j, DEGREE]) + abs(q.local[j, LAST_BUT_ONE])
    q.local[n, CONSTANT], q.spans[n] = 1.0, 1.0
    for m in range(1, (len(w.z) - n - 1) // 2 + 1):
        localize_wave(m * p.rate * h, n + 2 * m - 1, w)
    for r in range(len(q.derived)):
        q.spans[p.own + r] = max(q.spans[p.own + r], q.derived[r, size_column(p)])


@inner
def localize_wave(turn, cosine, w):
    """Write the series of the cosine of a phase that changes by this turn over the step, and in the next row of its sine."""
    q, sine = w.piece, cosine + 1
    q.local[cosine, CONSTANT], q.local[sine, CONSTANT] = w.z[cosine], w.z[sine]
    for k in range(DEGREE):
        share, following = turn / (k + 1), k + 1
        q.local[cosine, following], q.local[sine, following] = -share * q.local[sine, k], share * q.local[cosine, k]
    for j in range(cosine, sine + 1):
        q.spans[j], q.tails[j] = 0.0, abs(q.local[j, DEGREE]) + abs(q.local[j, LAST_BUT_ONE])
        for k in range(DEGREE + 1):
            q.spans[j] += abs(q.local[j, k])


@inner
def take_step(p, mode, max_length, w):
    """Begin a piece of a Taylor flight at the features in memory: its length; zero where no Taylor series is the flight."""
    q, derivatives, program = w.piece, w.dz.shape[1] > 0, 1 if w.moved.here else 0
    if derivatives:
        expand(p.variations[program, mode], p.own, q.varied, q.variations, w)
    if not derivatives or len(q.derived) > 0:  # else the series are the first rows of the derivatives'
        expand(p.taylor[mode], len(q.state), q.state, q.series, w)
    waves = (len(w.z) - len(w.piece.state) - 1) // 2
    h = min(max_length, TURNED / (waves * p.rate)) if waves > 0 else max_length
    h = min(h, TWO_PI / p.rate) if p.rate > 0.0 else h
    exponent = exponent_of(h) + 1.0
    for i in range(len(w.piece.series)):
        if i < p.own or is_watched(p, mode, i):
            exponent = row_exponent(w.piece.series[i], UNIT_EXPONENT, exponent)
    h = min(h, math.exp(LOG_2 * exact_exponent(w.piece.variations, p.own, FAINT_EXPONENT, exponent)))
    for _ in range(MOST_HALVINGS):
        if not h > 0.0:
            break
        localize(p, h, w)
        if is_resolved(p, mode, h, w):
            w.piece.length[ONLY] = h
            return h
        h *= 0.5
    return 0.0


@inner
def runs_away(p, w):
    """Whether a flight leaves the range of floats: the last terms of its series do, the first ones of own states do not."""
    first, last, largest = 0.0, 0.0, 0.0
    for i in range(len(w.piece.series)):
        largest = max(largest, abs(w.piece.series[i, CONSTANT]))
        first += abs(w.piece.series[i, LINEAR]) + abs(w.piece.series[i, SQUARE]) if i < p.own else 0.0
        last += abs(w.piece.series[i, DEGREE])
    return first < math.inf and not last < math.inf and largest > HUGE


@fused
def value_at(row, tau):
    """A series at a share of a step."""
    total = row[DEGREE]
    for k in range(DEGREE - 1, -1, -1):
        total = total * tau + row[k]
    return total


@inner
def expand_slopes(p, s, w):
    """Write how own states a time s after the start of the piece change with the start."""
    q, width = w.piece, w.piece.flow.shape[1]
    for i in range(p.own):
        for c in range(width):
            q.flow[i, c] = value_at(q.variations[p.own + i * width + c], s)


@inner
def slope(p, i, c, w):
    """The derivative of an own state along a direction, where `expand_slopes` has written those by the start of the piece."""
    q, own, along = w.piece, p.own, w.piece.flow.shape[1] - 1
    total = (q.flow[i, own] * w.dphi[c] if p.rate > 0.0 else 0.0) + (q.flow[i, along] if w.moved.here else 0.0)
    for j in range(own):
        total += q.flow[i, j] * w.dz[j, c]
    return total


@inner
def advance_states(p, tau, w):
    """Change own states, and their derivatives, to those at a share of the piece."""
    if w.dz.shape[1] > 0:
        expand_slopes(p, tau * w.piece.length[ONLY], w)
        for i in range(p.own):
            for c in range(w.dz.shape[1]):
                w.slopes[i, c] = slope(p, i, c, w)
    for i in range(p.own):
        w.z[i] = w.piece.states[INTERVALS, i] if tau == 1.0 else value_at(w.piece.local[i], tau)
        for c in range(w.dz.shape[1]):
            w.dz[i, c] = w.slopes[i, c]


@inner
def sizes_of(p, f, w):
    """Of a function over the piece: a bound on the sum of the sizes of its terms, and on what its series leaves out."""
    row, size, left = p.functions[f], 0.0, 0.0
    for j in range(len(w.z)):
        size += abs(row[j]) * w.piece.spans[j]
        left += abs(row[j]) * w.piece.tails[j]
    return size, left


@inner
def term_of(p, f, k, w):
    """One term of the series of a function over the piece."""
    row, total = p.functions[f], 0.0
    for j in range(len(w.z)):
        total += row[j] * w.piece.local[j, k]
    return total


@inner
def combine(p, f, w):
    """Write the series of a function over the piece."""
    row = p.functions[f]
    for k in range(TERMS):
        w.a[k] = 0.0
    for j in range(len(w.z)):
        if row[j] != 0.0:
            for k in range(DEGREE + 1):
                w.a[k] += row[j] * w.piece.local[j, k]


@inner
def bend_bound(a):
    """A bound on the second derivative of a series over the piece."""
    total = 0.0
    for k in range(2, DEGREE + 1):
        total += k * (k - 1.0) * abs(a[k])
    return total
