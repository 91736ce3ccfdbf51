"""A block of motions in one mode, a column each: the pieces of their flights, in loops that become vector instructions.

Functions watched are looked at in the basis of Bernstein; those that have one zero, or a first one far from any doubt, are
followed to it by Newton's method, and every other one by `sought` of `flight.py`, a column by itself.
"""

from nsmaps.exact.engine.jit import fused, inner
from nsmaps.exact.modes.blocks.approach import approached
from nsmaps.exact.modes.blocks.lanes import (
    CHANGES,
    COLUMN,
    DOUBTFUL,
    ERROR,
    GROWN,
    GUESS,
    KIND,
    LEAST,
    MORE,
    ON,
    PHI,
    PITCH,
    SHIFT,
    START,
    UPS,
    WHEN,
    WHICH,
    ZERO,
    A,
    B,
    U,
    X,
    Y,
)  # fmt: skip
from nsmaps.exact.modes.blocks.passing import waved
from nsmaps.exact.modes.blocks.series import combined, copied, full, valued
from nsmaps.exact.modes.flights.motion import within_turn
from nsmaps.exact.modes.march.flight import NO_FUNCTION, sought
from nsmaps.exact.modes.tables.taylor import ORDER, ROUNDING, TERMS

ON_SURFACE = 16.0 * ROUNDING  # of the sizes of terms: at the start of a flight this is left to `begins`
AT_ONCE = 2  # in place of a doubt: two functions may be zero at once, or the doubt be before the event


@fused
def signs_of(sign, n, t):
    """Write how many coefficients of B, with a sign and shifted, are positive, how often signs change, and the least size.

    A first coefficient of zero has the sign of the second.
    """
    for k in range(n):
        value = sign * (t[B + PITCH + k] if t[ZERO + k] > 0.0 else t[B + k]) + t[SHIFT + k]
        t[LEAST + k], t[CHANGES + k], t[UPS + k], t[U + k] = abs(value), 0.0, 0.0, 1.0 if value > 0.0 else 0.0
        t[UPS + k] = t[U + k]
    for i in range(ORDER // 3):
        of = B + (1 + 3 * i) * PITCH
        for k in range(n):
            x, y, z = t[of + k], t[of + PITCH + k], t[of + 2 * PITCH + k]
            x, y, z = sign * x + t[SHIFT + k], sign * y + t[SHIFT + k], sign * z + t[SHIFT + k]
            up, then, last = 1.0 if x > 0.0 else 0.0, 1.0 if y > 0.0 else 0.0, 1.0 if z > 0.0 else 0.0
            t[LEAST + k] = min(min(t[LEAST + k], abs(x)), min(abs(y), abs(z)))
            t[CHANGES + k] += abs(up - t[U + k]) + abs(then - up) + abs(last - then)
            t[UPS + k] += up + then + last
            t[U + k] = last


@inner
def screened(p, f, n, b, w):
    """Write which columns have no zero of a function (0), one (1) or an unknown number (2).

    A function that differs from one before by its sign and a constant has the same coefficients, which are in B already if
    it follows that.
    """
    t, h, sign, constant = b.t, b.h, p.signs[f], p.functions[f, p.first.shape[1] - 1]
    if p.twins[f] == f:
        combined(p.shapes[f], b.all, b.dense, ORDER, B, b.z, n, t)
    for k in range(n):
        t[Y + k], t[U + k] = 0.0, 0.0
    for j in range(len(w.z)):
        size, left = p.sizes[f, j], p.left[f, j]
        for k in range(n):
            t[Y + k] += size * abs(b.z[j, k])
            t[U + k] += left * abs(b.z[j, k])
    for k in range(n):
        t[ON + k] = p.on[h[START + k], f] if h[START + k] >= 0 else 0.0
    for k in range(n):
        start = sign * t[B + k]
        error = ROUNDING * t[Y + k] * (1.0 + t[GROWN + k]) + t[U + k]
        on_surface = start + constant <= ON_SURFACE * t[Y + k] if t[ON + k] == 0.0 else t[ON + k] == TERMS
        h[DOUBTFUL + k] = AT_ONCE if on_surface & (h[START + k] >= 0) else h[DOUBTFUL + k]
        near = (start + constant >= 0.0) & (start + constant <= error)
        t[ERROR + k], t[SHIFT + k] = error, -start if t[ON + k] > 0.0 else constant
        t[ZERO + k] = 1.0 if (t[ON + k] > 0.0) | near else 0.0
    signs_of(sign, n, t)
    for k in range(n):
        ups, sure = t[UPS + k], (t[LEAST + k] > t[ERROR + k]) & (t[ON + k] <= 1.0)
        one = (t[CHANGES + k] == 1.0) & (t[U + k] == 0.0) & (ups > 1.0)
        h[KIND + k] = (0 if ups == ORDER + 1.0 else 1 if one else 2) if sure else 2


@inner
def loaded(p, k, b, w):
    """Write a column to the memory of a single motion."""
    h = b.h
    for j in range(len(w.z)):
        w.z[j] = b.z[j, k]
    for f in range(len(w.on)):
        w.on[f] = p.on[h[START + k], f] if h[START + k] >= 0 else 0


@inner
def next_events(p, mode, n, b, w):
    """Write the first event of each column within a longest step: which function, when, and whether that is doubtful."""
    t, h = b.t, b.h
    for k in range(n):
        h[WHICH + k], t[WHEN + k], h[DOUBTFUL + k] = NO_FUNCTION, 1.0, 0
    for f in range(p.watched[mode], p.watched[mode + 1]):
        screened(p, f, n, b, w)
        approached(p, f, n, b)
        for k in range(n):
            if h[KIND + k] == 0:
                continue
            when = t[WHEN + k]
            near = 0.0 if h[WHICH + k] == NO_FUNCTION else 4.0 * ROUNDING * when
            if h[KIND + k] == 2 or abs(t[GUESS + k] - when) <= 4.0 * ROUNDING * when:
                loaded(p, k, b, w)
                found, x, unsure = sought(p, f, when + near, t[GROWN + k], w)
            else:
                found, x, unsure = t[GUESS + k] < when, t[GUESS + k], False
            if found and h[WHICH + k] != NO_FUNCTION and abs(x - when) <= near:
                h[DOUBTFUL + k] = AT_ONCE
            elif found:
                doubt = AT_ONCE if h[DOUBTFUL + k] > 0 else 1 if unsure else 0
                h[WHICH + k], t[WHEN + k], h[DOUBTFUL + k] = f, x, doubt
            elif unsure and h[DOUBTFUL + k] == 0:
                h[DOUBTFUL + k] = 1


@inner
def whole_step(p, mode, i, n, b):
    """Write a state at the end of the longest step."""
    for k in range(n):
        b.new[i, k] = b.z[i, k]
    for j in range(len(b.z)):
        whole = p.whole[mode, i * len(b.z) + j]
        for k in range(n):
            b.new[i, k] += whole * b.z[j, k]


@inner
def moved(p, mode, n, b):
    """Take the states of columns to their events; those without one to the end of the longest step."""
    t, h = b.t, b.h
    states, count = p.first.shape[1] - 1, 0
    for k in range(n):
        if h[WHICH + k] != NO_FUNCTION:
            h[COLUMN + count], t[X + count] = k, t[WHEN + k]
            count += 1
    copied(count, b)
    for q in range(states):
        i = p.flow_order[mode, q]
        if count < n:
            whole_step(p, mode, i, n, b)
        if count == 0:
            continue
        base, degree = p.flow_bases[mode, i], p.flow_degrees[mode, i]
        combined(p.flows[mode, i], p.flow_features[0][mode, i], p.flow_features[1][mode, i], degree, A, b.c, full(count), t)
        valued(degree, full(count), t)
        for m in range(count):
            b.other[i, m] = t[Y + m] + (b.other[base, m] if base != i else 0.0)
            b.new[i, h[COLUMN + m]] = b.z[i, h[COLUMN + m]] + b.other[i, m]
    for i in range(states):
        for k in range(n):
            b.z[i, k] = b.new[i, k]


@inner
def turned(p, mode, n, b):
    """Take the phases of columns along, and write their waves."""
    t, h = b.t, b.h
    for k in range(n):
        t[PHI + k], h[MORE + k] = within_turn(t[PHI + k] + p.rate * (t[WHEN + k] * p.steps[mode]))
    waved(p, n, b)
