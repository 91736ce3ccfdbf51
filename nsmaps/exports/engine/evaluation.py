"""What expressions of a function are, where that follows from the numbers of a table: constants, and the kinds of arrays."""

import ast
import math
import operator
from collections import Counter
from collections.abc import Callable
from itertools import takewhile
from typing import Any

import numpy as np

from nsmaps.exports.engine.kinds import CONSTANTS, OPEN, Array, Bound, Kind, Known, Record, array_of
from nsmaps.exports.engine.pruning import indices

SIGNS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Pow: operator.pow, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
    ast.GtE: operator.ge, ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Not: operator.not_, ast.USub: operator.neg,
}  # fmt: skip
LEAVING = ast.Return | ast.Break | ast.Continue  #: what ends a block
PLAIN: dict[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max, "int": int}


class NotConstantError(Exception):
    """An expression that is not a constant."""


def numeral(value: Any) -> bool:
    """Whether a constant is better read by its name: a finite float."""
    return isinstance(value, float) and math.isfinite(value)


class Evaluation:
    """What is known of one function: `known` names of its module, `given` kinds of its arguments, and what it learns by and by.

    `called` answers what a call returns if that is a constant.
    """

    def __init__(self, known: dict[str, Any], given: dict[str, Kind], called: Callable[..., Any]) -> None:
        self.known, self.given, self.called = known, given, called
        self.constants, self.facts = dict[str, Any](), dict[str, bool]()
        self.count = Counter[str]()  #: how often each variable is assigned

    def learn(self, test: ast.expr, holds: bool) -> None:
        """Keep in mind whether a condition on variables that do not change holds in the rest of a block."""
        nodes = list(ast.walk(test))
        plain = not any(isinstance(node, ast.Attribute | ast.Subscript | ast.Call) for node in nodes)
        if plain and all(self.count[node.id] <= 1 for node in nodes if isinstance(node, ast.Name)):
            self.facts[ast.dump(test)] = holds

    def kind(self, node: ast.expr) -> Kind:
        """The kind of an array, a record or a function, None of anything else."""
        match node:
            case ast.Name(id=name) if name in self.given and self.count[name] == 1:
                return self.given[name]
            case ast.Name(id=name) if name not in self.count and isinstance(self.known.get(name), np.ndarray):
                return array_of(self.known[name], fixed=True)
            case ast.Constant(value=bool() as value):
                return Known(value)
            case ast.Name(id=name) if name not in self.count and hasattr(self.known.get(name), "py_func"):
                return Bound(self.known[name])
            case ast.Attribute(value=inner, attr=name) if isinstance(record := self.kind(inner), Record):
                return record.kind(name)
            case ast.Subscript(value=inner, slice=at) if isinstance(array := self.kind(inner), Array):
                return array.at(len(indices(at)))
        return None

    def value(self, node: ast.expr) -> Any:
        """The constant that an expression is. Raises NotConstantError."""
        if self.facts and isinstance(node, ast.Compare) and (fact := self.facts.get(ast.dump(node))) is not None:
            return fact
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name) if name in self.constants:
                return self.constants[name]
            case ast.Name(id=name) if name not in self.count and isinstance(self.known.get(name), CONSTANTS):
                return self.known[name]
            case ast.Attribute(value=ast.Name(id="math"), attr="inf" | "nan" as name):
                return getattr(math, name)
            case ast.Attribute(value=inner, attr=name):
                record = self.kind(inner)
                if isinstance(record, Record) and record.fixed and isinstance(record.kind(name), str):
                    return getattr(record.value, name)
            case ast.Subscript():
                return self.entry(node)
            case ast.Tuple(elts=parts):
                return tuple(self.value(part) for part in parts)
            case ast.BinOp(left=left, op=sign, right=right) if type(sign) in SIGNS:
                return SIGNS[type(sign)](self.value(left), self.value(right))
            case ast.UnaryOp(op=sign, operand=inner):
                return SIGNS[type(sign)](self.value(inner))
            case ast.Compare(left=left, ops=[sign], comparators=[right]) if type(sign) in SIGNS:
                return SIGNS[type(sign)](self.value(left), self.value(right))
            case ast.Call():
                return self.answer(node)
        raise NotConstantError

    def entry(self, node: ast.Subscript) -> Any:
        """An entry of a shape, of a tuple, or of a fixed array, all of whose entries that it may be are the same."""
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            return self.length(node.value.value, self.value(node.slice))
        array = self.kind(node.value)
        if array is None:
            return self.value(node.value)[self.value(node.slice)]
        if not isinstance(array, Array) or array.value is None or len(indices(node.slice)) < len(array.shape):
            raise NotConstantError
        found = np.unique(array.value[tuple(map(self.index, indices(node.slice)))])
        if len(found) != 1:
            raise NotConstantError
        return found.item()

    def index(self, node: ast.expr) -> Any:
        """An index, or all where it is not known."""
        try:
            return self.value(node)
        except NotConstantError:
            return slice(None)

    def length(self, node: ast.expr, axis: int) -> int:
        """How long an array is along an axis."""
        array = self.kind(node)
        if isinstance(array, Record):
            return len(array.value)
        if not isinstance(array, Array) or (array.shape[axis] == OPEN and not array.fixed):
            raise NotConstantError
        return array.shape[axis]

    def answer(self, node: ast.Call) -> Any:
        """What a call returns."""
        match node.func:
            case ast.Name(id="len"):
                return self.length(node.args[0], 0)
            case ast.Name(id=name) if name in PLAIN:
                return PLAIN[name](*map(self.value, node.args))
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                return getattr(math, name)(*map(self.value, node.args))
            case ast.Name() as name if isinstance(function := self.kind(name), Bound):
                plain = takewhile(lambda each: not isinstance(each, ast.Starred), node.args)
                return self.called(function.compiled, list(map(self.kind, plain)))
        raise NotConstantError
