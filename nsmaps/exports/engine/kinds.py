"""The kinds of the values of the engine: inferred from those of the arguments, and written into its syntax trees.

The engine is written in the part of Python that this module knows: floats, integers, truth values, complex numbers, tuples of
these, and the two arrays of a flow; assignments, conditions, loops over a range, and calls. Each name has one kind in a block.
"""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from nsmaps.exports.engine.names import spelt

Kind = Any  #: one of the following, or a tuple of kinds
FLOAT, INT, BOOL, COMPLEX, FLOW = "float", "int", "bool", "complex", "flow"
ARRAYS = ("table", "flight")  #: of a flow: the numbers of the system, the coefficients of the flight
CONSTANTS = (bool, int, float)
SHORT = {BOOL: 0, INT: 1, FLOAT: 2, COMPLEX: 3}
Names = dict[str, tuple[str, Kind]]  #: of variables: what they are called in the program, and their kind


@dataclass(slots=True)
class Function:
    """One function: its tree, whose nodes learn their kinds, its variables, and the names that its module knows."""

    name: str
    tree: ast.FunctionDef
    known: dict[str, Any]
    arguments: dict[str, Kind]  #: by the name in the program, in order
    variables: dict[str, Kind]  #: other than arguments, by the name in the program
    returns: Kind = ""


def joined(one: Kind, other: Kind) -> Kind:
    """The kind that holds values of both."""
    if isinstance(one, tuple) and isinstance(other, tuple):
        return tuple(joined(a, b) for a, b in zip(one, other, strict=True))
    if one == other:
        return one
    return max(one, other, key=lambda kind: SHORT[kind])


def holds(one: Kind, other: Kind) -> bool:
    """True if a variable of the first kind can be given a value of the second."""
    return one == other or (one, other) == (FLOAT, INT)


class Inference:
    """The kinds within one function; `called` answers what a call returns, by its name, function and the arguments' kinds."""

    def __init__(self, function: Function, called: Callable[[str, Any, list[Kind]], Kind]) -> None:
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

    def _Return(self, node: ast.Return) -> None:
        assert node.value is not None
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
            if not (branch and isinstance(branch[-1], ast.Return | ast.Break)):
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
        before = dict(self.names)
        self.block(node.body)
        assert all(self.names[name] == before[name] for name in before), "a name has two kinds"

    def kind(self, node: ast.expr) -> Kind:
        """The kind of an expression, which its node keeps."""
        node.kind = getattr(self, f"_{type(node).__name__}")(node)  # type: ignore[attr-defined]
        return node.kind  # type: ignore[attr-defined]

    def parts(self, nodes: Sequence[ast.expr]) -> list[Kind]:
        """The kinds of expressions, those of a starred tuple one by one."""
        found: list[Kind] = []
        for node in nodes:
            found += self.kind(node.value) if isinstance(node, ast.Starred) else [self.kind(node)]
        return found

    def _Constant(self, node: ast.Constant) -> Kind:
        return type(node.value).__name__

    def _Name(self, node: ast.Name) -> Kind:
        if node.id in self.names:
            node.called, kind = self.names[node.id]  # type: ignore[attr-defined]
            return kind
        value = self.function.known[node.id]
        assert isinstance(value, CONSTANTS), node.id
        return type(value).__name__

    def _Attribute(self, node: ast.Attribute) -> Kind:
        if node.attr in ("inf", "nan"):
            return FLOAT
        self.kind(node.value)
        return node.attr if node.attr in ARRAYS else FLOAT

    def _Subscript(self, node: ast.Subscript) -> Kind:
        held = self.kind(node.value)
        self.kind(node.slice)
        if held in ARRAYS:
            return FLOAT
        assert isinstance(node.slice, ast.Constant)
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
            return FLOAT
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        if name in ("int", "complex"):
            return name
        if name == "abs":
            return FLOAT if kinds[0] == COMPLEX else kinds[0]
        if name in ("min", "max"):
            return joined(*kinds)
        return self.called(name, self.function.known[name], kinds)
