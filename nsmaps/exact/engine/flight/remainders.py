"""The remainders of cos, sin and exp without their first terms, computed without cancellation.

Only sums, products and scaling by powers of two are used, each rounded separately. Arguments are numbers without units, angles
in radians. Bounds on the errors, with u = 2**-53:

Reduction: with q the integer nearest to 2 x/pi, y = ((x - q P) - q P') - q P'' with parts P, P', P'' of pi/2 (Cody and Waite). P
and P' have 33 bits, so up to q = 2**20 their multiples are floats, and the first difference is exact (Sterbenz). The second is
exact too, or not below q P'/2, next to which q P'' is 1e-10. Two roundings of relative size u remain, and the parts omit 1.1e-37
of pi/2: |dy| <= 2.001 u |y| + 1e-36 |x|, and for |x| <= 1e6 |y| < pi/4 + 1e-9. For exp, x - n log(2) in two parts has one
rounding: |dy| <= 1.001 u |y| + 1e-22, |y| <= log(2)/2 + 1e-12.

Truncation: in rational arithmetic the polynomials with their float coefficients differ from (sin(y) - y)/y**3 by less than
3.3e-17, from (cos(y) - 1)/y**4 by less than 2.5e-18 (|y| <= 0.7853982), and from (exp(x) - 1 - x)/x**2 by less than 1.1e-16
(|x| <= 1/2).

Rounding: in a running error analysis the code is executed on numbers that carry an interval and an error bound, over pieces that
cover [1e-6, pi/4] and its mirror image. Below 1e-6 the terms after the first are less than 1e-13 of it.
"""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.exact.engine.constants import (
    COSINE_4,
    COSINE_6,
    COSINE_8,
    COSINE_10,
    COSINE_12,
    COSINE_14,
    DOUBLING,
    DOUBLING_1,
    FARTHEST,
    FOUR,
    FOURTH,
    OVER_DOUBLING,
    OVER_QUARTER,
    QUARTER,
    QUARTER_1,
    QUARTER_2,
    SINE_3,
    SINE_5,
    SINE_7,
    SINE_9,
    SINE_11,
    SINE_13,
    THREE,
)
from nsmaps.exact.engine.jit import inlined, inner


@inlined
def near_zero(y):
    """sin y - y and cos y - 1 for |y| <= pi/4: polynomials, in pairs of terms that can be evaluated in parallel."""
    z = y * y
    zz = z * z
    r = y * z * ((SINE_3 + z * SINE_5) + zz * ((SINE_7 + z * SINE_9) + zz * (SINE_11 + z * SINE_13)))
    c = -0.5 * z + zz * ((COSINE_4 + z * COSINE_6) + zz * ((COSINE_8 + z * COSINE_10) + zz * (COSINE_12 + z * COSINE_14)))
    return r, c


# fmt: off
@inlined
def growth_near_zero(x):
    """exp x - 1 - x for |x| <= 1/2: its Taylor series."""
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
    q = np.floor(x * OVER_QUARTER + 0.5)
    y = ((x - q * QUARTER) - q * QUARTER_1) - q * QUARTER_2
    r, c = near_zero(y)
    k = q - FOUR * np.floor(FOURTH * q)
    odd, far = k == 1.0 or k == THREE, k >= 2.0
    sine, less = 1.0 + c if odd else y + r, -1.0 - (y + r) if odd else c
    sine, less = -sine if far else sine, -2.0 - less if far else less
    return less, sine, r if q == 0.0 else sine - x


@inner
def reduce_exponent(x):
    """Decomposition of exp x for |x| <= 709: (n, exp y - 1), where x is y plus n ln 2."""
    n = np.floor(x * OVER_DOUBLING + 0.5)
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
    n, more = reduce_exponent(x)
    scale = math.ldexp(1.0, n)
    e = scale * more + (scale - 1.0)
    return e, e - x


class Remainders(NamedTuple):
    """For a complex x, real and imaginary parts."""

    two_re: float  #: of exp x - 1 - x
    two_im: float
    one_re: float  #: of exp x - 1
    one_im: float


@inlined
def remainders(alpha, omega, s):
    """The remainders of exp x for x = (alpha + i omega) s."""
    if alpha == 0.0:
        less, sine, sine_remainder = wave(omega * s)
        return Remainders(less, sine_remainder, less, sine)
    x, e = growth(alpha * s)
    if omega == 0.0:
        return Remainders(e, 0.0, x, 0.0)
    less, sine, sine_remainder = wave(omega * s)
    two_im = x * (omega * s) + (1.0 + x) * sine_remainder
    return Remainders(e + (1.0 + x) * less, two_im, x + (1.0 + x) * less, (1.0 + x) * sine)
