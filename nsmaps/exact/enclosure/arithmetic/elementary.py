"""sin, cos, exp and log of balls, from sums, products and powers of two alone; no library function is trusted.

Bounds on the errors of `wave` and `growth` are derived in `docs/explanation/numerics.md` and checked by the tests, in
rational arithmetic and in intervals of many digits; the constants here are those bounds, rounded up. Arguments are numbers
without units, angles in radians.
"""

import math
from typing import NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import ONE, TINY, Ball, between, bmul, bsub, exact, high, low, size
from nsmaps.exact.engine.constants import FARTHEST, THREE
from nsmaps.exact.engine.flight.remainders import growth, reduce_exponent, wave
from nsmaps.exact.engine.jit import inner

COSINE_OFF, SINE_OFF, REST_OFF = 2e-15, 1e-15, 5e-15  # relative error of cos - 1, sin and sin - x
GROWTH_OFF, BEND_OFF, EXP_OFF = 1e-15, 4e-15, 1e-15  # relative error of exp - 1, exp - 1 - x and exp itself
PARTS_OFF, MOST_ANGLE = 1e-36, 1e6  # error of the reduction to quarter turns, per radian; radians up to which it holds
WIDER = 1.0 + 8e-15  # more than the error of a radius computed from these functions with a few roundings


class BallPhase(NamedTuple):
    """Phases of the forcing."""

    phi: Ball
    less: Ball  #: its cosine minus one
    sine: Ball


@inner
def bwave(a):
    """The remainders cos - 1, sin and sin - x, by angle addition of the radius h: sin h <= h, 1 - cos h <= h^2/2."""
    x, h = a
    less, sine, remainder = wave(x)
    lost = PARTS_OFF * abs(x) if abs(x) <= MOST_ANGLE else math.inf
    s, c, q = abs(sine) + lost, abs(1.0 + less) + COSINE_OFF, 0.5 * h * h
    return (
        Ball(less, (min(s * h + c * q, 2.0) + COSINE_OFF * abs(less) + lost) * WIDER + TINY),
        Ball(sine, (min(c * h + s * q, 2.0) + SINE_OFF * s + lost) * WIDER + TINY),
        Ball(remainder, (min(abs(less) * h + s * q + h * q / THREE, 2.0 + h) + REST_OFF * abs(remainder) + lost) * WIDER + TINY),
    )


@inner
def bgrowth(a):
    """The remainders exp - 1 and exp - 1 - x, by exp(x + h) - exp x = (exp h - 1) exp x."""
    x, h = a
    plain, remainder = growth(x)
    more, bend = growth(h)
    whole = 1.0 + plain + 2.0 * GROWTH_OFF
    return (
        Ball(plain, (whole * more + GROWTH_OFF * abs(plain)) * WIDER + TINY),
        Ball(remainder, (abs(plain) * h + whole * bend + BEND_OFF * abs(remainder)) * WIDER + TINY),
    )


@inner
def bexp(a):
    """The exponential; beyond `FARTHEST` the bound is infinite, and below -`FARTHEST` the ball reaches from zero."""
    x, h = a
    n, more = reduce_exponent(min(max(x, -FARTHEST), FARTHEST))
    c = math.ldexp(1.0 + more, n)
    off, (more, _) = EXP_OFF if abs(x) <= FARTHEST else 1.0 if x < 0.0 else math.inf, growth(h)
    return Ball(c, c * (more + off) * WIDER + TINY)


@inner
def log_of(x):
    """The logarithm of a number, from an approximation c by log x = c + log(1 + w) with w = x exp(-c) - 1."""
    c = math.log(x)
    w = size(bsub(bmul(exact(x), bexp(exact(-c))), ONE))
    return Ball(c, w / (1.0 - w) * WIDER if w < 0.5 else math.inf)


@inner
def blog(a):
    """The logarithm of a ball of positive numbers."""
    return between(low(log_of(low(a))), high(log_of(high(a))))


@inner
def bangle(phi):
    """A phase with its cosine and sine, as in `angle`."""
    less, sine, _ = bwave(phi)
    return BallPhase(phi, less, sine)
