"""How rounding errors grow along a Taylor flight, piece by piece, by the derivatives of the rates.

Over a step h these are the mean J of those at its ends, and the errors of the states are multiplied by exp(h J).
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.tables.memory import INTERVALS
from nsmaps.exact.modes.tables.taylor import ROUNDING

PRODUCT, TERM, LAST, NEXT = range(
    4
)  # matrices in `Piece.growth`: of the flight so far, a term of a series, J at the start, its factor
EXPONENTIAL_TERMS = 12  # of exp(h J), whose h J has the size of a few units at most
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
def mean_slopes(p, w):
    """Write the mean of the derivatives of the rates at both ends of a piece, of which `resolved` wrote those at its end."""
    q = w.piece
    for i in range(p.own):
        for j in range(p.own):
            end = q.inside[INTERVALS, i * (p.own + 3) + SLOPES + j]
            start = q.growth[LAST, i, j]
            q.growth[LAST, i, j] = end
            q.growth[NEXT, i, j] = 0.5 * (start + end) if start == start else end


@inner
def multiplied(p, h, w):
    """Multiply the flow of errors by exp(h J), by its series."""
    g = w.piece.growth
    for c in range(p.own):
        for i in range(p.own):
            g[TERM, 0, i] = g[PRODUCT, i, c]
        for k in range(1, EXPONENTIAL_TERMS):
            for i in range(p.own):
                total = 0.0
                for j in range(p.own):
                    total += g[NEXT, i, j] * g[TERM, 0, j]
                g[TERM, 1, i] = total * h / k
            for i in range(p.own):
                g[TERM, 0, i] = g[TERM, 1, i]
                g[PRODUCT, i, c] += g[TERM, 0, i]


@inner
def grown_over(p, h, w):
    """What the errors of the states have grown to after a piece of length h, without 1: the largest, as shares of the states.

    States are as large as they were in this return and at the ends of the pieces so far.
    """
    q = w.piece
    mean_slopes(p, w)
    multiplied(p, h, w)
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
