"""Maps and closed forms as plain data and back, to the bit: what is written as JSON and as the table of a Python module.

The layout is that of `VERSION`; docs/reference/export.md describes it. Nothing that is read is executed.
"""

import ast
import os
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exports.closed_forms import (
    closed_document,
    closed_of_document,
    held_document,
    held_parts,
)
from nsmaps.exports.plain_data import (
    Document,
    coordinates_of,
    floats,
    formula_of,
    name_of,
    names_of,
    number_of,
    numbers,
    powers_of,
)
from nsmaps.exports.program import Exportable
from nsmaps.files.reading import json_of, text_of
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import ParametricMap, ParametricReport
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region, as_condition
from nsmaps.reduced.fit.polymap import FitReport, PolyMap
from nsmaps.symbolic.curve_iterates import HeldIterate, SecondIterate, held_of
from nsmaps.symbolic.map_iterates import ClosedMap

SCHEMA, VERSION = "nsmaps", 1
TABLE = "MAP"  #: the name of the table in a Python module
LARGEST = 2**28  #: bytes of a file that is read


def document(result: Exportable) -> Document:
    """A map or closed form as plain data: strings, numbers, lists and dictionaries. ConditionError for a region without text."""
    kind = kind_of(result)
    return {"schema": SCHEMA, "version": VERSION, "kind": kind} | KINDS[kind][1](result)


def kind_of(result: Exportable) -> str:
    """What a map or closed form is called, such as "polynomial map"."""
    return next(kind for kind, (cls, _, _) in KINDS.items() if isinstance(result, cls))


@checked
def load_map(path: str | os.PathLike[str]) -> Exportable:
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


def of_document(data: Document) -> Exportable:
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


def _report(report: Any) -> Document | None:
    """A report of arrays as plain data."""
    if report is None:
        return None
    values = {field.name: getattr(report, field.name) for field in fields(report)}
    return {k: numbers(v) if isinstance(v, np.ndarray) else [str(each) for each in v] for k, v in values.items()}


def _report_of(cls: type, data: Document | None, coordinates: Coordinates) -> Any:
    if data is None:
        return None
    values: Document = {}
    for name, value in data.items():
        if name == "coordinates":
            values[name] = coordinates
        elif name in ("names", "warnings"):
            values[name] = tuple(value)
        else:
            values[name] = np.array(value, np.int64) if name in ("points", "terms") else floats(value)
    return cls(**values)


def _polymap(polymap: PolyMap) -> Document:
    return {
        "coordinates": coordinates_of(polymap.coordinates),
        "centre": numbers(polymap.centre),
        "scale": numbers(polymap.scale),
        "domain": numbers(polymap.domain),
        "variables": None if polymap.variables is None else [str(text) for text in polymap.variables],
        "absolute": [str(name) for name in polymap.absolute],
        "outputs": [
            {"exponents": numbers(exponents), "coefficients": numbers(coefficients)}
            for exponents, coefficients in zip(polymap.exponents, polymap.coefficients, strict=True)
        ],
        "report": _report(polymap.report),
    }


def _polymap_of(data: Document) -> PolyMap:
    names = names_of(data["coordinates"])
    variables = None if data["variables"] is None else tuple(formula_of(text, names) for text in data["variables"])
    k = len(names if variables is None else variables)
    exponents = tuple(powers_of(each["exponents"], k, sparse=variables is not None) for each in data["outputs"])
    coefficients = tuple(floats(each["coefficients"]) for each in data["outputs"])
    centre, scale, domain = (floats(data[name]) for name in ("centre", "scale", "domain"))
    n = len(names)
    shapes = [(centre.shape, (k,)), (scale.shape, (k,)), (domain.shape, (n, 2)), ((len(exponents),), (n,))]
    shapes += [(c.shape, (len(e),)) for c, e in zip(coefficients, exponents, strict=True)]
    for found, wanted in shapes:
        if found != wanted:
            raise NsmapsError(f"an array of shape {found}; expected: {wanted}")
    report = _report_of(FitReport, data["report"], names)
    return PolyMap(names, exponents, coefficients, centre, scale, domain, tuple(data["absolute"]), report, variables)


def _region(region: Region) -> Document:
    return {"box": numbers(region.array)} if type(region) is Box else {"where": as_condition(region).text}


def _piece(piece: Piece) -> Document:
    about = {"name": piece.name, "word": piece.word, "returns": piece.returns}
    return about | {"region": _region(piece.region), "map": _polymap(piece.map)}


def _piece_of(data: Document, names: Coordinates) -> Piece:
    region = data["region"]
    held: Region = Box.of(names, region["box"]) if "box" in region else ConditionRegion(text=region["where"], coordinates=names)
    returns = data["returns"]
    if type(returns) is not int or returns < 1:
        raise NsmapsError(f"{returns!r:.60} returns of the piece {data['name']!r:.60}; expected: a whole number from 1 on")
    return Piece(name_of(data["name"]), held, _polymap_of(data["map"]), data["word"], returns)


def _composite(composite: CompositeMap) -> Document:
    pieces = [_piece(piece) for piece in composite.pieces]
    return {"coordinates": coordinates_of(composite.coordinates), "walls": list(composite.walls), "pieces": pieces}


def _composite_of(data: Document) -> CompositeMap:
    names = names_of(data["coordinates"])
    return CompositeMap(names, tuple(map(name_of, data["walls"])), tuple(_piece_of(piece, names) for piece in data["pieces"]))


def _parametric(parametric: ParametricMap) -> Document:
    return {
        "parameter": parametric.parameter,
        "low": parametric.low,
        "high": parametric.high,
        "coordinates": coordinates_of(parametric.coordinates),
        "walls": list(parametric.walls),
        "pieces": [_piece(piece) for piece in parametric.pieces],
        "nodes": numbers(parametric.nodes),
        "condition": parametric.condition,
        "report": _report(parametric.report),
    }


def _parametric_of(data: Document) -> ParametricMap:
    names = names_of(data["coordinates"])
    pieces = tuple(_piece_of(piece, names) for piece in data["pieces"])
    report = _report_of(ParametricReport, data["report"], names)
    ends = (number_of(data["low"]), number_of(data["high"]))
    walls, nodes = tuple(map(name_of, data["walls"])), floats(data["nodes"])
    return ParametricMap(name_of(data["parameter"]), *ends, names, walls, pieces, nodes, number_of(data["condition"]), report)


def _second_of(data: Document) -> SecondIterate:
    return SecondIterate.of(held_of(*held_parts(data)), data["order"])


Kind = tuple[type, Callable[[Any], Document], Callable[[Document], Exportable]]
KINDS: dict[str, Kind] = {
    "polynomial map": (PolyMap, _polymap, _polymap_of),
    "composite map": (CompositeMap, _composite, _composite_of),
    "parametric map": (ParametricMap, _parametric, _parametric_of),
    "second iterate": (SecondIterate, lambda it: held_document(it) | {"order": it.order}, _second_of),
    "held iterate": (HeldIterate, held_document, lambda data: held_of(*held_parts(data))),
    "closed map": (ClosedMap, closed_document, closed_of_document),
}
