"""Balls: numbers known up to a radius, in an arithmetic that rounds outward.

A ball is a pair (centre, radius). The result of every operation holds the results for all numbers of its operands: to the
radius is added what the rounding of the centre may be, at least one unit in its last place, and then what the rounding of
the radius may be (S. M. Rump, Acta Numerica 19, 2010, section 10). An infinite or NaN radius says that nothing is known. Of
sin, cos, exp and log it is assumed that they are right to `TOLD` of their size.
"""

import math

import numpy as np

from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.remainders import growth, wave

UNIT = 2.3e-16  # more than 2^-52: at least one unit in the last place
GROW = 1.0 + 2e-15  # more than a few roundings of a radius
TINY = 1e-300  # more than what underflow loses
TOLD = 2e-15  # more than what sin, cos, exp, log and their remainders are wrong by, relative to their size
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
def binv(a):
    """The reciprocal; nothing is known of that of a ball that holds zero."""
    least = (abs(a[0]) - a[1]) * (1.0 - 1e-15)
    c = 1.0 / a[0]
    r = (a[1] * abs(c) / least + UNIT * abs(c)) * GROW + TINY
    return c, r if least > 0.0 else math.inf


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
def between(least, most):
    """The ball of the numbers between two."""
    c = 0.5 * (least + most)
    return c, max(c - least, most - c) * GROW


@inlined
def bmeet(a, b):
    """A ball that holds what is in both; of the second nothing need be known."""
    least, most = low(b), high(b)
    return between(least if least > low(a) else low(a), most if most < high(a) else high(a))


@inner
def bsqrt(a):
    """The square root, of what is not negative."""
    root = between(math.sqrt(max(low(a), 0.0)) * (1.0 - 1e-15), math.sqrt(high(a)) * (1.0 + 1e-15))
    return root[0], root[1] * GROW + TINY


@inner
def bexp(a):
    """The exponential."""
    c = math.exp(a[0])
    return c, c * (math.expm1(a[1]) + TOLD) * (1.0 + TOLD) * GROW + TINY


@inner
def blog(a):
    """The logarithm, of what is positive."""
    least, most = math.log(low(a)), math.log(high(a))
    return between(least - TOLD * abs(least) - TINY, most + TOLD * abs(most) + TINY)


@inlined
def babs(a):
    """The absolute value."""
    return (abs(a[0]), a[1]) if abs(a[0]) >= a[1] else between(0.0, size(a))


@inlined
def bmax(a, b):
    """The greater one."""
    return between(max(low(a), low(b)), max(high(a), high(b)))


@inlined
def bmin(a, b):
    """The lesser one."""
    return between(min(low(a), low(b)), min(high(a), high(b)))


@inner
def bwave(a):
    """The remainders cos - 1, sin and sin - x, by angle addition of the radius h: sin h <= h, 1 - cos h <= h^2/2."""
    x, h = a
    less, sine, rest = wave(x)
    s, c, q = abs(sine), abs(1.0 + less), 0.5 * h * h
    lost = 1e-22 * abs(x)  # of the reduction to a quarter of a turn
    return (
        (less, (min(s * h + c * q, 2.0) + TOLD * abs(less) + lost) * GROW + TINY),
        (sine, (min(c * h + s * q, 2.0) + TOLD * s + lost) * GROW + TINY),
        (rest, (min(abs(less) * h + s * q + h * q * (1.0 / 3.0), 2.0 + h) + TOLD * abs(rest) + lost) * GROW + TINY),
    )


@inner
def bgrowth(a):
    """The remainders exp - 1 and exp - 1 - x."""
    x, h = a
    plain, rest = growth(x)
    more, bend = growth(h)
    return (
        (plain, ((1.0 + plain) * more + TOLD * (abs(plain) + (1.0 + plain) * more)) * GROW + TINY),
        (
            rest,
            (abs(plain) * h + (1.0 + plain) * bend + TOLD * (abs(rest) + abs(plain) * h + (1.0 + plain) * more)) * GROW + TINY,
        ),
    )


@inner
def bangle(phi):
    """A phase with its cosine less one and its sine, as `angle`."""
    less, sine, _ = bwave(phi)
    return phi, less, sine


@inner
def reduced(phi):
    """The phase less whole turns, its centre in [0, 2 pi), and these turns."""
    whole = np.floor(phi[0] / (2.0 * math.pi))
    turns = bmul((whole, 0.0), (2.0 * math.pi, 2.0 * PI_REST))
    return bsub(phi, turns), turns


@inlined
def rounded(x):
    """The ball of the numbers that x may be rounded from."""
    return x, UNIT * abs(x)


@inlined
def ball_in(c, k):
    """The ball at place k."""
    return c[k], c[k + 1]


@inlined
def put_ball(c, k, ball):
    """Write a ball."""
    c[k], c[k + 1] = ball


@inlined
def met(x, y, real, imaginary):
    """The sum of products."""
    return badd(bmul(x, real), bmul(y, imaginary))
