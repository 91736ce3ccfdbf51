"""The first zero of a polynomial that is positive before it, with a certificate: no step can pass one.

The arguments are those of `nsmaps.exact.engine.steps`, here for a Taylor series with a bound on what it leaves out. Times are in
units of the piece over which the polynomial is a series.
"""

import math
from typing import NamedTuple

from nsmaps.exact.engine.constants import BRACKET, INWARD, OUTWARD
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.steps import Gap, careful_step, departure, first_step, surely_reached
from nsmaps.exact.modes.tables.polynomials import BERNSTEIN
from nsmaps.exact.modes.tables.taylor import (
    CONSTANT,
    CUBE,
    EQUAL,
    LINEAR,
    ORDER,
    ROUNDING,
    SAFE,
    SIX,
    SQUARE,
    TERMS,
    write_powers,
)

MOST_STEPS = 10_000
MOST_TURNS = 1_000  # minima and maxima within one series
CLOSE = 2e-16  # of a zero: rounding
FAINT = 1e-300  # a rate that is not zero
MOST_NEWTON_STEPS = 100  # of one zero, with bisection where they fail
NONE, ONE, UNKNOWN = range(3)  # zeros of a polynomial, by its changes of sign


class Zero(NamedTuple):
    """The first zero of a function in a piece of a flight."""

    found: bool
    time: float  #: in units of the piece; without a zero the time up to which there is none
    doubtful: bool


@inner
def with_rates(a, x):
    """A polynomial at x, shape (TERMS,), with its first three derivatives: a `Gap` whose further ones are zero."""
    y, u, b, j = a[ORDER], 0.0, 0.0, 0.0
    for m in range(ORDER - 1, -1, -1):
        j = j * x + b
        b = b * x + u
        u = u * x + y
        y = y * x + a[m]
    return Gap(y, u, 2.0 * b, SIX * j, 0.0, 0.0)


@inner
def limits(a, x):
    """Bounds on the sizes of the second, third and fourth derivative over [0, x]."""
    snap, power = 0.0, 1.0
    for k in range(CUBE + 1, ORDER + 1):
        snap += k * (k - 1) * (k - 2) * (k - 3) * abs(a[k]) * power
        power *= x
    jerk = SIX * abs(a[CUBE]) + x * snap
    return (2.0 * abs(a[SQUARE]) + x * jerk) * OUTWARD, jerk * OUTWARD, snap * OUTWARD


@inner
def size_of(a, x):
    """The sum of the sizes of a polynomial's terms at x."""
    size = abs(a[ORDER])
    for k in range(ORDER - 1, -1, -1):
        size = size * x + abs(a[k])
    return size


@inner
def value(a, x):
    """A polynomial at x and its derivative."""
    y, u = a[ORDER], 0.0
    for m in range(ORDER - 1, -1, -1):
        u = u * x + y
        y = y * x + a[m]
    return y, u


@inner
def newton_step(y, u, low, x, high, bend):
    """A step of Newton's method, or of bisection, to a zero between low and high: (low, next x, high, whether it is there).

    It is there as soon as `bend`, a bound on the second derivative, leaves less than rounding to the step of Newton's method.
    """
    low, high = x if y > 0.0 else low, high if y > 0.0 else x
    step = -y / u if u < 0.0 else (0.0 if y == 0.0 else math.inf)
    newton = low <= x + step <= high
    new = x + step if newton else 0.5 * (low + high)
    return low, new, high, (newton and step * step * bend <= -CLOSE * new * u) or abs(new - x) <= CLOSE * new


@inner
def changes(b, on, error):
    """Zeros of a polynomial in (0, 1], by its coefficients b in the basis of Bernstein, (TERMS,): (NONE, ONE or UNKNOWN; where).

    With `on` it begins at zero. Coefficients within the error count as unknown. `where` is about the zero if there is one, else
    a place at which the polynomial is negative, or zero if that is not known.
    """
    zero = b[CONSTANT] if on else 0.0
    first = 1 if on or 0.0 <= b[CONSTANT] <= error else 0
    above, below = 0, 0
    for k in range(ORDER + 1):
        above += 1 if b[k] - zero > error else 0
        below += 1 if b[k] - zero < -error else 0
    if above == ORDER + 1 - first:
        return NONE, 1.0
    m = first
    while m <= ORDER and b[m] - zero > error:
        m += 1
    if m > first and m == above + first and above + below == ORDER + 1 - first:
        positive = m - 1
        high = b[positive] - zero
        return ONE, (m - 1 + high / (high - (b[m] - zero))) / ORDER
    least = m
    for k in range(m, ORDER + 1):
        least = k if b[k] < b[least] else least
    return UNKNOWN, least / ORDER if m > first and b[least] - zero < -error else 0.0


@inner
def write_bernstein(a, far, powers, b):
    """Write the coefficients of a polynomial over [0, far] in the basis of Bernstein, both of shape (TERMS,)."""
    write_powers(far, powers)
    for i in range(len(b)):
        b[i] = 0.0
    for k in range(ORDER + 1):
        x = a[k] * powers[k]
        for i in range(len(b)):
            b[i] += BERNSTEIN[k, i] * x


@inner
def sum_terms(a, powers):
    """A polynomial at the place of these powers."""
    x, y, u, v = 0.0, 0.0, 0.0, 0.0
    for k in range(0, TERMS, 4):
        k1, k2, k3 = k + 1, k + 2, k + 3
        x, y = x + a[k] * powers[k], y + a[k1] * powers[k1]
        u, v = u + a[k2] * powers[k2], v + a[k3] * powers[k3]
    return (x + y) + (u + v)


@inner
def differentiate(a, b):
    """Write the derivative of a polynomial."""
    last = len(a) - 1
    for k in range(last):
        following = k + 1
        b[k] = (k + 1.0) * a[following]
    b[last] = 0.0


@inner
def polish(a, low, x, high, bend):
    """The one zero between low, where the polynomial is positive, and high, to rounding, and the rate there."""
    u = 0.0
    for _ in range(MOST_NEWTON_STEPS):
        y, u = value(a, x)
        low, x, high, there = newton_step(y, u, low, x, high, bend)
        if there:
            break
    return x, u


@inner
def isolate(a, x, high, bend, w):
    """The one zero of a polynomial in (0, high) from an estimate, to rounding, and the rate there."""
    differentiate(a, w.b)
    differentiate(w.b, w.c)
    write_powers(x, w.powers)
    y, u, curve = sum_terms(a, w.powers), sum_terms(w.b, w.powers), sum_terms(w.c, w.powers)
    better = x - y / (u - 0.5 * y * curve / u) if u < 0.0 else x
    return polish(a, 0.0, better if 0.0 < better < high else x, high, bend)


@inner
def reach_or_step(gap, s, end, error, jerk, snap):
    """At s: whether there surely is a zero before `end`, after about h; else a step h without one."""
    surely, h = surely_reached(False, gap.size + error, 0.0, gap, jerk, snap)
    if surely and s + BRACKET * h <= end:
        return True, h
    return False, careful_step(False, max(gap.size - error, 0.0), 0.0, gap, jerk, snap)


@inner
def reach_or_first_step(gap, end, error, on, jerk, snap):
    """As `reach_or_step`, at the start; with `on` the polynomial is zero there and rises; bent downwards at no rate it falls."""
    if on:
        surely, h = departure(False, gap, 0.0, jerk, snap)
        if surely and BRACKET * h > end:
            return False, first_step(gap.rate, gap.acceleration, gap.jerk, jerk, snap)
        return surely, h
    rate = -FAINT if gap.rate == 0.0 and gap.acceleration < 0.0 else gap.rate
    start = Gap(gap.size, rate, gap.acceleration, gap.jerk, gap.snap, gap.crackle)
    return reach_or_step(start, 0.0, end, error, jerk, snap)


@inner
def stays_positive(lead, size, left):
    """Whether the first term that is not zero, at the end, surely outweighs all others on the way."""
    return 2.0 * lead - size > left + 2.0 * ROUNDING * size


@inner
def first_zero(a, end, left, on):
    """The first zero in (0, end] of a polynomial that is positive before it: a `Zero`.

    `left` bounds what the polynomial leaves out. With `on` it begins at zero; where it falls from there, or is negative at the
    start, the zero is at once. Bounds hold up to `end`, and no step goes beyond. Rounding is counted in the sizes of the terms.
    """
    if a[CONSTANT] < 0.0 or (on and (a[LINEAR] < 0.0 or (a[LINEAR] == 0.0 and a[SQUARE] < 0.0))):
        bend, _, _ = limits(a, end)
        return Zero(True, 0.0, a[CONSTANT] < 0.0 and a[LINEAR] * a[LINEAR] <= SAFE * ROUNDING * size_of(a, end) * bend)
    size = size_of(a, end)
    if stays_positive(a[LINEAR] * end if on else a[CONSTANT], size, left):
        return Zero(False, end, False)
    bend, jerk, snap = limits(a, end)
    gap = Gap(a[CONSTANT], a[LINEAR], 2.0 * a[SQUARE], SIX * a[CUBE], 0.0, 0.0)
    surely, h = reach_or_first_step(gap, end, left + ROUNDING * size, on, jerk, snap)
    s, doubtful = 0.0, False
    for _ in range(MOST_STEPS):
        if surely:
            x, rate = polish(a, s, s + h, s + BRACKET * h, bend)
            return Zero(True, x, doubtful or rate * rate <= SAFE * ROUNDING * size_of(a, x) * bend)
        if h <= ROUNDING * s:
            gap = with_rates(a, s)
            if gap.size <= 0.0 and gap.rate < 0.0 and gap.rate * gap.rate > SAFE * ROUNDING * size * bend:
                return Zero(True, s, doubtful)
            doubtful = True  # a graze within rounding: pass it, to where the function rises again
            h = EQUAL * s
            if gap.acceleration > 0.0:
                spread = math.sqrt(2.0 * gap.acceleration * ROUNDING * size_of(a, s))
                h += 2.0 * (abs(gap.rate) + spread) / gap.acceleration
        s += h * INWARD
        if s >= end:
            return Zero(False, end, doubtful)
        surely, h = reach_or_step(with_rates(a, s), s, end, left + ROUNDING * size_of(a, s), jerk, snap)
    return Zero(True, s, True)


@inner
def minima(a, end, b):
    """The least value of a polynomial at its minima in (0, end], inf without one, and their number; b is memory.

    A rate that is zero at either end but for rounding is zero: a minimum that is met at an event counts before it, once.
    """
    differentiate(a, b)
    x, least, number, rounding = 0.0, math.inf, 0, EQUAL * size_of(b, end)
    if abs(b[CONSTANT]) <= rounding:
        b[CONSTANT] = 0.0
    for _ in range(MOST_TURNS):
        falls = b[CONSTANT] < 0.0 or (b[CONSTANT] == 0.0 and b[LINEAR] < 0.0)
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
        found, step, _ = first_zero(b, end - x, 0.0, b[CONSTANT] == 0.0)
        if not found:
            rate, bend = value(b, end - x)
            if falls and end > x and rate <= rounding and bend < 0.0:
                height, _ = value(a, end)
                least, number = min(least, height), number + 1
            break
        x += step
        for i in range(ORDER):
            for k in range(ORDER - 1, i - 1, -1):
                following = k + 1
                b[k] += step * b[following]
        b[CONSTANT] = 0.0
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
            height, _ = value(a, x)
            least, number = min(least, height), number + 1
    return least, number
