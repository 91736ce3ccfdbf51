"""Balls: numbers known up to a radius, in an arithmetic that rounds outward.

A ball is a pair (centre, radius). The result of every operation holds the results for all numbers of its operands: to the
radius is added what the rounding of the centre may be, at least one unit in its last place, and then what the rounding of
the radius may be (S. M. Rump, Acta Numerica 19, 2010, section 10). An infinite or NaN radius says that nothing is known. Of
sin, cos, exp and log it is assumed that they are right to `TOLD` of their size. Like `flight.py`, this file is copied behind
what is generated.
"""

import math

import numpy as np

from nsmaps.exact.compiled import njit
from nsmaps.exact.remainders import growth, wave

# === engine ===

UNIT = 2.3e-16  # more than 2^-52: at least one unit in the last place
GROW = 1.0 + 2e-15  # more than a few roundings of a radius
TINY = 1e-300  # more than what underflow loses
TOLD = 2e-15  # more than what sin, cos, exp, log and their remainders are wrong by, relative to their size
PI_REST = 1.3e-16  # more than |pi - fl(pi)|


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def badd(a, b):
    """The sum."""
    c = a[0] + b[0]
    return c, (a[1] + b[1] + UNIT * abs(c)) * GROW


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bneg(a):
    """The negative."""
    return -a[0], a[1]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bsub(a, b):
    """The difference."""
    c = a[0] - b[0]
    return c, (a[1] + b[1] + UNIT * abs(c)) * GROW


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bmul(a, b):
    """The product."""
    c = a[0] * b[0]
    return c, (abs(a[0]) * b[1] + a[1] * (abs(b[0]) + b[1]) + UNIT * abs(c)) * GROW + TINY


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def binv(a):
    """The reciprocal; nothing is known of that of a ball that holds zero."""
    least = (abs(a[0]) - a[1]) * (1.0 - 1e-15)
    c = 1.0 / a[0]
    r = (a[1] * abs(c) / least + UNIT * abs(c)) * GROW + TINY
    return c, r if least > 0.0 else math.inf


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def low(a):
    """A lower bound on the ball."""
    return a[0] - a[1] - UNIT * (abs(a[0]) + a[1])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def high(a):
    """An upper bound on the ball."""
    return a[0] + a[1] + UNIT * (abs(a[0]) + a[1])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def size(a):
    """A bound on the absolute value."""
    return (abs(a[0]) + a[1]) * GROW


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def between(least, most):
    """The ball of the numbers between two."""
    c = 0.5 * (least + most)
    return c, max(c - least, most - c) * GROW


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bmeet(a, b):
    """A ball that holds what is in both; of the second nothing need be known."""
    least, most = low(b), high(b)
    return between(least if least > low(a) else low(a), most if most < high(a) else high(a))


@njit(cache=True, nogil=True, error_model="numpy")
def bsqrt(a):
    """The square root, of what is not negative."""
    root = between(math.sqrt(max(low(a), 0.0)) * (1.0 - 1e-15), math.sqrt(high(a)) * (1.0 + 1e-15))
    return root[0], root[1] * GROW + TINY


@njit(cache=True, nogil=True, error_model="numpy")
def bexp(a):
    """The exponential."""
    c = math.exp(a[0])
    return c, c * (math.expm1(a[1]) + TOLD) * (1.0 + TOLD) * GROW + TINY


@njit(cache=True, nogil=True, error_model="numpy")
def blog(a):
    """The logarithm, of what is positive."""
    least, most = math.log(low(a)), math.log(high(a))
    return between(least - TOLD * abs(least) - TINY, most + TOLD * abs(most) + TINY)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def babs(a):
    """The absolute value."""
    return (abs(a[0]), a[1]) if abs(a[0]) >= a[1] else between(0.0, size(a))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bmax(a, b):
    """The greater one."""
    return between(max(low(a), low(b)), max(high(a), high(b)))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bmin(a, b):
    """The lesser one."""
    return between(min(low(a), low(b)), min(high(a), high(b)))


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def btwin(y, more):
    """The remainders of `twin`, of y and exp x - 1."""
    plain, rest = bgrowth((-2.0 * y[0], 2.0 * y[1]))
    half = (-0.5, 0.0)
    return bmul(half, bmul(plain, badd((1.0, 0.0), more))), bmul(half, badd(bmul(plain, more), rest))


@njit(cache=True, nogil=True, error_model="numpy")
def bangle(phi):
    """A phase with its cosine less one and its sine, as `angle`."""
    less, sine, _ = bwave(phi)
    return phi, less, sine


@njit(cache=True, nogil=True, error_model="numpy")
def reduced(phi):
    """The phase less whole turns, its centre in [0, 2 pi), and these turns."""
    whole = np.floor(phi[0] / (2.0 * math.pi))
    turns = bmul((whole, 0.0), (2.0 * math.pi, 2.0 * PI_REST))
    return bsub(phi, turns), turns
