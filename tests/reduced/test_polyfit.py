"""Polynomial fits: exact recovery, the paper's monomials and figures of merit, and data that cannot bear a fit."""

from fractions import Fraction
from functools import partial

import mpmath
import numpy as np
import pytest
import sheets
import sympy as sp
from messages import message
from pydantic import ValidationError
from sheets import NAMES, TWO_PI, returns_of

from nsmaps.errors import FitError
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.reduced.fit.leastsquares import Design
from nsmaps.reduced.fit.lifts import unwrapped
from nsmaps.reduced.fit.polyfit import PolyFit, PolynomialFit, SeparableFit, compare_orders
from nsmaps.reduced.fit.polymap import design

surface_of = partial(sheets.surface_of, v=(0.6, 0.9, 25), phi=(0.15, 0.45, 21))


def scattered(start, f=lambda v, phi: (v, phi)):
    """A surface of any states, on a grid that only lends its axes."""
    start = np.asarray(start, float)
    grid = Grid(axes={"v": Axis(low=0, high=1, points=max(2, len(start))), "phi": Axis(low=0, high=1, points=2)})
    return Surface("F", grid, np.arange(grid.size) < len(start), returns_of(start, np.column_stack(f(*start.T))))


POLY23 = PolynomialFit(degrees={"v": 3, "phi": 2})
R3 = PolynomialFit(degrees={"v": {"v": 5, "phi": 3}, "phi": {"v": 5, "phi": 4}})


# --------------------------------------------------------------------------------- monomials as the paper has them
def keys(text):
    """Exponents (v, phi) of monomials as the paper prints them."""
    v, phi = sp.symbols("v phi")
    return [sp.Poly(sp.sympify(term, {"v": v, "phi": phi}), v, phi).monoms()[0] for term in text.split()]


CUBIC2DV = "1 phi v phi**2 phi*v v**2 phi**2*v phi*v**2 v**3"
APR3_V = CUBIC2DV.replace("v**2 phi**2*v", "v**2 phi**3 phi**2*v") + (
    " phi**3*v phi**2*v**2 phi*v**3 v**4 phi**3*v**2 phi**2*v**3 phi*v**4 v**5"
)
APR3_PHI = (
    "1 phi v phi**2 phi*v v**2 phi**3 phi**2*v phi*v**2 v**3 phi**4 phi**3*v phi**2*v**2 phi*v**3 v**4 "
    "phi**4*v phi**3*v**2 phi**2*v**3 phi*v**4 v**5"
)


@pytest.mark.parametrize(
    ("fit", "output", "text", "terms"),
    [(POLY23, "v", CUBIC2DV, 9), (POLY23, "phi", CUBIC2DV, 9), (R3, "v", APR3_V, 18), (R3, "phi", APR3_PHI, 20)],
    ids=["poly23 v", "poly23 phi", "poly35", "poly45"],
)
def test_the_papers_monomials_in_the_papers_order(fit, output, text, terms):
    assert len(keys(text)) == terms
    assert [tuple(row) for row in fit.exponents(NAMES, output).tolist()] == keys(text)


def test_other_counts_of_matlabs_rule():
    assert len(PolynomialFit(degrees={"v": 3, "phi": 3}).exponents(NAMES, "v")) == 10
    assert len(PolynomialFit(degrees={"v": 1, "phi": 1}).exponents(NAMES, "v")) == 3
    assert PolynomialFit(degrees={"v": 0, "phi": 0}).exponents(NAMES, "v").tolist() == [[0, 0]]
    assert PolynomialFit(degrees={"v": 2}).exponents(NAMES, "phi").tolist() == [[0, 0], [1, 0], [2, 0]]
    three = PolynomialFit(degrees={"x": 2, "y": 1, "z": 2}).exponents(("x", "y", "z"), "x")
    assert {tuple(row) for row in three.tolist()} == {
        (a, b, c) for a in range(3) for b in range(2) for c in range(3) if a + b + c <= 2
    }


def test_separable_monomials():
    fit = SeparableFit(degrees={"v": 2, "phi": 1})
    assert fit.exponents(NAMES, "v").tolist() == [[0, 0], [1, 0], [2, 0]]
    assert fit.exponents(NAMES, "phi").tolist() == [[0, 0], [0, 1]]


# ----------------------------------------------------------------------------------------------- exact recovery
B = dict(zip(keys(CUBIC2DV), [0.4, -0.8, 1.5, 0.6, -1.1, 0.9, 0.7, -0.3, -1.2], strict=True))
A = dict(zip(keys(CUBIC2DV), [1.2, 0.3, -0.7, 0.25, 0.5, -0.6, 1.0, 0.4, 0.1], strict=True))


def polynomial(coefficients):
    return lambda v, phi: sum(c * v**i * phi**j for (i, j), c in coefficients.items())


def cubic(v, phi):
    return polynomial(B)(v, phi), polynomial(A)(v, phi)


def test_a_cubic_is_recovered_to_rounding():
    polymap = POLY23.fit(surface_of(cubic))
    for name, expected in (("v", B), ("phi", A)):
        found = polymap.monomials(name)
        assert list(found) == list(expected)
        np.testing.assert_allclose(list(found.values()), list(expected.values()), rtol=1e-9)
    report = polymap.report
    assert report.max_error.max() < 1e-14
    assert (report.r2 > 1 - 1e-13).all()
    assert (report.condition < 50).all()
    assert report.points.tolist() == [525, 525]
    assert report.terms.tolist() == [9, 9]
    assert report.warnings == ()
    np.testing.assert_array_equal(polymap.domain, [[0.6, 0.9], [0.15, 0.45]])
    assert [exponents.tolist() for exponents in polymap.exponents] == [POLY23.exponents(NAMES, "v").tolist()] * 2


def test_a_fit_of_its_own_order_leaves_nothing_to_a_higher_one():
    polymap = R3.fit(surface_of(cubic))
    for name, expected in (("v", B), ("phi", A)):
        found = polymap.monomials(name)
        assert all(abs(value - expected.get(key, 0)) < 1e-7 for key, value in found.items())


def test_degree_16_is_well_conditioned_where_monomials_are_hopeless():
    f = lambda v, phi: (np.sin(9 * v + phi), 1 + np.exp(-v) * np.cos(7 * phi))  # noqa: E731
    polymap = PolynomialFit(degrees={"v": 16, "phi": 16}).fit(surface_of(f, v=(0.6, 0.9, 60), phi=(0.15, 0.45, 60)))
    assert polymap.report.condition.max() < 1e3
    assert polymap.report.max_error.max() < 1e-13
    points = np.random.default_rng(0).uniform([0.6, 0.15], [0.9, 0.45], (200, 2))
    np.testing.assert_allclose(polymap(points), np.column_stack(f(*points.T)), atol=1e-12)
    plain = np.column_stack([points[:, 0] ** i * points[:, 1] ** j for i in range(17) for j in range(17 - i)])
    assert np.linalg.cond(plain) > 1e12


def test_the_fit_is_the_least_squares_solution():
    f = lambda v, phi: (np.exp(v * phi), 2 + np.sin(3 * v) * phi**3)  # noqa: E731
    surface = surface_of(f)
    report = POLY23.fit(surface).report
    plain = np.column_stack([surface.start[:, 0] ** i * surface.start[:, 1] ** j for i, j in keys(CUBIC2DV)])
    for i in range(2):
        y = surface.lifted[:, i]
        c, *_ = np.linalg.lstsq(plain, y, rcond=None)
        errors = y - plain @ c
        assert report.sse[i] == pytest.approx(np.sum(errors**2), rel=1e-6)
        assert report.r2[i] == pytest.approx(1 - np.sum(errors**2) / np.sum((y - np.mean(y)) ** 2), rel=1e-12)
        assert report.max_error[i] == pytest.approx(np.abs(errors).max(), rel=1e-5)


def test_figures_of_merit_by_hand():
    # the line through (0, 0), (1, 1), (2, 0), (3, 1) is 0.2 + 0.2 v: errors -0.2, 0.6, -0.6, 0.2
    start = np.column_stack([[0, 1, 2, 3], [0.0, 0, 0, 0]])
    surface = scattered(start, lambda v, phi: (np.array([0.0, 1, 0, 1]), 1 + v))
    report = PolynomialFit(degrees={"v": 1, "phi": 0}).fit(surface).report
    assert report.sse[0] == pytest.approx(0.8, rel=1e-12)
    assert report.r2[0] == pytest.approx(1 - 0.8 / 1.0, rel=1e-12)
    assert report.max_error[0] == pytest.approx(0.6, rel=1e-12)
    row = report.rows()[0]
    assert row == {
        "output": "v", "r2": report.r2[0], "sse": report.sse[0], "max_error": report.max_error[0],
        "condition": report.condition[0], "points": 4, "terms": 2,
    }  # fmt: skip
    assert report.rows()[1]["output"] == "phi"


def test_r2_of_data_that_do_not_vary_is_unknown():
    report = POLY23.fit(surface_of(lambda v, phi: (np.full_like(v, 0.1), phi))).report
    assert np.isnan(report.r2[0])
    assert report.sse[0] < 1e-28
    assert report.r2[1] == pytest.approx(1)


def test_absolute_values():
    f = lambda v, phi: (np.abs(0.2 + v - 2 * v**2), phi)  # noqa: E731
    fit = PolynomialFit(degrees={"v": 2, "phi": 1}, absolute=("v",))
    polymap = fit.fit(surface_of(f, v=(0.0, 0.6, 30)))
    assert polymap.absolute == ("v",)
    np.testing.assert_allclose(list(polymap.monomials("v").values()), [0.2, 0, 1, 0, -2], atol=1e-12)
    np.testing.assert_allclose(polymap([[0.8, 0.3]]), [[0.28, 0.3]], atol=1e-12)
    np.testing.assert_allclose(polymap.derivative([[0.8, 0.3]])[0, 0], [2.2, 0], atol=1e-11)
    assert polymap.report.max_error[0] < 1e-14


# ---------------------------------------------------------------------------------------------------- separable
def test_separable_along_the_papers_curves():
    # v' on the line phi = 0.35, phi' on the line v = 0.85, of grids that miss both values
    f = lambda v, phi: (v**2 + 3 * (phi - 0.36) * v, phi + 5 * (v - 0.84) * phi**2)  # noqa: E731
    surface = surface_of(f, v=(0.6, 0.9, 6), phi=(0.15, 0.45, 11))
    assert {round(x, 12) for x in surface.start[:, 0]} >= {0.84}
    polymap = SeparableFit(degrees={"v": 2, "phi": 2}, lines={"phi": 0.352, "v": 0.85}).fit(surface)
    step = 0.03 * round((0.352 - 0.15) / 0.03) + 0.15
    np.testing.assert_allclose(list(polymap.monomials("v").values()), [0, 3 * (step - 0.36), 1], atol=1e-12)
    np.testing.assert_allclose(list(polymap.monomials("phi").values()), [0, 1, 0], atol=1e-12)
    assert polymap.report.points.tolist() == [6, 11]
    assert polymap.report.max_error.max() < 1e-14
    worst = np.abs(f(*surface.start.T)[0] - polymap(surface.start)[:, 0]).max()
    assert any(text.startswith("v' ") and f"{worst:.3g}" in text for text in polymap.report.warnings)
    np.testing.assert_allclose(polymap.domain, [[0.6, 0.9], [0.15, 0.45]])


def test_separable_over_all_data_is_the_least_squares_mean():
    polymap = SeparableFit(degrees={"v": 1, "phi": 1}).fit(surface_of(lambda v, phi: (v + (phi - 0.3), phi + 7 * (v - 0.75))))
    np.testing.assert_allclose(list(polymap.monomials("v").values()), [0, 1], atol=1e-12)
    np.testing.assert_allclose(list(polymap.monomials("phi").values()), [0, 1], atol=1e-11)
    assert polymap.report.points.tolist() == [525, 525]


def test_along_a_line_without_data_is_refused():
    surface = surface_of(cubic, phi=(1.1, 2.5, 15))
    with pytest.raises(FitError, match=message("reduced.no-data-on-line", name="phi", value=0.35, range="[1.1, 2.5]")):
        SeparableFit(degrees={"v": 2, "phi": 2}, lines={"phi": 0.35, "v": 0.75}).fit(surface)
    with pytest.raises(FitError, match=message("reduced.no-line", name="phi")):
        SeparableFit(degrees={"v": 2, "phi": 2}, lines={"v": 0.75}).fit(surface)
    with pytest.raises(FitError, match=message("errors.no-such", kind="coordinate", name="w", at="lines")):
        SeparableFit(degrees={"v": 2, "phi": 2}, lines={"phi": 0.35, "w": 0.75}).fit(surface)


# ------------------------------------------------------------------------------------------------------- angles
@pytest.mark.parametrize("turns", [-2, 0, 3])
def test_whole_turns_common_to_all_images_are_dropped(turns):
    f = lambda v, phi: (v, 6.0 + v * phi + TWO_PI * turns)  # noqa: E731
    polymap = PolynomialFit(degrees={"v": 1, "phi": 1}).fit(surface_of(f, phi=(0.1, 0.2, 9)))
    expected = PolynomialFit(degrees={"v": 1, "phi": 1}).fit(surface_of(lambda v, phi: (v, 6.0 + v * phi), phi=(0.1, 0.2, 9)))
    np.testing.assert_allclose(list(polymap.monomials("phi").values()), list(expected.monomials("phi").values()), atol=1e-11)


def test_images_over_two_pi_are_followed_and_reported():
    f = lambda v, phi: (v, 5.4 + 1.5 * (v - 0.6) / 0.3)  # noqa: E731
    polymap = PolynomialFit(degrees={"v": 1, "phi": 1}).fit(surface_of(f))
    assert polymap.report.max_error[1] < 1e-13
    assert polymap([[0.9, 0.3]])[0, 1] == pytest.approx(6.9)
    (warning,) = polymap.report.warnings
    assert "phi' reaches from 5.4 to 6.9" in warning
    assert "mixed" not in warning


def test_mixed_turns_are_reported():
    f = lambda v, phi: (v, 1 + phi + 2 * TWO_PI * (v > 0.8))  # noqa: E731
    report = POLY23.fit(surface_of(f)).report
    assert any("numbers of periods may be mixed" in text for text in report.warnings)
    assert report.r2[1] < 0.95


def test_a_region_over_the_seam_is_fitted_on_one_stretch():
    f = lambda v, phi: (v + np.sin(phi), 1 + 2 * phi)  # noqa: E731
    around = surface_of(
        lambda v, phi: f(v, np.where(phi > np.pi, phi - TWO_PI, phi)),
        phi=(0, TWO_PI, 401),
        member=lambda v, phi: (phi < 0.4) | (phi > TWO_PI - 0.4),
    )
    returns = around.returns  # phi' = 1 + 2 phi with phi continued below zero; the start keeps its own turn
    lifted = np.where(returns.start[:, 1] > np.pi, returns.lifted[:, 1] + TWO_PI, returns.lifted[:, 1])
    around = Surface("F", around.grid, around.member, returns_of(returns.start, np.column_stack([returns.image[:, 0], lifted])))
    polymap = PolynomialFit(degrees={"v": 3, "phi": 3}).fit(around)
    np.testing.assert_allclose(polymap.domain[1], [-0.4, 0.4], atol=TWO_PI / 400)
    assert polymap.report.max_error.max() < 1e-3
    np.testing.assert_allclose(polymap([[0.7, -0.1]]), [[0.7 + np.sin(-0.1), 0.8]], atol=1e-3)


@pytest.mark.parametrize("ends", [(0, 3.0), (-0.5, 0.5), (0, TWO_PI), (2.0, 8.0), (5.0, 7.0), (-3.0, 3.0)])
def test_a_stretch_that_is_whole_already_is_left_alone(ends):
    surface = surface_of(cubic, phi=(*ends, 60))
    np.testing.assert_array_equal(unwrapped(surface)[0], surface.start)


def test_plain_coordinates_are_never_turned():
    start = np.random.default_rng(0).uniform(-20, 20, (50, 2))
    grid = Grid(axes={"x": Axis(low=0, high=1, points=25), "y": Axis(low=0, high=1, points=2)})
    lifted = start @ [[1, 2], [3, 4]] + 100
    surface = Surface("F", grid, np.ones(50, bool), returns_of(start, lifted, ("x", "y")))
    polymap = PolynomialFit(degrees={"x": 1, "y": 1}).fit(surface)
    np.testing.assert_allclose(list(polymap.monomials("x").values()), [100, 3, 1], rtol=1e-11)
    assert polymap.report.warnings == ()


# --------------------------------------------------------------------------------------------------- hard cases
def test_nine_points_bear_poly23_and_eight_do_not():
    rng = np.random.default_rng(3)
    start = rng.uniform([0.6, 0.15], [0.9, 0.45], (10, 2))
    ten = POLY23.fit(scattered(start, cubic))
    np.testing.assert_allclose(list(ten.monomials("v").values()), list(B.values()), rtol=1e-6)
    assert ten.report.warnings == ()
    nine = POLY23.fit(scattered(start[:9], cubic))
    assert any("as many as terms" in text for text in nine.report.warnings)
    with pytest.raises(FitError, match=message("reduced.too-few-data", output="v", points=8, terms=9)):
        POLY23.fit(scattered(start[:8], cubic))
    with pytest.raises(FitError, match=message("reduced.too-few-data", points=0)):
        POLY23.fit(scattered(start[:0], cubic))


def test_collinear_points():
    v = np.linspace(0.6, 0.9, 50)
    with pytest.raises(FitError, match=message("reduced.rank", points=50, terms=9)):
        POLY23.fit(scattered(np.column_stack([v, v])))
    with pytest.raises(FitError, match=message("reduced.all-at", value=0.3, name="phi", number=3, at="v'")):
        POLY23.fit(scattered(np.column_stack([v, np.full(50, 0.3)])))
    with pytest.raises(FitError, match=message("reduced.at-values", values=2, name="phi")):
        POLY23.fit(scattered(np.column_stack([v, np.where(v > 0.7, 0.3, 0.4)])))
    line = scattered(np.column_stack([v, np.full(50, 0.3)]), lambda v, phi: (v**3, phi))
    along = SeparableFit(degrees={"v": 3, "phi": 0}).fit(line)
    np.testing.assert_allclose(list(along.monomials("v").values()), [0, 0, 0, 1], atol=1e-11)
    assert along.scale[1] == 1


@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9])
def test_a_narrow_box_is_fitted_as_well_as_a_wide_one(width):
    low = 0.7

    def f(v, phi):  # in exact arithmetic, since v - low is lost in floats
        s = [Fraction(x) - Fraction(low) for x in v.tolist()]
        return np.array([float(x / Fraction(width)) ** 3 for x in s]), phi

    surface = surface_of(f, v=(low, low + width, 20))
    report = POLY23.fit(surface).report
    assert report.max_error[0] < 1e-12
    assert report.condition[0] < 50


U = np.random.default_rng(0).uniform(0, 1, (6000, 2))
AWKWARD = {
    "triangle": U[U.sum(axis=1) <= 1],
    "curved band": np.column_stack([U[:, 0], 0.5 + 0.4 * np.cos(4 * U[:, 0]) + 0.02 * U[:, 1]]),
    "hairline": np.column_stack([U[:, 0], U[:, 0] ** 2 + 1e-6 * U[:, 1]]),
    "annulus": U[np.abs(np.hypot(U[:, 0] - 0.5, U[:, 1] - 0.5) - 0.4) < 0.03],
}


@pytest.mark.parametrize("name", AWKWARD)
def test_degree_16_where_the_region_is_no_box(name):
    """Chebyshev products of the box have condition 1e8 and more on these data; polynomials orthogonal on them do not."""
    states = 0.7 + 0.3 * AWKWARD[name]
    f = lambda v, phi: (np.exp(np.sin(7 * v + 3 * phi)), 1 + np.cos(10 * v * phi) ** 2)  # noqa: E731
    fit = PolynomialFit(degrees={"v": 16, "phi": 16})
    polymap = fit.fit(scattered(states[::2], f))
    plain = np.column_stack([states[::2, 0] ** i * states[::2, 1] ** j for i, j in fit.exponents(NAMES, "v").tolist()])
    assert np.linalg.cond(plain) > 1e13
    box = (states[::2] - polymap.centre) / polymap.scale
    assert np.linalg.cond(design(fit.exponents(NAMES, "v"), box)) > 1e8
    report = polymap.report
    assert report.condition.max() < 1e4
    unseen = np.abs(polymap(states[1::2]) - np.column_stack(f(*states[1::2].T))).max(axis=0)
    assert (unseen < 20 * report.left_out + 1e-12).all()
    assert report.left_out.max() < 1e-3
    assert (report.loss <= np.maximum(report.max_error, 1e-10)).all()  # of going back to Chebyshev products
    assert report.warnings == ()


def test_orthogonal_polynomials_span_the_same_and_find_the_same_minimum():
    states = 0.7 + 0.3 * AWKWARD["triangle"][:400]
    f = lambda v, phi: (np.exp(v * phi), 2 + np.sin(3 * v) * phi**3)  # noqa: E731
    fit = PolynomialFit(degrees={"v": 7, "phi": 7})
    report = fit.fit(scattered(states, f)).report
    with mpmath.workdps(40):
        rows = [[mpmath.mpf(v) ** i * mpmath.mpf(phi) ** j for i, j in fit.exponents(NAMES, "v").tolist()] for v, phi in states]
        design_, y = mpmath.matrix(rows), mpmath.matrix(f(*states.T)[0].tolist())
        errors = y - design_ * mpmath.cholesky_solve(design_.T * design_, design_.T * y)
        assert report.sse[0] == pytest.approx(float(sum(e**2 for e in errors)), rel=1e-6)


@pytest.mark.parametrize(
    ("fit", "width"),
    [(POLY23, 3e-3), (SeparableFit(degrees={"v": 5, "phi": 4}), 3e-3), (PolynomialFit(degrees={"v": 2, "phi": 5}), 3e-3)],
    ids=["poly23", "separable", "poly52"],
)
def test_data_along_a_curve_recover_what_the_monomials_span(fit, width):
    """Monomials without all products of earlier ones, on data that are badly conditioned: no other space takes their place."""
    rng = np.random.default_rng(3)
    along, across = rng.uniform(-1, 1, (2, 400))
    exponents = fit.exponents(NAMES, "v")
    problem = Design(exponents, np.stack([along, along + width * across], axis=1))
    y = problem.columns @ rng.normal(size=len(exponents))
    basis, least = problem.orthonormal
    assert least > 1e-8
    assert abs(basis @ (basis.T @ y) - y).max() < 1e-10
    assert abs(problem.columns @ problem.solve("v'", y).coefficients - y).max() < 1e-10


def test_points_on_a_conic_or_given_again_tell_nothing_apart():
    angle = np.linspace(0, 6, 200)
    circle = 0.5 + 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    with pytest.raises(FitError, match=message("reduced.rank", points=200, rank=5, terms=6)):
        PolynomialFit(degrees={"v": 2, "phi": 2}).fit(scattered(circle))
    again = np.repeat(np.random.default_rng(1).uniform(0.2, 0.8, (5, 2)), 10, axis=0)
    with pytest.raises(FitError, match=message("reduced.rank", points=50, rank=5, terms=6)):
        PolynomialFit(degrees={"v": 2, "phi": 2}).fit(scattered(again))


def test_an_order_higher_than_the_data_bear_is_told():
    runge = lambda v, phi: (1 / (1 + 25 * (2 * v - 1) ** 2 + 25 * (2 * phi - 1) ** 2), v)  # noqa: E731
    fit, points = PolynomialFit(degrees={"v": 16, "phi": 16}), np.random.default_rng(2).uniform(0, 1, (2000, 2))
    warned = {}
    for count in (17, 60):
        polymap = fit.fit(surface_of(runge, v=(0, 1, count), phi=(0, 1, count)))
        worst = np.abs(polymap(points)[:, 0] - runge(*points.T)[0]).max()
        warned[count] = any("the data do not determine polynomials of this order" in text for text in polymap.report.warnings)
        assert (worst > 5 * polymap.report.max_error[0]) == warned[count]
    assert warned == {17: True, 60: False}


def test_errors_of_points_left_out_by_leaving_them_out():
    start = np.random.default_rng(3).uniform([0.6, 0.15], [0.9, 0.45], (25, 2))
    f = lambda v, phi: (np.exp(v * phi), 2 + np.sin(3 * v) * phi**3)  # noqa: E731
    alone = []
    for k in range(len(start)):
        polymap = POLY23.fit(scattered(np.delete(start, k, axis=0), f))
        alone.append(np.abs(polymap(start[[k]])[0] - np.ravel(f(*start[[k]].T))))
    np.testing.assert_allclose(POLY23.fit(scattered(start, f)).report.left_out, np.max(alone, axis=0), rtol=1e-6)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_data_that_are_not_finite_are_refused(bad):
    def f(v, phi):
        image = v.copy()
        image[[3, 7]] = bad
        return image, phi

    with pytest.raises(FitError, match=message("reduced.lost-data", output="v", number=2, points=525)):
        POLY23.fit(surface_of(f))


def test_a_doubtful_condition_is_reported():
    v = np.linspace(0.6, 0.9, 50)
    phi = v + 1e-10 * np.sin(40 * v)
    report = PolynomialFit(degrees={"v": 1, "phi": 1}).fit(scattered(np.column_stack([v, phi]))).report
    assert report.condition.min() > 1e8
    assert sum("few digits are correct" in text for text in report.warnings) == 2


@pytest.mark.parametrize(
    ("fit", "said"),
    [
        (
            PolynomialFit(degrees={"v": 3, "ph": 2}),
            message("errors.no-such-near", kind="coordinate", name="ph", near="phi", at="degrees"),
        ),
        (PolynomialFit(degrees={"v": {"v": 1}}), message("reduced.no-degrees", name="phi")),
        (
            PolynomialFit(degrees={"v": {"w": 1}, "phi": {"v": 1}}),
            message("errors.no-such", kind="coordinate", name="w", at="degrees of v'"),
        ),
        (
            PolynomialFit(degrees={"v": 1, "phi": 1}, absolute=("w",)),
            message("errors.no-such", kind="coordinate", name="w", at="absolute"),
        ),
        (SeparableFit(degrees={"v": 1}), message("reduced.no-degrees-of", name="phi")),
        (SeparableFit(degrees={"v": 1, "phi": 1, "w": 1}), message("errors.no-such", kind="coordinate", name="w", at="degrees")),
    ],
)
def test_names_that_are_no_coordinates_are_refused(fit, said):
    with pytest.raises(FitError, match=said):
        fit.fit(surface_of(cubic))


@pytest.mark.parametrize("degrees", [{"v": -1}, {"v": 1.5}, {"v": 41}, {"v": "x"}, {"v": {"v": -1}}])
def test_degrees_that_are_no_degrees_are_refused(degrees):
    with pytest.raises(ValidationError):
        PolynomialFit(degrees=degrees)


def test_a_fit_of_ones_own_is_a_class_with_two_methods():
    class Even(PolyFit):
        def exponents(self, coordinates, output):
            return np.array([[0, 0], [2, 0], [0, 2]])

        def data(self, surface, output):
            return surface.start[:, 0] > 0.7

    polymap = Even().fit(surface_of(lambda v, phi: (1 + v**2, 2 * phi**2)))
    found = polymap.monomials("v")
    assert found[2, 0] != 0
    assert (1, 0) in found  # of Chebyshev products around a centre even powers alone are not even in v
    assert polymap.report.points.tolist() == [int(np.sum(surface_of(cubic).start[:, 0] > 0.7))] * 2
    with pytest.raises(TypeError, match=message("others.abstract")):
        PolyFit()


def test_orders_are_compared_in_the_order_given():
    f = lambda v, phi: (np.exp(v * phi), 2 + np.sin(3 * v) * phi**3)  # noqa: E731
    surface = surface_of(f)
    orders = {
        "poly23": POLY23,
        "poly11": PolynomialFit(degrees={"v": 1, "phi": 1}),
        "poly33": PolynomialFit(degrees={"v": 3, "phi": 3}),
    }
    table = compare_orders(surface, orders)
    assert [name for name, _ in table] == list(orders)
    sse = {name: report.sse for name, report in table}
    assert (sse["poly33"] <= sse["poly23"] * (1 + 1e-9)).all()
    assert (sse["poly23"] < sse["poly11"]).all()
    with pytest.raises(FitError, match=message("reduced.too-few-data", output="fit 'poly23")):
        compare_orders(scattered([[0.5, 0.5]]), orders)
