"""The remainders of cos, sin and exp without their first terms, computed without cancellation.

Only sums, products and scaling by powers of two are used, each rounded separately; `docs/numerics.md` derives bounds on the
errors of the results.
"""

import math

import numpy as np

from nsmaps.exact.engine.jit import inlined, inner

# pi/2 and ln 2 in parts (Cody and Waite): integer multiples of the first parts, up to 2^20, are floats
QUARTER, QUARTER_1, QUARTER_2 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
DOUBLING, DOUBLING_1 = 0.6931471803691238, 1.9082149292705877e-10
FARTHEST = 709.0  # beyond, exp is infinite, or negligible beside one


# fmt: off
@inlined
def near_zero(y):
    """sin y - y and cos y - 1 for |y| <= pi/4.

    Minimax polynomials in z = y^2 for (sin y - y)/(y z) and (cos y - 1 + z/2)/z^2, with errors of 3.3e-17 and 2.5e-18, in pairs
    that can be evaluated in parallel.
    """
    z = y * y
    zz = z * z
    r = y * z * ((-0.16666666666666664621 + z * 0.0083333333333309461029)
        + zz * ((-0.00019841269836754970014 + z * 2.755731610068302914e-6)
        + zz * (-2.5051131455427947391e-8 + z * 1.5918101230274120351e-10)))
    c = -0.5 * z + zz * ((0.041666666666666665387 - z * 0.0013888888888887395746)
        + zz * ((0.000024801587298763433164 - z * 2.7557317270560324065e-7)
        + zz * (2.0876146024689746601e-9 - z * 1.1382614868556324578e-11)))
    return r, c


@inlined
def growth_near_zero(x):
    """exp x - 1 - x for |x| <= 1/2."""
    z = x * x
    zz = z * z
    return z * (((1 / 2 + x * (1 / 6)) + z * (1 / 24 + x * (1 / 120)))
        + zz * (((1 / 720 + x * (1 / 5040)) + z * (1 / 40320 + x * (1 / 362880)))
        + zz * (((1 / 3628800 + x * (1 / 39916800)) + z * (1 / 479001600 + x * (1 / 6227020800))) + zz * (1 / 87178291200))))
# fmt: on


@inlined
def wave(x):
    """cos x - 1, sin x and sin x - x for |x| <= 1e6, each to a few units in its last place.

    The reduction to |y| <= pi/4 is made once: x is y plus q quarter turns.
    """
    q = np.floor(x * 0.6366197723675814 + 0.5)
    y = ((x - q * QUARTER) - q * QUARTER_1) - q * QUARTER_2
    r, c = near_zero(y)
    k = q - 4.0 * np.floor(0.25 * q)
    odd, far = k == 1.0 or k == 3.0, k >= 2.0
    sine, less = 1.0 + c if odd else y + r, -1.0 - (y + r) if odd else c
    sine, less = -sine if far else sine, -2.0 - less if far else less
    return less, sine, r if q == 0.0 else sine - x


@inner
def doubled(x):
    """Decomposition of exp x for |x| <= 709: (n, exp y - 1), where x is y plus n ln 2."""
    n = np.floor(x * 1.4426950408889634 + 0.5)
    y = (x - n * DOUBLING) - n * DOUBLING_1
    return int(n), y + growth_near_zero(y)


@inner
def growth(x):
    """exp x - 1 and exp x - 1 - x, each to a few units in its last place."""
    if abs(x) <= 0.5:
        e = growth_near_zero(x)
        return x + e, e
    if not abs(x) <= FARTHEST:
        e = math.inf if x > 0.0 else -1.0 if x < 0.0 else x
        return e, e - x if x < 0.0 else e
    n, more = doubled(x)
    scale = math.ldexp(1.0, n)
    e = scale * more + (scale - 1.0)
    return e, e - x


@inlined
def remainders(alpha, omega, s):
    """For x = (alpha + i omega) s the real and imaginary parts of exp x - 1 - x and of exp x - 1."""
    if alpha == 0.0:
        less, sine, sine_remainder = wave(omega * s)
        return less, sine_remainder, less, sine
    x, e = growth(alpha * s)
    if omega == 0.0:
        return e, 0.0, x, 0.0
    less, sine, sine_remainder = wave(omega * s)
    return e + (1.0 + x) * less, x * (omega * s) + (1.0 + x) * sine_remainder, x + (1.0 + x) * less, (1.0 + x) * sine
