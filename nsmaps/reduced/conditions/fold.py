"""The evaluation of the syntax tree of a condition by an algebra, which defines the results."""

import ast
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import partial, reduce
from typing import Generic, TypeVar

from nsmaps.files.expressions import CONSTANTS, SEVERAL, Reader

Term = TypeVar("Term")
Test = TypeVar("Test")

OPERATORS: dict[type[ast.AST], str] = {
    **{ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.UAdd: "+", ast.USub: "-"},
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="},
}


class Algebra(ABC, Generic[Term, Test]):
    """The results of the parts of a condition: terms of numbers and coordinates, and the tests that compare them."""

    exact = False  #: True if constants such as `pi/3` keep their form, False if they become floats

    @abstractmethod
    def number(self, value: float) -> Term:
        """A constant."""

    @abstractmethod
    def coordinate(self, column: int) -> Term:
        """A coordinate, by its number."""

    @abstractmethod
    def signed(self, sign: str, term: Term) -> Term:
        """A term after a sign, + or -."""

    @abstractmethod
    def arithmetic(self, operator: str, left: Term, right: Term) -> Term:
        """Two terms joined by +, -, *, / or **."""

    @abstractmethod
    def function(self, name: str, *arguments: Term) -> Term:
        """One of the FUNCTIONS of a term; min and max of two. An ArithmeticError says that a term is not real."""

    @abstractmethod
    def relation(self, operator: str, left: Term, right: Term) -> Test:
        """A comparison by <, <=, >, >=, == or !=. An ArithmeticError says that a term is not real."""

    @abstractmethod
    def conjunction(self, tests: Sequence[Test]) -> Test:
        """Tests joined by `and`; at least one."""

    @abstractmethod
    def disjunction(self, tests: Sequence[Test]) -> Test:
        """Tests joined by `or`; at least one."""

    @abstractmethod
    def negation(self, test: Test) -> Test:
        """The negation of a test."""

    def constant(self, name: str) -> Term:
        """A named constant, pi or e; called for exact algebras only."""
        return self.number(CONSTANTS[name])


def fold(text: str, names: Sequence[str], algebra: Algebra[Term, Test]) -> Test:
    """The result of an algebra for the condition on named coordinates in a text; a ConditionError states the column."""
    reader = Reader("condition", text, tuple(names))
    tree = reader.tree()
    reader.check(tree)
    return _test(reader, tree, algebra)


def fold_term(text: str, names: Sequence[str], algebra: Algebra[Term, Test]) -> Term:
    """The result of an algebra for the formula in named coordinates in a text; a ConditionError states the column."""
    reader = Reader("formula", text, tuple(names))
    tree = reader.tree()
    reader.check_value(tree)
    try:
        return _term(reader, tree, algebra)
    except ArithmeticError:
        reader.fail(1, "is not real")


def _test(reader: Reader, node: ast.expr, algebra: Algebra[Term, Test]) -> Test:
    match node:
        case ast.Compare(left=left, ops=ops, comparators=rights):
            try:
                terms = [_term(reader, part, algebra) for part in (left, *rights)]
                pairs = zip(ops, terms, terms[1:], strict=False)
                return algebra.conjunction([algebra.relation(OPERATORS[type(op)], a, b) for op, a, b in pairs])
            except ArithmeticError:  # infinite wherever the state is, as 1/(0*v)
                reader.fail(node, f"{reader.source(node)} compares a value that is not real")
        case ast.BoolOp(op=op, values=values):
            tests = [_test(reader, part, algebra) for part in values]
            return algebra.conjunction(tests) if isinstance(op, ast.And) else algebra.disjunction(tests)
        case ast.UnaryOp(operand=operand):
            return algebra.negation(_test(reader, operand, algebra))
    raise AssertionError(f"{ast.dump(node)} passed the check")


def _term(reader: Reader, node: ast.expr, algebra: Algebra[Term, Test]) -> Term:
    value = reader.value(node)
    power = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)  # exact results of constants could grow without bound
    if value is not None and (power or isinstance(node, ast.Constant) or not algebra.exact):
        return algebra.number(value)
    match node:
        case ast.Name(id=name):
            return algebra.coordinate(reader.column[name]) if name in reader.column else algebra.constant(name)
        case ast.UnaryOp(op=op, operand=operand):
            return algebra.signed(OPERATORS[type(op)], _term(reader, operand, algebra))
        case ast.BinOp(op=op, left=left, right=right):
            return algebra.arithmetic(OPERATORS[type(op)], _term(reader, left, algebra), _term(reader, right, algebra))
        case ast.Call(func=ast.Name(id=name), args=args):
            terms = [_term(reader, part, algebra) for part in args]
            return reduce(partial(algebra.function, name), terms) if name in SEVERAL else algebra.function(name, *terms)
    raise AssertionError(f"{ast.dump(node)} passed the check")
