"""Balls: numbers known up to a radius, in an arithmetic that rounds outward.

A ball is a pair (centre, radius). The result of every operation contains the results for all numbers of its operands: a bound on
the rounding error of the centre, at least one unit in its last place, is added to the radius, and then a bound on the rounding
error of the radius (S. M. Rump, Acta Numerica 19, 2010, section 10). An infinite or NaN radius states that nothing is known.
"""

import math

import numpy as np

from nsmaps.exact.engine.jit import inlined, inner

UNIT = 2.3e-16  # more than 2^-52: at least one unit in the last place
GROW = 1.0 + 2e-15  # more than a few roundings of a radius
TINY = 1e-300  # more than underflow loses
NOTHING, ONE = (0.0, 0.0), (1.0, 0.0)
PI_REST = 1.3e-16  # more than |pi - fl(pi)|


@inlined
def badd(a, b):
    """The sum."""
    c = a[0] + b[0]
    return c, (a[1] + b[1] + UNIT * abs(c)) * GROW


@inlined
def bneg(a):
    """The negative."""
    return -a[0], a[1]


@inlined
def bsub(a, b):
    """The difference."""
    c = a[0] - b[0]
    return c, (a[1] + b[1] + UNIT * abs(c)) * GROW


@inlined
def bmul(a, b):
    """The product."""
    c = a[0] * b[0]
    return c, (abs(a[0]) * b[1] + a[1] * (abs(b[0]) + b[1]) + UNIT * abs(c)) * GROW + TINY


@inlined
def bplus(a, x, y):
    """The sum a + x y, with one enlargement of the radius for all rounding errors."""
    p = x[0] * y[0]
    c = a[0] + p
    r = abs(x[0]) * y[1] + x[1] * (abs(y[0]) + y[1])
    return c, (a[1] + r + UNIT * (abs(p) + abs(c))) * GROW + TINY


@inlined
def met(x, y, u, v):
    """The sum x u + y v, as in `bplus`."""
    p, q = x[0] * u[0], y[0] * v[0]
    c = p + q
    r = (abs(x[0]) * u[1] + x[1] * (abs(u[0]) + u[1])) + (abs(y[0]) * v[1] + y[1] * (abs(v[0]) + v[1]))
    return c, (r + UNIT * (abs(p) + abs(q) + abs(c))) * GROW + TINY


@inlined
def binv(a):
    """The reciprocal; its radius is infinite where the ball contains zero."""
    lower = (abs(a[0]) - a[1]) * (1.0 - 1e-15)
    c = 1.0 / a[0]
    r = (a[1] * abs(c) / lower + UNIT * abs(c)) * GROW + TINY
    return c, r if lower > 0.0 else math.inf


@inlined
def low(a):
    """A lower bound on the ball."""
    return a[0] - a[1] - UNIT * (abs(a[0]) + a[1])


@inlined
def high(a):
    """An upper bound on the ball."""
    return a[0] + a[1] + UNIT * (abs(a[0]) + a[1])


@inlined
def size(a):
    """A bound on the absolute value."""
    return (abs(a[0]) + a[1]) * GROW


@inlined
def between(lower, upper):
    """The ball of all numbers between two bounds."""
    c = 0.5 * (lower + upper)
    return c, max(c - lower, upper - c) * GROW


@inlined
def bmeet(a, b):
    """A ball that contains the intersection of two; the second may be unbounded."""
    lower, upper = low(b), high(b)
    return between(lower if lower > low(a) else low(a), upper if upper < high(a) else high(a))


@inner
def bsqrt(a):
    """The square root of a ball of nonnegative numbers."""
    root = between(math.sqrt(max(low(a), 0.0)) * (1.0 - 1e-15), math.sqrt(high(a)) * (1.0 + 1e-15))
    return root[0], root[1] * GROW + TINY


@inlined
def babs(a):
    """The absolute value."""
    return (abs(a[0]), a[1]) if abs(a[0]) >= a[1] else between(0.0, size(a))


@inlined
def bmax(a, b):
    """The maximum."""
    return between(max(low(a), low(b)), max(high(a), high(b)))


@inlined
def bmin(a, b):
    """The minimum."""
    return between(min(low(a), low(b)), min(high(a), high(b)))


@inner
def reduced(phi):
    """The phase reduced modulo 2 pi, its centre in [0, 2 pi), and the number of turns removed."""
    whole = np.floor(phi[0] / (2.0 * math.pi))
    turns = bmul((whole, 0.0), (2.0 * math.pi, 2.0 * PI_REST))
    return bsub(phi, turns), turns


@inlined
def rounded(x):
    """The ball of all numbers that round to x."""
    return x, UNIT * abs(x)


@inlined
def ball_in(c, k):
    """The ball at place k."""
    return c[k], c[k + 1]


@inlined
def put_ball(c, k, ball):
    """Write a ball."""
    c[k], c[k + 1] = ball
