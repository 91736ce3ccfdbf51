"""Bounds on rounding and truncation, of code as it is written: the code is run on numbers that carry a bound on their error.

`Running` numbers hold an interval of exact values and a bound on what a computed one may be off by, each operation adding half
a unit in the last place of its result (a running error analysis); `Series` are polynomials with rational coefficients, which
read those that are written in the code, without rounding.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import floor, log2

from flint import fmpq, fmpq_poly

ROUND = 2.0**-53  #: what an operation is off by at most, relative to its result
SLACK = 1e-12  #: far more than what the arithmetic of this file itself is off by, relative


@dataclass(frozen=True)
class Running:
    """Numbers between two ends, computed with an error of at most `off`."""

    low: float
    high: float
    off: float = 0.0

    @property
    def largest(self):
        """The largest absolute value."""
        return max(abs(self.low), abs(self.high))

    @property
    def relative(self):
        """A bound on the relative error."""
        assert self.low > 0 or self.high < 0
        return self.off / min(abs(self.low), abs(self.high)) * (1 + SLACK)

    def near(self, more):
        """The same, where the number that is meant is another within `more`."""
        return outward(self.low - more, self.high + more, self.off + more)

    def __add__(self, other):
        other = running(other)
        return rounded(outward(self.low + other.low, self.high + other.high, self.off + other.off))

    def __mul__(self, other):
        other = running(other)
        ends = [x * y for x in (self.low, self.high) for y in (other.low, other.high)]
        off = self.largest * other.off + other.largest * self.off + self.off * other.off
        return rounded(outward(min(ends), max(ends), off))

    def __neg__(self):
        return Running(-self.high, -self.low, self.off)

    def __sub__(self, other):
        return self + -running(other)

    def __rsub__(self, other):
        return running(other) - self

    __radd__, __rmul__ = __add__, __mul__


def outward(low, high, off):
    """Ends and error moved outward by more than what computing them was off by."""
    return Running(low - SLACK * abs(low), high + SLACK * abs(high), off * (1 + SLACK))


def rounded(x):
    """A result is rounded once: by half a unit in the last place, whose size is that of the power of two below the result."""
    return Running(x.low, x.high, (x.off + ROUND * 2.0 ** floor(log2(x.largest + x.off))) * (1 + SLACK))


def running(x):
    """A float is known exactly."""
    return x if isinstance(x, Running) else Running(x, x)


@dataclass(frozen=True)
class Series:
    """A polynomial, the coefficients of its powers from the lowest."""

    of: tuple[Fraction, ...]

    def __add__(self, other):
        one, two = self.of, series(other).of
        n = max(len(one), len(two))
        pairs = zip(one + (Fraction(0),) * (n - len(one)), two + (Fraction(0),) * (n - len(two)), strict=True)
        return Series(tuple(x + y for x, y in pairs))

    def __mul__(self, other):
        other = series(other)
        total = [Fraction(0)] * (len(self.of) + len(other.of) - 1)
        for i, x in enumerate(self.of):
            for k, y in enumerate(other.of):
                total[i + k] += x * y
        return Series(tuple(total))

    def __neg__(self):
        return Series(tuple(-x for x in self.of))

    def __sub__(self, other):
        return self + -series(other)

    def __rsub__(self, other):
        return series(other) - self

    __radd__, __rmul__ = __add__, __mul__

    def over(self, power):
        """The polynomial over a power that divides it."""
        assert not any(self.of[:power])
        return Series(self.of[power:])

    def __call__(self, x):
        """The value at a rational number."""
        total = Fraction(0)
        for coefficient in reversed(self.of):
            total = total * x + coefficient
        return total

    def bound(self, radius, pieces):
        """A bound on the absolute value for |x| <= radius: in pieces, by the sizes of the terms around their middles."""
        half = Fraction(radius) / pieces
        shifted = (self.shifted((2 * k + 1) * half - radius) for k in range(pieces))
        return max(Series(tuple(map(abs, each.of)))(half) for each in shifted)

    def shifted(self, middle):
        """The polynomial in x - middle."""
        moved = fmpq_poly([exactly(x) for x in self.of])(fmpq_poly([exactly(middle), 1])).coeffs()
        return Series(tuple(Fraction(int(x.p), int(x.q)) for x in moved))


def exactly(x):
    """A rational number for python-flint."""
    return fmpq(x.numerator, x.denominator)


def series(x):
    """A float as a constant."""
    return x if isinstance(x, Series) else Series((Fraction(x),))
