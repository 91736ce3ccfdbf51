"""Safe readers of the numbers and conditions in a study's text: `pi/3`, `v > 0.63 - 0.53*phi and v > 0.55`."""

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any
from unicodedata import normalize

import numpy as np
from pydantic import BeforeValidator

from nsmaps.arrays import ArrayLike, Bools, finite_rows
from nsmaps.coordinates import as_states
from nsmaps.errors import ConditionError
from nsmaps.files.expressions import Reader
from nsmaps.reduced.conditions.algebras import Evaluate, Numbers, Symbols
from nsmaps.reduced.conditions.fold import fold

if TYPE_CHECKING:
    import sympy as sp


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """A condition on a state that was read from text; see `read_condition`."""

    text: str
    names: tuple[str, ...]
    holds: Evaluate

    def __call__(self, states: ArrayLike) -> Bools:
        """A mask of the states (N, n) at which the condition holds, shape (N,).

        It is false at every state that is NaN or infinite; a comparison with a value that is not real, as sqrt(-1), is false,
        != true.
        """
        array = as_states(states, self.names)
        with np.errstate(all="ignore"):
            return np.logical_and(self.holds(array.T), finite_rows(array))

    def sympy(self) -> "sp.Basic":
        """The same condition as a sympy Boolean in real symbols of the names; `pi/3` stays exact, 0.63 a float."""
        return fold(self.text, self.names, Symbols(self.names))

    def __reduce__(self) -> tuple[Any, ...]:
        return read_condition, (self.text, self.names)


def read_condition(text: str, names: Sequence[str]) -> Condition:
    """The condition on the named coordinates in a text, or a ConditionError that states the column.

    Allowed are comparisons, also chained, `and`, `or`, `not`, and in them the names and the expressions of `read_number`.

    >>> read_condition("0 < v <= 1 and phi < pi/2", ("v", "phi"))([[0.5, 1.0], [0.5, 2.0], [1.5, 1.0]])
    array([ True, False, False])
    """
    return Condition(text, tuple(names), fold(text, names, Numbers()))


class _Numbers(ast.NodeTransformer):
    """A syntax tree with numbers in place of some names."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self.values = {normalize("NFKC", name): value for name, value in values.items()}  # as Python normalises names

    def visit_Name(self, node: ast.Name) -> ast.expr:
        value = self.values.get(node.id)
        if value is None:
            return node
        size = ast.Constant(abs(value))
        return ast.UnaryOp(ast.USub(), size) if value < 0 else size


def with_numbers(text: str, values: Mapping[str, float], names: Sequence[str]) -> str:
    """A condition in text at finite values of some of its `names`, which are written in their place.

    >>> with_numbers("v >= 0.65 + d**2", {"d": -0.3}, ("v", "d"))
    'v >= 0.65 + (-0.3) ** 2'
    """
    return ast.unparse(_Numbers(values).visit(Reader("condition", text, tuple(names)).tree()))


def read_number(text: str) -> float:
    """The finite number in a text, or a ConditionError that states the column.

    Allowed are numbers, + - * / **, parentheses, pi, e and the FUNCTIONS of `nsmaps.files.expressions`, from sqrt to max.

    >>> read_number("2*pi/3") == 2 * math.pi / 3
    True
    """
    reader = Reader("number", text, ())
    value = reader.value(reader.tree())
    return reader.fail(1, "is not a number") if value is None else value


def as_number(value: object) -> float:
    """A finite number given as a number or as text; otherwise a ConditionError."""
    if isinstance(value, str):
        return read_number(value)
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise ConditionError(f"{value!r} is a {type(value).__name__}; expected: a number, or text as 'pi/3'")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = math.inf
    if not math.isfinite(number):
        shown = repr(value) if len(repr(value)) <= 40 else f"a number of {len(repr(value))} digits"
        raise ConditionError(f"{shown} is not finite; expected: a finite number, or text as 'pi/3'")
    return number


#: A field that holds a finite float and accepts text as `pi/3` for it.
Number = Annotated[float, BeforeValidator(as_number, json_schema_input_type=float | str)]
