"""Flights under noise: the contribution of the noise as a quintic over a step, and the time at which a wall is met in it.

The exact steps and the impacts are in `orbit.py`.
"""

import math

from nsmaps.exact.engine.flight.flow import evaluate, start
from nsmaps.exact.engine.jit import inner


@inner
def noise_over(normals, step, eta):
    """The contribution of the noise over a step of as many exact ones as there are normals: place and velocity, from zero, and
    eta.
    """
    n, m = 0.0, 0.0
    for x, y, z in normals:
        n, m, eta = (
            step[0, 0, 0] * n + step[0, 0, 1] * m + step[0, 0, 2] * eta + step[1, 0, 0] * x,
            step[0, 1, 0] * n + step[0, 1, 1] * m + step[0, 1, 2] * eta + step[1, 1, 0] * x + step[1, 1, 1] * y,
            step[0, 2, 2] * eta + step[1, 2, 0] * x + step[1, 2, 1] * y + step[1, 2, 2] * z,
        )
    return n, m, eta


@inner
def quintic(h, first, n, m, last):
    """The polynomial with place and rate zero and second rate `first` at zero, and these values after h: its coefficients of s^2
    to s^5.
    """
    b = first * 0.5
    n, m, a = (n - b * h * h) / (h * h), (m - first * h) / h, last - first
    return b, (10.0 * n - 4.0 * m + 0.5 * a) / h, (7.0 * m - 15.0 * n - a) / (h * h), (6.0 * n - 3.0 * m + 0.5 * a) / (h * h * h)


@inner
def shifted(q, s):
    """The quintic about s: its value, and its coefficients of x to x^5."""
    b, c, d, e = q
    return (
        s * s * (b + s * (c + s * (d + s * e))),
        s * (2.0 * b + s * (3.0 * c + s * (4.0 * d + s * 5.0 * e))),
        b + s * (3.0 * c + s * (6.0 * d + s * 10.0 * e)),
        c + s * (4.0 * d + s * 10.0 * e),
        d + 5.0 * s * e,
        e,
    )


@inner
def moved(p, n, x):
    """The displacement of the ball a time x after its last event, and its velocity."""
    d, v, _, _, _, _ = evaluate(p, x)
    _, m, a, b, e, f = n
    d += x * (m + x * (a + x * (b + x * (e + x * f))))
    return d, v + m + x * (2.0 * a + x * (3.0 * b + x * (4.0 * e + x * 5.0 * f)))


@inner
def gap(p, n, sign, room, x):
    """The gap to the wall on one side, and its rate."""
    d, v = moved(p, n, x)
    return room - sign * d, -sign * v


@inner
def least(p, n, sign, room, end):
    """The time at which a gap that shrinks at first and grows in the end is least, by bisection."""
    low, high = 0.0, end
    for _ in range(60):
        x = 0.5 * (low + high)
        if gap(p, n, sign, room, x)[1] < 0.0:
            low = x
        else:
            high = x
    return 0.5 * (low + high)


@inner
def root(p, n, sign, room, low, high):
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
        if abs(at - x) <= 1e-15 * high:
            return at
        x = at
    return x


@inner
def met_ahead(p, n, sign, room, end):
    """The time at which a wall that the ball is clear of is first met, or infinity: its gap is closed at the end, or where it is
    least.
    """
    y, u = gap(p, n, sign, room, end)
    if y > 0.0:
        if not (u > 0.0 and gap(p, n, sign, room, 0.0)[1] < 0.0):
            return math.inf
        end = least(p, n, sign, room, end)
        if gap(p, n, sign, room, end)[0] > 0.0:
            return math.inf
    return root(p, n, sign, room, 0.0, end)


@inner
def met_again(p, n, sign, end):
    """The time at which the wall just left is met again, or infinity; zero if the ball does not lift off."""
    u, b = gap(p, n, sign, 0.0, 0.0)[1], -sign * (start(p)[0] + 2.0 * n[2])
    hop = -2.5 * u / b if b < 0.0 else math.inf  # a quarter longer than with this acceleration throughout
    if hop < end and gap(p, n, sign, 0.0, hop)[0] <= 0.0:
        end = hop
    elif gap(p, n, sign, 0.0, end)[0] > 0.0:
        return math.inf
    low = end
    for _ in range(60):
        low *= 0.5
        if gap(p, n, sign, 0.0, low)[0] > 0.0:
            return root(p, n, sign, 0.0, low, 2.0 * low)
    return 0.0
