"""Maps and closed forms as plain data and back, to the bit: what is written as JSON and as the table of a Python module.

The layout is that of `VERSION`; docs/export.md describes it. Nothing that is read is executed.
"""

import ast
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.reading import json_of, odd_character, text_of
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import ParametricMap, ParametricReport
from nsmaps.reduced.conditions.region import Box, Region, Where
from nsmaps.reduced.fit.polymap import FitReport, PolyMap
from nsmaps.symbolic.curve_iterates import HeldIterate, SecondIterate, Values, held_of, second_of
from nsmaps.symbolic.map_iterates import ClosedMap

SCHEMA, VERSION = "nsmaps", 1
TABLE = "MAP"  #: the name of the table in a Python module
LARGEST = 2**28  #: bytes of a file that is read
DENSEST = 10_000_000  #: products of powers of all coordinates up to those that occur
FRACTION = re.compile(r"-?\d{1,4300}(/0*[1-9]\d{0,4299})?")  #: not 1e999999999, whose digits would fill the memory

Document = dict[str, Any]
AnyMap = PolyMap | CompositeMap | ParametricMap | SecondIterate | HeldIterate | ClosedMap


def document(result: AnyMap) -> Document:
    """A map or closed form as plain data: strings, numbers, lists and dictionaries. NsmapsError for a user-defined region."""
    kind = kind_of(result)
    return {"schema": SCHEMA, "version": VERSION, "kind": kind} | KINDS[kind][1](result)


def kind_of(result: AnyMap) -> str:
    """What a map or closed form is called, such as "polynomial map"."""
    return next(kind for kind, (cls, _, _) in KINDS.items() if isinstance(result, cls))


def read_map(path: str | os.PathLike[str]) -> AnyMap:
    """The map or closed form that `export` wrote as JSON (`.json`) or as a Python module (`.py`), the same to the bit.

    A module is not executed: its table is read.

    Raises:
        NsmapsError: the file was not exported, or by another version.
    """
    file = Path(path)
    try:
        text = text_of(file, LARGEST)
        return of_document(_table(text) if file.suffix == ".py" else json_of(text))
    except (NsmapsError, OSError) as error:
        raise error if isinstance(error, OSError) else NsmapsError(f"{file}: {error}") from error
    except Exception as error:  # a file that was not exported can be wrong in every way
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise NsmapsError(f"{file} is not an exported map ({why})") from error


def of_document(data: Document) -> AnyMap:
    """The map or closed form of plain data. NsmapsError for another schema, version or kind."""
    layout = (data.get("schema"), data.get("version")) if isinstance(data, dict) else (None, None)
    if layout != (SCHEMA, VERSION):
        raise NsmapsError(f"schema {layout[0]!r}, version {layout[1]!r}; expected: {SCHEMA!r}, {VERSION}")
    if data["kind"] not in KINDS:
        raise NsmapsError(f"a {data['kind']!r}; expected: {', '.join(KINDS)}")
    return KINDS[data["kind"]][2](data)


def _table(module: str) -> Document:
    """The table of a Python module, which is not executed."""
    for node in ast.parse(module).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and node.targets[0].id == TABLE:
            return ast.literal_eval(node.value)
    raise NsmapsError(f"there is no table {TABLE}; expected: a module that nsmaps exported")


def _numbers(values: Any) -> Any:
    """An array as nested lists; what JSON has no number for as text: 'inf', '-inf', 'nan'."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if isinstance(values, list):
        return [_numbers(value) for value in values]
    return values if not isinstance(values, float) or math.isfinite(values) else str(values)


def _floats(values: Any) -> Any:
    return np.array(values, dtype=str).astype(float) if _has_text(values) else np.array(values, float)


def _has_text(values: Any) -> bool:
    return any(map(_has_text, values)) if isinstance(values, list) else isinstance(values, str)


def _coordinates(names: Sequence[str]) -> list[Document]:
    return [{"name": str(name), "angle": isinstance(name, Angle)} for name in names]


def _names(data: Sequence[Document]) -> tuple[str, ...]:
    return tuple((Angle if each["angle"] else str)(_name(each["name"])) for each in data)


def _name(name: Any) -> str:
    """A name that can stand on one line of a program's comment."""
    if not (isinstance(name, str) and 0 < len(name) <= 100 and len(name.splitlines()) == 1 and not odd_character(name)):
        raise NsmapsError(f"{name!r:.60} is not a name; expected: one line of at most 100 characters")
    return name


def _number(value: Any) -> float:
    """A number, never a text, which sympy would evaluate."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise NsmapsError(f"{value!r:.60} is not a number; expected: a number")
    return float(value)


def _domain(data: Document) -> dict[str, tuple[float, float]]:
    return {_name(name): (_number(low), _number(high)) for name, (low, high) in data["domain"].items()}


def _powers(rows: Any, coordinates: int) -> Any:
    """Exponents, shape (terms, coordinates), of polynomials that can be evaluated."""
    powers = np.array(rows, np.int64).reshape(-1, coordinates)
    if powers.min(initial=0) < 0 or np.prod(powers.max(axis=0, initial=0) + 1.0) > DENSEST:
        raise NsmapsError(f"powers from {powers.min()} to {powers.max()}; expected: from 0, of at most {DENSEST:,} products")
    return powers


def _report(report: Any) -> Document | None:
    """A report of arrays as plain data."""
    if report is None:
        return None
    values = {field.name: getattr(report, field.name) for field in fields(report)}
    return {
        name: [str(each) for each in value] if isinstance(value, tuple) else _numbers(value) for name, value in values.items()
    }


def _report_of(cls: type, data: Document | None, coordinates: tuple[str, ...]) -> Any:
    if data is None:
        return None
    values: Document = {}
    for name, value in data.items():
        if name == "coordinates":
            values[name] = coordinates
        elif name in ("names", "warnings"):
            values[name] = tuple(value)
        else:
            values[name] = np.array(value, np.int64) if name in ("points", "terms") else _floats(value)
    return cls(**values)


def _polymap(polymap: PolyMap) -> Document:
    return {
        "coordinates": _coordinates(polymap.coordinates),
        "centre": _numbers(polymap.centre),
        "scale": _numbers(polymap.scale),
        "domain": _numbers(polymap.domain),
        "absolute": [str(name) for name in polymap.absolute],
        "outputs": [
            {"exponents": _numbers(exponents), "coefficients": _numbers(coefficients)}
            for exponents, coefficients in zip(polymap.exponents, polymap.coefficients, strict=True)
        ],
        "report": _report(polymap.report),
    }


def _polymap_of(data: Document) -> PolyMap:
    names = _names(data["coordinates"])
    exponents = tuple(_powers(each["exponents"], len(names)) for each in data["outputs"])
    coefficients = tuple(_floats(each["coefficients"]) for each in data["outputs"])
    centre, scale, domain = (_floats(data[name]) for name in ("centre", "scale", "domain"))
    n = len(names)
    shapes = [(centre.shape, (n,)), (scale.shape, (n,)), (domain.shape, (n, 2)), ((len(exponents),), (n,))]
    shapes += [(c.shape, (len(e),)) for c, e in zip(coefficients, exponents, strict=True)]
    for found, wanted in shapes:
        if found != wanted:
            raise NsmapsError(f"an array of shape {found}; expected: {wanted}")
    report = _report_of(FitReport, data["report"], names)
    return PolyMap(names, exponents, coefficients, centre, scale, domain, tuple(data["absolute"]), report)


def _region(region: Region) -> Document:
    if isinstance(region, Box):
        return {"box": _numbers(region.array)}
    if isinstance(region, Where):
        return {"where": region.text}
    raise NsmapsError(f"a region of the class {type(region).__name__}, which no file describes; expected: Box, Where")


def _piece(piece: Piece) -> Document:
    return {"name": piece.name, "word": piece.word, "region": _region(piece.region), "map": _polymap(piece.map)}


def _piece_of(data: Document, names: tuple[str, ...]) -> Piece:
    region = data["region"]
    held: Region = Box.of(names, region["box"]) if "box" in region else Where(text=region["where"], coordinates=names)
    return Piece(_name(data["name"]), held, _polymap_of(data["map"]), data["word"])


def _composite(composite: CompositeMap) -> Document:
    pieces = [_piece(piece) for piece in composite.pieces]
    return {"coordinates": _coordinates(composite.coordinates), "walls": list(composite.walls), "pieces": pieces}


def _composite_of(data: Document) -> CompositeMap:
    names = _names(data["coordinates"])
    return CompositeMap(names, tuple(map(_name, data["walls"])), tuple(_piece_of(piece, names) for piece in data["pieces"]))


def _parametric(parametric: ParametricMap) -> Document:
    return {
        "parameter": parametric.parameter,
        "low": parametric.low,
        "high": parametric.high,
        "coordinates": _coordinates(parametric.coordinates),
        "walls": list(parametric.walls),
        "pieces": [_piece(piece) for piece in parametric.pieces],
        "nodes": _numbers(parametric.nodes),
        "condition": parametric.condition,
        "report": _report(parametric.report),
    }


def _parametric_of(data: Document) -> ParametricMap:
    names = _names(data["coordinates"])
    pieces = tuple(_piece_of(piece, names) for piece in data["pieces"])
    report = _report_of(ParametricReport, data["report"], names)
    ends = (_number(data["low"]), _number(data["high"]))
    walls, nodes = tuple(map(_name, data["walls"])), _floats(data["nodes"])
    return ParametricMap(_name(data["parameter"]), *ends, names, walls, pieces, nodes, _number(data["condition"]), report)


def _terms(expr: Any, names: Sequence[str]) -> Document:
    """A sympy polynomial by its exponents, its coefficients as fractions in text."""
    import sympy as sp

    from nsmaps.symbolic.formula import symbol

    terms = sp.Poly(sp.sympify(expr, strict=True), *(symbol(name) for name in names)).terms()
    return {"exponents": [list(map(int, key)) for key, _ in terms], "coefficients": [str(sp.Rational(c)) for _, c in terms]}


def _expr(data: Document, names: Sequence[str]) -> Any:
    import sympy as sp

    from nsmaps.symbolic.formula import symbol

    x = [symbol(_name(name)) for name in names]
    powers = _powers(data["exponents"], len(names)).tolist()
    if bad := [c for c in data["coefficients"] if not (isinstance(c, str) and FRACTION.fullmatch(c))]:
        raise NsmapsError(f"the coefficient {bad[0]!r:.60}; expected: a fraction of whole numbers in text")
    pairs = zip(powers, data["coefficients"], strict=True)
    return sp.Add(*(sp.Rational(c) * sp.Mul(*(g**e for g, e in zip(x, key, strict=True))) for key, c in pairs))


def _held(iterate: SecondIterate | HeldIterate) -> Document:
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


def _held_parts(data: Document) -> tuple[Any, list[Any], Mapping[str, tuple[float, float]], list[Values]]:
    from nsmaps.symbolic.formula import symbol

    curves = [_expr(curve, data["symbols"]) for curve in data["curves"]]
    held: list[Values] = [
        {
            _name(name): _expr(value, value["symbols"]) if isinstance(value, dict) else _number(value)
            for name, value in values.items()
        }
        for values in data.get("held", [])
    ]
    return symbol(_name(data["variable"])), curves, _domain(data), held


def _second_of(data: Document) -> SecondIterate:
    variable, (first, second), domain, held = _held_parts(data)
    return second_of(variable, first, second, data["order"], domain, held)


def _closed(closed: ClosedMap) -> Document:
    names = [*map(str, closed.coordinates), *closed.symbols]
    return {
        "coordinates": _coordinates(closed.coordinates),
        "symbols": list(closed.symbols),
        "images": {name: _terms(image, names) for name, image in closed.images.items()},
        "absolute": [str(name) for name in closed.absolute],
        "degree": closed.degree,
        "domain": {name: list(ends) for name, ends in closed.domain.items()},
    }


def _closed_of(data: Document) -> ClosedMap:
    names, symbols = _names(data["coordinates"]), tuple(map(_name, data["symbols"]))
    images = {name: _expr(image, [*names, *symbols]) for name, image in data["images"].items()}
    return ClosedMap(names, symbols, images, tuple(data["absolute"]), int(_number(data["degree"])), _domain(data))


Kind = tuple[type, Callable[[Any], Document], Callable[[Document], AnyMap]]
KINDS: dict[str, Kind] = {
    "polynomial map": (PolyMap, _polymap, _polymap_of),
    "composite map": (CompositeMap, _composite, _composite_of),
    "parametric map": (ParametricMap, _parametric, _parametric_of),
    "second iterate": (SecondIterate, lambda it: _held(it) | {"order": it.order}, _second_of),
    "held iterate": (HeldIterate, _held, lambda data: held_of(*_held_parts(data))),
    "closed map": (ClosedMap, _closed, _closed_of),
}
