"""Printed polynomials: decimals are rational numbers, and what cannot be read is refused in words."""

from fractions import Fraction

import pytest
from messages import message
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
    with pytest.raises(ValidationError, match=message("reduced.monomial")):
        TabulatedMap(images={"v": {text: 1}, **KEEP}, over=OVER)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"images": {"v": {"1": 1}}}, message("reduced.image-missing", name="phi", names="v, phi")),
        ({"images": {"v": {"1": 1}, "ph": {"1": 1}}}, message("reduced.image-of-near", name="ph", near="phi")),
        (
            {"images": {"v": {"ph": 1}, **KEEP}},
            message("errors.no-such-near", kind="coordinate", name="ph", near="phi", at="the monomial 'ph'"),
        ),
        ({"images": {"v": {"v*phi": 1, "phi*v": 2}, **KEEP}}, message("reduced.monomial-twice", monomial="phi*v")),
        ({"images": {"v": {"1": (1, 2)}, **KEEP}}, message("reduced.parameter-without-value")),
        ({"absolute": ("w",)}, message("reduced.image-of", name="w")),
        ({"over": {"v": (0, 1)}}, message("coordinates.box-lacks", name="phi")),
        ({"over": {"v": (1, 1), "phi": (0, 1)}}, message("coordinates.box")),
    ],
)
def test_what_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        TabulatedMap(**{"images": {"v": {"1": 1}, **KEEP}, "over": OVER} | change).at(NAMES)


@pytest.mark.parametrize("coefficient", [float("nan"), float("inf"), "x", [1, float("nan")]])
def test_coefficients_that_are_no_numbers(coefficient):
    with pytest.raises(ValidationError):
        TabulatedMap(images={"v": {"1": coefficient}, **KEEP}, over=OVER)
