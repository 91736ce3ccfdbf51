"""How rounding errors grow along a Taylor flight, piece by piece, by the derivatives of the rates.

Over a step h these are the mean J of those at its ends, and the errors of the states are multiplied by exp(h J).
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.tables.memory import INTERVALS
from nsmaps.exact.modes.tables.taylor import ROUNDING

#: matrices in `Piece.growth`: of the flight so far, J at the start of a piece, h J, its exponential, memory
PRODUCT, LAST, MEAN, FACTOR, ROOM = range(5)
EXPONENTIAL_TERMS = 12  # of exp(A), where A is divided by a power of two until its size is at most one
MOST_SQUARES = 60
SLOPES = 2  # place of the derivatives by own states in a row of the law of the rates


@inner
def begin_growth(p, w):
    """Let the errors of a flight be those at its start."""
    q = w.piece
    for i in range(p.own):
        q.extent[i] = max(w.scales[i], abs(w.z[i]))
        for j in range(p.own):
            q.growth[PRODUCT, i, j] = 1.0 if i == j else 0.0
            q.growth[LAST, i, j] = math.nan


@inner
def mean_slopes(p, h, w):
    """Write h times the mean of the rates' derivatives at both ends of a piece, of which `resolved` wrote those at its end.

    The largest sum of the sizes in a row.
    """
    g, size = w.piece.growth, 0.0
    for i in range(p.own):
        total = 0.0
        for j in range(p.own):
            end, start = w.piece.inside[INTERVALS, i * (p.own + 3) + SLOPES + j], g[LAST, i, j]
            g[LAST, i, j] = end
            g[MEAN, i, j] = h * (0.5 * (start + end) if start == start else end)
            total += abs(g[MEAN, i, j])
        size = max(size, total)
    return size


@inner
def product(p, a, b, w):
    """Write the product of two matrices of `Piece.growth` in place of the second."""
    g = w.piece.growth
    for i in range(p.own):
        for c in range(p.own):
            total = 0.0
            for j in range(p.own):
                total += g[a, i, j] * g[b, j, c]
            g[ROOM, i, c] = total
    for i in range(p.own):
        for c in range(p.own):
            g[b, i, c] = g[ROOM, i, c]


@inner
def exponential(p, size, w):
    """Write the exponential of the matrix `MEAN`, whose rows have at most this size, by its series and by squares."""
    g, squares = w.piece.growth, 0
    while size > 1.0 and squares < MOST_SQUARES:
        size, squares = 0.5 * size, squares + 1
    for i in range(p.own):
        for j in range(p.own):
            g[MEAN, i, j] *= 0.5**squares
            g[FACTOR, i, j] = 1.0 if i == j else 0.0
    for k in range(EXPONENTIAL_TERMS, 0, -1):  # 1 + A (1 + A (...)/3)/2
        product(p, MEAN, FACTOR, w)
        for i in range(p.own):
            for j in range(p.own):
                g[FACTOR, i, j] = g[FACTOR, i, j] / k + (1.0 if i == j else 0.0)
    for _ in range(squares):
        product(p, FACTOR, FACTOR, w)


@inner
def grown_over(p, h, w):
    """What the errors of the states have grown to after a piece of length h, without 1: the largest, as shares of the states.

    States are as large as they were in this return and at the ends of the pieces so far.
    """
    q = w.piece
    exponential(p, mean_slopes(p, h, w), w)
    product(p, FACTOR, PRODUCT, w)
    largest = 1.0
    for i in range(p.own):
        q.extent[i] = max(q.extent[i], abs(w.z[i]))
    for i in range(p.own):
        total = 0.0
        for j in range(p.own):
            total += abs(q.growth[PRODUCT, i, j]) * q.extent[j]
        if q.extent[i] > 0.0 and not total <= largest * q.extent[i]:
            largest = total / q.extent[i]
    return min(largest - 1.0, 1.0 / ROUNDING)
