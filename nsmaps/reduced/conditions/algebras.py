"""Conditions in numbers and in symbols."""

import operator
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, TypeAlias

import numpy as np

from nsmaps.files.expressions import CAPITAL, SEVERAL
from nsmaps.reduced.conditions.fold import Algebra

Evaluate: TypeAlias = Callable[[Any], Any]  #: the columns of a batch of states, shape (n, N) -> one value a state

EXACT = 2**53  #: whole numbers up to here are themselves in a float
BINARY: dict[str, Callable[[Any, Any], Any]] = {
    **{"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "**": operator.pow},
    **{"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne},
}
SIGNS: dict[str, Callable[[Any], Any]] = {"+": operator.pos, "-": operator.neg}
NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "min": "minimum", "max": "maximum"}  #: as NumPy names them
RELATIONS = {"<": "Lt", "<=": "Le", ">": "Gt", ">=": "Ge", "==": "Eq", "!=": "Ne"}  #: as sympy names them


class Numbers(Algebra[Evaluate, Evaluate]):
    """Functions of the columns of a batch of states."""

    def number(self, value: float) -> Evaluate:
        """A constant."""
        return lambda x: value

    def coordinate(self, column: int) -> Evaluate:
        """A column."""
        return operator.itemgetter(column)

    def signed(self, sign: str, term: Evaluate) -> Evaluate:
        """A term after a sign."""
        return lambda x: SIGNS[sign](term(x))

    def arithmetic(self, operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
        """Two terms joined."""
        return lambda x: BINARY[operator](left(x), right(x))

    def function(self, name: str, *arguments: Evaluate) -> Evaluate:
        """NumPy's function."""
        called = getattr(np, NUMPY.get(name, name))
        return lambda x: called(*(argument(x) for argument in arguments))

    def relation(self, operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
        """A comparison."""
        return self.arithmetic(operator, left, right)

    def conjunction(self, tests: Sequence[Evaluate]) -> Evaluate:
        """Where all tests are true."""
        return lambda x: reduce(np.logical_and, [test(x) for test in tests])

    def disjunction(self, tests: Sequence[Evaluate]) -> Evaluate:
        """Where any test is true."""
        return lambda x: reduce(np.logical_or, [test(x) for test in tests])

    def negation(self, test: Evaluate) -> Evaluate:
        """Where a test is false."""
        return lambda x: np.logical_not(test(x))


class Symbols(Algebra[Any, Any]):
    """Sympy's expressions in real symbols of the coordinates; `pi/3` stays exact."""

    exact = True

    def __init__(self, names: Sequence[str]) -> None:
        import sympy

        self.names, self.sympy = names, sympy

    def number(self, value: float) -> Any:
        """A whole number as an integer, any other as its float."""
        return self.sympy.Integer(int(value)) if value.is_integer() and abs(value) <= EXACT else self.sympy.Float(value)

    def constant(self, name: str) -> Any:
        """A named constant."""
        return {"pi": self.sympy.pi, "e": self.sympy.E}[name]

    def coordinate(self, column: int) -> Any:
        """A real symbol."""
        return self.sympy.Symbol(self.names[column], real=True)

    def signed(self, sign: str, term: Any) -> Any:
        """A term after a sign."""
        return SIGNS[sign](term)

    def arithmetic(self, operator: str, left: Any, right: Any) -> Any:
        """Two terms joined."""
        return BINARY[operator](left, right)

    def function(self, name: str, *arguments: Any) -> Any:
        """Sympy's function; an ArithmeticError where sympy finds a term that is not real."""
        unchanged = {"evaluate": False} if name in SEVERAL else {}  # sympy's comparison of symbols may take minutes
        try:
            return getattr(self.sympy, name.title() if name in CAPITAL else name)(*arguments, **unchanged)
        except (TypeError, ValueError) as error:
            raise ArithmeticError(str(error)) from error

    def relation(self, operator: str, left: Any, right: Any) -> Any:
        """A relation; an ArithmeticError where sympy finds a term that is not real."""
        try:
            return getattr(self.sympy, RELATIONS[operator])(left, right)
        except TypeError as error:
            raise ArithmeticError(str(error)) from error

    def conjunction(self, tests: Sequence[Any]) -> Any:
        """Sympy's And."""
        return self.sympy.And(*tests)

    def disjunction(self, tests: Sequence[Any]) -> Any:
        """Sympy's Or."""
        return self.sympy.Or(*tests)

    def negation(self, test: Any) -> Any:
        """Sympy's Not."""
        return self.sympy.Not(test)
