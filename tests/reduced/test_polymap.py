"""Polynomial maps: their values, derivatives and monomials against exact and 50-digit arithmetic."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

from nsmaps.coordinates import Angle
from nsmaps.errors import FitError, StateError
from nsmaps.reduced.fit.polymap import PolyMap, design, paper_order

NAMES = ("v", Angle("phi"))


def random_map(seed, degrees=(4, 3), names=NAMES, absolute=()):
    """A map of random coefficients over a small box away from zero."""
    rng = np.random.default_rng(seed)
    grids = np.indices([d + 1 for d in degrees]).reshape(len(degrees), -1).T
    exponents = tuple(
        grids[np.sort(rng.choice(len(grids), max(2, len(grids) - i - 1), replace=False))] for i in range(len(names))
    )
    coefficients = tuple(rng.normal(size=len(each)) for each in exponents)
    centre, scale = rng.uniform(0.3, 1, len(names)), rng.uniform(0.1, 0.5, len(names))
    return PolyMap(names, exponents, coefficients, centre, scale, np.stack([centre - scale, centre + scale], 1), absolute)


def precisely(polymap, i, state):
    """Output i at one state, by the definition of Chebyshev polynomials, with 50 digits."""
    total = mpmath.mpf(0)
    for key, coefficient in zip(polymap.exponents[i].tolist(), polymap.coefficients[i].tolist(), strict=True):
        term = mpmath.mpf(coefficient)
        for j, degree in enumerate(key):
            x = (mpmath.mpf(state[j]) - mpmath.mpf(float(polymap.centre[j]))) / mpmath.mpf(float(polymap.scale[j]))
            term *= mpmath.chebyt(degree, x)
        total += term
    return abs(total) if polymap.coordinates[i] in polymap.absolute else total


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), at=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), absolute=st.booleans())
def test_values_and_derivatives_against_50_digits(seed, at, absolute):
    polymap = random_map(seed, absolute=("v",) if absolute else ())
    state = (polymap.centre + polymap.scale * np.array(at)).tolist()
    image, slopes = polymap([state])[0], polymap.derivative([state])[0]
    with mpmath.workdps(50):
        for i in range(2):
            assert image[i] == pytest.approx(float(precisely(polymap, i, state)), rel=1e-12, abs=1e-11)
            for j in range(2):
                step = mpmath.mpf("1e-20")
                shifted = [mpmath.mpf(x) + (step if k == j else 0) for k, x in enumerate(state)]
                slope = (precisely(polymap, i, shifted) - precisely(polymap, i, state)) / step
                assert slopes[i, j] == pytest.approx(float(slope), rel=1e-9, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_monomials_are_converted_exactly(seed):
    polymap = random_map(seed)
    state = [Fraction(3, 7), Fraction(5, 11)]
    with mpmath.workdps(60):
        for i, name in enumerate(NAMES):
            total = sum(Fraction(c) * state[0] ** key[0] * state[1] ** key[1] for key, c in polymap.monomials(name).items())
            exact = precisely(polymap, i, [mpmath.mpf(x.numerator) / x.denominator for x in state])
            size = sum(abs(c) for c in polymap.monomials(name).values())
            assert abs(mpmath.mpf(total.numerator) / total.denominator - exact) < 2e-16 * size


def test_monomials_by_hand():
    # 2 T_2((v - 1)/2) + T_1((v - 1)/2) T_1(phi/4) = (v - 1)^2 - 2 + (v - 1) phi/8
    exponents = (np.array([[2, 0], [1, 1]]), np.array([[0, 0]]))
    coefficients = (np.array([2.0, 1.0]), np.array([3.0]))
    polymap = PolyMap(NAMES, exponents, coefficients, np.array([1.0, 0]), np.array([2.0, 4]), np.zeros((2, 2)))
    assert polymap.monomials("v") == {(0, 0): -1, (0, 1): -0.125, (1, 0): -2, (1, 1): 0.125, (2, 0): 1}
    assert list(polymap.monomials("v")) == [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0)]
    assert polymap.monomials("phi") == {(0, 0): 3}
    v, phi = sp.symbols("v phi", real=True)
    assert sp.expand(polymap.symbolic("v") - ((v - 1) ** 2 - 2 + (v - 1) * phi / 8)) == 0
    np.testing.assert_array_equal(polymap([[3, 4]]), [[3, 3]])
    np.testing.assert_array_equal(polymap.derivative([[3, 4]]), [[[4.5, 0.25], [0, 0]]])


def by_fractions(monomials, state):
    """The value of plain monomials at a state of rational numbers, exactly."""
    return sum(c * Fraction(state[0]) ** i * Fraction(state[1]) ** j for (i, j), c in monomials.items())


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_monomials_become_chebyshev_products_exactly(seed):
    rng = np.random.default_rng(seed)
    monomials = {
        name: {(int(i), int(j)): Fraction(int(c), 7) for i, j, c in rng.integers([0, 0, -(10**9)], [6, 5, 10**9], (8, 3))}
        for name in NAMES
    }
    low = rng.uniform(0.1, 2, 2)
    polymap = PolyMap.of_monomials(NAMES, monomials, np.stack([low, low + rng.uniform(1e-3, 1, 2)], axis=1))
    for state in rng.uniform(polymap.domain[:, 0], polymap.domain[:, 1], (5, 2)).tolist():
        for i, name in enumerate(NAMES):
            size = np.abs(polymap.coefficients[i]).sum()
            assert abs(Fraction(polymap([state])[0, i]) - by_fractions(monomials[name], state)) < 1e-13 * size


def test_what_cancels_in_monomials_keeps_its_digits():
    # (v - 0.7)^8, in monomials that cancel to 1e-24 over a box of half-width 1e-3
    terms = sp.Poly(sp.expand((sp.Symbol("v") - sp.Rational(7, 10)) ** 8), sp.Symbol("v")).as_dict()
    monomials = {"v": {(k, 0): Fraction(int(c.p), int(c.q)) for (k,), c in terms.items()}, "phi": {(0, 1): Fraction(1)}}
    polymap = PolyMap.of_monomials(NAMES, monomials, [[0.699, 0.701], [0, 1]])
    assert polymap([[0.7005, 0.2]])[0] == pytest.approx([(0.7005 - 0.7) ** 8, 0.2], rel=1e-9)
    assert polymap.monomial_error("v") > 1e7 * 1e-24
    assert polymap.monomial_error("phi") < 1e-15


def test_another_box_is_the_same_map():
    polymap = random_map(5)
    other = polymap.over([[0.1, 2.0], [-1, 3]])
    points = np.random.default_rng(1).uniform(polymap.domain[:, 0], polymap.domain[:, 1], (50, 2))
    np.testing.assert_allclose(other(points), polymap(points), atol=1e-10)
    np.testing.assert_array_equal(other.domain, [[0.1, 2], [-1, 3]])
    for box in ([[0, 0], [0, 1]], [[0, np.inf], [0, 1]]):
        with pytest.raises(StateError, match=message("coordinates.box")):
            polymap.over(box)


@pytest.mark.parametrize("absolute", [(), ("v",)])
def test_rounding_of_monomials_is_the_largest_difference(absolute):
    polymap = random_map(9, degrees=(9, 9), absolute=absolute)
    points = np.random.default_rng(6).uniform(polymap.domain[:, 0], polymap.domain[:, 1], (20_000, 2))
    plain = np.sum([c * points[:, 0] ** i * points[:, 1] ** j for (i, j), c in polymap.monomials("v").items()], axis=0)
    brute = np.abs((np.abs(plain) if absolute else plain) - polymap(points)[:, 0]).max()
    assert brute / 3 < polymap.monomial_error("v") < 30 * brute
    assert PolyMap.reset(NAMES, {"phi": 1.2}).monomial_error("phi") == 0.0


def test_symbols_and_numbers_agree():
    polymap = random_map(7, absolute=("phi",))
    points = np.random.default_rng(2).uniform(polymap.domain[:, 0], polymap.domain[:, 1], (20, 2))
    v, phi = sp.symbols("v phi", real=True)
    for i, name in enumerate(NAMES):
        values = [float(polymap.symbolic(name).subs({v: a, phi: b})) for a, b in points.tolist()]
        np.testing.assert_allclose(polymap(points)[:, i], values, rtol=1e-10, atol=1e-10)
    assert isinstance(polymap.symbolic("phi"), sp.Abs)
    assert (polymap(points)[:, 1] >= 0).all()


def test_three_coordinates():
    polymap = random_map(3, degrees=(2, 3, 1), names=("x", "y", "z"))
    points = np.random.default_rng(4).uniform(0, 1, (5, 3))
    with mpmath.workdps(40):
        expected = [[float(precisely(polymap, i, point)) for i in range(3)] for point in points.tolist()]
    np.testing.assert_allclose(polymap(points), expected, rtol=1e-12, atol=1e-12)
    assert polymap.derivative(points).shape == (5, 3, 3)


def test_a_batch_of_any_size_is_its_rows():
    polymap = random_map(11, degrees=(16, 16))
    points = np.random.default_rng(5).uniform(polymap.domain[:, 0], polymap.domain[:, 1], (40_000, 2))
    whole = polymap(points)
    picked = [0, 16_383, 16_384, 39_999]
    np.testing.assert_allclose(whole[picked], [polymap(points[[k]])[0] for k in picked], rtol=1e-11, atol=1e-11)
    assert polymap(np.empty((0, 2))).shape == (0, 2)
    assert polymap.derivative(np.empty((0, 2))).shape == (0, 2, 2)


def test_nan_stays_nan():
    polymap = random_map(2)
    assert np.isnan(polymap([[np.nan, 0.5], [0.5, np.nan]])).all()
    assert np.isfinite(polymap([[0.5, 0.5]])).all()


def test_a_reset_sets_and_keeps():
    reset = PolyMap.reset(NAMES, {"phi": 1.2})
    states = [[0.3, 4.0], [-1.7, -0.1]]
    np.testing.assert_array_equal(reset(states), [[0.3, 1.2], [-1.7, 1.2]])
    np.testing.assert_array_equal(reset.derivative(states), [[[1, 0], [0, 0]]] * 2)
    assert reset.report is None
    assert reset.monomials("v") == {(1, 0): 1.0}
    assert reset.symbolic("phi") == sp.Float(1.2, 17)
    assert np.isinf(reset.domain).all()
    with pytest.raises(FitError, match=message("errors.no-such-near", kind="coordinate", name="ph", near="phi")):
        PolyMap.reset(NAMES, {"ph": 1.2})


def test_design_is_the_products():
    x = np.random.default_rng(0).uniform(-1, 1, (6, 2))
    expected = np.column_stack([np.ones(6), x[:, 1], 2 * x[:, 0] ** 2 - 1, x[:, 0] * (4 * x[:, 1] ** 3 - 3 * x[:, 1])])
    np.testing.assert_allclose(design(np.array([[0, 0], [0, 1], [2, 0], [1, 3]]), x), expected, atol=1e-15)


def test_the_papers_order_in_three_coordinates():
    keys = [(a, b, c) for a in range(2) for b in range(2) for c in range(2)]
    assert paper_order(keys)[:4] == [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)]


def test_what_is_refused():
    polymap = random_map(0)
    with pytest.raises(StateError):
        polymap([0.5, 0.5])
    with pytest.raises(FitError, match=message("errors.no-such", kind="coordinate", name="w")):
        polymap.monomials("w")
