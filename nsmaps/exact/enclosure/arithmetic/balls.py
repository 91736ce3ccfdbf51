"""Balls: numbers known up to a radius, in an arithmetic that rounds outward.

The result of every operation contains the results for all numbers of its operands: a bound on the rounding error of the centre,
at least one unit in its last place, is added to the radius, and then a bound on the rounding error of the radius (S. M. Rump,
Acta Numerica 19, 2010, section 10). An infinite or NaN radius states that nothing is known.
"""

import math
from typing import NamedTuple

from nsmaps.exact.engine.jit import inlined, inner

UNIT = 2.3e-16  #: more than 2^-52: at least one unit in the last place
GROW = 1.0 + 2e-15  #: more than a few roundings of a radius
TINY = 1e-300  #: more than underflow loses
PI_REST = 1.3e-16  #: more than |pi - fl(pi)|
SHRINK, ENLARGE = 1.0 - 1e-15, 1.0 + 1e-15  #: beyond the roundings of a difference, of a square root
RADIUS = 1  #: place of the radius in an array, after that of the centre


class Ball(NamedTuple):
    """All numbers within a radius of a centre."""

    centre: float
    radius: float


ZERO, ONE, TURN = Ball(0.0, 0.0), Ball(1.0, 0.0), Ball(2.0 * math.pi, 2.0 * PI_REST)


@inlined
def badd(a, b):
    """The sum."""
    c = a.centre + b.centre
    return Ball(c, (a.radius + b.radius + UNIT * abs(c)) * GROW)


@inlined
def bneg(a):
    """The negative."""
    return Ball(-a.centre, a.radius)


@inlined
def bsub(a, b):
    """The difference."""
    c = a.centre - b.centre
    return Ball(c, (a.radius + b.radius + UNIT * abs(c)) * GROW)


@inlined
def spread_of_product(a, b):
    """The radius of a product, without rounding."""
    return abs(a.centre) * b.radius + a.radius * (abs(b.centre) + b.radius)


@inlined
def bmul(a, b):
    """The product."""
    c = a.centre * b.centre
    return Ball(c, (spread_of_product(a, b) + UNIT * abs(c)) * GROW + TINY)


@inlined
def bplus(a, x, y):
    """The sum a + x y, with one enlargement of the radius for all rounding errors."""
    p = x.centre * y.centre
    c = a.centre + p
    return Ball(c, (a.radius + spread_of_product(x, y) + UNIT * (abs(p) + abs(c))) * GROW + TINY)


@inlined
def bdot(x, y, u, v):
    """The sum x u + y v, as in `bplus`."""
    p, q = x.centre * u.centre, y.centre * v.centre
    c = p + q
    r = spread_of_product(x, u) + spread_of_product(y, v)
    return Ball(c, (r + UNIT * (abs(p) + abs(q) + abs(c))) * GROW + TINY)


@inlined
def binv(a):
    """The reciprocal; its radius is infinite where the ball contains zero."""
    lower = (abs(a.centre) - a.radius) * SHRINK
    c = 1.0 / a.centre
    r = (a.radius * abs(c) / lower + UNIT * abs(c)) * GROW + TINY
    return Ball(c, r if lower > 0.0 else math.inf)


@inlined
def low(a):
    """A lower bound on the ball."""
    return a.centre - a.radius - UNIT * (abs(a.centre) + a.radius)


@inlined
def high(a):
    """An upper bound on the ball."""
    return a.centre + a.radius + UNIT * (abs(a.centre) + a.radius)


@inlined
def size(a):
    """A bound on the absolute value."""
    return (abs(a.centre) + a.radius) * GROW


@inlined
def exact(x):
    """The ball of one number."""
    return Ball(x, 0.0)


@inlined
def bhalf(a):
    """Half of a ball: exact."""
    return Ball(0.5 * a.centre, 0.5 * a.radius)


@inlined
def btwice(a):
    """Twice a ball: exact."""
    return Ball(2.0 * a.centre, 2.0 * a.radius)


@inlined
def widen(a, r):
    """A ball with a radius larger by r."""
    return Ball(a.centre, (a.radius + r) * GROW)


@inlined
def between(lower, upper):
    """The ball of all numbers between two bounds."""
    c = 0.5 * (lower + upper)
    return Ball(c, max(c - lower, upper - c) * GROW)


@inlined
def bhull(a, b):
    """A ball that contains two balls."""
    return between(min(low(a), low(b)), max(high(a), high(b)))


@inlined
def bmeet(a, b):
    """A ball that contains the intersection of two; the second may be unbounded."""
    lower, upper = low(b), high(b)
    return between(lower if lower > low(a) else low(a), upper if upper < high(a) else high(a))


@inner
def bsqrt(a):
    """The square root of a ball of nonnegative numbers."""
    root = between(math.sqrt(max(low(a), 0.0)) * SHRINK, math.sqrt(high(a)) * ENLARGE)
    return Ball(root.centre, root.radius * GROW + TINY)


@inlined
def babs(a):
    """The absolute value."""
    return Ball(abs(a.centre), a.radius) if abs(a.centre) >= a.radius else between(0.0, size(a))


@inlined
def bmax(a, b):
    """The maximum."""
    return between(max(low(a), low(b)), max(high(a), high(b)))


@inlined
def bmin(a, b):
    """The minimum."""
    return between(min(low(a), low(b)), min(high(a), high(b)))


@inlined
def ball_of(x):
    """The ball of all numbers that round to x."""
    return Ball(x, UNIT * abs(x))


@inlined
def ball_in(numbers, k):
    """The ball at place k of an array."""
    return Ball(numbers[k], numbers[k + RADIUS])


@inlined
def two_balls(numbers, k):
    """The balls from place k of an array on."""
    return ball_in(numbers, k), ball_in(numbers, k + 2)


@inlined
def four_balls(numbers, k):
    """The balls from place k of an array on."""
    return *two_balls(numbers, k), *two_balls(numbers, k + 4)


@inlined
def put_ball(numbers, k, ball):
    """Write a ball at place k of an array."""
    numbers[k], numbers[k + RADIUS] = ball.centre, ball.radius


@inlined
def put_balls(numbers, k, balls):
    """Write balls from place k of an array on."""
    for ball in balls:
        put_ball(numbers, k, ball)
        k += 2
