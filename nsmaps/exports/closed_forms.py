"""Closed forms, whose coefficients are fractions or polynomials of symbols, as plain data and back."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from nsmaps.errors import NsmapsError
from nsmaps.exports.plain_data import Document, coordinates_of, domain_of, name_of, names_of, number_of, powers_of
from nsmaps.symbolic.curve_iterates import HeldIterate, Values
from nsmaps.symbolic.map_iterates import ClosedMap

FRACTION = re.compile(r"-?\d{1,4300}(/0*[1-9]\d{0,4299})?")  #: not 1e999999999, whose digits would fill the memory


def _terms(expr: Any, names: Sequence[str]) -> Document:
    """A sympy polynomial by its exponents, its coefficients as fractions in text."""
    import sympy as sp

    from nsmaps.symbolic.formula import symbol

    terms = sp.Poly(sp.sympify(expr, strict=True), *(symbol(name) for name in names)).terms()
    return {"exponents": [list(map(int, key)) for key, _ in terms], "coefficients": [str(sp.Rational(c)) for _, c in terms]}


def _expr(data: Document, names: Sequence[str]) -> Any:
    import sympy as sp

    from nsmaps.symbolic.formula import symbol

    x = [symbol(name_of(name)) for name in names]
    powers = powers_of(data["exponents"], len(names)).tolist()
    if bad := [c for c in data["coefficients"] if not (isinstance(c, str) and FRACTION.fullmatch(c))]:
        raise NsmapsError(f"the coefficient {bad[0]!r:.60}; expected: a fraction of whole numbers in text")
    pairs = zip(powers, data["coefficients"], strict=True)
    return sp.Add(*(sp.Rational(c) * sp.Mul(*(g**e for g, e in zip(x, key, strict=True))) for key, c in pairs))


def held_document(iterate: HeldIterate) -> Document:
    """An iterate of curves as plain data."""
    free = {s for curve in iterate.curves for s in curve.free_symbols} - {iterate.variable}
    names = [str(iterate.variable), *sorted(map(str, free))]
    return {
        "variable": names[0],
        "symbols": names,
        "curves": [_terms(curve, names) for curve in iterate.curves],
        "domain": {name: list(ends) for name, ends in iterate.domain.items()},
        "held": [{name: _value(value) for name, value in values.items()} for values in iterate.held],
    }


def _value(value: Any) -> float | Document:
    """A number, or a sympy polynomial with its symbols."""
    if isinstance(value, float):
        return value
    names = sorted(map(str, value.free_symbols))
    return {"symbols": names, **_terms(value, names)}


def held_parts(data: Document) -> tuple[Any, list[Any], Mapping[str, tuple[float, float]], list[Values]]:
    """The variable, the curves, the domain and the values held of an iterate."""
    from nsmaps.symbolic.formula import symbol

    curves = [_expr(curve, data["symbols"]) for curve in data["curves"]]
    held: list[Values] = [
        {
            name_of(name): _expr(value, value["symbols"]) if isinstance(value, dict) else number_of(value)
            for name, value in values.items()
        }
        for values in data.get("held", [])
    ]
    return symbol(name_of(data["variable"])), curves, domain_of(data), held


def closed_document(closed: ClosedMap) -> Document:
    """A closed map as plain data."""
    names = [*map(str, closed.coordinates), *closed.symbols]
    return {
        "coordinates": coordinates_of(closed.coordinates),
        "symbols": list(closed.symbols),
        "images": {name: _terms(image, names) for name, image in closed.images.items()},
        "absolute": [str(name) for name in closed.absolute],
        "degree": closed.degree,
        "domain": {name: list(ends) for name, ends in closed.domain.items()},
    }


def closed_of_document(data: Document) -> ClosedMap:
    """The closed map of plain data."""
    names, symbols = names_of(data["coordinates"]), tuple(map(name_of, data["symbols"]))
    images = {name: _expr(image, [*names, *symbols]) for name, image in data["images"].items()}
    return ClosedMap(names, symbols, images, tuple(data["absolute"]), int(number_of(data["degree"])), domain_of(data))
