"""The composite map of a map that is given by formulas, at the values of its parameters."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Coordinates
from nsmaps.errors import ConditionError
from nsmaps.exact.piecewise.formulas import Choices, formulas_of
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.composite.piece import Piece
from nsmaps.reduced.conditions.condition import with_numbers
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.conditions.text import text_of
from nsmaps.reduced.fit.polymap import PolyMap

MIDDLE = math.nextafter(math.nextafter(math.pi, 0), 0)  #: of angles in [0, 2 pi), of which 2 pi itself is not one
HIGHEST = 40  #: degree of images that become polynomials, as of fits


def composite_of(return_map: PiecewiseMap) -> CompositeMap:
    """A map given by formulas as a composite map: what encloses images of boxes and writes maps in other languages takes it.

    Images that are polynomials of the coordinates become polynomials with coefficients that are rounded once, all others
    formulas in text. Parameters are numbers. Pieces have the names and words of the map's letters.

    Raises:
        ConditionError: names the piece, and what of its formulas has no text.
    """
    formulas = formulas_of(Choices.of(return_map))
    names, symbols = [str(name) for name in return_map.coordinates], [str(symbol) for symbol in formulas.symbols]
    own = dict(zip(formulas.variables, sp.symbols(names, real=True), strict=True))
    numbers = dict(zip(symbols, return_map.parameters.values(), strict=True))

    def text(formula: Any) -> str:
        return with_numbers(text_of(formula.xreplace(own), (*names, *symbols)), numbers, (*names, *symbols))

    exact = {symbol: sp.Rational(Fraction(numbers[str(symbol)])) for symbol in formulas.symbols}
    pieces = []
    for letter, condition, images in zip(formulas.letters, formulas.conditions, formulas.images, strict=True):
        try:
            region = ConditionRegion(coordinates=return_map.coordinates, text=text(condition))
            terms = [_monomials(image.xreplace(exact), formulas.variables) for image in images]
            known = [each for each in terms if each is not None]
            polynomial = len(known) == len(terms)
            polymap = (
                _polynomial(return_map.coordinates, known)
                if polynomial
                else _formula(return_map.coordinates, [text(each) for each in images])
            )
        except ConditionError as error:
            raise ConditionError(f"the piece {letter!r} of {type(return_map).__name__}: {error}") from error
        pieces.append(Piece(letter, region, polymap, letter))
    return CompositeMap(return_map.coordinates, return_map.letters, tuple(pieces))


def _monomials(image: sp.Expr, variables: Sequence[sp.Symbol]) -> dict[tuple[int, ...], Fraction] | None:
    """The coefficients of an image by their exponents, None unless it is a polynomial of a moderate degree."""
    if not image.is_polynomial(*variables):
        return None
    poly = sp.Poly(image, *variables)
    found = {key: value for key, value in poly.terms() if value != 0}
    real = all(value.is_real and value.is_finite for value in found.values())
    return {key: _fraction(value) for key, value in found.items()} if real and poly.total_degree() <= HIGHEST else None


def _fraction(value: sp.Expr) -> Fraction:
    return Fraction(int(value.p), int(value.q)) if value.is_Rational else Fraction(str(value.evalf(40)))


def _polynomial(names: Coordinates, images: Sequence[Mapping[tuple[int, ...], Fraction]]) -> PolyMap:
    """Images in Chebyshev products of the coordinates in their units, angles less the middle of the circle."""
    middle = np.where(names.angles, MIDDLE, 0.0)
    box = middle[:, None] + _units(names, images)[:, None] * [-1.0, 1.0]
    return replace(PolyMap.of_monomials(names, dict(zip(names, images, strict=True)), box), domain=_domain(names))


def _units(names: Coordinates, images: Sequence[Mapping[tuple[int, ...], Fraction]]) -> Floats:
    """Powers of 16 in which the coefficients of all terms are nearest to one, shape (n,), 1 of angles: in others terms cancel."""
    own = np.eye(len(names))
    terms = [(key - own[i], value) for i, image in enumerate(images) for key, value in image.items()]
    powers = np.array([power for power, _ in terms]).reshape(-1, len(names)) * ~names.angles
    sizes = [math.log2(abs(value.numerator)) - math.log2(value.denominator) for _, value in terms]
    return np.asarray(16.0 ** -np.round(np.linalg.lstsq(powers, sizes)[0] / 4))


def _formula(names: Coordinates, texts: Sequence[str]) -> PolyMap:
    """Images that are formulas, each a variable of its own."""
    n, unit = len(names), tuple(np.eye(len(names), dtype=int)[:, None])
    ones = (np.ones(1),) * n
    return PolyMap(names, unit, ones, np.zeros(n), np.ones(n), _domain(names), variables=tuple(texts))


def _domain(names: Coordinates) -> np.ndarray:
    """Angles in [0, 2 pi), other coordinates anywhere."""
    return np.where(names.angles[:, None], [MIDDLE - TWO_PI / 2, MIDDLE + TWO_PI / 2], [-np.inf, np.inf])
