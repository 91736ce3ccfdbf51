"""Parametric maps: exact where the truth is a polynomial of the parameter, and honest where it is not."""

from functools import partial

import numpy as np
import pytest
import sheets
import sympy as sp
from messages import message
from sheets import NAMES, TWO_PI

from nsmaps.dynamics.continuation.follow import continue_branch, doublings_of
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.errors import FitError, NsmapsError
from nsmaps.reduced.composite.composite import CompositeMap, Piece, PieceSpec, build_composite
from nsmaps.reduced.composite.parametric import chebyshev_nodes, parametric_map, report_on
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.polyfit import PolynomialFit, SeparableFit
from nsmaps.reduced.fit.polymap import PolyMap

LOW, HIGH = 0.26, 0.35
NODES = chebyshev_nodes((LOW, HIGH), 7)
surface_of = partial(sheets.surface_of, v=(0.6, 0.9, 25), phi=(0.15, 0.45, 21))


def smooth(d, v, phi):
    return 0.3 * d**2 * v**2 + d * phi + 0.1, 1 + d**3 * v * phi - d


PIECES = [
    PieceSpec(name="up", region=ConditionRegion(text="v > 0.9", coordinates=NAMES), reset={"phi": 1.2}),
    PieceSpec(
        name="low",
        region=ConditionRegion(text="v <= 0.9", coordinates=NAMES),
        family="F",
        fit=PolynomialFit(degrees={"v": 2, "phi": 2}, absolute=("v",)),
    ),
]


def composite(f, d, **axes):
    surface = surface_of(lambda v, phi: f(d, v, phi), **axes)
    return build_composite(NAMES, ("B",), {"F": surface}, PIECES), surface


def made(f, order=4, nodes=NODES):
    return parametric_map({d: composite(f, d)[0] for d in nodes.tolist()}, "d", (LOW, HIGH), order)


def test_a_polynomial_of_the_parameter_is_recovered():
    parametric = made(smooth)
    states = np.random.default_rng(0).uniform([0.6, 0.15], [0.9, 0.45], (40, 2))
    for d in (LOW, 0.2777, 0.31, HIGH):
        got = parametric.at(d)
        np.testing.assert_allclose(got.first_return(states).image, np.column_stack(smooth(d, *states.T)), atol=1e-13)
        np.testing.assert_allclose(got.first_return([[0.95, 0.2]]).image, [[0.95, 1.2]])
        assert got.piece("low").map.absolute == ("v",)
    assert parametric.condition < 2
    polynomial = parametric.piece("low").map.symbolic("phi")
    v, phi, d = sp.symbols("v phi d", real=True)
    difference = sp.Poly(sp.expand(polynomial - (1 + d**3 * v * phi - d)), v, phi, d)
    assert max(abs(c) for c in difference.coeffs()) < 1e-7  # monomials of a narrow range of d
    assert parametric.piece("low").map.monomial_error("phi") < 1e-11
    assert parametric.piece("low").map.monomial_error("d") < 1e-15


def test_every_value_shares_one_scaling_though_the_data_do_not():
    nodes = {d: composite(smooth, d, v=(0.6, 0.5 + d, 25))[0] for d in NODES.tolist()}
    parametric = parametric_map(nodes, "d", (LOW, HIGH), 4)
    assert parametric.piece("low").map.domain[0].tolist() == [0.6, 0.5 + NODES.max()]
    states = np.array([[0.7, 0.3]])
    np.testing.assert_allclose(parametric.at(0.3).first_return(states).image, np.column_stack(smooth(0.3, *states.T)), atol=1e-12)


def test_data_on_one_line_at_every_value():
    line = PieceSpec(name="line", region=PIECES[1].region, family="F", fit=SeparableFit(degrees={"v": 2, "phi": 0}))
    nodes = {}
    for d in NODES.tolist():
        surface = surface_of(lambda v, phi, d=d: smooth(d, v, phi))
        on_line = surface.restrict(surface.start[:, 1] == surface.start[0, 1])
        nodes[d] = build_composite(NAMES, ("B",), {"F": on_line}, [line])
    polymap = parametric_map(nodes, "d", (LOW, HIGH), 4).piece("line").map
    assert np.ptp(polymap.domain, axis=1) == pytest.approx([0.3, 0, 0.09])
    assert polymap([[0.7, 0.15, 0.3]])[0, 0] == pytest.approx(smooth(0.3, 0.7, 0.15)[0], abs=1e-13)


def test_outside_of_its_values_there_is_no_map():
    parametric = made(smooth)
    for value in (0.2599, 0.3501, np.nan):
        with pytest.raises(NsmapsError, match=message("reduced.outside-fitted", parameter="d", low=0.26, high=0.35)):
            parametric.at(value)
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="piece", name="lo", near="low")):
        parametric.piece("lo")


def test_angles_are_brought_onto_one_turn():
    def turning(d, v, phi):  # an image that crosses 2 pi in the middle of the range of d
        return v, TWO_PI + 8 * (d - 0.305) + 0.1 * phi

    parametric = made(turning)
    for d in (0.27, 0.3, 0.33):
        image = parametric.at(d).first_return([[0.7, 0.3]]).image
        np.testing.assert_allclose(image, np.mod(np.column_stack(turning(d, 0.7, 0.3)), TWO_PI), atol=1e-12)


def over_the_seam(d, turn):
    """v' = (1 + v)/2 + d phi and phi' = phi/2 + 4 d over phi = 0, as fitted to phases on a turn."""
    domain = np.array([[0.0, 1.0], [2 * np.pi * turn - 0.3, 2 * np.pi * turn + 0.3]])
    exponents = np.array([[0, 0], [1, 0], [0, 1]]), np.array([[0, 0], [0, 1]])
    coefficients = np.array([0.75, 0.25, 0.3 * d]), np.array([4 * d % TWO_PI, 0.15])
    polymap = PolyMap(NAMES, exponents, coefficients, domain.mean(axis=1), np.array([0.5, 0.3]), domain)
    box = Box(coordinates=NAMES, bounds={"v": (0.0, 1.0), "phi": (-0.3, 0.3)})
    return CompositeMap(NAMES, ("B",), (Piece("P", box, polymap, "BB"),))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_neither_the_order_of_the_values_nor_the_turns_of_the_data_matter(seed):
    rng = np.random.default_rng(seed)
    composites = {d: over_the_seam(d, rng.integers(-1, 2)) for d in rng.permutation(np.linspace(0, 2, 9)).tolist()}
    parametric = parametric_map(composites, "d", (0.0, 2.0), 2)
    v, phi = np.random.default_rng(0).uniform([0, -0.3], [1, 0.3], (40, 2)).T
    for d in (0.0, 0.31, 2.0):
        got = parametric.at(d).first_return(np.column_stack([v, phi])).image
        expected = np.column_stack([(1 + v) / 2 + d * phi, (phi / 2 + 4 * d) % TWO_PI])
        np.testing.assert_allclose(got, expected, atol=1e-13)
    whole = sheets.surface_of(lambda v, phi: ((1 + v) / 2 + 0.31 * phi, phi / 2 + 1.24), v=(0, 1, 9), phi=(-0.3, 0.3, 9))
    report = report_on(parametric, [(0.31, over_the_seam(0.31, 1), {"P": whole})])
    assert max(report.error.max(), report.refit.max()) < 1e-13


@pytest.mark.parametrize("order", [2, 8])
def test_errors_at_values_held_out(order):
    def bumpy(d, v, phi):
        return 0.5 + np.exp(v * phi) * np.sin(60 * d) / 5, 1 + 0 * v

    parametric = made(bumpy, order, chebyshev_nodes((LOW, HIGH), 12))
    held = [(d, *composite(bumpy, d)) for d in (LOW, 0.3, 0.33)]
    report = report_on(parametric, [(d, fitted, {"low": surface}) for d, fitted, surface in held])
    assert (report.names, report.values.tolist()) == (("low",), [LOW, 0.3, 0.33])
    for h, (d, fitted, surface) in enumerate(held):
        exact = surface.lifted[:, 0]
        ours, refit = parametric.at(d).piece("low").map(surface.start)[:, 0], fitted.piece("low").map(surface.start)[:, 0]
        expected = [np.abs(refit - exact).max(), np.abs(ours - exact).max(), np.abs(ours - refit).max()]
        np.testing.assert_allclose(
            [report.refit[0, h, 0], report.error[0, h, 0], report.difference[0, h, 0]], expected, rtol=1e-9
        )


def quadratic(a, v, phi):  # periods double at a = 3/4 and 5/4
    return 1 - a * v**2, 1 + a**2 * v / 4


WHOLE = PieceSpec(
    name="low", region=ConditionRegion(text="0 < 1", coordinates=NAMES), family="F", fit=PolynomialFit(degrees={"v": 2, "phi": 0})
)


def quadratics(orders):
    fitted = {}
    for a in chebyshev_nodes((0.6, 1.3), 5).tolist():
        surface = surface_of(lambda v, phi, a=a: quadratic(a, v, phi), v=(-1, 1, 9), phi=(0, 2, 3))
        fitted[a] = build_composite(NAMES, ("B",), {"F": surface}, [WHOLE])
    return parametric_map(fitted, "a", (0.6, 1.3), 1, orders)


def test_period_doublings_of_a_parametric_map_are_where_they_are_known_to_be():
    parametric = quadratics({"low": {"phi": 2}})
    cycle = periodic_orbit(parametric.at(0.7), [0.6, 1.0])
    branch = continue_branch(parametric.at, "p", cycle, 0.7, (0.6, 1.3), direction="up", step=0.1, kinds=("period doubling",))
    doubled = doublings_of(parametric.at, branch, (0.6, 1.3), max_doublings=1, step=0.1, kinds=("period doubling",))
    found = [event.value for each in (branch, *doubled) for event in each.of_kind("period doubling")]
    assert found == pytest.approx([0.75, 1.25], abs=1e-9)


def test_images_have_orders_of_their_own():
    """Of least squares at the nodes by themselves: the image of v is of order 0, that of phi of order 2 and so exact."""
    nodes, states = chebyshev_nodes((0.6, 1.3), 5), np.array([[0.7, 0.3], [-0.4, 2.0]])
    for orders, order in (({"low": {"v": 0, "phi": 2}}, 0), ({"low": 2}, 2)):
        parametric = quadratics(orders)
        slope = np.polynomial.Polynomial.fit(nodes, -nodes, order)
        for a in (0.6, 0.93):
            image = parametric.at(a).first_return(states).image
            expected = np.column_stack([1 + slope(a) * states[:, 0] ** 2, quadratic(a, *states.T)[1]])
            np.testing.assert_allclose(image, expected, atol=1e-12)
        assert parametric.piece("low").map.exponents[0][:, 2].max() == order


def test_what_is_refused():
    for orders, said in (
        ({"lo": 2}, message("errors.no-such-near", kind="piece", name="lo", near="low")),
        ({"low": {"ph": 2}}, message("reduced.degree-of", name="ph", near="phi", piece="low", names="v, phi")),
        ({"low": {"phi": 5}}, message("reduced.degree", degree=5, parameter="a", number=5, least=6)),
    ):
        with pytest.raises(NsmapsError, match=said):
            quadratics(orders)
    with pytest.raises(FitError, match=message("reduced.degree", degree=7, parameter="d", number=7)):
        made(smooth, 7)
    one, _ = composite(smooth, 0.3)
    other = build_composite(NAMES, ("B",), {}, PIECES[:1])
    with pytest.raises(FitError, match=message("reduced.different-pieces")):
        parametric_map({0.3: one, 0.31: other}, "d", (LOW, HIGH), 1)


def test_nodes_are_those_of_chebyshev():
    nodes = chebyshev_nodes((-1, 1), 5)
    np.testing.assert_allclose(np.cos(5 * np.arccos(nodes)), 0, atol=1e-14)
    assert (np.diff(nodes) > 0).all()
