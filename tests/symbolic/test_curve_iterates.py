"""The second iterate as a polynomial: general coefficients, numbers, and both orders of composition."""

from types import SimpleNamespace

import exported
import numpy as np
import pytest
import sympy as sp
from messages import message

from nsmaps.errors import NsmapsError
from nsmaps.reduced.fit.polyfit import PolynomialFit, SeparableFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.symbolic.curve_iterates import envelope_curves, second_iterate

POLY23 = PolynomialFit(degrees={"v": 3, "phi": 2})
B = sp.symbols("b_0:9", real=True)
V, LOW, HIGH = sp.symbols("v phi_min phi_max", real=True)


def f1(v, phi):
    """Eq. cubic2dv, written out by hand."""
    b = B
    return (
        b[0] + b[1] * phi + b[2] * v + b[3] * phi**2 + b[4] * phi * v + b[5] * v**2
        + b[6] * phi**2 * v + b[7] * phi * v**2 + b[8] * v**3
    )  # fmt: skip


def test_alphas_are_the_expansion_of_eq_seconditerativev():
    iterate = second_iterate(POLY23)
    assert len(iterate.alpha) == 10
    expanded = sp.Poly(sp.expand(f1(f1(V, HIGH), LOW)), V)
    for power, alpha in enumerate(iterate.alpha):
        assert sp.expand(alpha - expanded.coeff_monomial(V**power)) == 0


def test_the_other_order_is_eq_auxv2nd():
    iterate = second_iterate(POLY23, order="min_first")
    assert sp.expand(iterate.expr - f1(f1(V, LOW), HIGH)) == 0


def test_printed_alphas_and_the_two_misprints():
    """alpha_9, alpha_8, alpha_7 as printed; alpha_0 without its last printed term; alpha_3 with p_1^3 read as phi_max^3."""
    alpha = second_iterate(POLY23).alpha
    b = B
    assert sp.expand(alpha[9] - b[8] ** 4) == 0
    assert sp.expand(alpha[8] - (3 * b[5] * b[8] ** 3 + 3 * b[7] * b[8] ** 3 * HIGH)) == 0
    printed = (
        3 * b[5] ** 2 * b[8] ** 2 + 3 * b[2] * b[8] ** 3 + 6 * b[5] * b[7] * b[8] ** 2 * HIGH + 3 * b[4] * b[8] ** 3 * HIGH
        + 3 * b[7] ** 2 * b[8] ** 2 * HIGH**2 + 3 * b[6] * b[8] ** 3 * HIGH**2
    )  # fmt: skip
    assert sp.expand(alpha[7] - printed) == 0
    misprint = b[3] ** 2 * b[6] * b[8] * HIGH**6
    assert sp.Poly(alpha[0], *B, HIGH).coeff_monomial(misprint) == 0
    assert sp.Poly(alpha[1], *B, HIGH).coeff_monomial(misprint) == 3
    assert sp.Poly(alpha[3], *B, HIGH).coeff_monomial(b[5] * b[6] * b[7] * HIGH**3) == 2


def test_numbers_and_fixed_points():
    rng = np.random.default_rng(3)
    exponents = POLY23.exponents(("v", "phi"), "v")
    coefficients = rng.normal(size=len(exponents)) * 0.1
    box = np.array([[0.5, 1.0], [0.1, 0.9]])
    maps = PolyMap(
        ("v", "phi"), (exponents, exponents), (coefficients, coefficients), box.mean(axis=1), np.ptp(box, axis=1) / 2, box
    )
    iterate = second_iterate(maps, 0.2, 0.7)
    for v in (0.5, 0.8, 1.0):
        first = maps([[v, 0.7]])[0, 0]
        assert iterate(v) == pytest.approx(maps([[first, 0.2]])[0, 0], abs=1e-12)
    points = iterate.fixed_points()
    assert points == sorted(points)
    for point in points:
        assert iterate(point) == pytest.approx(point, rel=1e-9)


def test_phi_is_iterated_at_extremes_of_v():
    iterate = second_iterate(POLY23, variable="phi")
    a = sp.symbols("a_0:9", real=True)
    phi, low, high = sp.symbols("phi v_min v_max", real=True)
    g = lambda v, phi: f1(v, phi).subs(dict(zip(B, a, strict=True)), simultaneous=True)  # noqa: E731
    assert str(iterate.variable) == "phi"
    assert sp.expand(iterate.expr - g(low, g(high, phi))) == 0
    assert len(iterate.alpha) == 5


def test_separable_fits_hold_nothing():
    alpha = second_iterate(SeparableFit(degrees={"v": 2, "phi": 1}), variable="phi").alpha
    a = sp.symbols("a_0:2", real=True)
    assert [sp.expand(x) for x in alpha] == [a[0] + a[0] * a[1], a[1] ** 2]


def polynomial_map(names, degrees, box, seed):
    rng = np.random.default_rng(seed)
    fit, box = PolynomialFit(degrees=dict(zip(names, degrees, strict=True))), np.array(box, float)
    exponents = tuple(fit.exponents(names, name) for name in names)
    coefficients = tuple(rng.normal(size=len(each)) * 0.2 for each in exponents)
    return PolyMap(names, exponents, coefficients, box.mean(axis=1), np.ptp(box, axis=1) / 2, box)


def test_one_and_three_coordinates():
    line = polynomial_map(("x",), (3,), [[0, 1]], 1)
    assert second_iterate(line)(0.3) == pytest.approx(line(line([[0.3]]))[0, 0], abs=1e-14)
    space = polynomial_map(("x", "y", "z"), (2, 2, 1), [[0, 1], [1, 2], [-1, 0]], 2)
    low, high = {"x": 0.2, "z": -0.7}, {"x": 0.8, "z": -0.1}
    iterate = second_iterate(space, low, high, variable="y")
    first = space([[0.8, 1.4, -0.1]])[0, 1]
    assert iterate(1.4) == pytest.approx(space([[0.2, first, -0.7]])[0, 1], abs=1e-13)
    some = second_iterate(space, {"x": 0.2}, {"x": 0.8}, variable="y")
    assert sorted(map(str, some.expr.free_symbols)) == ["y", "z_max", "z_min"]
    assert some.at(z_min=-0.7, z_max=-0.1)(1.4) == pytest.approx(iterate(1.4), abs=1e-14)


def test_nth_iterates_at_a_sequence_of_values():
    polymap = exported.random_map([[0.5, 1.0], [0.1, 0.9]], size=0.1)
    held = [0.2, 0.7, 0.4, 0.3]
    value = 0.62
    for phi in held:
        value = polymap([[value, phi]])[0, 0]
    iterate = second_iterate(polymap, held=held)
    assert len(iterate.alpha) == 82
    assert iterate(0.62) == pytest.approx(value, rel=1e-12)
    assert iterate.domain == {"v": (0.5, 1.0)}
    with pytest.raises(NsmapsError, match=message("symbolic.degree", number=5, degree=243, terms=244)):
        second_iterate(polymap, held=[*held, 0.2])


def test_numbers_for_general_coefficients_give_the_iterate_of_numbers():
    polymap = polynomial_map(("v", "phi"), (3, 2), [[-1, 1], [-1, 1]], 4)
    numbers = {f"b_{k}": sp.Rational(c) for k, c in enumerate(polymap.exact_monomials("v").values())}
    general = second_iterate(POLY23).at(**numbers, phi_min=0.2, phi_max=0.7)
    assert general.alpha == second_iterate(polymap, 0.2, 0.7).alpha


def test_d_stays_a_symbol_in_the_coefficients():
    parametric = exported.parametric()
    iterate = second_iterate(parametric, 0.2, 0.4, piece="P0")
    d = sp.Symbol("d", real=True)
    assert len(iterate.alpha) == 10
    assert all(alpha.free_symbols <= {d} and alpha.is_polynomial(d) for alpha in iterate.alpha)
    assert iterate.domain == {"v": (0.6, 0.9), "d": (0.26, 0.35)}
    for value in (0.26, 0.3, 0.35):
        plain = second_iterate(parametric.at(value), 0.2, 0.4, piece="P0")
        assert iterate.at(d=value)(0.7) == pytest.approx(plain(0.7), abs=1e-13)
    with pytest.raises(NsmapsError, match=message("symbolic.no-piece-named")):
        second_iterate(parametric, 0.2, 0.4)
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="piece", name="P2")):
        second_iterate(parametric, 0.2, 0.4, piece="P2")


def test_envelopes_in_closed_form_are_two_curves():
    polymap = polynomial_map(("v", "phi"), (3, 2), [[0.5, 1.0], [0.1, 0.9]], 5)
    envelope = SimpleNamespace(coordinate="v", kind="closed form", held=np.array([[np.nan, np.nan], [0.9, 0.1]]))
    lower, upper = envelope_curves(polymap, envelope)
    assert [lower(0.7), upper(0.7)] == pytest.approx(polymap([[0.7, 0.9], [0.7, 0.1]])[:, 0].tolist(), abs=1e-15)
    with pytest.raises(NsmapsError, match=message("symbolic.envelope", name="v", kind="numeric")):
        envelope_curves(polymap, SimpleNamespace(coordinate="v", kind="numeric", held=None))


def test_bad_calls_are_errors():
    with pytest.raises(NsmapsError, match=message("errors.value", name="order", value="'upper'")):
        second_iterate(POLY23, order="upper")
    three = PolyMap.reset(("x", "y", "z"), {})
    with pytest.raises(NsmapsError, match=message("symbolic.one-value", value=0.2, names="y, z")):
        second_iterate(three, 0.2, 0.4)
    with pytest.raises(NsmapsError, match=message("symbolic.held", name="w")):
        second_iterate(three, {"w": 1.0})
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="coordinate", name="ph", near="phi")):
        second_iterate(POLY23, variable="ph")
    with pytest.raises(NsmapsError, match=message("symbolic.absolute", name="v")):
        second_iterate(POLY23.model_copy(update={"absolute": ("v",)}))
    with pytest.raises(NsmapsError, match=message("symbolic.symbols", first="b_0")):
        second_iterate(POLY23)(0.5)
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="symbol", name="c_0", near="b_0")):
        second_iterate(POLY23).at(c_0=1)
    with pytest.raises(NsmapsError, match=message("symbolic.no-value")):
        second_iterate(POLY23, held=[])
    with pytest.raises(NsmapsError, match=message("symbolic.degree", number=3, degree=27, terms=3981263)):
        second_iterate(POLY23, held=[None] * 3)


def test_what_is_held_is_told_in_the_order_of_the_curves():
    polymap = polynomial_map(("v", "phi"), (3, 2), [[0.5, 1.0], [0.1, 0.9]], 5)
    assert second_iterate(polymap, 0.2, 0.7).held == ({"phi": 0.7}, {"phi": 0.2})
    assert second_iterate(polymap, 0.2, 0.7, "min_first").held == ({"phi": 0.2}, {"phi": 0.7})
    assert second_iterate(polymap, held=[0.3, 0.1, 0.2]).held == ({"phi": 0.3}, {"phi": 0.1}, {"phi": 0.2})
    open_ends = second_iterate(polymap)
    assert open_ends.held == ({"phi": HIGH}, {"phi": LOW})
    half = open_ends.at(phi_max=0.7)
    assert half.held == ({"phi": 0.7}, {"phi": LOW})
    put_in = half.at(phi_min=0.2)
    assert put_in.held == ({"phi": 0.7}, {"phi": 0.2})
    curves = [polymap([[0.8, values["phi"]]])[0, 0] for values in put_in.held]
    assert [float(c.subs(V, 0.8)) for c in put_in.curves] == pytest.approx(curves, abs=1e-12)
    three = second_iterate(PolyMap.reset(("x", "y", "z"), {"x": 0.1}), {"y": 1.0, "z": 2.0}, {"y": 3.0, "z": 4.0})
    assert three.held == ({"y": 3.0, "z": 4.0}, {"y": 1.0, "z": 2.0})
