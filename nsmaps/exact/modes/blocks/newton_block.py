"""Newton's method in the columns of a block whose function has one zero, or a first one that a part of the step shows.

A column whose coefficients in the basis of Bernstein change sign more than once is looked at again over the part of the step that
ends where they are the farthest below zero.
"""

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.series_block import combine, evaluate_with_slope, whole_vectors
from nsmaps.exact.modes.blocks.workspace import AT, IN, PART_POINTS, PITCH, POINTS, SERIES
from nsmaps.exact.modes.march.zeros import CLOSE
from nsmaps.exact.modes.tables.polynomials import BERNSTEIN
from nsmaps.exact.modes.tables.taylor import ORDER, SAFE

ROUNDS = 12  # of Newton's method in a block; more are rare


@inner
def list_columns(kind, count, n, b):
    """Write the columns of a kind to `column`, behind others: how many there are then."""
    h = b.h
    for k in range(n):
        if h[IN.kind + k] == kind:
            h[IN.column + count] = k
            count += 1
    return count


@inner
def dip(sign, k, t):
    """Where a column's `POINTS`, positive before, are the farthest below zero before they rise again, in [0, 1], or 0."""
    m = 1 if t[AT.at_zero + k] > 0.0 else 0
    first = m
    while m <= ORDER and sign * t[POINTS + m * PITCH + k] + t[AT.shift + k] > t[AT.error + k]:
        m += 1
    if m == first or m > ORDER:
        return 0.0
    least, value = m, sign * t[POINTS + m * PITCH + k] + t[AT.shift + k]
    for i in range(m + 1, ORDER + 1):
        other = sign * t[POINTS + i * PITCH + k] + t[AT.shift + k]
        if other > value:
            break
        least, value = i, other
    return least / ORDER if value < -t[AT.error + k] else 0.0


@inner
def narrow(count, b):
    """Write, in the first columns of `SERIES`, whether there surely is one zero before `high`, and the first approximation to it.

    This is decided by the coefficients over [0, high] in the basis of Bernstein, `PART_POINTS`.
    """
    t, h, wide = b.t, b.h, whole_vectors(count)
    for i in range(ORDER + 1):
        for q in range(wide):
            t[PART_POINTS + i * PITCH + q] = 0.0
    for q in range(wide):
        t[AT.value + q] = 1.0
    for k in range(ORDER + 1):
        for q in range(wide):
            t[AT.slope + q] = t[SERIES + k * PITCH + q] * t[AT.value + q]
            t[AT.value + q] *= t[AT.high + q]
        for i in range(k, ORDER + 1):
            weight, of = BERNSTEIN[k, i], PART_POINTS + i * PITCH
            for q in range(wide):
                t[of + q] += weight * t[AT.slope + q]
    for q in range(count):
        k = h[IN.column + q]
        least = 1 if t[AT.at_zero + k] > 0.0 else 0
        m = least
        while m <= ORDER and t[PART_POINTS + m * PITCH + q] > t[AT.error + k]:
            m += 1
        one = least < m and m <= ORDER
        for i in range(m, ORDER + 1):
            one = one and t[PART_POINTS + i * PITCH + q] < -t[AT.error + k]
        t[AT.done + q] = 0.0 if one else 1.0
        if one:
            below = PART_POINTS + m * PITCH + q
            high = t[below - PITCH]
            t[AT.x + q] = t[AT.high + q] * (m - 1 + high / (high - t[below])) / ORDER


@inner
def guess_zeros(p, f, n, b):
    """Write first approximations to zeros: (number of columns that may have one first zero, with those of one zero behind)."""
    t, h, sign = b.t, b.h, p.signs[f]
    several = 0
    for i in range(list_columns(2, 0, n, b)):
        k = h[IN.column + i]
        far = dip(sign, k, t) if t[AT.zero_terms + k] <= 1.0 else 0.0
        if far > 0.0:
            h[IN.column + several], t[AT.high + several] = k, far
            several += 1
    count = list_columns(1, several, n, b)
    for i in range(several, count):
        k = h[IN.column + i]
        m = int(t[AT.positives + k])
        below = POINTS + m * PITCH + k
        high, low = sign * t[below - PITCH] + t[AT.shift + k], sign * t[below] + t[AT.shift + k]
        t[AT.x + i], t[AT.high + i] = (m - 1 + high / (high - low)) / ORDER, 1.0
    return several, count


@inner
def newton_step(n, t):
    """A step of Newton's method, or of bisection, in columns that have not arrived: how many then have not."""
    left = 0
    for i in range(n):
        x, y, u, done = t[AT.x + i], t[AT.value + i], t[AT.slope + i], t[AT.done + i] > 0.0
        low, high, bend = t[AT.low + i], t[AT.high + i], t[AT.bend + i]
        low, high = x if y > 0.0 else low, high if y > 0.0 else x
        step = -y / u
        new, middle = x + step, 0.5 * (low + high)
        inside = (u < 0.0) & (low <= new) & (new <= high)
        there = done | (inside & (step * step * bend <= -CLOSE * new * u))
        t[AT.low + i], t[AT.high + i], t[AT.rate + i], t[AT.done + i] = (
            low,
            high,
            t[AT.rate + i] if done else u,
            1.0 if there else 0.0,
        )
        t[AT.x + i] = x if done else new if inside else middle
        left += 0 if there else 1
    return left


@inner
def find_zeros(p, f, n, b):
    """Follow the columns of one zero, or of a first one, to it by Newton's method; those that do not arrive are not known."""
    t, h = b.t, b.h
    several, count = guess_zeros(p, f, n, b)
    if count == 0:
        return
    for j in range(len(b.z)):
        for i in range(count):
            b.c[j, i] = b.z[j, h[IN.column + i]]
    (order, used), wide = p.series_features, whole_vectors(count)
    combine(p.series[f], (order[f], used[f]), ORDER, SERIES, b.c, wide, t)
    for i in range(wide):
        t[AT.low + i], t[AT.bend + i], t[AT.done + i], t[AT.rate + i] = 0.0, 0.0, 0.0 if i < count else 1.0, 0.0
    for i in range(count):
        t[SERIES + i] = 0.0 if t[AT.zero_terms + h[IN.column + i]] > 0.0 else t[SERIES + i]
    for j in range(len(b.z)):
        for i in range(wide):
            t[AT.bend + i] += p.bends[f, j] * abs(b.c[j, i])
    if several > 0:
        narrow(several, b)
    for i in range(several):
        h[IN.kind + h[IN.column + i]] = 2 if t[AT.done + i] > 0.0 else 1
    for _ in range(ROUNDS):
        evaluate_with_slope(wide, t)
        if newton_step(wide, t) == 0:
            break
    for i in range(count):
        k = h[IN.column + i]
        sure = t[AT.done + i] > 0.0 and t[AT.rate + i] * t[AT.rate + i] > SAFE * t[AT.error + k] * t[AT.bend + i]
        h[IN.kind + k], t[AT.guess + k] = h[IN.kind + k] if sure else 2, t[AT.x + i]
