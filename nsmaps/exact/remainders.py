"""What is left of cos, sin and exp when their first terms are taken away, without cancellation.

Like `flight.py`, this file is copied behind the flow that is generated for a system; it may be imported by itself as well.
"""

import math

from numba import njit

# === engine ===


# fmt: off
@njit(cache=True, nogil=True, error_model="numpy")
def wave(x):
    """cos x - 1, sin x and sin x - x for x >= 0, each to a few units in its last place.

    One reduction to |y| <= pi/4 by pi/2 in three parts (Cody and Waite), then Taylor's polynomials.
    """
    q = math.floor(x * 0.6366197723675814 + 0.5)
    y = ((x - q * 1.5707963267341256) - q * 6.077100506303966e-11) - q * 2.0222662487959506e-21
    z = y * y
    r = y * z * (-1.6666666666666666e-01 + z * (8.333333333333333e-03 + z * (-1.984126984126984e-04
        + z * (2.7557319223985893e-06 + z * (-2.505210838544172e-08 + z * (1.6059043836821613e-10
        + z * (-7.647163731819816e-13 + z * 2.8114572543455206e-15)))))))
    c = z * (-0.5 + z * (4.1666666666666664e-02 + z * (-1.388888888888889e-03 + z * (2.48015873015873e-05
        + z * (-2.755731922398589e-07 + z * (2.08767569878681e-09 + z * (-1.1470745597729725e-11
        + z * (4.779477332387385e-14 - z * 1.5619206968586225e-16))))))))
    if q == 0.0:
        return c, y + r, r
    k = int(q) & 3
    if k == 0:
        return c, y + r, (y + r) - x
    if k == 1:
        return -(y + r) - 1.0, 1.0 + c, (1.0 + c) - x
    if k == 2:
        return -2.0 - c, -(y + r), -(y + r) - x
    return (y + r) - 1.0, -1.0 - c, (-1.0 - c) - x


@njit(cache=True, nogil=True, error_model="numpy")
def growth(x):
    """exp x - 1 and exp x - 1 - x, each to a few units in its last place."""
    if abs(x) > 0.5:
        e = math.expm1(x)
        return e, e - x
    e = x * x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040 + x * (1 / 40320
        + x * (1 / 362880 + x * (1 / 3628800 + x * (1 / 39916800 + x * (1 / 479001600 + x * (1 / 6227020800
        + x / 87178291200))))))))))))
    return x + e, e
# fmt: on
