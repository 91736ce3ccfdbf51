"""A block of motions in one mode, a column each: the pieces of their flights, in loops that become vector instructions.

Functions watched are looked at in the basis of Bernstein; those that have one zero, far from any doubt, are followed to it by
Newton's method, and every other one by `sought` of `flight.py`, a column by itself.
"""

from nsmaps.exact.engine.flight.remainders import wave
from nsmaps.exact.engine.jit import fused, inner
from nsmaps.exact.modes.blocks.lanes import (
    BEND,
    CHANGES,
    COLUMN,
    DOUBTFUL,
    ERROR,
    GROWN,
    GUESS,
    HIGH,
    KIND,
    LEAST,
    LOW,
    MORE,
    ON,
    PHI,
    PITCH,
    RATE,
    SHIFT,
    START,
    THERE,
    UPS,
    WHEN,
    WHICH,
    A,
    B,
    U,
    X,
    Y,
)  # fmt: skip
from nsmaps.exact.modes.march.flight import NO_FUNCTION, sought, within_turn
from nsmaps.exact.modes.march.zeros import CLOSE
from nsmaps.exact.modes.tables.taylor import ORDER, ROUNDING

AT_ONCE = 2  # in place of a doubt: two functions may be zero at once, or the doubt be before the event
ROUNDS = 12  # of Newton's method in a block; more are rare


@fused
def combined(rows, order, used, at, z, n, t):
    """Write combinations of the rows of z in n columns: row m from `at` on is the sum of rows[j, m] z[j].

    Of the features, those with more terms first in `order`, used[m] have a term m or further ones.
    """
    for m in range(ORDER + 1):
        of, width, j = at + m * PITCH, used[m], 0
        i0, i1 = order[0], order[1]
        c, d = rows[i0, m] if width > 0 else 0.0, rows[i1, m]
        if width % 2 == 1 or width == 0:
            j = width % 2
            for k in range(n):
                t[of + k] = c * z[i0, k]
        else:
            j = 2
            for k in range(n):
                t[of + k] = c * z[i0, k] + d * z[i1, k]
        for _ in range((width - j) // 6):
            i0, i1, i2, i3, i4, i5 = order[j], order[j + 1], order[j + 2], order[j + 3], order[j + 4], order[j + 5]
            c, d, e, f, g, h = rows[i0, m], rows[i1, m], rows[i2, m], rows[i3, m], rows[i4, m], rows[i5, m]
            for k in range(n):
                three = c * z[i0, k] + d * z[i1, k] + e * z[i2, k]
                t[of + k] += three + (f * z[i3, k] + g * z[i4, k] + h * z[i5, k])
            j += 6
        for _ in range((width - j) // 2):
            i0, i1 = order[j], order[j + 1]
            c, d = rows[i0, m], rows[i1, m]
            for k in range(n):
                t[of + k] += c * z[i0, k] + d * z[i1, k]
            j += 2


@fused
def evaluated(n, t):
    """Write the polynomials of A at X to Y, and their derivatives to U; three coefficients at a time."""
    for k in range(n):
        t[Y + k], t[U + k] = t[A + ORDER * PITCH + k], 0.0
    for i in range(ORDER // 3):
        of = A + (ORDER - 3 - 3 * i) * PITCH
        for k in range(n):
            x, y, u = t[X + k], t[Y + k], t[U + k]
            u, y = u * x + y, y * x + t[of + 2 * PITCH + k]
            u, y = u * x + y, y * x + t[of + PITCH + k]
            t[U + k], t[Y + k] = u * x + y, y * x + t[of + k]


@fused
def signs_of(sign, n, t):
    """Write how many coefficients of B, with a sign and shifted, are positive, how often signs change, and the least size."""
    for k in range(n):
        value = sign * (t[B + PITCH + k] if t[ON + k] > 0.0 else t[B + k]) + t[SHIFT + k]
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
        combined(p.shapes[f], b.all, b.dense, B, b.z, n, t)
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
        start = -sign * t[B + k]
        t[ERROR + k] = ROUNDING * t[Y + k] * (1.0 + t[GROWN + k]) + t[U + k]
        t[SHIFT + k] = start if t[ON + k] > 0.0 else constant
    signs_of(sign, n, t)
    for k in range(n):
        ups, sure = t[UPS + k], (t[LEAST + k] > t[ERROR + k]) & (t[ON + k] <= 1.0)
        one = (t[CHANGES + k] == 1.0) & (t[U + k] == 0.0) & (ups > 1.0)
        h[KIND + k] = (0 if ups == ORDER + 1.0 else 1 if one else 2) if sure else 2


@inner
def improved(n, t):
    """A step of Newton's method, or of bisection, in columns that have not arrived: how many then have not."""
    left = 0
    for i in range(n):
        x, y, u, low, high, bend, rate, done = (
            t[X + i], t[Y + i], t[U + i], t[LOW + i], t[HIGH + i], t[BEND + i], t[RATE + i], t[THERE + i] > 0.0,
        )  # fmt: skip
        low, high = x if y > 0.0 else low, high if y > 0.0 else x
        step = -y / u
        new, middle = x + step, 0.5 * (low + high)
        inside = (u < 0.0) & (low <= new) & (new <= high)
        there = done | (inside & (step * step * bend <= -CLOSE * new * u))
        t[LOW + i], t[HIGH + i], t[RATE + i], t[THERE + i] = low, high, rate if done else u, 1.0 if there else 0.0
        t[X + i] = x if done else new if inside else middle
        left += 0 if there else 1
    return left


@inner
def approached(p, f, n, b, w):
    """Follow the columns of one zero to it by Newton's method; those that do not arrive are of an unknown number."""
    t, h, sign, count = b.t, b.h, p.signs[f], 0
    for k in range(n):
        if h[KIND + k] == 1:
            m = int(t[UPS + k])
            high = sign * t[B + (m - 1) * PITCH + k] + t[SHIFT + k]
            low = sign * t[B + m * PITCH + k] + t[SHIFT + k]
            h[COLUMN + count], t[X + count] = k, (m - 1 + high / (high - low)) / ORDER
            for j in range(len(w.z)):
                b.c[j, count] = b.z[j, k]
            count += 1
    if count == 0:
        return
    combined(p.series[f], p.series_features[0][f], p.series_features[1][f], A, b.c, count, t)
    for i in range(count):
        t[LOW + i], t[HIGH + i], t[BEND + i], t[THERE + i], t[RATE + i] = 0.0, 1.0, 0.0, 0.0, 0.0
        t[A + i] = 0.0 if t[ON + h[COLUMN + i]] > 0.0 else t[A + i]
    for j in range(len(w.z)):
        for i in range(count):
            t[BEND + i] += p.bends[f, j] * abs(b.c[j, i])
    for _ in range(ROUNDS):
        evaluated(count, t)
        if improved(count, t) == 0:
            break
    for i in range(count):
        k = h[COLUMN + i]
        sure = t[THERE + i] > 0.0 and t[RATE + i] * t[RATE + i] > 16.0 * t[ERROR + k] * t[BEND + i]
        h[KIND + k], t[GUESS + k] = 1 if sure else 2, t[X + i]


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
        approached(p, f, n, b, w)
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
def moved(p, mode, n, b, w):
    """Take the states of columns to their events; those without one to the end of the longest step."""
    t, h = b.t, b.h
    states, width, count = p.first.shape[1] - 1, len(w.z), 0
    for k in range(n):
        if h[WHICH + k] != NO_FUNCTION:
            h[COLUMN + count], t[X + count] = k, t[WHEN + k]
            for j in range(width):
                b.c[j, count] = b.z[j, k]
            count += 1
    for i in range(states):
        for k in range(n):
            b.new[i, k] = b.z[i, k]
        for j in range(width):
            whole = p.whole[mode, i * width + j]
            for k in range(n):
                b.new[i, k] += whole * b.z[j, k]
        if count == 0:
            continue
        combined(p.flows[mode, i], p.flow_features[0][mode, i], p.flow_features[1][mode, i], A, b.c, count, t)
        evaluated(count, t)
        for m in range(count):
            b.new[i, h[COLUMN + m]] = b.z[i, h[COLUMN + m]] + t[Y + m]
    for i in range(states):
        for k in range(n):
            b.z[i, k] = b.new[i, k]


@inner
def turned(p, mode, n, b, w):
    """Take the phases of columns along, and write their waves."""
    t, h = b.t, b.h
    states = p.first.shape[1] - 1
    for k in range(n):
        t[PHI + k], h[MORE + k] = within_turn(t[PHI + k] + p.rate * (t[WHEN + k] * p.steps[mode]))
    for m in range(1, (len(w.z) - states - 1) // 2 + 1):
        for k in range(n):
            less, sine, _ = wave(m * t[PHI + k])
            b.z[states + 2 * m - 1, k], b.z[states + 2 * m, k] = 1.0 + less, sine
