"""sin, cos, exp and log: bounds on their errors proved for the code as it stands, and compared with many digits."""

import inspect
import math
from fractions import Fraction
from itertools import pairwise
from math import factorial, log, pi

import mpmath as mp
import numpy as np
import pytest
from flint import arb, ctx
from numba import njit
from running import Running, Series, running

from nsmaps.exact.enclosure.arithmetic import elementary
from nsmaps.exact.enclosure.arithmetic.balls import Ball
from nsmaps.exact.engine.flight import remainders

NEAREST = Fraction(7853982, 10**7)  #: more than pi/4, and than any |y| that `wave` comes to, as is checked below
ORDER = 30  #: of Taylor polynomials in the place of functions; what they leave out is added
REDUCTION = 2.001 * 2.0**-53  #: what the y of `wave` is off by at most, relative; derived in the module `remainders`


def taylor(signs, first, order=ORDER):
    """The Taylor polynomial with signs[n % len(signs)]/n! from a first power on."""
    return Series(tuple(Fraction(signs[n % len(signs)] * (n >= first), factorial(n)) for n in range(order)))


def truncation(near_zero):
    """Bounds on the errors of (sin y - y)/y^3 and (cos y - 1)/y^4 for |y| <= NEAREST, all arithmetic being exact."""
    sine, less = near_zero(Series((Fraction(0), Fraction(1))))
    half = NEAREST**2 / 2
    errors = (sine - taylor((0, 1, 0, -1), 3)).over(3), (less - taylor((1, 0, -1, 0), 2)).over(4)
    in_squares = (Series(error.of[::2]).shifted(half) for error in errors)
    return [error.bound(half, 60) + NEAREST ** (ORDER - 4) / factorial(ORDER) * 2 for error in in_squares]


def growth_truncation(growth_near_zero):
    """A bound on the error of (exp x - 1 - x)/x^2 for |x| <= 1/2, all arithmetic being exact."""
    error = (growth_near_zero(Series((Fraction(0), Fraction(1)))) - taylor((1,), 2)).over(2)
    return error.bound(Fraction(1, 2), 60) + Fraction(1, 2) ** (ORDER - 2) / factorial(ORDER) * 2


def pieces(least, most, ratio):
    """Intervals that cover [least, most], each ending at the ratio times its beginning, and their mirror images."""
    ends = np.geomspace(least, most, int(np.ceil(np.log(most / least) / np.log(ratio))) + 1)
    for a, b in pairwise(ends):
        yield a, b
        yield -b, -a


def wave_errors(near_zero):
    """Bounds on the relative errors of cos - 1, sin and sin - x, for |y| >= 1e-6, in all four quarters of a turn."""
    of_sine, of_cosine = map(float, truncation(near_zero))
    less, sine, rest = [], [], []

    def parts(y):
        r, c = near_zero(y)
        return y, r.near(of_sine * y.largest**3), c.near(of_cosine * y.largest**4)

    for low, high in pieces(1e-6, float(NEAREST), 1.02):
        rest.append(parts(Running(low, high))[1].relative)
        y, r, c = parts(Running(low, high, REDUCTION * max(abs(low), abs(high))))
        less += [c.relative, (-1.0 - (y + r)).relative, (-2.0 - c).relative, (-2.0 - (-1.0 - (y + r))).relative]
        sine += [(y + r).relative, (1.0 + c).relative]
        for q, value in ((1, 1.0 + c), (2, -(y + r)), (3, -(1.0 + c)), (4, y + r), (5, 1.0 + c)):
            for quarters, turned in ((q, value), (-q, -value if q % 2 else value)):  # sin(y - pi/2) = -sin(y + pi/2)
                x = Running(low, high) + quarters * pi / 2
                rest.append((turned - Running(x.low, x.high)).relative)
    return max(less), max(sine), max(rest)


def growth_errors(growth_near_zero):
    """Bounds on the relative errors of exp - 1, exp - 1 - x and exp."""
    off = float(growth_truncation(growth_near_zero))
    plain, rest, whole = [], [], []
    for low, high in pieces(1e-6, 0.5, 1.02):
        x = Running(low, high)
        e = growth_near_zero(x).near(off * x.largest**2)
        plain.append((x + e).relative)
        rest.append(e.relative)
    for low, high in pieces(1e-6, 0.34658, 1.02):
        y = Running(low, high, REDUCTION / 2 * max(abs(low), abs(high)) + 1e-22)
        more = y + growth_near_zero(y).near(off * y.largest**2)
        whole.append((1.0 + more).relative)
        for n in (-60, -2, -1, 1, 2, 60):
            x = Running(low, high) + n * log(2)
            if min(abs(x.low), abs(x.high)) > 0.5:
                e = 2.0**n * more + (running(2.0**n) - 1.0)
                plain.append(e.relative)
                rest.append((e - Running(x.low, x.high)).relative)
    return max(plain), max(rest), max(whole)


NEAR_ZERO, GROWTH_NEAR_ZERO = remainders.near_zero.py_func, remainders.growth_near_zero.py_func
WAVE_BOUNDS = elementary.COSINE_OFF, elementary.SINE_OFF, elementary.REST_OFF
GROWTH_BOUNDS = elementary.GROWTH_OFF, elementary.BEND_OFF, elementary.EXP_OFF


def planted(function, number, other):
    """A function with one number of its code changed."""
    lines = inspect.getsource(function).splitlines()
    text = "\n".join(line for line in lines if not line.startswith("@"))
    assert text.count(number) == 1
    names = dict(function.__globals__)
    exec(text.replace(number, other), names)
    return names[function.__name__]


def check_wave(near_zero):
    """The bounds of the docs and of `bwave`, of which none is idle."""
    assert all(bound < most for bound, most in zip(truncation(near_zero), (3.3e-17, 2.5e-18), strict=True))
    errors = wave_errors(near_zero)
    assert all(bound / 4 < error < bound for error, bound in zip(errors, WAVE_BOUNDS, strict=True)), errors


def test_the_errors_of_sine_and_cosine_are_within_their_bounds():
    check_wave(NEAR_ZERO)


def test_the_errors_of_exp_are_within_their_bounds():
    assert growth_truncation(GROWTH_NEAR_ZERO) < 1.1e-16
    errors = growth_errors(GROWTH_NEAR_ZERO)
    assert all(bound / 5 < error < bound for error, bound in zip(errors, GROWTH_BOUNDS, strict=True)), errors


@pytest.mark.parametrize(
    ("number", "other"),
    [
        ("SINE_5", "0.0083333333333310"),
        ("SINE_7", "-0.000198412698367"),
        ("COSINE_12", "2.0877e-9"),
        ("0.5 * z", "0.50000000000001 * z"),
        ("z * SINE_5", "(z + 0.0) * (SINE_5 + 1.0) - z"),  # right but for rounding
    ],
)
def test_an_error_planted_in_the_polynomials_is_found(number, other):
    with pytest.raises(AssertionError):
        check_wave(planted(NEAR_ZERO, number, other))


def test_an_error_planted_in_the_series_of_exp_is_found():
    assert growth_truncation(planted(GROWTH_NEAR_ZERO, "1 / 5040", "1 / 5041")) > 1e-10
    assert growth_truncation(planted(GROWTH_NEAR_ZERO, " + zz * (1 / 87178291200)", "")) > 1e-15


def test_the_parts_of_a_quarter_and_of_ln_2():
    """Whole multiples up to 2^20 of the first ones are floats, and what all leave out is below what is taken for it."""
    quarter = [Fraction(part) for part in (remainders.QUARTER, remainders.QUARTER_1, remainders.QUARTER_2)]
    doubling = [Fraction(part) for part in (remainders.DOUBLING, remainders.DOUBLING_1)]
    for part in (*quarter[:2], doubling[0]):
        assert part.numerator.bit_length() - (part.numerator & -part.numerator).bit_length() + 1 + 20 <= 53
    with mp.workdps(60):
        left = abs(mp.pi / 2 - sum(mp.mpf(part.numerator) / part.denominator for part in quarter))
        assert left + 2 * mp.mpf(2) ** -53 * quarter[2] < elementary.PARTS_OFF  # with the rounding of its product, by quarters
        assert abs(mp.log(2) - sum(mp.mpf(part.numerator) / part.denominator for part in doubling)) < 1.2e-26
    assert elementary.MOST_ANGLE * 2 / pi * (1 + 1e-9) + 1 < 2**20


def test_the_reduction_rounds_twice():
    """The first difference is exact, and y is off by what the two others round, and by what the parts of pi/2 leave out."""
    for x in awkward(np.random.default_rng(4), 3000, elementary.MOST_ANGLE).tolist():
        q = math.floor(x * 0.6366197723675814 + 0.5)
        first = x - q * remainders.QUARTER
        y = (first - q * remainders.QUARTER_1) - q * remainders.QUARTER_2
        assert Fraction(first) == Fraction(x) - q * Fraction(remainders.QUARTER)
        assert abs(y) < NEAREST
        with mp.workdps(60):
            assert abs(y - (mp.mpf(x) - q * mp.pi / 2)) <= REDUCTION * abs(y) + elementary.PARTS_OFF * abs(x)


def test_powers_of_two_are_exact():
    power = njit(lambda n: math.ldexp(1.0, n))
    assert all(power(n) == 2.0**n for n in range(-1074, 1024))


def awkward(rng, number, most):
    """Numbers of all sizes, uniform ones, and those next to multiples of a quarter of a turn."""
    of_all_sizes = 10.0 ** rng.uniform(-300, np.log10(most), number // 3)
    quarters = rng.integers(0, int(most / 1.6), number // 3) * (np.pi / 2)
    uniform = rng.uniform(0, most if most < 1000 else 100, number - 2 * (number // 3))
    found = np.concatenate([of_all_sizes, quarters + np.spacing(quarters) * rng.integers(-3, 4, len(quarters)), uniform])
    return found * rng.choice([-1.0, 1.0], number)


WAVE, GROWTH = njit(remainders.wave.py_func), njit(remainders.growth.py_func)
BWAVE, BEXP, BLOG = (njit(getattr(elementary, name).py_func) for name in ("bwave", "bexp", "blog"))


def off(found, exact, bound, by_angle=0.0):
    """Is a number off by more than a bound relative to the exact value, or the angle, or what underflow loses."""
    return not abs(found - exact) <= bound * abs(exact) + by_angle + 1e-300


@pytest.mark.parametrize("number", [20_000, pytest.param(300_000, marks=pytest.mark.thorough)])
def test_sine_and_cosine_against_50_digits(number):
    rng = np.random.default_rng(1)
    with ctx.workdps(50):
        for x in awkward(rng, number, elementary.MOST_ANGLE).tolist():
            angle, sine = arb(x), arb(x).sin()
            exact = -2 * (angle / 2).sin() ** 2, sine, sine - x if abs(x) > 1e-10 else -(angle**3) / 6
            for value, reference, bound in zip(WAVE(x), exact, WAVE_BOUNDS, strict=True):
                assert not off(value, reference, bound, elementary.PARTS_OFF * abs(x)), x


def test_exp_against_50_digits():
    rng = np.random.default_rng(2)
    with ctx.workdps(50):
        for x in (10.0 ** rng.uniform(-20, np.log10(709), 10_000) * rng.choice([-1.0, 1.0], 10_000)).tolist():
            exponent, plain = arb(x), arb(x).expm1()
            rest = plain - x if abs(x) > 1e-10 else exponent**2 / 2 + exponent**3 / 6
            for value, reference, bound in zip(GROWTH(x), (plain, rest), GROWTH_BOUNDS[:2], strict=True):
                assert not off(value, reference, bound), x
            centre, radius = BEXP(Ball(x, 0.0))
            assert abs(centre - exponent.exp()) <= radius
            centre, radius = BLOG(Ball(abs(x), 0.0))
            assert abs(centre - abs(exponent).log()) <= radius < 1e-13


@ctx.workprec(200)
def test_sine_and_cosine_in_arb():
    """The bounds on truncation and the values themselves, in another library's balls."""
    import flint

    rng = np.random.default_rng(3)
    for x in awkward(rng, 100_000, elementary.MOST_ANGLE).tolist():
        exact = flint.arb(x)
        sine, cosine = exact.sin(), -2 * (exact / 2).sin() ** 2
        less, found, _ = WAVE(x)
        for value, reference, bound in ((less, cosine, elementary.COSINE_OFF), (found, sine, elementary.SINE_OFF)):
            assert abs(value - reference) < bound * abs(reference) + elementary.PARTS_OFF * abs(x) + 1e-300, x
    for bound, first, power in zip(
        truncation(NEAR_ZERO), (flint.arb.sin, lambda y: -2 * (y / 2).sin() ** 2), (3, 4), strict=True
    ):
        coefficients = NEAR_ZERO(Series((Fraction(0), Fraction(1))))[power - 3].of
        polynomial = flint.arb_poly([flint.arb(flint.fmpq(c.numerator, c.denominator)) for c in coefficients])
        for y in np.linspace(0.01, 0.785398, 1000).tolist():
            function = first(flint.arb(y)) - (flint.arb(y) if power == 3 else 0)
            assert abs(polynomial(flint.arb(y)) - function) < float(bound) * flint.arb(y) ** power


def test_beyond_their_range_nothing_is_known():
    for x in (1.01e6, -1e7, 1e300, np.inf, np.nan):
        assert not any(np.isfinite(radius) for _, radius in BWAVE(Ball(x, 0.0)))
    assert all(np.isfinite(radius) for _, radius in BWAVE(Ball(-1e6, 1e-3)))
    assert [np.isfinite(BEXP(Ball(x, 0.0)).radius) for x in (709.0, 710.0, np.inf, np.nan)] == [True, False, False, False]
    for x, h in ((-710.0, 0.0), (-1e5, 10.0), (-720.0, 1000.0)):
        centre, radius = BEXP(Ball(x, h))
        assert centre - radius <= 0
        assert radius >= (1e-300 if h < 100 else 1e100)
    assert [np.isfinite(BLOG(Ball(x, 0.0)).radius) for x in (1e-300, 1e290, 0.0, -1.0, np.inf)] == [
        True,
        True,
        False,
        False,
        False,
    ]
    plain, rest = GROWTH(-1e4)
    assert (plain, rest) == (-1.0, 9999.0)
    assert GROWTH(800.0) == (np.inf, np.inf)
    assert np.isnan(GROWTH(np.nan)).all()
