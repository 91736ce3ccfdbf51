"""Pieces of a Taylor flight: one step of heyoka each, at whose start the series of all features are known to rounding.

heyoka: F. Biscani and D. Izzo, MNRAS 504 (2021) 2614. Steps are chosen by the last two terms of a series, as by A. Jorba and M.
Zou, Experimental Mathematics 14 (2005) 99, section 3.2, but for each row by itself. Times `tau` and `x` within a piece are in
units of its length, other quantities in the units of the system, phases in radians.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_step
from nsmaps.exact.modes.flights.laws import size_column
from nsmaps.exact.modes.flights.resolution import is_resolved, is_watched
from nsmaps.exact.modes.tables.memory import ONLY
from nsmaps.exact.modes.tables.taylor import DEGREE, TERMS

UNIT = 2.0**-53
CONSTANT, LINEAR, SQUARE = 0, 1, 2  # terms of a series
PHASE = 0  # place in `Piece.settings`
LEADING = 5  # first terms of a series with whose sizes the last ones are compared
FAINT = 1e-13  # of its leading terms: what the last ones of a derivative may be
TURNED = 1.3  # radians over which the series of a wave is exact to rounding, (UNIT 20!)^(1/20)
HUGE = 1e10  # of a state: its power DEGREE + 1, as of the last terms, is near the end of the range of floats
LAST_BUT_ONE = DEGREE - 1  # term of a series
MOST_HALVINGS = 60  # of a step whose series is not the flight


@inner
def expand(p, mode, w):
    """Write the series of own and derived states in time, from the features in memory."""
    q = w.piece
    for j in range(len(q.state)):
        q.state[j] = w.z[j]
    q.settings[PHASE], q.time[ONLY], q.halt[ONLY] = q.phase[ONLY], 0.0, 0.0
    call_step(
        p.taylor[mode], q.state.ctypes.data, q.settings.ctypes.data, q.time.ctypes.data, q.halt.ctypes.data, q.series.ctypes.data
    )


@inner
def vary(p, mode, w):
    """Write the series of the derivatives of own states by their start, the phase and the parameters along a direction."""
    q, program = w.piece, 1 if w.moved.here else 0
    for j in range(p.own):
        q.varied[j] = w.z[j]
    q.settings[PHASE], q.time[ONLY], q.halt[ONLY] = q.phase[ONLY], 0.0, 0.0
    call_step(
        p.variations[program, mode],
        q.varied.ctypes.data,
        q.settings.ctypes.data,
        q.time.ctypes.data,
        q.halt.ctypes.data,
        q.variations.ctypes.data,
    )


@inner
def exact_length(series, first, share, max_length):
    """The longest step, at most `max_length`, over which series (rows, DEGREE + 1), from a row on, are exact but for a share.

    The last two terms of each are at most that share of the largest of its first terms, whatever the units and the origin.
    """
    h = max_length
    for i in range(first, len(series)):
        h = row_length(series, i, share, h)
    return h


@inner
def row_length(series, i, share, max_length):
    """As `exact_length`, of one row."""
    h = max_length
    for m in range(DEGREE - 1, DEGREE + 1):
        tail = abs(series[i, m])
        if tail > 0.0:
            size, power = 0.0, 1.0
            for j in range(LEADING):
                size, power = max(size, abs(series[i, j]) * power), power * h
            if not tail * h**m <= share * size:
                h = min(h, length_by(series[i], m, tail, share))
    return h


@inner
def length_by(row, m, tail, share):
    """The longest step at which the term m of a series, of this size, is a share of the largest of its first terms."""
    part, log_length = math.log(share / tail), -math.inf
    for j in range(DEGREE - 1):
        if abs(row[j]) > 0.0 and (j < LEADING or log_length == -math.inf):
            log_length = max(log_length, (part + math.log(abs(row[j]))) / (m - j))
    return math.exp(log_length)


@inner
def localize(p, h, w):
    """Write the series of all features in units of a step."""
    q, n = w.piece, len(w.piece.state)
    for j in range(n):
        power = 1.0
        for k in range(DEGREE + 1):
            q.local[j, k], power = q.series[j, k] * power, power * h
    q.local[n, CONSTANT] = 1.0
    for m in range(1, (len(w.z) - n - 1) // 2 + 1):
        c, s, turn = n + 2 * m - 1, n + 2 * m, m * p.rate * h
        q.local[c, CONSTANT], q.local[s, CONSTANT] = w.z[c], w.z[s]
        for k in range(DEGREE):
            share, following = turn / (k + 1), k + 1
            q.local[c, following], q.local[s, following] = -share * q.local[s, k], share * q.local[c, k]
    for j in range(len(w.z)):
        span = 0.0
        for k in range(DEGREE + 1):
            span += abs(q.local[j, k])
        q.spans[j], q.tails[j] = span, abs(q.local[j, DEGREE]) + abs(q.local[j, LAST_BUT_ONE])
    for r in range(len(q.derived)):
        q.spans[p.own + r] = max(q.spans[p.own + r], q.derived[r, size_column(p)])


@inner
def take_step(p, mode, max_length, w):
    """Begin a piece of a Taylor flight at the features in memory: its length; zero where no Taylor series is the flight."""
    derivatives = w.dz.shape[1] > 0
    if derivatives:
        vary(p, mode, w)
    if derivatives and len(w.piece.derived) == 0:
        for i in range(p.own):
            for k in range(DEGREE + 1):
                w.piece.series[i, k] = w.piece.variations[i, k]
    else:
        expand(p, mode, w)
    waves = (len(w.z) - len(w.piece.state) - 1) // 2
    h = min(max_length, TURNED / (waves * p.rate)) if waves > 0 else max_length
    h = min(h, TWO_PI / p.rate) if p.rate > 0.0 else h
    for i in range(len(w.piece.series)):
        if i < p.own or is_watched(p, mode, i):
            h = row_length(w.piece.series, i, UNIT, h)
    if derivatives:
        h = exact_length(w.piece.variations, p.own, FAINT, h)
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


@inner
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
        w.z[i] = value_at(w.piece.local[i], tau)
        for c in range(w.dz.shape[1]):
            w.dz[i, c] = w.slopes[i, c]


@inner
def combine(p, f, w):
    """Write the series of a function over the piece: the sizes of its terms, and a bound on what is left out."""
    row, size, left = p.functions[f], 0.0, 0.0
    for k in range(TERMS):
        w.a[k] = 0.0
    for j in range(len(w.z)):
        if row[j] != 0.0:
            for k in range(DEGREE + 1):
                w.a[k] += row[j] * w.piece.local[j, k]
            size += abs(row[j]) * w.piece.spans[j]
            left += abs(row[j]) * w.piece.tails[j]
    return size, left


@inner
def bend_bound(a):
    """A bound on the second derivative of a series over the piece."""
    total = 0.0
    for k in range(2, DEGREE + 1):
        total += k * (k - 1.0) * abs(a[k])
    return total
