"""Arrays, names and numbers of exported maps as plain data and back; what is read is checked and never executed."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from nsmaps.coordinates import Coordinates, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.files.reading import odd_character
from nsmaps.reduced.conditions.algebras import Numbers
from nsmaps.reduced.conditions.fold import fold_term

DENSEST = 10_000_000  #: products of powers of all coordinates up to those that occur

Document = dict[str, Any]


def numbers(values: Any) -> Any:
    """An array as nested lists; what JSON has no number for as text: 'inf', '-inf', 'nan'."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if isinstance(values, list):
        return [numbers(value) for value in values]
    return values if not isinstance(values, float) or math.isfinite(values) else str(values)


def floats(values: Any) -> Any:
    """An array of the numbers in nested lists, in which text stands for infinities and NaN."""
    return np.array(values, dtype=str).astype(float) if _has_text(values) else np.array(values, float)


def _has_text(values: Any) -> bool:
    return any(map(_has_text, values)) if isinstance(values, list) else isinstance(values, str)


def coordinates_of(names: Sequence[str]) -> list[Document]:
    """Coordinates as plain data, with whether they are angles."""
    return [{"name": str(name), "angle": is_angle(name)} for name in names]


def names_of(data: Sequence[Document]) -> Coordinates:
    """The coordinates of plain data."""
    return Coordinates([name_of(each["name"]) for each in data], [each["name"] for each in data if each["angle"]])


def name_of(name: Any) -> str:
    """A name that can stand on one line of a program's comment."""
    if not (isinstance(name, str) and 0 < len(name) <= 100 and len(name.splitlines()) == 1 and not odd_character(name)):
        raise NsmapsError(f"{name!r:.60} is not a name; expected: one line of at most 100 characters")
    return name


def number_of(value: Any) -> float:
    """A number, never a text, which sympy would evaluate."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise NsmapsError(f"{value!r:.60} is not a number; expected: a number")
    return float(value)


def domain_of(data: Document) -> dict[str, tuple[float, float]]:
    """The domain of plain data, by name."""
    return {name_of(name): (number_of(low), number_of(high)) for name, (low, high) in data["domain"].items()}


def formula_of(text: Any, names: Sequence[str]) -> str:
    """A formula of the coordinates, which is read and never executed."""
    fold_term(text, names, Numbers())
    return str(text)


def powers_of(rows: Any, coordinates: int, sparse: bool = False) -> Any:
    """Exponents, shape (terms, coordinates), of polynomials that can be evaluated: term by term if `sparse`."""
    powers = np.array(rows, np.int64).reshape(-1, coordinates)
    if powers.min(initial=0) < 0 or (powers.max(initial=0) if sparse else np.prod(powers.max(axis=0, initial=0) + 1.0)) > DENSEST:
        raise NsmapsError(f"powers from {powers.min()} to {powers.max()}; expected: from 0, of at most {DENSEST:,} products")
    return powers
