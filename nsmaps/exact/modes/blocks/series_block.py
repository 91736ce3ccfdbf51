"""Polynomials in the time since the start of a step, rows and rates, a column each, in loops that become vector instructions."""

from nsmaps.exact.engine.jit import fused, inlined, inner
from nsmaps.exact.modes.blocks.workspace import AT, PITCH, SERIES, VECTOR
from nsmaps.exact.modes.tables.taylor import ORDER


@fused
def combine(rows, features, degree, at, z, n, t):
    """Write combinations of the rows of z in n columns: row m up to a degree from `at` on is the sum of rows[j, m] z[j].

    `features` are their numbers, those with more terms first, and how many have a term m or further ones.
    """
    order, used = features
    for m in range(degree + 1):
        of, width, j = at + m * PITCH, used[m], 0
        first, second = 0, 1
        i0, i1 = order[first], order[second]
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
            j1, j2, j3, j4, j5 = j + 1, j + 2, j + 3, j + 4, j + 5
            i0, i1, i2, i3, i4, i5 = order[j], order[j1], order[j2], order[j3], order[j4], order[j5]
            c, d, e, f, g, h = rows[i0, m], rows[i1, m], rows[i2, m], rows[i3, m], rows[i4, m], rows[i5, m]
            for k in range(n):
                three = c * z[i0, k] + d * z[i1, k] + e * z[i2, k]
                t[of + k] += three + (f * z[i3, k] + g * z[i4, k] + h * z[i5, k])
            j += 6
        for _ in range((width - j) // 2):
            j1 = j + 1
            i0, i1 = order[j], order[j1]
            c, d = rows[i0, m], rows[i1, m]
            for k in range(n):
                t[of + k] += c * z[i0, k] + d * z[i1, k]
            j += 2


@fused
def evaluate_with_slope(n, t):
    """Write the polynomials of `SERIES` at x to `value`, and their derivatives to `slope`; three coefficients at a time."""
    for k in range(n):
        t[AT.value + k], t[AT.slope + k] = t[SERIES + ORDER * PITCH + k], 0.0
    for i in range(ORDER // 3):
        c = SERIES + (ORDER - 3 - 3 * i) * PITCH
        c1, c2 = c + PITCH, c + PITCH + PITCH
        for k in range(n):
            x, y, u = t[AT.x + k], t[AT.value + k], t[AT.slope + k]
            u, y = u * x + y, y * x + t[c2 + k]
            u, y = u * x + y, y * x + t[c1 + k]
            t[AT.slope + k], t[AT.value + k] = u * x + y, y * x + t[c + k]


@fused
def evaluate_row(row, terms, n, t):
    """Write one polynomial of so many terms at the times of n columns to `value`; four coefficients at a time."""
    for k in range(n):
        t[AT.value + k] = 0.0
    m = (terms + 3) // 4 * 4
    while m > 0:
        m3, m2, m1, m = m - 1, m - 2, m - 3, m - 4
        c3, c2, c1, c0 = row[m3], row[m2], row[m1], row[m]
        for k in range(n):
            x = t[AT.time + k]
            t[AT.value + k] = (((t[AT.value + k] * x + c3) * x + c2) * x + c1) * x + c0


@inlined
def whole_vectors(n):
    """A number of columns rounded up to whole vectors, for which loops have no remainder."""
    return (n + VECTOR - 1) // VECTOR * VECTOR


@inner
def weigh_row(row, z, n, t):
    """Write the sum of rows of z in n columns, each times a weight, to `value`, and the sum of the terms' sizes to `slope`."""
    for k in range(n):
        t[AT.value + k], t[AT.slope + k] = 0.0, 0.0
    for j in range(len(z)):
        c = row[j]
        if c == 0.0:
            continue
        for k in range(n):
            term = c * z[j, k]
            t[AT.value + k] += term
            t[AT.slope + k] += abs(term)


@inner
def sum_row(row, z, n, t):
    """As `weigh_row`, without the sizes."""
    for k in range(n):
        t[AT.value + k] = 0.0
    for j in range(len(z)):
        c = row[j]
        if c == 0.0:
            continue
        for k in range(n):
            t[AT.value + k] += c * z[j, k]


@inner
def write_rates(p, mode, n, b):
    """Write the rates of the features, in steps of the mode, to `field`: as `velocity` of `nsmaps.exact.modes.flights.states`."""
    states, turn = p.first.shape[1] - 1, p.rate * p.steps[mode]
    for k in range(n):
        b.field[states, k] = 0.0
    for i in range(states):
        following = i + 1
        for k in range(n):
            b.field[i, k] = 0.0
        for j in range(p.first[mode, i], p.first[mode, following]):
            value, column = p.values[j], p.columns[j]
            for k in range(n):
                b.field[i, k] += value * b.z[column, k]
    for m in range(1, (len(b.z) - states - 1) // 2 + 1):
        sines = states + 2 * m
        cosines = sines - 1
        for k in range(n):
            b.field[cosines, k], b.field[sines, k] = -m * turn * b.z[sines, k], m * turn * b.z[cosines, k]
