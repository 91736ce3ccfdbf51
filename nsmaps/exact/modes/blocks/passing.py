"""A block of motions at their starts and through events, in loops that become vector instructions.

This holds for *plain* transitions: without contact or a reset by another formula, in systems without sliding. Arithmetic and
decisions are those of `section.py` and `returns.py`.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.engine.flight.remainders import wave
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.lanes import BEND, EVENT, KIND, PHI, RATE, SHIFT, THERE, UNSURE, WHICH, U, X, Y
from nsmaps.exact.modes.tables.taylor import ROUNDING

NONE = -1  # in place of a transition: none takes place
NOT_PLAIN = -2  # in place of a transition: to be decided for the motion by itself


@inner
def waved(p, n, b):
    """Write 1 and the waves of the phases of columns behind their states."""
    t, states = b.t, p.first.shape[1] - 1
    for m in range(1, (len(b.z) - states - 1) // 2 + 1):
        for k in range(n):
            less, sine, _ = wave(m * t[PHI + k])
            b.z[states + 2 * m - 1, k], b.z[states + 2 * m, k] = 1.0 + less, sine


@inner
def weighed_rows(row, z, n, t):
    """Write to Y the sum of rows of z in n columns, each times a weight, and to U the sum of the terms' sizes."""
    for k in range(n):
        t[Y + k], t[U + k] = 0.0, 0.0
    for j in range(len(z)):
        c = row[j]
        if c == 0.0:
            continue
        for k in range(n):
            term = c * z[j, k]
            t[Y + k] += term
            t[U + k] += abs(term)


@inner
def summed_rows(row, z, n, t):
    """As `weighed_rows`, without the sizes."""
    for k in range(n):
        t[Y + k] = 0.0
    for j in range(len(z)):
        c = row[j]
        if c == 0.0:
            continue
        for k in range(n):
            t[Y + k] += c * z[j, k]


@inner
def permitted(p, e, z, n, t):
    """Write to THERE where the conditions of a transition hold, and to UNSURE where one is zero but for rounding."""
    for k in range(n):
        t[THERE + k], t[UNSURE + k] = 1.0, 0.0
    for c in range(p.conditions[e], p.conditions[e + 1]):
        weighed_rows(p.where[c], z, n, t)
        for k in range(n):
            t[THERE + k] = t[THERE + k] if t[Y + k] >= 0.0 else 0.0
            t[UNSURE + k] = 1.0 if abs(t[Y + k]) <= ROUNDING * t[U + k] else t[UNSURE + k]


@inner
def chosen(p, mode, n, b):
    """Write to EVENT the transitions that take place where functions are zero, and to SHIFT whether they are doubtful."""
    t, h = b.t, b.h
    for k in range(n):
        h[EVENT + k], t[SHIFT + k] = NOT_PLAIN, 0.0
    for f in range(p.watched[mode], p.watched[mode + 1]):
        if not p.plain[f]:
            continue
        for k in range(n):
            h[EVENT + k] = NONE if h[WHICH + k] == f else h[EVENT + k]
        for c in range(p.choices[f + 1] - p.choices[f]):
            e = p.chosen[p.choices[f + 1] - 1 - c]
            permitted(p, e, b.z, n, t)
            for k in range(n):
                here, holds = h[WHICH + k] == f, t[THERE + k] > 0.0
                later = 0.0 if holds else t[SHIFT + k]
                t[SHIFT + k] = max(later, t[UNSURE + k]) if here else t[SHIFT + k]
                h[EVENT + k] = e if here & holds else h[EVENT + k]


@inner
def reset_columns(p, e, n, b):
    """Write the states just after a transition to the columns that it takes place in."""
    t, h, states = b.t, b.h, p.first.shape[1] - 1
    if not p.moves[e]:
        return
    for i in range(states):
        if p.jumps[e, i]:
            summed_rows(p.resets[e, i], b.z, n, t)
            for k in range(n):
                b.new[i, k] = t[Y + k] if h[EVENT + k] == e else b.z[i, k]
    for i in range(states):
        if p.jumps[e, i]:
            for k in range(n):
                b.z[i, k] = b.new[i, k]


@inner
def jumped(p, mode, n, b):
    """Take columns through plain events; their states before are in `c`, and the sums of sizes in X."""
    t = b.t
    for k in range(n):
        t[X + k] = 0.0
    for j in range(len(b.z)):
        for k in range(n):
            t[X + k] += abs(b.z[j, k])
            b.c[j, k] = b.z[j, k]
    chosen(p, mode, n, b)
    for f in range(p.watched[mode], p.watched[mode + 1]):
        for c in range(p.choices[f], p.choices[f + 1] if p.plain[f] else p.choices[f]):
            reset_columns(p, p.chosen[c], n, b)


@inner
def rising(p, e, n, b):
    """Mark the columns of a transition that cannot have come to the zero of its function, which rises there.

    Those whose function falls so slowly that its events may accumulate are marked too.
    """
    t, h, mode, function, states = b.t, b.h, p.mode[e], p.functions[p.function[e]], p.first.shape[1] - 1
    turn = p.rate * p.steps[mode]
    for k in range(n):
        t[RATE + k], t[BEND + k] = 0.0, 0.0
    for i in range(len(b.z)):
        c = function[i]
        if c == 0.0 or i == states:
            continue
        for k in range(n):
            t[Y + k] = 0.0
        if i < states:
            for j in range(p.first[mode, i], p.first[mode, i + 1]):
                value, column = p.values[j], p.columns[j]
                for k in range(n):
                    t[Y + k] += value * b.z[column, k]
        else:
            m, even = (i - states + 1) // 2, (i - states) % 2 == 0
            value, column = (m * turn, i - 1) if even else (-m * turn, i + 1)
            for k in range(n):
                t[Y + k] = value * b.z[column, k]
        for k in range(n):
            t[RATE + k] += c * t[Y + k]
            t[BEND + k] += abs(c * t[Y + k])
    for k in range(n):
        h[KIND + k] = 1 if (h[EVENT + k] == e) & (t[RATE + k] > ROUNDING * t[BEND + k]) else h[KIND + k]
    if p.bounces[e] < 0:
        return
    for k in range(n):
        t[X + k] = 0.0
    for j in range(len(b.z)):
        bend = 10.0 * SUMMED_SPEED * p.bends[p.bounces[e], j]
        for k in range(n):
            t[X + k] += bend * abs(b.z[j, k])
    longer = 1.0 / (p.rate * p.steps[mode]) if p.rate > 0.0 else 1.0
    for k in range(n):
        h[KIND + k] = 1 if (h[EVENT + k] == e) & (abs(t[RATE + k]) <= longer * t[X + k]) else h[KIND + k]


@inner
def given_columns(p, found, r, row, n, b):
    """Write the phases, the waves and the coordinates of n starts from a row on; KIND is 1 outside of the domain."""
    t, h, states = b.t, b.h, p.first.shape[1] - 1
    for k in range(n):
        h[KIND + k], t[PHI + k], b.z[states, k] = 0, p.phase, 1.0
    for i in range(states):
        for k in range(n):
            b.z[i, k] = 0.0
    for c in range(len(p.places)):
        for k in range(n):
            x = found.states[r, row + k, c]
            found.states[r + 1, row + k, c] = math.nan
            h[KIND + k] = h[KIND + k] if math.isfinite(x) else 1
            if p.places[c] >= 0:
                b.z[p.places[c], k] = x
            else:
                h[KIND + k] = h[KIND + k] if abs(x) <= MOST_PHASE else 1
                t[PHI + k] = x - math.floor(x / TWO_PI) * TWO_PI if h[KIND + k] == 0 else 0.0
    waved(p, n, b)
    for j in range(len(b.z)):
        for k in range(n):
            b.c[j, k] = b.z[j, k]


@inner
def begun_columns(p, found, r, row, n, b):
    """Write features and transitions of n motions just after their starts, from a row on; KIND as `given_columns`.

    There is one start, of a plain transition.
    """
    t, h, e, states = b.t, b.h, p.starts[0], p.first.shape[1] - 1
    given_columns(p, found, r, row, n, b)
    for i in range(states):
        summed_rows(p.states[0, i], b.c, n, t)
        for k in range(n):
            b.z[i, k] = t[Y + k]
    permitted(p, e, b.z, n, t)
    for k in range(n):
        h[EVENT + k] = e
        h[KIND + k] = h[KIND + k] if (t[THERE + k] > 0.0) | p.after else 1
    if not p.after:
        rising(p, e, n, b)
        reset_columns(p, e, n, b)
