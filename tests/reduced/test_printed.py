"""Printed polynomials: decimals are rational numbers, and what cannot be read is refused in words."""

from fractions import Fraction

import pytest
from pydantic import ValidationError

from nsmaps.coordinates import Angle
from nsmaps.reduced.composite.printed import TabulatedMap

NAMES = ("v", Angle("phi"))
OVER = {"v": (0.2, 0.4), "phi": (0, "pi/2")}
KEEP = {"phi": {"phi": 1}}


def test_coefficients_are_collapsed_exactly():
    # 1e10 (d - 0.3)^4 of v, expanded: near d = 0.3 floats leave two digits of it
    powers = (81e6, -108e7, 54e8, -12e9, 1e10)
    polymap = TabulatedMap(images={"v": {"v**2": powers}, **KEEP}, over=OVER, parameter="d").at(NAMES, 0.3001)
    exact = float(10**10 * (Fraction("0.3001") - Fraction("0.3")) ** 4 * Fraction(0.35) ** 2)
    assert polymap([[0.35, 1.0]])[0] == pytest.approx([exact, 1.0], rel=1e-14)
    assert abs(sum(c * 0.3001**k for k, c in enumerate(powers)) * 0.35**2 - exact) > 1e-3 * exact


def test_absolute_values_and_orders_of_factors():
    terms = {"v": {"1": -1, "phi ** 2 * v": 2}, "phi": {"v*phi**2": 2}}
    polymap = TabulatedMap(images=terms, over=OVER, absolute=("v",)).at(NAMES)
    assert polymap([[0.25, 1.0]])[0] == pytest.approx([0.5, 0.5])
    assert polymap.monomials("phi")[1, 2] == pytest.approx(2)


@pytest.mark.parametrize("text", ["v^2", "2*v", "v+1", "v**-1", "v**1.5", "v*v", "", "v**", "**2", "v**200", "sin(v)"])
def test_what_is_no_monomial(text):
    with pytest.raises(ValidationError, match=r"the monomial .* cannot be read"):
        TabulatedMap(images={"v": {text: 1}, **KEEP}, over=OVER)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"images": {"v": {"1": 1}}}, "the image of 'phi' is missing; expected: those of all of v, phi"),
        ({"images": {"v": {"1": 1}, "ph": {"1": 1}}}, "the image of 'ph', did you mean 'phi'"),
        ({"images": {"v": {"ph": 1}, **KEEP}}, "the monomial 'ph': no coordinate 'ph', did you mean 'phi'"),
        ({"images": {"v": {"v*phi": 1, "phi*v": 2}, **KEEP}}, "'phi\\*v' is given twice"),
        ({"images": {"v": {"1": (1, 2)}, **KEEP}}, "a polynomial of a parameter that has no value"),
        ({"absolute": ("w",)}, "the image of 'w'"),
        ({"over": {"v": (0, 1)}}, "'phi' is missing"),
        ({"over": {"v": (1, 1), "phi": (0, 1)}}, "low < high"),
    ],
)
def test_what_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        TabulatedMap(**{"images": {"v": {"1": 1}, **KEEP}, "over": OVER} | change).at(NAMES)


@pytest.mark.parametrize("coefficient", [float("nan"), float("inf"), "x", [1, float("nan")]])
def test_coefficients_that_are_no_numbers(coefficient):
    with pytest.raises(ValidationError):
        TabulatedMap(images={"v": {"1": coefficient}, **KEEP}, over=OVER)
