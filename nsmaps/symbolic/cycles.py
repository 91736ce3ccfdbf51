"""Two-cycles of polynomial maps: their equations in closed form, eq. pvqv_modified, and their real solutions."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, WithCoordinates, as_box
from nsmaps.errors import check_class
from nsmaps.errors.arguments import checked

if TYPE_CHECKING:
    from nsmaps.reduced.fit.polymap import PolyMap
    from nsmaps.symbolic.curve_iterates import SecondIterate

STEPS = 60  #: of Newton's method
CLOSE = 1e-10  #: of a box's sides: two solutions that are one, and what a residual may be
MOST_STARTS = 5_000  #: of Newton's method, on a grid over the box


@dataclass(frozen=True, slots=True, eq=False)
class CurveCycles:
    """The two-cycles of two curves of one coordinate in turn: q = first(p), p = second(q)."""

    equation: Any  #: to be zero: the image of p under both curves less p, a sympy polynomial in p, the coordinate's own symbol
    points: Floats  #: shape (C, 2), p and q of each real solution, p ascending
    multipliers: Floats  #: shape (C,), the slope of both curves in turn at p, stable where it is within (-1, 1)


@dataclass(frozen=True, slots=True, eq=False)
class TwoCycles(WithCoordinates):
    """The two-cycles of a whole map, x -> y -> x."""

    coordinates: Coordinates
    unknowns: tuple[Any, ...]  #: sympy symbols of the coordinates of x and then of y, such as v_1, phi_1, v_2, phi_2
    equations: tuple[Any, ...]  #: of f(x) - y and then of f(y) - x, to be zero, in the unknowns
    points: Floats  #: shape (C, 2, n), x and y of each cycle found, the lesser first coordinate first
    multipliers: NDArray[np.complex128]  #: shape (C, n), of the second iterate, the largest first
    residual: Floats  #: shape (C,), the largest of `|f(x) - y|` and `|f(y) - x|`


@checked
def curve_cycles(iterate: "SecondIterate") -> CurveCycles:
    """All real two-cycles of the curves of a second iterate; with `min_first` xi_L(xi_U(p)) = p, eq. pvqv_modified.

    The roots are those of its polynomial in 40 digits. Fixed points that both curves share are among them, with p = q.

    Raises:
        NsmapsError: the coefficients are not numbers.
    """
    from nsmaps.symbolic.curve_iterates import SecondIterate
    from nsmaps.symbolic.formula import exact

    check_class(iterate, SecondIterate, "only the curves of a second iterate have such cycles")
    x = iterate.variable
    fixed = iterate.fixed_points()
    slope = iterate.expr.diff(x)
    rows = [(p, float(iterate.curves[0].subs(x, exact(p)))) for p in fixed]
    slopes = [float(slope.subs(x, exact(p))) for p in fixed]
    return CurveCycles(iterate.expr - x, np.array(rows).reshape(-1, 2), np.array(slopes))


@checked
def two_cycles(polynomial: "PolyMap", box: BoxLike | None = None) -> TwoCycles:
    """The two-cycles of a polynomial map that lie in a box, with the polynomial system that they solve.

    Newton's method from a grid of starts: what it finds are solutions, but nothing proves that it finds all. An angle's image is
    taken on the turn that brings the image of the box's middle nearest to it. Fixed points are left out.

    Args:
        box: as of `as_box`; that of the map's data if omitted.

    Raises:
        StateError: the box is not one, or is not bounded.
    """
    from nsmaps.reduced.fit.polymap import PolyMap
    from nsmaps.symbolic.formula import check_closed

    check_class(polynomial, PolyMap, "the cycles are those of polynomials; `find_cycles` encloses those of other maps")
    check_closed(polynomial)
    sides = as_box(polynomial.domain if box is None else box, polynomial.coordinates)
    middle = sides.mean(axis=1)
    turns = np.where(polynomial.coordinates.angles, np.round((polynomial(middle[None])[0] - middle) / TWO_PI), 0.0)
    x, y = _solutions(polynomial, sides, TWO_PI * turns)
    slopes = polynomial.derivative(y) @ polynomial.derivative(x)
    values = np.linalg.eigvals(slopes).astype(complex)
    values = np.take_along_axis(values, np.argsort(-np.abs(values), axis=1, kind="stable"), axis=1)
    gaps = np.hstack([polynomial(x) - TWO_PI * turns - y, polynomial(y) - TWO_PI * turns - x])
    residual = np.abs(gaps).max(axis=1, initial=0.0)
    return TwoCycles(polynomial.coordinates, *_system(polynomial, turns), np.stack([x, y], axis=1), values, residual)


def _solutions(polynomial: "PolyMap", box: Floats, shift: Floats) -> tuple[Floats, Floats]:
    """Both points of each two-cycle found in the box, each (C, n)."""
    n, size = len(box), np.ptp(box, axis=1)
    nodes = [np.linspace(low, high, max(3, round(MOST_STARTS ** (1 / n)))) for low, high in box]
    x = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, n)
    for _ in range(STEPS):
        y = polynomial(x) - shift
        gap = polynomial(y) - shift - x
        slope = polynomial.derivative(y) @ polynomial.derivative(x) - np.eye(n)
        usable = np.isfinite(gap).all(axis=1) & np.isfinite(slope).all(axis=(1, 2)) & (np.abs(np.linalg.det(slope)) > 0)
        x, gap, slope = x[usable], gap[usable], slope[usable]
        x = x - np.linalg.solve(slope, gap[:, :, None])[:, :, 0]
    y = polynomial(x) - shift
    inside = [((z >= box[:, 0]) & (z <= box[:, 1])).all(axis=1) for z in (x, y)]
    closes = (np.abs(polynomial(y) - shift - x) <= CLOSE * size).all(axis=1)
    distinct = (np.abs(x - y) > 100 * CLOSE * size).any(axis=1)  # a fixed point is a solution too
    accepted = inside[0] & inside[1] & closes & distinct
    x, y = x[accepted], y[accepted]
    first = np.where((x[:, :1] <= y[:, :1]), x, y)
    _, one_of_each = np.unique(np.round((first - box[:, 0]) / size / (100 * CLOSE)), axis=0, return_index=True)
    return first[one_of_each], np.where((x[:, :1] <= y[:, :1]), y, x)[one_of_each]


def _system(polynomial: "PolyMap", turns: Floats) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The unknowns, and the equations of a two-cycle in them."""
    import sympy as sp

    from nsmaps.symbolic.formula import formula, symbol

    f = formula(polynomial)
    x, y = ([symbol(f"{name}_{k}") for name in polynomial.coordinates] for k in (1, 2))
    equations = []
    for source, target in ((x, y), (y, x)):
        swaps = dict(zip((symbol(name) for name in polynomial.coordinates), source, strict=True))
        for name, unknown, turn in zip(polynomial.coordinates, target, turns, strict=True):
            image = f.images[name].as_expr().subs(swaps, simultaneous=True)
            equations.append((sp.Abs(image) if name in f.absolute else image) - 2 * sp.pi * int(turn) - unknown)
    return (*x, *y), tuple(equations)
