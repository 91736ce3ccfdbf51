"""Polynomials in the time since the start of a step, a column each, in loops that become vector instructions."""

from nsmaps.exact.engine.jit import fused, inlined, inner
from nsmaps.exact.modes.blocks.lanes import COLUMN, PITCH, A, U, X, Y
from nsmaps.exact.modes.tables.taylor import ORDER


@fused
def combined(rows, order, used, degree, at, z, n, t):
    """Write combinations of the rows of z in n columns: row m up to a degree from `at` on is the sum of rows[j, m] z[j].

    Of the features, those with more terms first in `order`, used[m] have a term m or further ones.
    """
    for m in range(degree + 1):
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
def valued(degree, n, t):
    """Write the polynomials of A at X to Y, of degree ORDER or of one less than a multiple of three."""
    for k in range(n):
        t[Y + k] = t[A + ORDER * PITCH + k] if degree == ORDER else 0.0
    for i in range(ORDER // 3):
        if ORDER - 1 - 3 * i > degree:
            continue
        of = A + (ORDER - 3 - 3 * i) * PITCH
        for k in range(n):
            x = t[X + k]
            t[Y + k] = ((t[Y + k] * x + t[of + 2 * PITCH + k]) * x + t[of + PITCH + k]) * x + t[of + k]


@inner
def copied(count, b):
    """Write the features of the columns in COLUMN to `c`."""
    for j in range(len(b.z)):
        for i in range(count):
            b.c[j, i] = b.z[j, b.h[COLUMN + i]]


@inlined
def full(n):
    """A number of columns rounded up to whole vectors, for which loops have no remainder."""
    return (n + 15) // 16 * 16
