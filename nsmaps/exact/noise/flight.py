"""Flights under noise: the contribution of the noise as a quintic over a step, and the time at which a wall is met in it.

The exact steps, after D. T. Gillespie (Phys. Rev. E 54, 1996), and the impacts are in `orbit.py`.
"""

import math
from typing import NamedTuple

from nsmaps.exact.engine.constants import ROUNDING
from nsmaps.exact.engine.flight.flow import evaluate, start
from nsmaps.exact.engine.jit import inlined, inner

LAW, ROOT = range(2)  # of an exact step: transition, and a root of the covariance
N, RATE, ETA = range(3)  # and their rows: place, velocity and noise
HOP = 2.5  # times -u/b, a quarter longer than the hop with this acceleration throughout: within it a low one is over
HALVINGS = 60  # of a bracket, to rounding


class Expansion(NamedTuple):
    """A quintic about some time: its value there and the coefficients of the powers of the time since then."""

    value: float
    rate: float  #: of the first power
    second: float
    third: float
    fourth: float
    fifth: float


@inner
def noise_over(normals, step, eta):
    """The contribution of the noise over a step of as many exact ones as there are normals: place, velocity (from zero), eta."""
    n, m = 0.0, 0.0
    for x, y, z in normals:
        n, m, eta = (
            transition_row(step, N, n, m, eta) + step[ROOT, N, N] * x,
            transition_row(step, RATE, n, m, eta) + step[ROOT, RATE, N] * x + step[ROOT, RATE, RATE] * y,
            step[LAW, ETA, ETA] * eta + step[ROOT, ETA, N] * x + step[ROOT, ETA, RATE] * y + step[ROOT, ETA, ETA] * z,
        )
    return n, m, eta


@inlined
def transition_row(step, row, n, m, eta):
    """A row of the transition over an exact step."""
    return step[LAW, row, N] * n + step[LAW, row, RATE] * m + step[LAW, row, ETA] * eta


@inner
def quintic(h, first, n, m, last):
    """Coefficients of s^2 to s^5 of the polynomial with place and rate 0 and second rate `first` at 0, these values after h."""
    b = first * 0.5
    n, m, a = (n - b * h * h) / (h * h), (m - first * h) / h, last - first
    return b, (10 * n - 4 * m + 0.5 * a) / h, (7 * m - 15 * n - a) / (h * h), (6 * n - 3 * m + 0.5 * a) / (h * h * h)


@inner
def expand_about(q, s):
    """The quintic about s."""
    b, c, d, e = q
    return Expansion(
        s * s * (b + s * (c + s * (d + s * e))),
        s * (2.0 * b + s * (3 * c + s * (4 * d + s * 5 * e))),
        b + s * (3 * c + s * (6 * d + s * 10 * e)),
        c + s * (4 * d + s * 10 * e),
        d + 5 * s * e,
        e,
    )


@inner
def position_at(p, n, x):
    """The displacement of the ball a time x after its last event, and its velocity."""
    d, v, _, _, _, _ = evaluate(p, x)
    d += x * (n.rate + x * (n.second + x * (n.third + x * (n.fourth + x * n.fifth))))
    return d, v + n.rate + x * (2.0 * n.second + x * (3 * n.third + x * (4 * n.fourth + x * 5 * n.fifth)))


@inner
def gap(p, n, sign, room, x):
    """The gap to the wall on one side, and its rate."""
    d, v = position_at(p, n, x)
    return room - sign * d, -sign * v


@inner
def is_closed(p, n, sign, x):
    """True if the ball is not clear of the wall just left."""
    y, _ = gap(p, n, sign, 0.0, x)
    return not y > 0.0


@inner
def time_of_minimum(p, n, sign, room, end):
    """The time at which a gap that shrinks at first and grows in the end is least, by bisection."""
    low, high = 0.0, end
    for _ in range(HALVINGS):
        x = 0.5 * (low + high)
        _, u = gap(p, n, sign, room, x)
        if u < 0.0:
            low = x
        else:
            high = x
    return 0.5 * (low + high)


@inner
def zero_of_gap(p, n, sign, room, low, high):
    """The zero of a gap that is positive at `low` and not at `high`, by Newton steps within the bracket."""
    x = high
    for _ in range(100):
        y, u = gap(p, n, sign, room, x)
        if y > 0.0:
            low = x
        else:
            high = x
        at = x - y / u if u < 0.0 else low
        at = at if low < at and at < high else 0.5 * (low + high)
        if abs(at - x) <= ROUNDING * high:
            return at
        x = at
    return x


@inner
def time_to_wall(p, n, sign, room, end):
    """The time at which a wall that the ball is clear of is first met, or infinity: the gap closes at the end or its minimum."""
    y, u = gap(p, n, sign, room, end)
    if y > 0.0:
        if not u > 0.0:
            return math.inf
        _, u = gap(p, n, sign, room, 0.0)
        if not u < 0.0:
            return math.inf
        end = time_of_minimum(p, n, sign, room, end)
        y, _ = gap(p, n, sign, room, end)
        if y > 0.0:
            return math.inf
    return zero_of_gap(p, n, sign, room, 0.0, end)


@inner
def time_to_same_wall(p, n, sign, end):
    """The time at which the wall just left is met again, or infinity; zero if the ball does not lift off."""
    _, u = gap(p, n, sign, 0.0, 0.0)
    a, _, _, _ = start(p)
    b = -sign * (a + 2.0 * n.second)
    hop = -HOP * u / b if b < 0.0 else math.inf
    if hop < end and is_closed(p, n, sign, hop):
        end = hop
    elif not is_closed(p, n, sign, end):
        return math.inf
    low = end
    for _ in range(HALVINGS):
        low *= 0.5
        if not is_closed(p, n, sign, low):
            return zero_of_gap(p, n, sign, 0.0, low, 2.0 * low)
    return 0.0
