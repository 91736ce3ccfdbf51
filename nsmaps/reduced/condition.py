"""Safe readers of the numbers and conditions in a study's text: `pi/3`, `v > 0.63 - 0.53*phi and v > 0.55`."""

import ast
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from nsmaps.arrays import ArrayLike
from nsmaps.errors import ConditionError
from nsmaps.exact.impacts import as_states
from nsmaps.reduced.reader import ARITHMETIC, COMPARISONS, Evaluate, Reader

if TYPE_CHECKING:
    import sympy as sp

Bools = NDArray[np.bool_]

EXACT = 2**53  #: whole numbers up to here are themselves in a float


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """A condition on a state that was read from text; see `read_condition`."""

    text: str
    names: tuple[str, ...]
    holds: Evaluate

    def __call__(self, states: ArrayLike) -> Bools:
        """Where the condition holds, states (N, n) -> shape (N,).

        It holds at no state that is NaN or infinite; a comparison with what is not real, as sqrt(-1), is false, != true.
        """
        array = as_states(states, self.names)
        with np.errstate(all="ignore"):
            return np.logical_and(self.holds(array.T), np.isfinite(array).all(axis=1))

    def sympy(self) -> "sp.Basic":
        """The same condition as a sympy Boolean in real symbols of the names; `pi/3` stays exact, 0.63 a float."""
        reader = Reader("condition", self.text, self.names)
        return _boolean(reader, reader.tree())

    def __reduce__(self) -> tuple[Any, ...]:
        return read_condition, (self.text, self.names)


def read_condition(text: str, names: Sequence[str]) -> Condition:
    """The condition that a text states of the named coordinates, or a ConditionError that names the column.

    Accepted are comparisons, chained too, `and`, `or`, `not`, and in them what `read_number` accepts and the names.

    >>> read_condition("0 < v <= 1 and phi < pi/2", ("v", "phi"))([[0.5, 1.0], [0.5, 2.0], [1.5, 1.0]])
    array([ True, False, False])
    """
    reader = Reader("condition", text, tuple(names))
    return Condition(text, tuple(names), reader.test(reader.tree()))


def read_number(text: str) -> float:
    """The finite number that a text states, or a ConditionError that names the column.

    Accepted are numbers, + - * / **, parentheses, pi, e, sqrt, sin, cos, exp and log.

    >>> read_number("2*pi/3") == 2 * math.pi / 3
    True
    """
    reader = Reader("number", text, ())
    value = reader.term(reader.tree())
    return value if isinstance(value, float) else reader.fail(1, "is not a number")


def as_number(value: object) -> float:
    """A number given as such or as text, finite; otherwise a ConditionError."""
    if isinstance(value, str):
        return read_number(value)
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise ConditionError(f"{value!r} is a {type(value).__name__}; accepted: a number, or text as 'pi/3'")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = math.inf
    if not math.isfinite(number):
        shown = repr(value) if len(repr(value)) <= 40 else f"a number of {len(repr(value))} digits"
        raise ConditionError(f"{shown} is not finite; accepted: a finite number, or text as 'pi/3'")
    return number


#: A field that holds a finite float and accepts text as `pi/3` for it.
Number = Annotated[float, BeforeValidator(as_number, json_schema_input_type=float | str)]


def _boolean(reader: Reader, node: ast.expr) -> Any:
    """The sympy form of a condition that the reader has accepted."""
    import sympy as sp

    match node:
        case ast.Compare():
            terms = [_expression(reader, part) for part in (node.left, *node.comparators)]
            names = [COMPARISONS[type(op)][1] for op in node.ops]
            try:
                return sp.And(*(getattr(sp, name)(a, b) for name, a, b in zip(names, terms, terms[1:], strict=False)))
            except TypeError:  # infinite wherever the state is, as 1/(0*v)
                reader.fail(node, f"{reader.source(node)} compares what is not real")
        case ast.BoolOp():
            join = sp.And if isinstance(node.op, ast.And) else sp.Or
            return join(*(_boolean(reader, part) for part in node.values))
        case ast.UnaryOp():
            return sp.Not(_boolean(reader, node.operand))
    raise AssertionError(f"{ast.dump(node)} was not accepted")


def _expression(reader: Reader, node: ast.expr) -> Any:
    """The sympy form of an arithmetic expression that the reader has accepted."""
    import sympy as sp

    match node:
        case ast.Constant(value=int() | float() as value):
            return _exact(float(value))
        case ast.Name(id=name):
            if name in reader.column:
                return sp.Symbol(reader.names[reader.column[name]], real=True)
            return {"pi": sp.pi, "e": sp.E}[name]
        case ast.UnaryOp(op=op, operand=operand):
            return ARITHMETIC[type(op)](_expression(reader, operand))
        case ast.BinOp(op=op, left=left, right=right):
            power = reader.term(node) if isinstance(op, ast.Pow) else None
            if isinstance(power, float):  # exact powers of constants could grow without bound
                return _exact(power)
            return ARITHMETIC[type(op)](_expression(reader, left), _expression(reader, right))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return getattr(sp, name)(_expression(reader, argument))
    raise AssertionError(f"{ast.dump(node)} was not accepted")


def _exact(value: float) -> Any:
    """A whole number as sympy's integer, any other as its float."""
    import sympy as sp

    return sp.Integer(int(value)) if value.is_integer() and abs(value) <= EXACT else sp.Float(value)
