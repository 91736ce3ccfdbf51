"""Ranges of polynomials against rational arithmetic and 50-digit critical points: no rounding makes them inner."""

from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
from flint import fmpq

from nsmaps.enclosures.bernstein import Polynomials
from nsmaps.enclosures.branch_and_bound import ranges
from nsmaps.reduced.fit.polymap import PolyMap

NAMES = ("x", "y", "z")


def polymap(terms, centre, scale, absolute=()):
    """Every output the same sum of Chebyshev products, given by coefficient and exponents."""
    exponents, coefficients = np.array(list(terms)), np.array(list(terms.values()), float)
    n = exponents.shape[1]
    names = NAMES[:n]
    box = np.column_stack([np.subtract(centre, scale), np.add(centre, scale)])
    return PolyMap(names, (exponents,) * n, (coefficients,) * n, np.array(centre, float), np.array(scale, float), box, absolute)


def rational(x):
    return fmpq(*float(x).as_integer_ratio())


def exactly(return_map, states):
    """The first image of states in rational arithmetic, by recurrences from the floats that the map holds."""
    values, keys = [], [tuple(key) for key in return_map.exponents[0].tolist()]
    terms = dict(zip(keys, [rational(c) for c in return_map.coefficients[0]], strict=True))
    for state in states:
        total = terms
        for k in reversed(range(len(state))):
            s, parts = (rational(state[k]) - rational(return_map.centre[k])) / rational(return_map.scale[k]), {}
            t = [fmpq(1), s]
            while len(t) <= return_map.exponents[0].max():
                t.append(2 * s * t[-1] - t[-2])
            for key, c in total.items():
                parts[key[:k]] = parts.get(key[:k], 0) + c * t[key[k]]
            total = parts
        values.append(total[()])
    return values


def random_map(rng, n, degree, size=1.0):
    keys = [key for key in product(range(degree + 1), repeat=n) if sum(key) <= degree]
    return polymap({key: size * rng.normal() / (1 + sum(key)) for key in keys}, rng.uniform(-2, 2, n), rng.uniform(0.1, 3, n))


@pytest.mark.parametrize(("n", "degree", "size"), [(1, 10, 1), (1, 16, 3e10), (2, 3, 1), (2, 10, 3e10), (2, 16, 1), (3, 3, 1)])
@pytest.mark.parametrize("width", [1.0, 1e-3, 1e-9, 0.0])
def test_the_range_holds_every_exact_value(n, degree, size, width):
    rng = np.random.default_rng(1000 * n + degree)
    return_map = random_map(rng, n, degree, size)
    middle = return_map.centre + return_map.scale * rng.uniform(-1, 1, (4, n))
    half = width * return_map.scale * rng.uniform(0.1, 1, (4, n))
    boxes = np.stack([middle - half, middle + half], axis=2)
    found = ranges(Polynomials.of(return_map).hulls, boxes)
    for box, (low, high) in zip(boxes, found.bounds, strict=True):
        inside = np.clip(box[:, 0] + np.ptp(box, axis=1) * rng.random((30, n)), *box.T)
        corners = np.array(list(product(*box)))
        values = exactly(return_map, np.concatenate([inside, corners]))
        assert rational(low) <= min(values)
        assert max(values) <= rational(high)
        floats = return_map(inside)[:, 0]
        assert low <= floats.min()
        assert floats.max() <= high


def test_the_range_is_that_of_the_critical_points():
    """A degree of 10 with several turning points: ends and zeros of the derivative in 50 digits."""
    rng = np.random.default_rng(5)
    return_map = polymap({(k,): rng.normal() for k in range(11)}, [0.3], [0.7])
    low, high = ranges(Polynomials.of(return_map).hulls, np.array([[[-0.4, 0.95]]])).bounds[0]
    with mpmath.workdps(50):
        plain = [mpmath.mpf(c.numerator) / c.denominator for c in return_map.exact_monomials("x").values()]
        roots = mpmath.polyroots([k * plain[k] for k in range(10, 0, -1)], maxsteps=500, extraprec=200)
        places = [-0.4, 0.95, *(r.real for r in roots if abs(r.imag) < 1e-30 and -0.4 <= r.real <= 0.95)]
        values = [mpmath.polyval(plain[::-1], mpmath.mpf(x)) for x in places]
        least, largest = min(values), max(values)
    assert len(places) > 4
    assert low <= least
    assert largest <= high
    assert least - low < 1e-11
    assert high - largest < 1e-11


def test_cancelling_coefficients_on_a_thin_box_where_the_value_is_zero():
    """(x - y)^4 times 3e10 about the diagonal: plain terms of 3e10 that cancel to nothing."""
    monomials = {(4 - k, k): Fraction(30_000_000_000) * (-1) ** k * [1, 4, 6, 4, 1][k] for k in range(5)}
    return_map = PolyMap.of_monomials(("x", "y"), {"x": monomials, "y": monomials}, [[0, 1], [0, 1]])
    box = np.array([[[0.5, 0.5], [0.499999, 0.500001]], [[0.25, 0.75], [0.25, 0.75]]])
    thin, wide = ranges(Polynomials.of(return_map).hulls, box).bounds
    assert thin[0] <= 0 <= 3e10 * 1e-24 <= thin[1]
    assert thin[1] - thin[0] < 1e-2  # 3e10 times what rounding of its coefficients allows
    assert wide[0] <= 0
    assert 3e10 / 16 <= wide[1] < 3e10 / 16 + 1e-2


def test_an_absolute_value_has_its_kink():
    """|T_1| of x over [-1, 1] and beyond zero: 0 is taken where the polynomial changes sign."""
    return_map = polymap({(1,): 2.0}, [0.0], [1.0], absolute=("x",))
    boxes = np.array([[[-0.5, 0.25]], [[0.5, 0.75]], [[-0.75, -0.5]]])
    found = ranges(Polynomials.of(return_map).hulls, boxes)
    assert found.bounds == pytest.approx(np.array([[0, 1], [1, 1.5], [1, 1.5]]), abs=1e-12)
    assert found.at[1:, 1, 0] == pytest.approx(np.array([[0.75, 0.75], [-0.75, -0.75]]))


def test_the_sign_of_a_slope_is_proved():
    """x^3 - 3x + y: the slope by x is between -3 and 9 over [-1, 2], by y one."""
    terms = {(3, 0): Fraction(1), (1, 0): Fraction(-3), (0, 1): Fraction(1)}
    return_map = PolyMap.of_monomials(("x", "y"), {"x": terms, "y": terms}, [[-1, 2], [0, 1]])
    polynomials, box = Polynomials.of(return_map), np.array([[[-1.0, 2.0], [0.0, 1.0]]])
    assert ranges(polynomials.slope(0).hulls, box).bounds[0] == pytest.approx([-3, 9], abs=1e-10)
    assert ranges(polynomials.slope(1).hulls, box).bounds[0] == pytest.approx([1, 1], abs=1e-12)
    low, high = ranges(polynomials.slope(0).hulls, box).bounds[0]
    assert low <= -3
    assert high >= 9
