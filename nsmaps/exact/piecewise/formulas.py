"""The pieces of a map given by formulas: conditions and images in sympy."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import sympy as sp
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanAtom, BooleanFunction
from sympy.printing.codeprinter import PrintMethodNotImplementedError

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.flows.laws import code
from nsmaps.exact.systems.parameters import System, choices_of

CONDITIONS = (Relational, BooleanFunction, BooleanAtom)


@dataclass(frozen=True, eq=False)
class PieceFormulas:
    """The formulas of P pieces over n coordinates, for all values of the parameters."""

    letters: tuple[str, ...]  #: of the pieces, in their order
    conditions: tuple[Any, ...]
    images: tuple[tuple[sp.Expr, ...], ...]  #: of each piece, in the order of the coordinates
    variables: tuple[sp.Symbol, ...]  #: the coordinates
    symbols: tuple[sp.Symbol, ...]  #: the parameters


@dataclass(frozen=True)
class Choices:
    """A class of maps with the values of its fields that are not numbers, of which any may be a list."""

    cls: Any
    text: str
    values: dict[str, Any] = field(compare=False)

    @classmethod
    def of(cls, system: System) -> "Choices":
        """The class of a map with its choices."""
        values = choices_of(system)
        return cls(type(system), repr(values), values)


@lru_cache(maxsize=64)
def formulas_of(choices: Choices) -> PieceFormulas:
    """The formulas of a class with its choices.

    Raises:
        SystemDefinitionError: states which piece is not one, and why.
    """
    cls = choices.cls
    symbolic, symbols = in_symbols(cls, choices.values)
    names = tuple(cls.coordinates)
    variables = tuple(sp.Symbol(f"_y_{k}", real=True) for k in range(len(names)))
    try:
        pieces = symbolic.pieces(SimpleNamespace(**dict(zip(names, variables, strict=True))))
    except (TypeError, AttributeError) as error:
        shown = str(error)
        for variable, name in zip(variables, names, strict=True):
            shown = re.sub(rf"\b{variable}\b", f"x.{name}", shown)
        raise SystemDefinitionError(f"{cls.__name__}.pieces: {shown}; {_advice(error, names)}") from error
    if not (isinstance(pieces, Mapping) and pieces):
        raise SystemDefinitionError(
            f"{cls.__name__}.pieces gives {pieces!r:.80}; expected: pairs of a condition and images by letter"
        )
    known = {*variables, *symbols.values()}
    found = [_piece(f"the piece {letter!r} of {cls.__name__}", piece, names, known) for letter, piece in pieces.items()]
    letters = tuple(map(str, pieces))
    if not all(len(letter) == 1 and letter.isalnum() for letter in letters):
        given = ", ".join(map(repr, letters))
        raise SystemDefinitionError(f"{cls.__name__} names its pieces {given}; expected: a letter or a digit for each")
    conditions, images = zip(*found, strict=True)
    return PieceFormulas(letters, conditions, images, variables, tuple(symbols.values()))


def _advice(error: Exception, names: Sequence[str]) -> str:
    """What is expected of pieces that raise an error."""
    if isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace):
        return f"expected: the coordinates, {', '.join(f'x.{name}' for name in names)}"
    if "truth value" in str(error):
        return "a formula cannot choose by a relation of symbols: write conditions with & and |, and cases as pieces"
    return "expected: formulas in sympy's functions, as sympy.sin, not those of math or numpy"


def _piece(what: str, piece: Any, names: Sequence[str], known: set[sp.Symbol]) -> tuple[Any, tuple[sp.Expr, ...]]:
    """The condition and the images of a piece, in the order of the coordinates."""
    match piece:
        case (given, Mapping() as images):
            condition = sp.sympify(given)
        case _:
            raise SystemDefinitionError(f"{what} is {piece!r:.80}; expected: a condition, and the images by coordinate")
    if not isinstance(condition, CONDITIONS):
        raise SystemDefinitionError(
            f"the condition of {what[4:]} is {condition}; expected: a relation, such as x.x <= 0, or True"
        )
    if set(images) != set(names):
        given, expected = ", ".join(map(str, images)) or "none", ", ".join(names)
        raise SystemDefinitionError(f"{what} has images of {given}; expected: of each of {expected}")
    rows = tuple(sp.sympify(images[name]) for name in names)
    for formula in (condition, *rows):
        if unknown := formula.free_symbols - known:
            raise SystemDefinitionError(
                f"{what} has {', '.join(sorted(map(str, unknown)))} in {formula}; expected: fields and states"
            )
        try:
            code(formula)
        except PrintMethodNotImplementedError as error:
            raise SystemDefinitionError(f"{what} has {formula}; expected: functions that Python's math has") from error
    return condition, rows
