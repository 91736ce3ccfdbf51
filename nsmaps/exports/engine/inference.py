"""The kinds of the values of the engine: inferred from those of the arguments, and written into its syntax trees.

The engine is written in the part of Python that this module knows: floats, integers, truth values, complex numbers, tuples of
these, and arrays in records; assignments, conditions, loops, and calls. Each name has one kind in a block.
"""

import ast
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np

from nsmaps.exports.engine.kinds import (
    BOOL,
    COMPLEX,
    CONSTANTS,
    FLOAT,
    INT,
    Array,
    Bound,
    Fields,
    Function,
    Kind,
    Known,
    Record,
    array_of,
    holds,
    joined,
    spelt,
)  # fmt: skip
from nsmaps.exports.engine.pruning import indices

Names = dict[str, tuple[str, Kind]]  #: of variables: what they are called in the program, and their kind
OF_MATH = {"isnan": BOOL, "isfinite": BOOL, "floor": INT}  #: functions whose value is not a float


class Inference:
    """The kinds within one function; `called` answers what a call returns, by its node, function and the arguments' kinds."""

    def __init__(self, function: Function, called: Callable[[ast.Name, Any, list[Kind]], Kind]) -> None:
        self.function, self.called = function, called
        self.names: Names = {each.arg: (spelt(each.arg), function.arguments[spelt(each.arg)]) for each in function.tree.args.args}
        self.block(function.tree.body)

    def block(self, statements: Sequence[ast.stmt]) -> None:
        """Infer statements in order."""
        for statement in statements:
            getattr(self, f"_{type(statement).__name__}")(statement)

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):  # a docstring is one
            self.kind(node.value)

    def _Break(self, node: ast.Break) -> None:
        pass

    _Continue = _Break

    def _Return(self, node: ast.Return) -> None:
        if node.value is None:
            return
        kind, so_far = self.kind(node.value), self.function.returns
        self.function.returns = joined(so_far, kind) if so_far else kind

    def _Assign(self, node: ast.Assign) -> None:
        (target,) = node.targets
        self._assign(target, self.kind(node.value))

    def _AugAssign(self, node: ast.AugAssign) -> None:
        self.kind(node.value)
        self.kind(node.target)

    def _assign(self, target: ast.expr, kind: Kind) -> None:
        if isinstance(target, ast.Tuple):
            for each, part in zip(target.elts, kind, strict=True):
                self._assign(each, part)
        elif isinstance(target, ast.Name) and target.id != "_":
            known = self.names.get(target.id)
            if known is None or not holds(known[1], kind):
                self._declare(target.id, kind)
            self.kind(target)
        elif not isinstance(target, ast.Name):
            self.kind(target)

    def _declare(self, name: str, kind: Kind) -> None:
        called, variables = spelt(name), {**self.function.arguments, **self.function.variables}
        while called in variables and variables[called] != kind:
            called += "_of_" + str(kind)
        self.names[name] = called, kind
        if called not in self.function.arguments:
            self.function.variables[called] = kind

    def _If(self, node: ast.If) -> None:
        self.kind(node.test)
        before, left = dict(self.names), []
        for branch in (node.body, node.orelse):
            self.names = dict(before)
            self.block(branch)
            if not (branch and isinstance(branch[-1], ast.Return | ast.Break | ast.Continue)):
                left.append(self.names)
        self.names = dict(before)
        for names in left:
            self.names = {**self.names, **names}
        assert all(self.names[name] == names[name] for names in left for name in names), "a name has two kinds"

    def _For(self, node: ast.For) -> None:
        assert isinstance(node.iter, ast.Call)
        for bound in node.iter.args:
            self.kind(bound)
        self._assign(node.target, INT)
        self._rounds(node.body)

    def _While(self, node: ast.While) -> None:
        self.kind(node.test)
        self._rounds(node.body)

    def _rounds(self, body: Sequence[ast.stmt]) -> None:
        before = dict(self.names)
        self.block(body)
        assert all(self.names[name] == before[name] for name in before), "a name has two kinds"

    def kind(self, node: ast.expr) -> Kind:
        """The kind of an expression, which its node keeps."""
        node.kind = getattr(self, f"_{type(node).__name__}")(node)  # type: ignore[attr-defined]
        return node.kind  # type: ignore[attr-defined]

    def parts(self, nodes: list[ast.expr]) -> list[Kind]:
        """The kinds of expressions, those of a starred tuple one by one; a part of a tuple is written as its entries."""
        found: list[Kind] = []
        nodes[:] = [each for node in nodes for each in self.entries(node)]
        for node in nodes:
            found += self.kind(node.value) if isinstance(node, ast.Starred) else [self.kind(node)]
        return found

    def entries(self, node: ast.expr) -> list[ast.expr]:
        """The entries of a starred part of a tuple, or the expression itself."""
        match node:
            case ast.Starred(value=ast.Subscript(value=ast.Name(id=name), slice=ast.Slice(lower=low, upper=high))):
                start, stop = (None if each is None else ast.literal_eval(each) for each in (low, high))
                places = range(len(self.names[name][1]))[start:stop]
                return [ast.Subscript(ast.Name(name, ast.Load()), ast.Constant(k), ast.Load()) for k in places]
        return [node]

    def _Constant(self, node: ast.Constant) -> Kind:
        return type(node.value).__name__

    def _Name(self, node: ast.Name) -> Kind:
        if node.id in self.names:
            node.called, kind = self.names[node.id]  # type: ignore[attr-defined]
            return kind
        value = self.function.known[node.id]
        if hasattr(value, "py_func"):
            return Bound(value)
        if isinstance(value, np.ndarray):
            return array_of(value, fixed=True)
        assert isinstance(value, CONSTANTS), node.id
        return type(value).__name__

    def _Attribute(self, node: ast.Attribute) -> Kind:
        if node.attr in ("inf", "nan"):
            return FLOAT
        held = self.kind(node.value)
        if isinstance(held, Record):
            return held.kind(node.attr)
        if isinstance(held, Fields):
            return held[held.names.index(node.attr)]
        return held if isinstance(held, Array) else FLOAT  # of an array its address, and of a complex number a part

    def _Subscript(self, node: ast.Subscript) -> Kind:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            self.kind(node.value.value)
            return INT
        held = self.kind(node.value)
        if isinstance(held, Array):
            for each in indices(node.slice):
                self.kind(each)
            return held.at(len(indices(node.slice)))
        assert isinstance(node.slice, ast.Constant), ast.unparse(node)
        self.kind(node.slice)
        return held[node.slice.value]

    def _BinOp(self, node: ast.BinOp) -> Kind:
        both = joined(self.kind(node.left), self.kind(node.right))
        return joined(both, FLOAT) if isinstance(node.op, ast.Div) else both

    def _UnaryOp(self, node: ast.UnaryOp) -> Kind:
        kind = self.kind(node.operand)
        return BOOL if isinstance(node.op, ast.Not) else kind

    def _BoolOp(self, node: ast.BoolOp) -> Kind:
        assert {self.kind(value) for value in node.values} == {BOOL}
        return BOOL

    def _Compare(self, node: ast.Compare) -> Kind:
        self.kind(node.left)
        for each in node.comparators:
            self.kind(each)
        return BOOL

    def _IfExp(self, node: ast.IfExp) -> Kind:
        self.kind(node.test)
        return joined(self.kind(node.body), self.kind(node.orelse))

    def _Tuple(self, node: ast.Tuple) -> Kind:
        return tuple(self.parts(node.elts))

    def _Call(self, node: ast.Call) -> Kind:
        kinds = self.parts(node.args)
        if isinstance(node.func, ast.Attribute):  # of math or numpy
            whole = isinstance(node.func.value, ast.Name) and node.func.value.id == "math"
            return OF_MATH.get(node.func.attr, FLOAT) if whole else FLOAT
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        if name in ("int", "complex"):
            return name
        if name == "len":
            return INT
        if name == "abs":
            return FLOAT if kinds[0] == COMPLEX else kinds[0]
        if name in ("min", "max"):
            return reduce(joined, kinds)
        kind = self.names[name][1] if name in self.names else None
        known = kind.compiled if isinstance(kind, Bound) else self.function.known[name]
        if isinstance(known, type):  # a named tuple
            order = [each.arg for each in node.keywords]
            node.args += [node.keywords[order.index(each)].value for each in known._fields[len(node.args) :]]  # type: ignore[attr-defined]
            node.keywords = []
            found = Fields(self.parts(node.args))
            found.names = known._fields  # type: ignore[attr-defined]
            return found
        if not any(isinstance(each, ast.Starred) for each in node.args):
            kinds = [Known(each.value) if is_truth(each) else kind for each, kind in zip(node.args, kinds, strict=True)]  # type: ignore[attr-defined]
        return self.called(node.func, known, kinds)


def is_truth(node: ast.expr) -> bool:
    """Whether an expression is True or False."""
    return isinstance(node, ast.Constant) and isinstance(node.value, bool)
