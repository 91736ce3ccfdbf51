"""A block of motions at their starts and through events, in loops that become vector instructions.

This holds for *plain* transitions: the only one of its function, without conditions, contact or a reset by another formula, in
systems without sliding. Arithmetic and decisions are those of `section.py` and `returns.py`.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.flight.remainders import wave
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import MOST_PHASE
from nsmaps.exact.modes.blocks.lanes import KIND, PHI, WHICH, U, X, Y
from nsmaps.exact.modes.tables.taylor import ROUNDING


@inner
def waved(p, n, b):
    """Write 1 and the waves of the phases of columns behind their states."""
    t, states = b.t, p.first.shape[1] - 1
    for m in range(1, (len(b.z) - states - 1) // 2 + 1):
        for k in range(n):
            less, sine, _ = wave(m * t[PHI + k])
            b.z[states + 2 * m - 1, k], b.z[states + 2 * m, k] = 1.0 + less, sine


@inner
def weighed_rows(row, z, n, t, at):
    """Write the sum of rows of z in n columns, each times a weight."""
    begun = False
    for j in range(len(z)):
        c = row[j]
        if c == 0.0:
            continue
        if begun:
            for k in range(n):
                t[at + k] += c * z[j, k]
        else:
            for k in range(n):
                t[at + k] = c * z[j, k]
        begun = True
    for k in range(0 if begun else n):
        t[at + k] = 0.0


@inner
def reset_columns(p, e, n, b):
    """Write the states just after a transition to the columns that its function takes through it."""
    t, h, states = b.t, b.h, p.first.shape[1] - 1
    for i in range(states):
        if p.jumps[e, i]:
            weighed_rows(p.resets[e, i], b.z, n, t, Y)
            for k in range(n):
                b.new[i, k] = t[Y + k] if h[WHICH + k] == p.function[e] else b.z[i, k]
    for i in range(states):
        if p.jumps[e, i]:
            for k in range(n):
                b.z[i, k] = b.new[i, k]


@inner
def jumped(p, mode, n, b):
    """Take columns through the resets of plain events; their states before are in `c`, and the sums of sizes in X."""
    t = b.t
    for k in range(n):
        t[X + k] = 0.0
    for j in range(len(b.z)):
        for k in range(n):
            t[X + k] += abs(b.z[j, k])
            b.c[j, k] = b.z[j, k]
    for f in range(p.watched[mode], p.watched[mode + 1]):
        if p.plain[f] >= 0 and p.moves[p.plain[f]]:
            reset_columns(p, p.plain[f], n, b)


@inner
def rising(p, e, n, b):
    """Mark the columns that cannot have come to the zero of a transition's function, which rises there."""
    t, h, mode, function, states = b.t, b.h, p.mode[e], p.functions[p.function[e]], p.first.shape[1] - 1
    turn = p.rate * p.steps[mode]
    for k in range(n):
        t[U + k], t[X + k] = 0.0, 0.0
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
            m = (i - states + 1) // 2
            even = (i - states) % 2 == 0
            value, column = (m * turn, i - 1) if even else (-m * turn, i + 1)
            for k in range(n):
                t[Y + k] = value * b.z[column, k]
        for k in range(n):
            t[U + k] += c * t[Y + k]
            t[X + k] += abs(c * t[Y + k])
    for k in range(n):
        h[KIND + k] = 1 if t[U + k] > ROUNDING * t[X + k] else h[KIND + k]


@inner
def begun_columns(p, found, r, row, n, b):
    """Write the features just after the start of n motions from a row on; KIND is 1 where coordinates are outside of the domain.

    There is one start, of a plain transition.
    """
    t, h, e, states = b.t, b.h, p.starts[0], p.first.shape[1] - 1
    for k in range(n):
        h[KIND + k], h[WHICH + k], t[PHI + k], b.z[states, k] = 0, p.function[e], 0.0, 1.0
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
    for i in range(states):
        weighed_rows(p.states[0, i], b.z, n, t, Y)
        for k in range(n):
            b.new[i, k] = t[Y + k]
    for i in range(states):
        for k in range(n):
            b.z[i, k] = b.new[i, k]
    if not p.after:
        rising(p, e, n, b)
        reset_columns(p, e, n, b)
