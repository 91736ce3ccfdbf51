"""Newton's method in the columns of a block whose function has one zero, or a first one that a part of the step shows.

A column whose coefficients in the basis of Bernstein change sign more than once is looked at again over the part of the step that
ends where they are the farthest below zero.
"""

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.lanes import (
    BEND,
    COLUMN,
    ERROR,
    GUESS,
    HIGH,
    KIND,
    LOW,
    ON,
    PITCH,
    RATE,
    SHIFT,
    THERE,
    UPS,
    ZERO,
    A,
    B,
    C,
    U,
    X,
    Y,
)  # fmt: skip
from nsmaps.exact.modes.blocks.series import combined, copied, evaluated, full
from nsmaps.exact.modes.march.zeros import CLOSE
from nsmaps.exact.modes.tables.polynomials import BERNSTEIN
from nsmaps.exact.modes.tables.taylor import ORDER

ROUNDS = 12  # of Newton's method in a block; more are rare


@inner
def listed(kind, count, n, b):
    """Write the columns of a kind to COLUMN, behind others: how many there are then."""
    h = b.h
    for k in range(n):
        if h[KIND + k] == kind:
            h[COLUMN + count] = k
            count += 1
    return count


@inner
def dip(sign, k, t):
    """Where a column's coefficients of B, positive before, are the farthest below zero before they rise again, 0 without such.

    The place is one in [0, 1].
    """
    m = 1 if t[ZERO + k] > 0.0 else 0
    first = m
    while m <= ORDER and sign * t[B + m * PITCH + k] + t[SHIFT + k] > t[ERROR + k]:
        m += 1
    if m == first or m > ORDER:
        return 0.0
    least, value = m, sign * t[B + m * PITCH + k] + t[SHIFT + k]
    for i in range(m + 1, ORDER + 1):
        other = sign * t[B + i * PITCH + k] + t[SHIFT + k]
        if other > value:
            break
        least, value = i, other
    return least / ORDER if value < -t[ERROR + k] else 0.0


@inner
def narrowed_down(count, b):
    """Write, in the first columns of A, whether there surely is one zero before HIGH, and the first approximation to it.

    The coefficients over [0, HIGH] in the basis of Bernstein take the place of B's to this end, in C.
    """
    t, h, wide = b.t, b.h, full(count)
    for i in range(ORDER + 1):
        for q in range(wide):
            t[C + i * PITCH + q] = 0.0
    for q in range(wide):
        t[Y + q] = 1.0
    for k in range(ORDER + 1):
        for q in range(wide):
            t[U + q] = t[A + k * PITCH + q] * t[Y + q]
            t[Y + q] *= t[HIGH + q]
        for i in range(k, ORDER + 1):
            weight, of = BERNSTEIN[k, i], C + i * PITCH
            for q in range(wide):
                t[of + q] += weight * t[U + q]
    for q in range(count):
        k = h[COLUMN + q]
        least = 1 if t[ZERO + k] > 0.0 else 0
        m = least
        while m <= ORDER and t[C + m * PITCH + q] > t[ERROR + k]:
            m += 1
        one = least < m and m <= ORDER
        for i in range(m, ORDER + 1):
            one = one and t[C + i * PITCH + q] < -t[ERROR + k]
        t[THERE + q] = 0.0 if one else 1.0
        if one:
            high = t[C + (m - 1) * PITCH + q]
            t[X + q] = t[HIGH + q] * (m - 1 + high / (high - t[C + m * PITCH + q])) / ORDER


@inner
def aimed(p, f, n, b):
    """Write first approximations to zeros: (number of columns that may have one first zero, with those of one zero behind)."""
    t, h, sign = b.t, b.h, p.signs[f]
    several = 0
    for i in range(listed(2, 0, n, b)):
        k = h[COLUMN + i]
        far = dip(sign, k, t) if t[ON + k] <= 1.0 else 0.0
        if far > 0.0:
            h[COLUMN + several], t[HIGH + several] = k, far
            several += 1
    count = listed(1, several, n, b)
    for i in range(several, count):
        k = h[COLUMN + i]
        m = int(t[UPS + k])
        high = sign * t[B + (m - 1) * PITCH + k] + t[SHIFT + k]
        low = sign * t[B + m * PITCH + k] + t[SHIFT + k]
        t[X + i], t[HIGH + i] = (m - 1 + high / (high - low)) / ORDER, 1.0
    return several, count


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
def approached(p, f, n, b):
    """Follow the columns of one zero, or of a first one, to it by Newton's method; those that do not arrive are not known."""
    t, h = b.t, b.h
    several, count = aimed(p, f, n, b)
    if count == 0:
        return
    copied(count, b)
    wide = full(count)
    combined(p.series[f], p.series_features[0][f], p.series_features[1][f], ORDER, A, b.c, wide, t)
    for i in range(wide):
        t[LOW + i], t[BEND + i], t[THERE + i], t[RATE + i] = 0.0, 0.0, 0.0 if i < count else 1.0, 0.0
    for i in range(count):
        t[A + i] = 0.0 if t[ON + h[COLUMN + i]] > 0.0 else t[A + i]
    for j in range(len(b.z)):
        for i in range(wide):
            t[BEND + i] += p.bends[f, j] * abs(b.c[j, i])
    if several > 0:
        narrowed_down(several, b)
    for i in range(several):
        h[KIND + h[COLUMN + i]] = 2 if t[THERE + i] > 0.0 else 1
    for _ in range(ROUNDS):
        evaluated(wide, t)
        if improved(wide, t) == 0:
            break
    for i in range(count):
        k = h[COLUMN + i]
        sure = t[THERE + i] > 0.0 and t[RATE + i] * t[RATE + i] > 16.0 * t[ERROR + k] * t[BEND + i]
        h[KIND + k], t[GUESS + k] = h[KIND + k] if sure else 2, t[X + i]
