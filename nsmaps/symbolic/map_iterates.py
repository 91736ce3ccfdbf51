"""Closed forms of whole maps: n-th iterates, and compositions of different pieces along a word of regions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from nsmaps.coordinates import BoxLike, Coordinates, WithCoordinates
from nsmaps.errors import NsmapsError, check_class, check_known
from nsmaps.errors.arguments import checked

if TYPE_CHECKING:
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.reduced.composite.parametric import ParametricMap
    from nsmaps.reduced.fit.polymap import PolyMap
    from nsmaps.symbolic.formula import AnyPolynomial, Domain, Formula


@dataclass(frozen=True, slots=True, eq=False)
class ClosedMap(WithCoordinates):
    """A composition of maps in closed form: the image of each coordinate as one polynomial in all coordinates."""

    coordinates: Coordinates
    symbols: tuple[str, ...]  #: carried through in the coefficients, such as d or b_0
    images: Mapping[str, Any]  #: by coordinate, sympy polynomials with exact coefficients; within an absolute value
    absolute: tuple[str, ...]  #: coordinates of whose polynomial the absolute value is taken
    degree: int  #: the largest total degree in the coordinates
    domain: "Domain"  #: of the map that is applied first and of parameters, where bounded

    def alpha(self, output: str) -> dict[tuple[int, ...], Any]:
        """The coefficients of an output's polynomial by exponents of the coordinates, exact."""
        import sympy as sp

        return dict(sp.Poly(self._image(output), *self._variables()).terms())

    def at(self, **values: float) -> "ClosedMap":
        """The same at numbers for some of its symbols. NsmapsError for an unknown name."""
        from nsmaps.symbolic.formula import exact, symbol

        for name in values:
            check_known("no symbol", name, self.symbols)
        swaps = {symbol(name): exact(value) for name, value in values.items()}
        images = {name: image.subs(swaps) for name, image in self.images.items()}
        return replace(self, images=images, symbols=tuple(name for name in self.symbols if name not in values))

    def over(self, box: BoxLike | None = None) -> "PolyMap":
        """The composition as a PolyMap in Chebyshev products of a box (see `as_box`), each coefficient rounded once.

        Expanded monomials of a high degree cancel in floats. A parameter becomes the last coordinate, which the map leaves as it
        is. If the box is omitted it is that of the map applied first.

        Raises:
            NsmapsError: no box is given and the map has none, or a symbol is not a parameter and has no value.
        """
        import sympy as sp

        from nsmaps.reduced.fit.polymap import PolyMap
        from nsmaps.symbolic.formula import symbol

        names = (*self.coordinates, *self.symbols)
        if box is None and (lost := [name for name in names if name not in self.domain]):
            raise NsmapsError(f"{lost[0]!r} has no bounded domain; expected: a box, one row each for {', '.join(names)}")
        variables = [symbol(name) for name in names]
        monomials = {}
        for name in names:
            terms = sp.Poly(self.images.get(name, symbol(name)), *variables).terms()
            monomials[name] = {key: Fraction(int(c.p), int(c.q)) for key, c in terms}
        sides = [self.domain[name] for name in names] if box is None else box
        return PolyMap.of_monomials(names, monomials, sides, self.absolute)

    def _image(self, output: str) -> Any:
        check_known("no coordinate", output, self.images)
        return self.images[output]

    def _variables(self) -> list[Any]:
        from nsmaps.symbolic.formula import symbol

        return [symbol(name) for name in self.coordinates]


@checked
def symbolic_iterate(
    polynomial: "AnyPolynomial", n_iterates: int, *, piece: str | None = None, coordinates: Sequence[str] = ("v", "phi")
) -> ClosedMap:
    """An iterate of a whole polynomial map in closed form.

    Args:
        polynomial: a fitted map; a composite or parametric map, of which one piece is iterated; or a PolyFit, for general
            coefficients: b_0, b_1, ... of the first coordinate and a_0, a_1, ... of the second, in the order of eq. cubic2dv.
        n_iterates: number of applications of the map, at least one.
        piece: of a composite or parametric map.
        coordinates: of a PolyFit, which does not know them.

    Raises:
        NsmapsError: the degree or the number of terms exceeds its limit (the message states both), or what is composed is
            no polynomial, because of an absolute value.
    """
    from nsmaps.symbolic.formula import formula

    if n_iterates < 1:
        raise NsmapsError(f"n_iterates is {n_iterates}; expected: at least one iterate")
    return _composition([formula(polynomial, piece, coordinates)] * n_iterates)


@checked
def compose_pieces(composite: "CompositeMap | ParametricMap", word: Sequence[str]) -> ClosedMap:
    """The composition of pieces along a word of regions, such as ["R2", "R1", "R1"], the first applied first.

    It is what an orbit does that visits these regions in this order; whether a state stays in them is not looked at. Angles are
    not wrapped on the way. Errors as `symbolic_iterate`.
    """
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.reduced.composite.parametric import ParametricMap
    from nsmaps.symbolic.formula import formula

    check_class(composite, (CompositeMap, ParametricMap), "a word of regions requires a map of pieces")
    if isinstance(word, str) or not word:
        known = ", ".join(piece.name for piece in composite.pieces)
        raise NsmapsError(f"the word is {word!r}; expected: a sequence of one or more of {known}")
    return _composition([formula(composite, name) for name in word])


def _composition(steps: "Sequence[Formula]") -> ClosedMap:
    """The formulas applied one after the other, the first first."""
    from nsmaps.symbolic.formula import composed, degree_in, symbol

    first = steps[0]
    images = dict(first.images)
    for number, (last, step) in enumerate(pairwise(steps), 2):
        for name in last.absolute:
            if any(degree_in(image, [image.ring.index(image.ring(symbol(name)))]) for image in step.images.values()):
                raise NsmapsError(
                    f"iterate {number} depends on {name!r}, of which an absolute value was taken: it is not a polynomial; "
                    "expected: absolute values in the last map alone"
                )
        images = composed(step, images, number)
    ring = first.ring
    own = [ring.index(ring(symbol(name))) for name in first.coordinates]
    degree = max(degree_in(image, own) for image in images.values())
    others = tuple(str(s) for s in ring.symbols if str(s) not in first.coordinates)
    exprs = {str(name): image.as_expr() for name, image in images.items()}
    return ClosedMap(first.coordinates, others, exprs, steps[-1].absolute, degree, first.domain)
