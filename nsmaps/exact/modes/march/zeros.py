"""The first zero of a polynomial that is positive before it, with a certificate: no step can pass one.

The arguments are those of `nsmaps.exact.engine.steps`, here for a Taylor series with a bound on what it leaves out.
"""

import math

from nsmaps.exact.engine.constants import INWARD, OUTWARD
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.steps import careful_step, departure, first_step, surely_reached
from nsmaps.exact.modes.tables.polynomials import BERNSTEIN
from nsmaps.exact.modes.tables.taylor import ORDER, ROUNDING, TERMS, raised

MOST_STEPS = 10_000
MOST_TURNS = 1_000  # minima and maxima within one series
CLOSE = 2e-16  # of a zero: rounding
FAINT = 1e-300  # a rate that is not zero


@inner
def with_rates(a, x):
    """A polynomial at x with its first three derivatives, and zeros for two more."""
    y, u, b, j = a[ORDER], 0.0, 0.0, 0.0
    for m in range(ORDER - 1, -1, -1):
        j = j * x + b
        b = b * x + u
        u = u * x + y
        y = y * x + a[m]
    return y, u, 2.0 * b, 6.0 * j, 0.0, 0.0


@inner
def limits(a, x):
    """Bounds on the sizes of the second, third and fourth derivative over [0, x]."""
    snap, power = 0.0, 1.0
    for k in range(4, ORDER + 1):
        snap += k * (k - 1) * (k - 2) * (k - 3) * abs(a[k]) * power
        power *= x
    jerk = 6.0 * abs(a[3]) + x * snap
    return (2.0 * abs(a[2]) + x * jerk) * OUTWARD, jerk * OUTWARD, snap * OUTWARD


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
def nearer(y, u, low, x, high, bend):
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
    """Changes of sign of a polynomial in (0, 1], by its coefficients in the basis of Bernstein: (0; 1; 2 for unknown; where).

    With `on` it begins at zero. Coefficients within the error count as unknown. `where` is about the zero if there is one, else
    a place at which the polynomial is negative, or zero if that is not known.
    """
    zero = b[0] if on else 0.0
    first = 1 if on or 0.0 <= b[0] <= error else 0
    above, below = 0, 0
    for k in range(ORDER + 1):
        above += 1 if b[k] - zero > error else 0
        below += 1 if b[k] - zero < -error else 0
    if above == ORDER + 1 - first:
        return 0, 1.0
    m = first
    while m <= ORDER and b[m] - zero > error:
        m += 1
    if m > first and m == above + first and above + below == ORDER + 1 - first:
        high = b[m - 1] - zero
        return 1, (m - 1 + high / (high - (b[m] - zero))) / ORDER
    least = m
    for k in range(m, ORDER + 1):
        least = k if b[k] < b[least] else least
    return 2, least / ORDER if m > first and b[least] - zero < -error else 0.0


@inner
def narrowed(a, far, powers, b):
    """Write the coefficients of a polynomial over [0, far] in the basis of Bernstein."""
    raised(far, powers)
    for i in range(len(b)):
        b[i] = 0.0
    for k in range(ORDER + 1):
        x = a[k] * powers[k]
        for i in range(len(b)):
            b[i] += BERNSTEIN[k, i] * x


@inner
def summed(a, powers):
    """A polynomial at the place of these powers."""
    x, y, u, v = 0.0, 0.0, 0.0, 0.0
    for k in range(0, TERMS, 4):
        x, y = x + a[k] * powers[k], y + a[k + 1] * powers[k + 1]
        u, v = u + a[k + 2] * powers[k + 2], v + a[k + 3] * powers[k + 3]
    return (x + y) + (u + v)


@inner
def differentiated(a, b):
    """Write the derivative of a polynomial."""
    for k in range(len(a) - 1):
        b[k] = (k + 1.0) * a[k + 1]
    b[len(a) - 1] = 0.0


@inner
def polish(a, low, x, high, bend):
    """The one zero between low, where the polynomial is positive, and high, to rounding, and the rate there."""
    u = 0.0
    for _ in range(100):
        y, u = value(a, x)
        low, x, high, there = nearer(y, u, low, x, high, bend)
        if there:
            break
    return x, u


@inner
def isolated(a, x, high, bend, w):
    """The one zero of a polynomial in (0, high) from an estimate, to rounding, and the rate there."""
    differentiated(a, w.b)
    differentiated(w.b, w.c)
    raised(x, w.powers)
    y, u, curve = summed(a, w.powers), summed(w.b, w.powers), summed(w.c, w.powers)
    better = x - y / (u - 0.5 * y * curve / u) if u < 0.0 else x
    return polish(a, 0.0, better if 0.0 < better < high else x, high, bend)


@inner
def seen(gap, s, end, error, jerk, snap):
    """At s: whether there surely is a zero before `end`, after about h; else a step h without one."""
    surely, h = surely_reached(False, gap[0] + error, 0.0, gap, jerk, snap)
    if surely and s + 1.5 * h <= end:
        return True, h
    return False, careful_step(False, max(gap[0] - error, 0.0), 0.0, gap, jerk, snap)


@inner
def begun(gap, end, error, on, jerk, snap):
    """As `seen`, at the start; with `on` the polynomial is zero there and rises; without a rate but bent downwards it falls."""
    if on:
        surely, h = departure(False, gap, 0.0, jerk, snap)
        if surely and 1.5 * h > end:
            return False, first_step(gap[1], gap[2], gap[3], jerk, snap)
        return surely, h
    rate = -FAINT if gap[1] == 0.0 and gap[2] < 0.0 else gap[1]
    return seen((gap[0], rate, *gap[2:]), 0.0, end, error, jerk, snap)


@inner
def falls(a0, a1, a2, on):
    """Whether a polynomial is negative at the start, or with `on` falls from zero there."""
    return a0 < 0.0 or (on and (a1 < 0.0 or (a1 == 0.0 and a2 < 0.0)))


@inner
def stays_positive(lead, size, left):
    """Whether the first term that is not zero, at the end, surely outweighs all others on the way."""
    return 2.0 * lead - size > left + 2.0 * ROUNDING * size


@inner
def first_zero(a, end, left, on):
    """The first zero in (0, end] of a polynomial that is positive before it: (is there one, where, is that doubtful).

    `left` bounds what the polynomial leaves out. With `on` it begins at zero; where it falls from there, or is negative at the
    start, the zero is at once. Bounds hold up to `end`, and no step goes beyond. Rounding is counted in the sizes of the terms.
    """
    if falls(a[0], a[1], a[2], on):
        bend, _, _ = limits(a, end)
        return True, 0.0, a[0] < 0.0 and a[1] * a[1] <= 16.0 * ROUNDING * size_of(a, end) * bend
    size = size_of(a, end)
    if stays_positive(a[1] * end if on else a[0], size, left):
        return False, end, False
    bend, jerk, snap = limits(a, end)
    surely, h = begun((a[0], a[1], 2.0 * a[2], 6.0 * a[3], 0.0, 0.0), end, left + ROUNDING * size, on, jerk, snap)
    s, doubtful = 0.0, False
    for _ in range(MOST_STEPS):
        if surely:
            x, rate = polish(a, s, s + h, s + 1.5 * h, bend)
            return True, x, doubtful or rate * rate <= 16.0 * ROUNDING * size_of(a, x) * bend
        if h <= ROUNDING * s:
            gap = with_rates(a, s)
            if gap[0] <= 0.0 and gap[1] < 0.0 and gap[1] * gap[1] > 16.0 * ROUNDING * size * bend:
                return True, s, doubtful
            doubtful = True  # a graze within rounding: pass it, to where the function rises again
            h = 4.0 * ROUNDING * s
            if gap[2] > 0.0:
                h += 2.0 * (abs(gap[1]) + math.sqrt(2.0 * gap[2] * ROUNDING * size_of(a, s))) / gap[2]
        s += h * INWARD
        if s >= end:
            return False, end, doubtful
        surely, h = seen(with_rates(a, s), s, end, left + ROUNDING * size_of(a, s), jerk, snap)
    return True, s, True


@inner
def minima(a, end, b):
    """The least value of a polynomial at its minima in (0, end], inf without one, and their number; b is memory.

    A rate that is zero at either end but for rounding is zero: a minimum that is met at an event counts before it, once.
    """
    for k in range(ORDER):
        b[k] = (k + 1) * a[k + 1]
    b[ORDER] = 0.0
    x, least, number, blur = 0.0, math.inf, 0, 4.0 * ROUNDING * size_of(b, end)
    if abs(b[0]) <= blur:
        b[0] = 0.0
    for _ in range(MOST_TURNS):
        falls = b[0] < 0.0 or (b[0] == 0.0 and b[1] < 0.0)
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
        found, step, _ = first_zero(b, end - x, 0.0, b[0] == 0.0)
        if not found:
            rate, bend = value(b, end - x)
            if falls and end > x and rate <= blur and bend < 0.0:
                least, number = min(least, value(a, end)[0]), number + 1
            break
        x += step
        for i in range(ORDER):
            for k in range(ORDER - 1, i - 1, -1):
                b[k] += step * b[k + 1]
        b[0] = 0.0
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
            least, number = min(least, value(a, x)[0]), number + 1
    return least, number
