"""The second iterate as a polynomial: general coefficients, numbers, and both orders of composition."""

import numpy as np
import pytest
import sympy as sp

from nsmaps.auxiliary.iterate import second_iterate
from nsmaps.errors import NsmapsError
from nsmaps.reduced.polyfit import Full
from nsmaps.reduced.polymap import PolyMap

POLY23 = Full(degrees={"v": 3, "phi": 2})
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


def test_bad_calls_are_errors():
    with pytest.raises(NsmapsError, match="order is 'upper'"):
        second_iterate(POLY23, order="upper")
    with pytest.raises(NsmapsError, match="two coordinates"):
        second_iterate(PolyMap.reset(("x", "y", "z"), {}))
