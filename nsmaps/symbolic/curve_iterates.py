"""Closed forms of iterates of one coordinate in sympy: the second iterate with its alpha coefficients, eq. seconditerativev.

The alphas agree with the paper's supplement except for two misprints: the last term of alpha_0, 3 b3^2 b6 b8 phi_max^6, is a
term of alpha_1, where it also stands; and p_1^3 in alpha_3 means phi_max^3.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, Self, overload, runtime_checkable

from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError, check_known, near_match
from nsmaps.errors.arguments import checked
from nsmaps.results import Result

if TYPE_CHECKING:
    from nsmaps.arrays import Floats
    from nsmaps.symbolic.formula import AnyPolynomial, Domain, Formula

Order = Literal["max_first", "min_first"]
Held = Any  #: a number or sympy expression for the one other coordinate, or a mapping of names to them
Values = Mapping[str, Any]  #: floats or sympy expressions, by coordinate
HELD = "closed form"  #: the kind of an envelope that is two curves of a family
DIGITS = 40  # of numerical coefficients: plain monomials cancel, and a map is to agree with its closed form


@runtime_checkable
class ClosedEnvelope(Protocol):
    """An envelope in closed form, from which its curves are derived."""

    coordinate: str
    kind: Any  #: "closed form" where it has one
    held: "Floats | None"  #: shape (n, 2), the others' values on the lower and the upper curve


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HeldIterate(Result):
    """The n-th iterate of one coordinate as a polynomial in it, the others held at a sequence of values."""

    from_files: ClassVar[bool] = False

    variable: Any  #: sympy symbol of the coordinate
    expr: Any  #: sympy polynomial in the variable
    alpha: tuple[Any, ...]  #: its coefficients, lowest power first
    curves: tuple[Any, ...]  #: sympy polynomials in the order in which they are applied, one a value held
    domain: "Domain" = field(default_factory=dict)  #: where the map was fitted, of the coordinate and of parameters
    held: tuple[Values, ...] = ()  #: what the others are held at on each curve, in the order of `curves`

    def summary(self) -> str:
        """The numbers that matter."""
        numbers = ", ".join(f"{float(value):.6g}" if value.is_number else str(value) for value in self.alpha)
        return f"order {len(self.alpha) - 1} in {self.variable}, alpha = {numbers}"

    def __call__(self, value: float) -> float:
        """The iterate of one value; for numerical coefficients. Evaluated exactly, curve after curve, rounded once."""
        return _value(self.curves, self.variable, value)

    def fixed_points(self) -> list[float]:
        """The real fixed points, ascending; for numerical coefficients."""
        return _fixed_points(self.expr, self.variable)

    def at(self, **values: Any) -> Self:
        """The same at numbers for some of its symbols, such as d, phi_min or b_0. NsmapsError for an unknown name."""
        curves = _substituted(self.curves, self.variable, values)
        found = held_of(self.variable, curves, self.domain, _held_at(self.held, values))
        return replace(self, expr=found.expr, alpha=found.alpha, curves=found.curves, held=found.held)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SecondIterate(HeldIterate):
    """The second iterate of one coordinate as a polynomial in it, the others held at their extremes alternately."""

    picture: ClassVar[str] = "nsmaps.figures.domains.second_iterate"

    order: Order = "max_first"  #: of the extremes on the two curves, first-iterate maps of eq. auxv

    @classmethod
    def of(cls, iterate: HeldIterate, order: Order) -> "SecondIterate":
        """An iterate of two curves with the order of their extremes."""
        return cls(**{each.name: getattr(iterate, each.name) for each in fields(iterate)}, order=order)


@overload
def second_iterate(
    polynomial: "AnyPolynomial",
    phi_min: Held = ...,
    phi_max: Held = ...,
    order: Order = ...,
    *,
    variable: str | None = ...,
    piece: str | None = ...,
    coordinates: Sequence[str] = ...,
) -> SecondIterate: ...


@overload
def second_iterate(
    polynomial: "AnyPolynomial",
    *,
    held: Sequence[Held],
    variable: str | None = ...,
    piece: str | None = ...,
    coordinates: Sequence[str] = ...,
) -> HeldIterate: ...


@checked
def second_iterate(
    polynomial: "AnyPolynomial",
    phi_min: Held = None,
    phi_max: Held = None,
    order: Order = "max_first",
    *,
    held: Sequence[Held] | None = None,
    variable: str | None = None,
    piece: str | None = None,
    coordinates: Sequence[str] = ("v", "phi"),
) -> SecondIterate | HeldIterate:
    """The second iterate of one coordinate of a polynomial map, the others held at their extremes alternately.

    `max_first` is f(f(v, phi_max), phi_min), eq. seconditerativev; where f falls with phi it is xi_U(xi_L(v)), which fixes q_v.
    `min_first` is f(f(v, phi_min), phi_max) = xi_L(xi_U(v)), eq. auxv2nd, which fixes p_v.

    Args:
        polynomial: a fitted map, for numbers; a ParametricMap, whose parameter stays a symbol in the coefficients; or a PolyFit,
            for general coefficients b_0, b_1, ... in the order of eq. cubic2dv.
        phi_min, phi_max: the lower and upper extreme of the other coordinate; of several others a mapping of names to numbers.
            If None they are symbols of these names, such as phi_min, or v_min if phi is the variable.
        order: of the two curves.
        held: in place of these, n values at which the others are held, in the order in which they are applied, of the n-th
            iterate: one gives a first-iterate map of eq. auxv. A value of None leaves symbols, such as phi_1 for the first.
        variable: the coordinate that is iterated; the first if omitted.
        piece: of a composite or parametric map.
        coordinates: of a PolyFit, which does not know them.

    Raises:
        NsmapsError: the coordinate takes an absolute value or is unknown, the limit of the degree is exceeded, the order is
            unknown, or no value is held.
    """
    from nsmaps.symbolic.formula import formula

    if order not in ("max_first", "min_first"):
        raise NsmapsError(f"order is {order!r}; expected: 'max_first' (eq. seconditerativev), 'min_first' (eq. auxv2nd)")
    if held is not None and not len(held):
        raise NsmapsError("no value is given to hold the other coordinates at; expected: one for each of n >= 1 iterates")
    f = formula(polynomial, piece, coordinates)
    name = _variable(f, variable)
    if held is not None:
        return _held_iterate(f, name, [_held(f, name, each, f"_{k}") for k, each in enumerate(held, 1)])
    low, high = _held(f, name, phi_min, "_min"), _held(f, name, phi_max, "_max")
    return SecondIterate.of(_held_iterate(f, name, [high, low] if order == "max_first" else [low, high]), order)


def envelope_curves(
    polynomial: "AnyPolynomial", envelope: ClosedEnvelope, *, piece: str | None = None
) -> tuple[HeldIterate, HeldIterate]:
    """The lower and the upper auxiliary map of a coordinate as polynomials, where they are two curves of its family, eq. auxv.

    An angle's image is that of the map's formula, on whatever turn. Errors as `second_iterate`, and one for an envelope that has
    no closed form, as of curves that cross (eq. auxphi).
    """
    from nsmaps.symbolic.formula import formula

    if envelope.kind != HELD or envelope.held is None:
        raise NsmapsError(f"the envelope of {envelope.coordinate!r} is {envelope.kind}; expected: one in closed form")
    others = [(k, name) for k, name in enumerate(formula(polynomial, piece).coordinates) if name != envelope.coordinate]
    sides = [{name: float(envelope.held[k, side]) for k, name in others} for side in (0, 1)]
    lower, upper = (second_iterate(polynomial, held=[side], variable=envelope.coordinate, piece=piece) for side in sides)
    return lower, upper


def held_of(variable: Any, curves: Sequence[Any], domain: "Domain", held: Sequence[Values] = ()) -> HeldIterate:
    """The composition of curves, sympy polynomials in the variable, the first applied first; NsmapsError if it is too long."""
    import sympy as sp

    from nsmaps.symbolic.formula import Formula, composed

    name = str(variable)
    others = sorted({s for curve in curves for s in sp.sympify(curve, strict=True).free_symbols} - {variable}, key=str)
    ring = sp.ring([variable, *others], sp.QQ)[0]
    general = not {str(s) for s in others} <= set(domain)
    whole = ring(variable)
    for number, curve in enumerate(curves, 1):
        step = Formula(Coordinates((name,)), (), {name: ring.from_expr(sp.sympify(curve, strict=True))}, (), {}, general)
        whole = composed(step, {name: whole}, number)[name]
    parts: dict[int, dict[tuple[int, ...], Any]] = {}
    for key, c in whole.terms():
        parts.setdefault(key[0], {})[(0, *key[1:])] = c
    alpha = tuple(_rounded(ring.from_dict(parts.get(k, {})).as_expr()) for k in range(max(parts, default=0) + 1))
    expr = sp.Add(*(a * variable**k for k, a in enumerate(alpha)))
    return HeldIterate(variable, expr, alpha, tuple(curves), domain, tuple(held))


def _held_iterate(f: "Formula", name: str, held: Sequence[Mapping[str, Any]]) -> HeldIterate:
    """The composition of the curves of one coordinate at the values held."""
    from nsmaps.symbolic.formula import symbol

    image = f.images[name].as_expr()
    curves = [image.subs({symbol(other): value for other, value in values.items()}, simultaneous=True) for values in held]
    domain = {key: ends for key, ends in f.domain.items() if key in (name, *f.parameters)}
    return held_of(symbol(name), curves, domain, [_as_floats(values) for values in held])


def _variable(f: "Formula", name: str | None) -> str:
    chosen = f.coordinates[0] if name is None else name
    check_known("no coordinate", chosen, f.coordinates)
    if chosen in f.absolute:
        raise NsmapsError(
            f"the absolute value of {chosen!r} is taken, whose iterates are not polynomials; expected: a coordinate without one"
        )
    return chosen


def _held(f: "Formula", name: str, given: Held, suffix: str) -> dict[str, Any]:
    """The values of the coordinates beside the variable, in sympy, by name."""
    from nsmaps.symbolic.formula import exact, symbol

    others = [other for other in f.coordinates if other != name]
    if given is not None and not isinstance(given, Mapping):
        if len(others) != 1:
            raise NsmapsError(f"one value {given!r} for {', '.join(others) or 'no coordinate'}; expected: a mapping of names")
        given = {others[0]: given}
    values = dict(given or {})
    for other in values:
        if other not in others:
            raise NsmapsError(f"held: {other!r}{near_match(str(other), others)}; expected: {', '.join(others) or 'nothing'}")
    return {other: exact(values[other]) if other in values else symbol(f"{other}{suffix}") for other in others}


def _as_floats(values: Mapping[str, Any]) -> Values:
    """Values in sympy as floats, where they are numbers."""
    return {str(name): float(value) if value.is_number else value for name, value in values.items()}


def _held_at(held: Sequence[Values], values: Mapping[str, Any]) -> list[Values]:
    """What is held with numbers for some of its symbols."""
    import sympy as sp

    from nsmaps.symbolic.formula import exact, symbol

    swaps = {symbol(name): exact(value) for name, value in values.items()}
    return [_as_floats({name: sp.sympify(value, strict=True).subs(swaps) for name, value in each.items()}) for each in held]


def _rounded(coefficient: Any) -> Any:
    """A coefficient with its rational numbers in 40 digits; one of symbols with whole numbers unchanged."""
    whole = not coefficient.is_number and all(c.is_Integer for c in coefficient.as_coefficients_dict().values())
    return coefficient if whole else coefficient.n(DIGITS)


def _substituted(curves: Sequence[Any], variable: Any, values: Mapping[str, Any]) -> list[Any]:
    """Curves with numbers for some of their symbols."""
    from nsmaps.symbolic.formula import exact, symbol

    known = sorted({str(s) for curve in curves for s in curve.free_symbols - {variable}})
    for name in values:
        check_known("no symbol", name, known)
    return [curve.subs({symbol(name): exact(value) for name, value in values.items()}) for curve in curves]


def _value(curves: Sequence[Any], variable: Any, value: float) -> float:
    from nsmaps.symbolic.formula import exact

    reached = exact(float(value))
    for curve in curves:
        _check_numerical(curve, variable)
        reached = curve.subs(variable, reached)
    return float(reached)


def _fixed_points(expr: Any, variable: Any) -> list[float]:
    import sympy as sp

    _check_numerical(expr, variable)
    roots = sp.Poly(expr - variable, variable).nroots(n=DIGITS, maxsteps=500)
    return sorted(float(root) for root in roots if root.is_real)


def _check_numerical(expr: Any, variable: Any) -> None:
    if left := sorted(str(s) for s in expr.free_symbols - {variable}):
        raise NsmapsError(f"the coefficients have the symbols {', '.join(left)}; expected: numbers, as by at({left[0]}=0.3)")
