"""Bounds on the time derivatives of sets of flights, for all times."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import ball_in, size
from nsmaps.exact.engine.flight.layout import AT_CHAINS, AT_RATES, CHAIN, CHAIN_POWER, CHAINED, DIFFERENCE_RE, POWERS, SIMPLE
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.jit import inner


@inner
def ball_bounds(p, c):
    """Bounds on |jerk| and |snap| of flights for all times, with coefficients from index c; infinite for flights that grow."""
    t = p.table
    n, plain, k, rates = int(t[POWERS]), int(t[SIMPLE]), c, int(t[AT_RATES])
    jerk, snap = (math.inf, math.inf) if n > 1 else (0.0, 0.0)
    k += 2 * n
    b0, b1, b2, b3 = 0.0, 0.0, 0.0, 0.0
    for i in range(plain + int(t[CHAINED])):
        (alpha, omega), power = pair(t, rates, i), 0
        speed = math.sqrt(alpha**2 + omega**2)
        if i >= plain:
            at = int(t[AT_CHAINS]) + CHAIN * (i - plain)
            power = int(t[at + CHAIN_POWER])
            alpha = max(alpha, alpha - t[at + DIFFERENCE_RE])
        if power == 0:
            b0, b1, b2, b3 = 0.0, 0.0, 0.0, 0.0
        greatest = math.inf if alpha > 0.0 or (power > 0 and alpha == 0.0) else 1.0
        for m in range(1, power + 1):  # s^n exp(alpha s)/n! is greatest at s = -n/alpha
            greatest *= power / (math.e * -alpha * m) if alpha < 0.0 else 1.0
        x, y = size(ball_in(t, k)), size(ball_in(t, k + 2))
        weight = math.sqrt(x * x + y * y)
        first = speed * greatest + b0
        second = speed * first + b1
        third = speed * second + b2
        jerk, snap = jerk + weight * third, snap + weight * (speed * third + b3)
        b0, b1, b2, b3 = greatest, first, second, third
        k += 4
    return jerk, snap
