"""Fits in other functions than monomials: in any that a class gives as sympy expressions, and in Fourier series of angles."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from nsmaps.arrays import Bools, Ints
from nsmaps.coordinates import is_angle
from nsmaps.errors import FitError
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.fit.monomials import has_lower, paper_order
from nsmaps.reduced.fit.polyfit import Degree, PolyFit, known, up_to

if TYPE_CHECKING:
    import sympy as sp

Harmonics = Annotated[int, Field(ge=0, le=200)]


class BasisFit(PolyFit):
    """A fit of sums of functions that a class gives, such as 1, sin(phi) and exp(-v).

    Where they span the polynomials in a few functions with some monomials, as harmonics do in cos(phi) and sin(phi), these few
    are the variables, of which each is computed once; else all functions are.
    """

    @abstractmethod
    def basis(self, coordinates: Sequence[str], output: str) -> "Sequence[sp.Expr | float]":
        """The functions of one output in real sympy symbols of the coordinates, linearly independent; 1 for a constant."""

    def variables(self, coordinates: Sequence[str]) -> "Sequence[sp.Expr]":
        """The functions in which those of all outputs are polynomials, or themselves."""
        return self._spanned(coordinates)[0]

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The degree of each variable in monomials of the same span as the functions of an output, shape (m, k)."""
        return self._spanned(coordinates)[1][list(coordinates).index(output)]

    def _spanned(self, coordinates: Sequence[str]) -> "tuple[Sequence[sp.Expr], Sequence[Ints]]":
        import sympy as sp

        given = tuple(self._functions(coordinates, name) for name in coordinates)
        return _spanned(given, sp.Symbol(str(coordinates[0]), real=True))

    def _functions(self, coordinates: Sequence[str], output: str) -> "tuple[sp.Expr, ...]":
        """The basis of an output, checked."""
        import sympy as sp

        given = list(self.basis(coordinates, output))
        for each in given:
            if not isinstance(each, sp.Expr | int | float):
                what = f"{type(self).__name__}.basis for {output}' has {each!r}"
                raise FitError(f"{what}, a {type(each).__name__}; expected: sympy expressions and numbers")
        if not given:
            raise FitError(f"{type(self).__name__}.basis for {output}' is empty; expected: one function at least")
        return tuple(map(sp.sympify, given))


@lru_cache(maxsize=64)
def _spanned(given: "tuple[tuple[sp.Expr, ...], ...]", spare: "sp.Expr") -> "tuple[Sequence[sp.Expr], Sequence[Ints]]":
    """The variables of functions of each output, a spare one if all are constant, and exponents of monomials of the same span."""
    import sympy as sp

    functions = [each for own in given for each in own]
    opened = [sp.expand_trig(sp.expand(each)) for each in functions]
    variables, polynomials = _polynomials(opened, spare)
    rows = iter(polynomials)
    own = [[next(rows) for _ in each] for each in given]
    exponents = [np.array(paper_order({key for each in of for key in each}), int).reshape(-1, len(variables)) for of in own]
    if all(_is_span(*pair) for pair in zip(own, exponents, strict=True)):
        return variables, exponents
    variables = list(dict.fromkeys(each for each in functions if each.free_symbols)) or [spare]
    return variables, [np.array([[int(each == x) for x in variables] for each in of], int).reshape(len(of), -1) for of in given]


def _polynomials(functions: "Sequence[sp.Expr]", spare: "sp.Expr") -> "tuple[list[sp.Expr], list[dict[tuple[int, ...], float]]]":
    """Functions as polynomials in as few others, those of the highest degree last; squares of sines become those of cosines."""
    import sympy as sp

    found = sp.parallel_poly_from_expr([*functions, sp.Dummy()])[1].gens
    gens = [x for x in found if x.free_symbols and not x.is_Dummy] or [spare]
    plain = [sp.Poly(each, *gens) for each in functions]
    for x in gens:
        if isinstance(x, sp.sin) and (cosine := sp.cos(x.args[0])) in gens:
            plain = [sp.Poly(sp.rem(each.as_expr(), x**2 + cosine**2 - 1, x), *gens) for each in plain]
    tables = [{key: float(c) for key, c in each.terms() if c} for each in plain]
    highest = np.max([key for each in tables for key in each], axis=0)
    order = np.argsort(highest, kind="stable").tolist()
    return [gens[j] for j in order], [{tuple(key[j] for j in order): c for key, c in each.items()} for each in tables]


def _is_span(functions: Sequence[Mapping[tuple[int, ...], float]], exponents: Ints) -> bool:
    """Whether functions (m) span all monomials in them, and these all Chebyshev products of the same degrees."""
    if len(functions) != len(exponents) or not has_lower(exponents).all():
        return False
    matrix = np.array([[each.get(tuple(key), 0.0) for key in exponents.tolist()] for each in functions])
    return bool(np.linalg.matrix_rank(matrix / np.abs(matrix).max(axis=1, keepdims=True)) == len(functions))


class Fourier(PolyFit):
    """Fourier series in the angles of a map, times monomials in the other coordinates, for maps of whole circles.

    The image of an angle is so many times the angle as it winds, once for most maps of the circle, plus a periodic function; the
    circle is not cut. Harmonics are kept as products of cos(phi) and sin(phi), of which each is computed once.

    Examples:
        >>> from nsmaps import Angle
        >>> Fourier(harmonics=2).exponents((Angle("phi"),), "phi").tolist()  # of sin(phi) and cos(phi): 1, s, c, s c, T_2(c)
        [[0, 0], [1, 0], [0, 1], [1, 1], [0, 2]]
    """

    harmonics: Harmonics | dict[str, Harmonics] = Field(description="number of harmonics, of every angle or by angle")
    degrees: dict[str, Degree] = Field({}, description="degrees of the other coordinates, by the rule of `full`; 0 if omitted")
    turns: int = Field(1, description="how often the image of an angle goes round as the angle does once")

    def variables(self, coordinates: Sequence[str]) -> "Sequence[sp.Expr]":
        """The sines of the angles, the other coordinates, and the cosines, which have the highest powers, last."""
        import sympy as sp

        symbols = {name: sp.Symbol(str(name), real=True) for name in coordinates}
        angles = [symbols[name] for name in coordinates if is_angle(name)]
        others = [symbols[name] for name in coordinates if not is_angle(name)]
        return [*map(sp.sin, angles), *others, *map(sp.cos, angles)]

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The powers of sines (0 or 1), of the other coordinates and of cosines, shape (m, k)."""
        angles, others = ([name for name in coordinates if is_angle(name) == kind] for kind in (True, False))
        if not angles:
            raise FitError(
                f"harmonics: none of {', '.join(coordinates)} is an angle; expected: a map with an angle, or `PolynomialFit`"
            )
        by = self.harmonics if isinstance(self.harmonics, dict) else dict.fromkeys(angles, self.harmonics)
        for name in by:
            known(name, angles, "harmonics")
        for name in self.degrees:
            known(name, others, "degrees")
        highest = [self.degrees.get(name, 0) for name in others]
        monomials = paper_order(up_to(highest, max(highest, default=0)))
        waves = [[(0, 0), *(each for k in range(1, by.get(name, 0) + 1) for each in ((1, k - 1), (0, k)))] for name in angles]
        rows = [(*(s for s, _ in wave), *powers, *(c for _, c in wave)) for powers in monomials for wave in product(*waves)]
        return np.array(rows, int)

    def winding(self, coordinates: Sequence[str], output: str) -> int:
        """The `turns`."""
        return self.turns

    def data(self, surface: Surface, output: str) -> Bools:
        """All of the surface."""
        return np.ones(len(surface.start), bool)
