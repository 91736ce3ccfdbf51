"""Fits in other functions than monomials: Fourier series, bases of a user's own, their maps, enclosures and refusals."""

import re
from dataclasses import replace

import mpmath
import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps.coordinates import TWO_PI, Angle, Coordinates
from nsmaps.enclosures.composed import bounds_of
from nsmaps.errors import FitError, NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import parametric_map
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.basis import BasisFit, Fourier
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.store.serialize import decode, encode

CIRCLE, CYLINDER = (Angle("phi"),), ("v", Angle("phi"))
V, PHI = sp.symbols("v phi", real=True)


def surface_of(names, lifted, axes, turned=True):
    """The returns that a formula of states (N, n) gives on a grid, with their turns or without."""
    grid, names = Grid(axes=dict(zip(names, axes, strict=True))), Coordinates(names)
    start = grid.states()
    images = np.asarray(lifted(start), float)
    wrapped = names.wrap(images)
    turns = np.round((images - wrapped) / TWO_PI).astype(np.int32) * turned
    rows = np.zeros(len(start), np.int64), np.full(len(start), Outcome.returned, np.int8), np.full(len(start), np.nan)
    return Surface("all", grid, np.ones(len(start), bool), Returns(names, ("B",), start, wrapped, turns, *rows, fitted=True))


def around(points, start=0.0):
    """An axis of the whole circle."""
    return Axis(low=start, high=start + TWO_PI * (1 - 1 / points), points=points)


def on_circle(lifted, points=64, start=0.0, turned=True):
    return surface_of(CIRCLE, lifted, [around(points, start)], turned)


def whole(polymap):
    """The composite map of one piece that holds everywhere near."""
    bounds = {str(name): (0, 6.29) if isinstance(name, Angle) else (-50.0, 50.0) for name in polymap.coordinates}
    return CompositeMap(
        polymap.coordinates, ("B",), (Piece("all", Box(coordinates=polymap.coordinates, bounds=bounds), polymap, "BB"),)
    )


def wavy(x):
    return x + 0.3 + 0.7 * np.sin(x) - 0.2 * np.cos(2 * x) + 0.05 * np.sin(3 * x)


@pytest.mark.parametrize(("start", "turned"), [(0.0, True), (-2.0, True), (0.0, False)])
def test_a_trigonometric_polynomial_is_found_again(start, turned):
    polymap = Fourier(harmonics=3).fit(on_circle(wavy, start=start, turned=turned))
    terms = polymap.symbolic("phi").as_coefficients_dict()
    wanted = {PHI: 1, sp.S.One: 0.3, sp.sin(PHI): 0.7, sp.cos(2 * PHI): -0.2, sp.sin(3 * PHI): 0.05}
    shift = 2 * np.pi * round((float(terms[sp.S.One]) - 0.3) / (2 * np.pi))
    found = {term: float(c) - shift * (term == 1) for term, c in terms.items()}
    assert set(wanted) <= set(found)
    assert max(abs(c - wanted.get(term, 0.0)) for term, c in found.items()) < 1e-13
    assert polymap.report.terms.tolist() == [7]
    assert polymap.report.warnings == ()
    x = np.linspace(-9, 9, 101)[:, None]
    assert np.abs(Coordinates(CIRCLE).difference(polymap(x), wavy(x))).max() < 1e-13
    slopes = 1 + 0.7 * np.cos(x) + 0.4 * np.sin(2 * x) + 0.15 * np.cos(3 * x)
    np.testing.assert_allclose(polymap.derivative(x)[:, :, 0], slopes, atol=1e-13)


def test_an_analytic_circle_map_converges_geometrically():
    """The error of K harmonics of 1/(5/4 - cos phi) is that of its series in powers of 1/2."""
    poisson = lambda x: x + 0.3 / (1.25 - np.cos(x))  # noqa: E731
    errors = {}
    for harmonics in (4, 8, 16, 24):
        fitted = Fourier(harmonics=harmonics).fit(on_circle(poisson, 128))
        x = np.linspace(0, TWO_PI, 1000)[:, None]
        errors[harmonics] = np.abs(fitted(x) - poisson(x)).max()
    for harmonics, error in errors.items():
        assert 0.2 < error / (0.3 * 8 / 3 * 0.5**harmonics) < 1.1, harmonics
    assert len(errors) == 4


@pytest.mark.parametrize("turns", [-1, 0, 2, 3])
def test_maps_that_wind_otherwise(turns):
    lifted = lambda x: turns * x + 1 + 0.5 * np.sin(x)  # noqa: E731
    polymap = Fourier(harmonics=2, turns=turns).fit(on_circle(lifted, start=-1.0))
    x = np.linspace(-9, 9, 101)[:, None]
    assert np.abs(polymap.coordinates.difference(polymap(x), lifted(x))).max() < 1e-13
    assert np.abs(polymap.coordinates.difference(whole(polymap).first_return(x).image, lifted(x))).max() < 1e-13


def test_fixed_points_and_rotation_numbers_are_those_of_the_map():
    lifted = lambda x: x + 0.1 + 0.5 * np.sin(x)  # noqa: E731
    found = nsmaps.cells.find_cycles(whole(Fourier(harmonics=3).fit(on_circle(lifted))), [[0, TWO_PI]], max_period=1)
    points = sorted(float(cycle.states[0, 0]) for cycle in found.cycles)
    np.testing.assert_allclose(points, [np.pi + np.arcsin(0.2), 2 * np.pi - np.arcsin(0.2)], atol=1e-12)
    turning = lambda x: x + 0.7 + 0.4 * np.sin(x)  # noqa: E731
    orbit = whole(Fourier(harmonics=3).fit(on_circle(turning))).orbits([[0.2]], 2000)
    with mpmath.workdps(30):
        x = mpmath.mpf("0.2")
        for _ in range(2000):
            x += mpmath.mpf("0.7") + mpmath.mpf("0.4") * mpmath.sin(x)
        total = np.sum(orbit.lifted - orbit.start)
        assert abs(total - float(x - mpmath.mpf("0.2"))) < 1e-9


class Own(BasisFit):
    """Functions without a common structure, and for phi' with its angle added."""

    def basis(self, coordinates, output):
        return [1, sp.exp(-V), V**3, sp.sin(2 * PHI + sp.Rational(3, 10)), sp.sqrt(V) * sp.cos(PHI)]

    def winding(self, coordinates, output):
        return 1

    def data(self, surface, output):
        return np.ones(len(surface.start), bool)


class Waves(Own):
    """A Fourier series written out."""

    def basis(self, coordinates, output):
        return [1, *(wave(k * PHI) for k in range(1, 5) for wave in (sp.cos, sp.sin))]


def own(v, phi, lib):
    """An image of Own's functions, in NumPy or mpmath."""
    return (
        0.4 + 0.2 * lib.exp(-v) - 0.1 * v**3 + 0.15 * lib.sin(2 * phi + 0.3) + 0.05 * lib.sqrt(v) * lib.cos(phi),
        phi + 0.5 - 0.3 * lib.exp(-v) + 0.02 * v**3 + 0.4 * lib.sqrt(v) * lib.cos(phi),
    )


@pytest.fixture(scope="module")
def fitted():
    """The fit of Own to a map that is made of its functions, but for its coefficients."""
    lifted = lambda x: np.stack(own(*x.T, np), axis=1)  # noqa: E731
    return Own().fit(surface_of(CYLINDER, lifted, [Axis(low=0.2, high=1.5, points=12), around(24)]))


def test_functions_of_ones_own_are_found_again(fitted):
    assert fitted.variables == ("phi", "exp(-v)", "v**3", "sin(2*phi + 3/10)", "sqrt(v)*cos(phi)")
    x = np.random.default_rng(0).uniform([0.1, -7], [2, 7], (300, 2))
    np.testing.assert_allclose(fitted(x), np.stack(own(*x.T, np), axis=1), rtol=0, atol=1e-13)
    assert fitted.depends("v").tolist() == [True, True]
    assert fitted.middle[0] != fitted.middle[0]
    slopes, step = fitted.derivative(x[:20]), mpmath.mpf("1e-20")
    with mpmath.workdps(50):
        for row, (v, phi) in zip(slopes, x[:20].tolist(), strict=True):
            here = own(mpmath.mpf(v), mpmath.mpf(phi), mpmath)
            for j, there in enumerate((own(v + step, mpmath.mpf(phi), mpmath), own(mpmath.mpf(v), phi + step, mpmath))):
                np.testing.assert_allclose(
                    row[:, j], [float((b - a) / step) for a, b in zip(here, there, strict=True)], atol=1e-12
                )
    symbolic = sp.lambdify((V, PHI), [fitted.symbolic(name) for name in CYLINDER])
    np.testing.assert_allclose(np.transpose(symbolic(*x.T)), fitted(x), atol=1e-13)


def test_functions_that_span_polynomials_in_a_few_are_computed_from_these():
    assert list(map(str, Waves().variables(CIRCLE))) == ["sin(phi)", "cos(phi)"]
    shifted = on_circle(wavy)
    series, written = Fourier(harmonics=4).fit(shifted), Waves().fit(shifted)
    x = np.linspace(0, TWO_PI, 50)[:, None]
    np.testing.assert_allclose(series(x), written(x), atol=1e-13)


@pytest.mark.parametrize("kind", ["own", "fourier"])
def test_compiled_returns_are_the_map(kind, fitted):
    lifted = lambda x: np.stack([0.5 * x[:, 0] + 0.3 * np.sin(x[:, 1]), x[:, 1] + 0.1 * x[:, 0] + 0.2 * np.sin(x[:, 1])], 1)  # noqa: E731
    grid = [Axis(low=0.1, high=1, points=10), around(24)]
    polymap = fitted if kind == "own" else Fourier(harmonics=2, degrees={"v": 2}).fit(surface_of(CYLINDER, lifted, grid))
    composite, x = whole(polymap), np.random.default_rng(1).uniform([0.1, -9], [1, 9], (3000, 2))
    returns = composite.first_return(x, derivative=True)
    np.testing.assert_allclose(returns.lifted, polymap(x), rtol=0, atol=4e-14)
    np.testing.assert_allclose(returns.derivative, polymap.derivative(x), rtol=0, atol=4e-14)
    orbit, state = composite.orbits(x[:5], 3), x[:5]
    for k in range(3):
        state = composite.first_return(state).image
        assert (orbit.image[5 * k : 5 * k + 5] == state).all()


def test_images_of_boxes_hold_those_of_their_states(fitted):
    """Against 30 digits; the excess shrinks with the square of the box."""
    rng, excess = np.random.default_rng(3), []
    exact = {}
    for name in CYLINDER:
        i = fitted.coordinates.index(name)
        exact[i] = sp.lambdify((V, PHI), fitted.symbolic(name).xreplace({sp.Float(0): 0}), "mpmath")
    for size in (0.3, 0.03, 0.003):
        low = rng.uniform([0.2, 0], [1.2, 6], (20, 2))
        boxes = np.stack([low, low + size * rng.uniform(0.3, 1, (20, 2))], axis=2)
        found = bounds_of(fitted).hulls(boxes)
        ends = found.outer + found.margin[:, :, None] * [-1.0, 1.0]
        taken = boxes[:, None, :, 0] + rng.uniform(0, 1, (20, 200, 2)) * np.ptp(boxes, axis=2)[:, None]
        values = fitted(taken.reshape(-1, 2)).reshape(20, 200, 2)
        assert (ends[:, None, :, 0] <= values).all()
        assert (values <= ends[:, None, :, 1]).all()
        with mpmath.workdps(30):
            for box, at in zip(ends, taken[:, 0].tolist(), strict=True):
                for i, image in exact.items():
                    assert box[i, 0] - 1e-15 <= image(*map(mpmath.mpf, at)) <= box[i, 1] + 1e-15
        excess.append((np.ptp(ends, axis=2) - np.ptp(found.inner, axis=2)).max())
        for j in range(2):
            slope, wanted = (
                bounds_of(fitted).slope(j).hulls(boxes),
                fitted.derivative(taken.reshape(-1, 2)).reshape(20, 200, 2, 2),
            )
            assert (slope.outer[:, None, :, 0] - 1e-13 <= wanted[..., j]).all()
            assert (wanted[..., j] <= slope.outer[:, None, :, 1] + 1e-13).all()
    assert excess[1] < excess[0] / 40
    assert excess[2] < excess[1] / 40


def test_images_of_boxes_across_jumps_and_kinks():
    """floor(v) + abs(v - 1)/2: from 0 to 1 to the left of 1, at least 1 from there on."""
    names = ("v",)
    texts, units = ("floor(v)", "abs(v - 1)"), (np.eye(2, dtype=int),)
    polymap = PolyMap(names, units, (np.array([1.0, 0.5]),), np.zeros(2), np.ones(2), np.array([[0.0, 2.0]]), variables=texts)
    found = bounds_of(polymap).hulls(np.array([[[0.9, 1.1]], [[1.1, 1.2]], [[1.0, 1.0]]]))
    ends = found.outer[:, 0] + found.margin[:, :1] * [-1.0, 1.0]
    assert ends[0, 0] <= 0.0 + 1e-15
    np.testing.assert_allclose(ends[1:], [[1.05, 1.1], [1.0, 1.0]], atol=1e-12)
    kinked = replace(polymap, exponents=(np.array([[0, 1]]),), coefficients=(np.array([1.0]),))
    slopes = bounds_of(replace(kinked, variables=("v", "abs(v - 1)"))).slope(0).hulls(np.array([[[0.9, 1.1]], [[1.1, 1.2]]]))
    np.testing.assert_allclose(slopes.outer[:, 0], [[-1, 1], [1, 1]], atol=1e-12)


def test_domains_and_morse_sets_of_series():
    """Of phi' = phi + 0.3 + 0.6 sin phi, which rests at sin phi = -1/2."""
    polymap = Fourier(harmonics=1).fit(on_circle(lambda x: x + 0.3 + 0.6 * np.sin(x)))
    rest, saddle = np.pi + np.arcsin(0.5), 2 * np.pi - np.arcsin(0.5)
    for return_map, bounds in ((polymap, "outer"), (whole(polymap), "enclosed")):
        domain = nsmaps.attracting_domain(return_map, [[3.4, 3.9]], bounds_kind=bounds)
        assert domain.forward_invariant
        assert domain.status == bounds
        assert domain.boxes[-1][0, 0] <= rest <= domain.boxes[-1][0, 1]
    cover = nsmaps.cells.morse_sets(whole(polymap), [[0, TWO_PI]], depth=6)
    for x in (rest, saddle):
        assert ((cover.hulls[:, 0, 0] <= x) & (x <= cover.hulls[:, 0, 1])).any()
    assert (np.abs(cover.hulls.mean(axis=2) - [rest, saddle]).min(axis=1) < 0.1).all()


SYSTEM = """
from nsmaps import Angle, PiecewiseMap
from nsmaps.exact import Coordinates


class Dissipative(PiecewiseMap):
    dimensionless = True
    coordinates = Coordinates(("v", Angle("phi")))
    K: float = 0.3

    def pieces(self, x):
        from sympy import sin

        v = 0.3 * x.v + self.K * sin(x.phi)
        return {"A": (True, {"v": v, "phi": x.phi + 0.2 + v})}
"""
STUDY = """
system: mine.py:Dissipative
parameters: {K: 0.3}
grid:
  v: {from: -0.5, to: 0.5, points: 12}
  phi: {from: 0, to: 6.0, points: 21}
families: {A: [A]}
diagonal:
  family: A
  delta: 5
  orders: {series: {class: "nsmaps:Fourier", harmonics: 1, degrees: {v: 1}}, full: {full: {v: 1, phi: 3}}}
composite:
  - name: whole
    box: {v: [-0.6, 0.6], phi: [0, 6.2831853]}
    family: A
    fit: {class: "nsmaps:Fourier", harmonics: 1, degrees: {v: 1}}
orbits:
  - {start: {v: 0.1, phi: 1.0}, n_returns: 30}
domains:
  - {name: outer, map: whole, box: {v: [-0.5, 0.3], phi: [3.2, 4.2]}, bounds_kind: outer, max_updates: 1}
"""


@pytest.mark.thorough
def test_a_study_with_a_series(tmp_path):
    """It is computed, stored, drawn and exported; what has no closed form is left out with the reason."""
    from nsmaps.study.pictures.draw import draw

    (tmp_path / "mine.py").write_text(SYSTEM)
    (tmp_path / "study.yaml").write_text(STUDY)
    result = nsmaps.run_study(tmp_path / "study.yaml", out=tmp_path / "run")
    again = nsmaps.read_result(tmp_path / "run")
    polymap, stored = (each.composite.piece("whole").map for each in (result, again))
    x = np.random.default_rng(0).uniform([-1, 0], [1, 6], (50, 2))
    v = 0.3 * x[:, 0] + 0.3 * np.sin(x[:, 1])
    np.testing.assert_allclose(polymap(x), np.stack([v, x[:, 1] + 0.2 + v], axis=1), atol=1e-13)
    assert (stored(x) == polymap(x)).all()
    assert len(draw(again, ["cobweb", "envelopes", "fit_error"], tmp_path / "figures", dpi=30)) >= 3
    assert list(nsmaps.export(again, "json")) == ["dissipative.json", "composite_map.json"]
    assert nsmaps.export(polymap, "latex").count(r"\sin{\left(\phi \right)}") >= 2


def test_stored_to_the_bit(fitted):
    arrays = {}
    again = decode(encode(fitted, "map", arrays), arrays)
    assert again.variables == fitted.variables
    x = np.random.default_rng(2).uniform([0.1, 0], [1, 6], (50, 2))
    assert (again(x) == fitted(x)).all()


def test_what_needs_polynomials_says_so(fitted):
    wanted = message("symbolic.variables", names=re.compile("phi, exp.*"))
    for call in (
        lambda: nsmaps.symbolic.symbolic_iterate(fitted, 2),
        lambda: nsmaps.symbolic.second_iterate(fitted, 0, 1),
        lambda: nsmaps.symbolic.two_cycles(fitted),
    ):
        with pytest.raises(NsmapsError, match=wanted):
            call()
    for call in (lambda: fitted.monomials("v"), lambda: fitted.over([[0, 1], [0, 1]]), lambda: fitted.monomial_error("v")):
        with pytest.raises(FitError, match=message("reduced.not-a-polynomial", names="v, phi", factors="phi")):
            call()
    with pytest.raises(NsmapsError, match=message("symbolic.fit", fit="Fourier")):
        nsmaps.symbolic.symbolic_iterate(Fourier(harmonics=1), 2)
    with pytest.raises(FitError, match=message("reduced.other-variables", name="all")):
        parametric_map({0.1: whole(fitted), 0.2: whole(fitted)}, "d", (0.1, 0.2), 1)


class Logarithm(Own):
    def basis(self, coordinates, output):
        return [1, sp.log(V - 1)]


class Words(Own):
    def basis(self, coordinates, output):
        return ["sin(phi)"]


class Elsewhere(Own):
    def basis(self, coordinates, output):
        return [1, sp.Symbol("q")]


class Bessel(Own):
    def basis(self, coordinates, output):
        return [1, sp.besselj(0, V)]


@pytest.mark.parametrize(
    ("fit", "why"),
    [
        (Logarithm(), message("reduced.lost-variable", formula="log(v - 1)", at="v'")),
        (Words(), message("reduced.not-expressions", fit="Words", name="v", formula="sin(phi)", type="str")),
        (Elsewhere(), message("reduced.not-a-coordinate", name="q", names="phi, v", at="a variable of Elsewhere")),
        (Bessel(), message("reduced.function", formula="besselj(0, v)", function="besselj", at="a variable of Bessel")),
        (Fourier(harmonics={"v": 1}), message("errors.no-such", kind="coordinate", name="v", known="phi", at="harmonics")),
        (
            Fourier(harmonics=1, degrees={"phi": 1}),
            message("errors.no-such", kind="coordinate", name="phi", known="v", at="degrees"),
        ),
        (Fourier(harmonics=12), message("reduced.rank", points=100, rank=20, terms=25)),
    ],
)
def test_fits_that_cannot_be(fit, why):
    surface = surface_of(CYLINDER, lambda x: x, [Axis(low=0.2, high=1.5, points=5), around(20)])
    with pytest.raises(FitError, match=why):
        fit.fit(surface)


def test_harmonics_need_an_angle():
    with pytest.raises(FitError, match=message("reduced.no-angle", names="x")):
        Fourier(harmonics=1).fit(surface_of(("x",), lambda x: x, [Axis(low=0, high=1, points=5)]))


def test_a_map_of_a_plain_fit_has_no_variables():
    polymap = PolynomialFit(degrees={"phi": 3}).fit(on_circle(wavy))
    assert polymap.variables is None
    assert polymap.depends("phi").tolist() == [True]
