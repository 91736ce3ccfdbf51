"""Polynomial maps in exact symbols, and their compositions: coefficients are rational numbers or symbols, nothing is rounded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb, prod
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.errors import NsmapsError, check_class
from nsmaps.reduced.composite.composite import CompositeMap, Piece, piece_named
from nsmaps.reduced.composite.parametric import ParametricMap
from nsmaps.reduced.fit.polyfit import PolyFit
from nsmaps.reduced.fit.polymap import PolyMap

MOST_DEGREE = 100  #: of a composition that is written out
MOST_TERMS, MOST_GENERAL = 3_000, 60_000  #: of one, with numbers and with symbols for its coefficients
LETTERS = "bacehklmnpqrstuw"  #: of general coefficients, by output: b_i of the first and a_i of the second, as in the supplement

AnyPolynomial = PolyMap | PolyFit | Piece | CompositeMap | ParametricMap
Domain = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class Formula(WithCoordinates):
    """The images of a map as elements of a sympy ring in its coordinates, its parameters and its general coefficients."""

    coordinates: Coordinates
    parameters: tuple[str, ...]  #: of a ParametricMap
    images: Mapping[str, Any]  #: by coordinate
    absolute: tuple[str, ...]
    domain: Domain  #: of coordinates and parameters, where bounded
    general: bool  #: whether coefficients are symbols

    @property
    def ring(self) -> Any:
        """The sympy ring of the images."""
        return next(iter(self.images.values())).ring


def symbol(name: str) -> Any:
    """The sympy symbol of a coordinate, parameter or coefficient."""
    return sp.Symbol(str(name), real=True)


def exact(number: Any) -> Any:
    """A float as the rational that it is, an irrational number as one in 60 digits, and symbols unchanged; text is refused."""
    value = sp.Rational(float(number)) if isinstance(number, float | np.floating) else sp.sympify(number, strict=True)
    return sp.Rational(value.n(60)) if value.is_number and not value.is_Rational else value


def formula(polynomial: AnyPolynomial, piece: str | None = None, coordinates: Sequence[str] = ("v", "phi")) -> Formula:
    """The exact images of a map, or of one of its pieces.

    Raises:
        NsmapsError: there are several pieces and none is named, or a piece is named of what has none.
    """
    if isinstance(polynomial, PolyFit):
        return _general(polynomial, Coordinates(coordinates))
    parameters = (polynomial.parameter,) if isinstance(polynomial, ParametricMap) else ()
    polymap = _polymap(polynomial, piece)
    check_closed(polymap)
    names = Coordinates([name for name in polymap.coordinates if name not in parameters])
    ring = sp.ring([symbol(name) for name in polymap.coordinates], sp.QQ)[0]
    images = {}
    for name in names:
        terms = polymap.exact_monomials(name).items()
        images[name] = ring.from_dict({key: sp.QQ(c.numerator, c.denominator) for key, c in terms if c})
    ends = zip(polymap.coordinates, polymap.domain.tolist(), strict=True)
    domain = {str(name): (low, high) for name, (low, high) in ends if np.isfinite([low, high]).all() and low < high}
    return Formula(names, parameters, images, polymap.absolute, domain, False)


def check_closed(polymap: PolyMap) -> None:
    """Raise a NsmapsError for a map in other variables than the coordinates."""
    if polymap.variables is not None:
        of = f"a map with the variables {', '.join(polymap.variables)}"
        raise NsmapsError(
            f"{of} has no closed iterates; expected: polynomials in {polymap.coordinates}, or `IteratedMap` in numbers"
        )


def _polymap(return_map: PolyMap | Piece | CompositeMap | ParametricMap, piece: str | None) -> PolyMap:
    if isinstance(return_map, CompositeMap | ParametricMap):
        if piece is None and len(return_map.pieces) > 1:
            raise NsmapsError(f"no piece is named; expected: one of {', '.join(each.name for each in return_map.pieces)}")
        return return_map.pieces[0].map if piece is None else piece_named(return_map.pieces, piece).map
    if piece is not None:
        raise NsmapsError(f"the piece {piece!r} of a {type(return_map).__name__}; expected: of a composite or parametric map")
    check_class(return_map, (PolyMap, Piece), "only images that are polynomials have closed forms")
    return return_map.map if isinstance(return_map, Piece) else return_map


def _general(fit: PolyFit, names: Coordinates) -> Formula:
    """The images of a fit with symbols for its coefficients."""
    if fit.variables(names) is not None:
        raise NsmapsError(
            f"a {type(fit).__name__} has no closed iterates: it is not of monomials; expected: `PolynomialFit` or `SeparableFit`"
        )
    rows = {name: fit.exponents(names, name).tolist() for name in names}
    letters = zip(LETTERS, names, strict=False)
    symbols = {name: [symbol(f"{letter}_{i}") for i in range(len(rows[name]))] for letter, name in letters}
    ring = sp.ring([*(symbol(name) for name in names), *(b for each in symbols.values() for b in each)], sp.QQ)[0]
    x = ring.gens[: len(names)]
    images = dict.fromkeys(names, ring.zero)
    for name in names:
        for b, row in zip(symbols[name], rows[name], strict=True):
            images[name] += ring(b) * prod((g**e for g, e in zip(x, row, strict=True)), start=ring.one)
    return Formula(names, (), images, fit.absolute, {}, True)


def composed(step: Formula, inner: Mapping[str, Any], number: int) -> dict[str, Any]:
    """The images of a step at polynomials in place of its coordinates; a NsmapsError where that is too long to be of use."""
    limit = MOST_GENERAL if step.general else MOST_TERMS
    swaps = {step.ring.index(step.ring(symbol(name))): image.set_ring(step.ring) for name, image in inner.items()}
    own = [step.ring.index(step.ring(symbol(name))) for name in step.coordinates]
    for image in step.images.values():
        degree, terms = _composed_degree(image, swaps, own), sum(_products(key, swaps) for key in image.monoms())
        if not step.general:
            others = [i for i in range(len(step.ring.gens)) if i not in own]
            terms = min(terms, prod(_monomials(image, swaps, gens) for gens in (own, others)))
        if degree > MOST_DEGREE or terms > limit:
            raise NsmapsError(
                f"iterate {number} has degree {degree} and up to {terms} terms; expected: degree {MOST_DEGREE} and {limit} terms"
            )
    powers = {i: [step.ring.one] for i in swaps}
    return {name: _substituted(image, swaps, powers) for name, image in step.images.items()}


def _substituted(image: Any, swaps: Mapping[int, Any], powers: Mapping[int, list[Any]]) -> Any:
    """An image at polynomials in place of generators; sympy's `compose` would work out their powers for every term again."""
    parts: dict[tuple[int, ...], dict[tuple[int, ...], Any]] = {}
    for key, c in image.terms():
        others = tuple(0 if i in swaps else e for i, e in enumerate(key))
        parts.setdefault(tuple(key[i] for i in swaps), {})[others] = c
    total = image.ring.zero
    for exponents, rest_of_terms in parts.items():
        product = image.ring.from_dict(rest_of_terms)
        for i, e in zip(swaps, exponents, strict=True):
            while len(powers[i]) <= e:
                powers[i].append(powers[i][-1] * swaps[i])
            product *= powers[i][e]
        total += product
    return total


def _monomials(image: Any, swaps: Mapping[int, Any], gens: Sequence[int]) -> int:
    """A bound on the monomials in some generators that a composition has."""
    occurring = {i for each in (image, *swaps.values()) for key in each.monoms() for i in gens if key[i]}
    return comb(_composed_degree(image, swaps, gens) + len(occurring), len(occurring))


def degree_in(image: Any, gens: Sequence[int]) -> int:
    """The total degree of a ring element in some of its generators, by their numbers."""
    return max((sum(key[i] for i in gens) for key in image.monoms()), default=0)


def _composed_degree(image: Any, swaps: Mapping[int, Any], gens: Sequence[int]) -> int:
    """A bound on the total degree in some generators of an image in which others are replaced."""
    degrees = {i: degree_in(swaps[i], gens) if i in swaps else int(i in gens) for i in range(len(image.ring.gens))}
    return max((sum(e * degrees[i] for i, e in enumerate(key)) for key in image.monoms()), default=0)


def _products(key: tuple[int, ...], swaps: Mapping[int, Any]) -> int:
    """A bound on the terms that one monomial makes when what it is of is replaced by polynomials."""
    return prod(comb(max(1, len(swaps[i])) + e - 1, e) for i, e in enumerate(key) if i in swaps)
