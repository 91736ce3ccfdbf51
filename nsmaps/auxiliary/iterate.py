"""Closed forms of iterates in sympy: the second-iterate polynomial with its alpha coefficients, eq. seconditerativev.

The alphas agree with the paper's supplement but for two errors of print: the last term of alpha_0, 3 b3^2 b6 b8 phi_max^6, is a
term of alpha_1, where it also stands; and p_1^3 in alpha_3 means phi_max^3.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from nsmaps.reduced.polyfit import PolyFit
    from nsmaps.reduced.polymap import PolyMap

Order = Literal["max_first", "min_first"]
DIGITS = 40  # of numerical coefficients: plain monomials cancel, and a map is to agree with its closed form


@dataclass(frozen=True, slots=True, eq=False)
class SecondIterate:
    """The second iterate of one coordinate as a polynomial in it, the other held at its extremes in turn."""

    variable: Any  #: sympy symbol of the coordinate
    expr: Any  #: sympy polynomial in the variable
    alpha: tuple[Any, ...]  #: its coefficients, lowest power first
    first: Any  #: sympy polynomial of the curve applied first
    second: Any  #: sympy polynomial of the curve applied second
    order: Order

    def __call__(self, value: float) -> float:
        """The second iterate of one value; for numerical coefficients. Evaluated in 40 digits, rounded once."""
        return float(self.expr.subs(self.variable, _exact(float(value))))

    def fixed_points(self) -> list[float]:
        """The real fixed points, ascending; for numerical coefficients."""
        import sympy as sp

        roots = sp.Poly(self.expr - self.variable, self.variable).nroots(n=DIGITS, maxsteps=500)
        return sorted(float(root) for root in roots if root.is_real)


def second_iterate(
    map: "PolyMap | PolyFit", phi_min: Any = None, phi_max: Any = None, order: Order = "max_first"
) -> SecondIterate:
    """The second iterate of the first coordinate of a two-dimensional polynomial map, the other held at phi_max and phi_min.

    `max_first` is f(f(v, phi_max), phi_min), eq. seconditerativev; where f falls with phi it is xi_U(xi_L(v)), which fixes q_v.
    `min_first` is f(f(v, phi_min), phi_max) = xi_L(xi_U(v)), eq. auxv2nd, which fixes p_v.

    Args:
        map: a fitted map, for numbers; or a PolyFit, for general coefficients b_0, b_1, ... in the order of eq. cubic2dv.
        phi_min, phi_max: numbers, or None for symbols of these names.

    Raises:
        NsmapsError: the map has not two coordinates, takes an absolute value, or the order is unknown.
    """
    import sympy as sp

    if order not in ("max_first", "min_first"):
        raise NsmapsError(f"order is {order!r}; accepted: 'max_first' (eq. seconditerativev), 'min_first' (eq. auxv2nd)")
    v, phi, f = _polynomial(map)
    low = sp.Symbol("phi_min", real=True) if phi_min is None else _exact(phi_min)
    high = sp.Symbol("phi_max", real=True) if phi_max is None else _exact(phi_max)
    inner, outer = (high, low) if order == "max_first" else (low, high)
    first, second = f.subs(phi, inner), f.subs(phi, outer)
    poly = sp.Poly(sp.expand(second.subs(v, first)), v)
    alpha = tuple(a.n(DIGITS) if a.is_number else a for a in reversed(poly.all_coeffs()))
    return SecondIterate(v, sp.Add(*(a * v**k for k, a in enumerate(alpha))), alpha, first, second, order)


def _exact(number: Any) -> Any:
    """A float as the rational that it is; anything of sympy as it stands."""
    import sympy as sp

    return sp.Rational(number) if isinstance(number, float) else sp.sympify(number)


def _polynomial(map: "PolyMap | PolyFit") -> tuple[Any, Any, Any]:
    """The symbols of both coordinates, and the first coordinate's image as a polynomial in them."""
    import sympy as sp

    from nsmaps.reduced.polyfit import PolyFit

    names = ("v", "phi") if isinstance(map, PolyFit) else map.coordinates
    if len(names) != 2 or names[0] in map.absolute:
        raise NsmapsError(f"a second iterate needs a polynomial in two coordinates; this map has {', '.join(names)}")
    symbols = [sp.Symbol(name, real=True) for name in names]
    if isinstance(map, PolyFit):
        exponents = [tuple(int(e) for e in row) for row in map.exponents(names, names[0])]
        terms = {e: sp.Symbol(f"b_{i}", real=True) for i, e in enumerate(exponents)}
    else:
        terms = {e: sp.Rational(c.numerator, c.denominator) for e, c in map.exact_monomials(names[0]).items()}
    f = sp.Add(*(c * sp.Mul(*(x**k for x, k in zip(symbols, e, strict=True))) for e, c in terms.items()))
    return symbols[0], symbols[1], f
