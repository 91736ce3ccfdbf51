"""Compositions of whole maps and of pieces along words, and their two-cycles, against the maps themselves."""

from fractions import Fraction

import exported
import numpy as np
import pytest
import sympy as sp
from messages import message

from nsmaps.coordinates import TWO_PI, Angle
from nsmaps.errors import NsmapsError
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import ParametricMap
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.symbolic.curve_iterates import second_iterate
from nsmaps.symbolic.cycles import curve_cycles, two_cycles
from nsmaps.symbolic.map_iterates import compose_pieces, symbolic_iterate

PLANE = exported.random_map([[0.5, 1.0], [0.1, 0.9]], size=0.1)
STATES = np.random.default_rng(0).uniform([0.5, 0.1], [1.0, 0.9], (50, 2))


def piece(name, seed, absolute=()):
    region = ConditionRegion(text="v > 0", coordinates=exported.NAMES)
    return Piece(name, region, exported.random_map([[0.5, 1.0], [0.1, 0.9]], (2, 2), absolute, seed=seed, size=0.1))


@pytest.mark.thorough
def test_the_third_iterate_is_the_map_three_times():
    third = symbolic_iterate(PLANE, 3)
    assert third.degree == 27
    np.testing.assert_allclose(third.over()(STATES), PLANE(PLANE(PLANE(STATES))), rtol=0, atol=1e-13)
    v, phi = sp.symbols("v phi", real=True)
    state = {v: sp.Rational(0.7), phi: sp.Rational(0.4)}
    value = sp.Poly(third.images["v"], v, phi).eval(state)
    assert float(value) == pytest.approx(PLANE(PLANE(PLANE([[0.7, 0.4]])))[0, 0], abs=1e-14)
    total = sum(c * state[v] ** i * state[phi] ** j for (i, j), c in third.alpha("v").items())
    assert total == value


def test_a_word_of_regions_is_read_from_the_left():
    pieces = (piece("R1", 1), piece("R2", 2), piece("R3", 3, ("v",)))
    composite = CompositeMap(exported.NAMES, ("B",), pieces)
    one, two, three = (each.map for each in pieces)
    word = compose_pieces(composite, ["R2", "R1", "R1"])
    assert word.degree == 8
    np.testing.assert_allclose(word.over()(STATES), one(one(two(STATES))), rtol=0, atol=1e-13)
    assert np.abs(word.over()(STATES) - two(one(one(STATES)))).max() > 1e-3
    last = compose_pieces(composite, ["R1", "R3"])
    assert last.absolute == ("v",)
    np.testing.assert_allclose(last.over()(STATES), three(one(STATES)), rtol=0, atol=1e-13)
    with pytest.raises(NsmapsError, match=message("symbolic.depends-on-absolute", number=2, name="v")):
        compose_pieces(composite, ["R3", "R1"])
    with pytest.raises(NsmapsError, match=message("symbolic.word", word="R1")):
        compose_pieces(composite, "R1")
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="piece", name="R4")):
        compose_pieces(composite, ["R4"])


def test_a_word_with_d_and_with_a_reset():
    parametric = exported.parametric()
    word = compose_pieces(parametric, ["P1", "P0"])
    assert word.symbols == ("d",)
    states = np.random.default_rng(1).uniform([0.1, 0.1], [0.6, 3.0], (20, 2))
    for d in (0.26, 0.31):
        at = parametric.at(d)
        expected = at.piece("P0").map(at.piece("P1").map(states))
        np.testing.assert_allclose(word.at(d=d).over()(states), expected, rtol=1e-12)
        with_d = np.column_stack([states, np.full(20, d)])
        np.testing.assert_allclose(word.over()(with_d), np.column_stack([expected, with_d[:, 2]]), rtol=1e-12)
    reset = Piece("up", ConditionRegion(text="v > 1", coordinates=exported.NAMES), PolyMap.reset(exported.NAMES, {"phi": 1.2}))
    after = compose_pieces(CompositeMap(exported.NAMES, ("B",), (piece("R1", 1), reset)), ["up", "R1"])
    v = sp.Symbol("v", real=True)
    assert after.images["phi"].free_symbols == {v}
    with pytest.raises(NsmapsError, match=message("symbolic.no-domain", name="v")):
        after.over()
    box = [[0.5, 1.0], [0.1, 0.9]]
    assert np.array_equal(after.over({"phi": box[1], "v": box[0]})([[0.7, 0.2]]), after.over(box)([[0.7, 0.2]]))
    np.testing.assert_allclose(after.over(box)([[0.7, 0.2]]), piece("R1", 1).map([[0.7, 1.2]]), atol=1e-13)


def test_the_whole_second_iterate_in_d_is_within_reason():
    names, box = (*exported.NAMES, "d"), [[0.5, 1.0], [0.1, 0.9], [0.26, 0.35]]
    rng = np.random.default_rng(4)
    exponents = np.array([(i, j, k) for i in range(4) for j in range(3) for k in range(5) if i + j <= 3])
    coefficients = tuple(rng.normal(size=len(exponents)) * 0.01 for _ in range(2))
    identity = np.array([[0, 0, 0], [0, 0, 1]]), np.array([0.305, 0.045])
    centre, scale = np.mean(box, axis=1), np.ptp(box, axis=1) / 2
    polymap = PolyMap(names, (exponents, exponents, identity[0]), (*coefficients, identity[1]), centre, scale, np.array(box))
    region = ConditionRegion(text="v > 0", coordinates=exported.NAMES)
    in_d = ParametricMap("d", 0.26, 0.35, exported.NAMES, ("B",), (Piece("P", region, polymap),), np.array([0.3]), 1.0)
    twice = symbolic_iterate(in_d, 2)
    plane = in_d.at(0.3).piece("P").map
    np.testing.assert_allclose(twice.at(d=0.3).over()(STATES), plane(plane(STATES)), rtol=0, atol=1e-13)


def test_general_coefficients_and_refusals():
    line = symbolic_iterate(PolynomialFit(degrees={"x": 1}), 3, coordinates=("x",))
    x, b0, b1 = sp.symbols("x b_0 b_1", real=True)
    assert sp.expand(line.images["x"] - (b0 + b1 * (b0 + b1 * (b0 + b1 * x)))) == 0
    assert line.at(b_0=0.5, b_1=-1).images["x"] == sp.Rational(1, 2) - x
    with pytest.raises(NsmapsError, match=message("symbolic.degree", number=4, degree=81, terms=3403)):
        symbolic_iterate(PLANE, 4)
    with pytest.raises(NsmapsError, match=message("errors.value", name="n_iterates", value=0)):
        symbolic_iterate(PLANE, 0)
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="symbol", name="d")):
        symbolic_iterate(PLANE, 1).at(d=1)
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="coordinate", name="w")):
        symbolic_iterate(PLANE, 1).alpha("w")
    with pytest.raises(NsmapsError, match=message("symbolic.piece-of", name="R1", map="PolyMap")):
        symbolic_iterate(PLANE, 1, piece="R1")


def test_two_cycles_of_the_logistic_map():
    """x -> r x (1 - x): the two-cycle is (r + 1 +- sqrt((r + 1)(r - 3))) / (2 r), its multiplier 4 + 2 r - r^2."""
    r = 3.2
    line = PolyMap.of_monomials(("x",), {"x": {(1,): Fraction(r), (2,): -Fraction(r)}}, [[0, 1]])
    low, high = ((r + 1 + sign * np.sqrt((r + 1) * (r - 3))) / (2 * r) for sign in (-1, 1))
    curves = curve_cycles(second_iterate(line))
    np.testing.assert_allclose(curves.points, [[0, 0], [low, high], [1 - 1 / r, 1 - 1 / r], [high, low]], atol=1e-14)
    np.testing.assert_allclose(curves.multipliers, [r * r, 4 + 2 * r - r * r, (2 - r) ** 2, 4 + 2 * r - r * r], rtol=1e-12)
    assert sp.Poly(curves.equation).degree() == 4
    cycles = two_cycles(line)
    np.testing.assert_allclose(cycles.points, [[[low], [high]]], atol=1e-14)
    np.testing.assert_allclose(cycles.multipliers, [[4 + 2 * r - r * r]], rtol=1e-12)


def test_p_and_q_lie_on_both_curves():
    twice = second_iterate(PLANE, 0.2, 0.7, "min_first")
    cycles = curve_cycles(twice)
    assert len(cycles.points) >= 1
    for p, q in cycles.points:
        assert PLANE([[p, 0.2]])[0, 0] == pytest.approx(q, abs=1e-9 * max(1, abs(q)))
        assert PLANE([[q, 0.7]])[0, 0] == pytest.approx(p, abs=1e-9 * max(1, abs(p)))


def henon(names=("x", "y")):
    """x' = 1 - a x^2 + y, y' = b x at a = 0.9, b = 0.3, whose two-cycle solves a^2 x^2 - a (1 - b) x + (1 - b)^2 - a = 0."""
    a, b = Fraction(9, 10), Fraction(3, 10)
    images = {names[0]: {(0, 0): Fraction(1), (2, 0): -a, (0, 1): Fraction(1)}, names[1]: {(1, 0): b}}
    return PolyMap.of_monomials(names, images, [[-2, 2], [-1, 1]])


def test_the_two_cycle_of_the_henon_map_solves_its_system():
    cycles = two_cycles(henon())
    roots = np.sort(np.roots([0.81, -0.9 * 0.7, 0.49 - 0.9]))
    np.testing.assert_allclose(cycles.points, [[[roots[0], 0.3 * roots[1]], [roots[1], 0.3 * roots[0]]]], atol=1e-13)
    assert np.prod(cycles.multipliers) == pytest.approx(0.09, rel=1e-10)  # the determinant b, squared
    assert cycles.residual.max() < 1e-13
    assert [str(s) for s in cycles.unknowns] == ["x_1", "y_1", "x_2", "y_2"]
    values = dict(zip(cycles.unknowns, cycles.points[0].ravel().tolist(), strict=True))
    assert [abs(float(each.subs(values))) < 1e-13 for each in cycles.equations] == [True] * 4


def test_an_angle_is_taken_on_the_nearest_turn():
    names = ("x", Angle("phi"))
    plain = henon(names)
    turned = PolyMap.of_monomials(
        names, {n: plain.exact_monomials(n) | ({(0, 0): Fraction(3 * TWO_PI)} if n == "phi" else {}) for n in names}, plain.domain
    )
    np.testing.assert_allclose(two_cycles(turned).points, two_cycles(plain).points, atol=1e-12)
    assert any(each.has(sp.pi) for each in two_cycles(turned).equations)


def test_no_cycle_and_bad_boxes():
    line = PolyMap.of_monomials(("x",), {"x": {(1,): Fraction(1, 2)}}, [[-1, 1]])
    assert two_cycles(line).points.shape == (0, 2, 1)
    assert two_cycles(line).multipliers.shape == (0, 1)
    with pytest.raises(NsmapsError, match=message("coordinates.box")):
        two_cycles(PolyMap.reset(("x",), {}))
    with pytest.raises(NsmapsError, match=message("coordinates.box")):
        two_cycles(line, [[1, 0]])
