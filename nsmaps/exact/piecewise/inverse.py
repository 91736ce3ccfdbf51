"""The inverse of a map given by formulas, piece by piece: the preimages, where they are in their pieces."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import sympy as sp
from sympy.polys.polyerrors import PolynomialError
from sympy.solvers.solveset import NonlinearError

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.piecewise.formulas import Choices, PieceFormulas, formulas_of
from nsmaps.exact.systems.parameters import System


def inverse_of(system: System) -> Any:
    """The map of a state to its preimage: in the first piece in which it has one, with that piece's letter.

    Raises:
        SystemDefinitionError: the equations of a piece are not solved, or preimages are given of other pieces or coordinates.
    """
    cls = _inverse_class(Choices.of(system))
    return cls.model_construct(**{name: getattr(system, name) for name in cls.model_fields})


@lru_cache(maxsize=64)
def _inverse_class(choices: Choices) -> Any:
    """The class of the inverse of a class with its choices."""
    cls, of = choices.cls, formulas_of(choices)
    names = tuple(cls.coordinates)
    solved = _stated_preimages(choices, of, names) or {
        letter: _preimage(choices.cls, of, k) for k, letter in enumerate(of.letters)
    }
    rows = dict[str, tuple[Any, tuple[sp.Expr, ...]]]()
    for k, letter in enumerate(of.letters):
        old = dict(zip(of.variables, solved[letter], strict=True))
        condition = sp.And(of.conditions[k], *(sp.Not(earlier) for earlier in of.conditions[:k]))
        rows[letter] = condition.subs(old, simultaneous=True), solved[letter]

    def pieces(self: Any, x: SimpleNamespace) -> Mapping[str, tuple[Any, Mapping[str, Any]]]:
        known = {variable: getattr(x, name) for variable, name in zip(of.variables, names, strict=True)}
        known |= {symbol: getattr(self, name) for symbol, name in zip(of.symbols, cls.parameter_names(), strict=True)}
        return {
            letter: (condition.subs(known), {name: row.subs(known) for name, row in zip(names, images, strict=True)})
            for letter, (condition, images) in rows.items()
        }

    body = {"pieces": pieces, "__module__": __name__, "__qualname__": f"Inverse{cls.__name__}"}
    return type(f"Inverse{cls.__name__}", (cls,), body)


def _stated_preimages(choices: Choices, of: PieceFormulas, names: Sequence[str]) -> dict[str, tuple[sp.Expr, ...]] | None:
    """The preimages that a class gives, in the order of the coordinates, by letter; None where it gives none."""
    symbolic, _ = in_symbols(choices.cls, choices.values)
    given = symbolic.preimages(SimpleNamespace(**dict(zip(names, of.variables, strict=True))))
    if given is None:
        return None
    wrong = set(given) != set(of.letters) or any(set(row) != set(names) for row in given.values())
    if wrong:
        raise SystemDefinitionError(
            f"{choices.cls.__name__}.preimages gives {given!r:.80}; expected: for each of {', '.join(of.letters)} the "
            f"formulas of {', '.join(names)} before the return"
        )
    return {letter: tuple(sp.sympify(given[letter][name]) for name in names) for letter in of.letters}


def _preimage(cls: type, of: PieceFormulas, k: int) -> tuple[sp.Expr, ...]:
    """The state before a return by a piece, as formulas of the state after it, by its equations."""
    if cls.coordinates.angles.any():  # type: ignore[attr-defined]
        raise SystemDefinitionError(
            f"the inverse of {cls.__name__}, whose coordinates have angles, of which equations have solutions in every turn; "
            "expected: a method `preimages(self, x)`"
        )
    after = [sp.Symbol(f"_z_{j}", real=True) for j in range(len(of.variables))]
    equations = [image - new for image, new in zip(of.images[k], after, strict=True)]
    try:
        found = [tuple(row) for row in sp.linsolve(equations, list(of.variables))]
    except (NonlinearError, PolynomialError):
        solved = sp.solve(equations, list(of.variables), dict=True)
        found = [tuple(row.get(x, x) for x in of.variables) for row in solved]
    checked = [row for row in found if _leads_back(of, k, row, after)]
    if not len(found) == len(checked) == 1:
        raise SystemDefinitionError(
            f"the inverse of the piece {of.letters[k]!r} of {cls.__name__}: {len(checked)} of {len(found)} solutions of its "
            "equations lead back to every state; expected: one, or a method `preimages(self, x)`"
        )
    (rows,) = found
    return tuple(row.subs(dict(zip(after, of.variables, strict=True)), simultaneous=True) for row in rows)


def _leads_back(of: PieceFormulas, k: int, before: tuple[sp.Expr, ...], after: Sequence[sp.Symbol]) -> bool:
    """True if the state before a return is free of itself, and the piece maps it to the state after."""
    old = dict(zip(of.variables, before, strict=True))
    images = [image.subs(old, simultaneous=True) for image in of.images[k]]
    back = all(sp.simplify(image - new) == 0 for image, new in zip(images, after, strict=True))
    return back and not any(row.has(*of.variables) for row in before)
