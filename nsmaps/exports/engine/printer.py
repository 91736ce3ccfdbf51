"""The engine as text of another language: what C and Julia have in common."""

import ast
from collections.abc import Iterable
from typing import Any

import numpy as np

from nsmaps.exports.engine.functions import Functions, numbered
from nsmaps.exports.engine.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    Array,
    Fields,
    Function,
    Kind,
    Record,
    passed,
    spelt,
)

Node = Any  #: of a syntax tree, which has the kind that was inferred
SIGNS: dict[type, tuple[str, int]] = {ast.Add: ("+", 5), ast.Sub: ("-", 5), ast.Mult: ("*", 6), ast.Div: ("/", 6)}
RELATIONS: dict[type, str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="
}  # fmt: skip
CHOICE, EITHER, BOTH, RELATION, UNARY, WHOLE = 0, 1, 2, 4, 7, 9  #: how tightly operators bind, sums 5 and products 6


class Language(Functions):
    """What a language says in its own way: its words, tuples, complex numbers and functions."""

    stop: str  #: the end of a statement
    arrow: str  #: between a record and its field
    opening: str  #: of a block, with its word and its condition
    elseif: str
    otherwise: str
    end: str  #: of a block

    def whole(self, function: Function) -> str:
        """A function whose lines are written."""
        raise NotImplementedError

    def tuple_of(self, nodes: list[Node], kind: Kind) -> tuple[str, int]:
        """Expressions as a tuple of this kind."""
        raise NotImplementedError

    def directions(self, node: Node, axis: int) -> str:
        """The same, of an axis that is as long as there are directions."""
        raise NotImplementedError

    def handed(self, nodes: list[Node], kinds: Iterable[Kind]) -> list[str]:
        """Expressions as values of these kinds, those of starred tuples too."""
        raise NotImplementedError

    def complex(self, real: str, imaginary: str) -> str:
        """A complex number from its parts."""
        raise NotImplementedError

    def of_complex(self, sign: ast.operator, left: Node, right: Node) -> tuple[str, int]:
        """A sum, difference, product or quotient of complex numbers, and how tightly it binds."""
        raise NotImplementedError

    def quotient(self, left: str, right: str) -> str:
        """The whole quotient of integers above zero."""
        raise NotImplementedError

    def counted(self, text: str) -> str:
        """One for a truth value that holds, otherwise zero."""
        raise NotImplementedError

    def library(self, name: str, node: Node) -> str:
        """What a function of `math`, `numpy` or Python is called in a call."""
        raise NotImplementedError


class Printer(Language):
    """The functions that some entries of the engine reach, callees first, and their text."""

    def __init__(self, own: dict[str, Kind]) -> None:
        """`own` is what those functions return that the program has in place of the engine's."""
        super().__init__(own)
        self.constants, self.fields = dict[str, Any](), dict[str, dict[str, Kind]]()
        self.helpers = dict[str, None]()  #: functions of the program that the text calls, in order
        self.function: Function
        self.lines, self.above, self.declared = list[str](), list[str](), set[str]()
        self.depth, self.count = 0, 0

    def texts(self) -> list[str]:
        """All functions, each after those that it calls."""
        return [self.text(function) for function in self.functions.values()]

    def text(self, function: Function) -> str:
        """One function."""
        self.function, self.lines, self.count = function, [], 0
        self.declared, self.above = set(function.arguments), list[str]()
        self.block(function.tree.body)
        return self.whole(function)

    def first(self, target: Node) -> str | None:
        """The name of a variable that an assignment declares; one that is first assigned in a block is declared above all."""
        name = getattr(target, "called", None)
        if name is None or name in self.declared:
            return None
        self.declared.add(name)
        if self.depth == 1:
            return name
        self.above.append(name)
        return None

    def put(self, line: str) -> None:
        self.lines.append("    " * self.depth + line)

    def block(self, statements: Iterable[ast.stmt]) -> None:
        """Statements, one level deeper."""
        self.depth += 1
        for statement in statements:
            getattr(self, f"_{type(statement).__name__}")(statement)
        self.depth -= 1

    def _Expr(self, node: Node) -> None:
        if not isinstance(node.value, ast.Constant):
            self.put(f"{self.value(node.value)}{self.stop}")

    def _Return(self, node: Node) -> None:
        value = f" {self.value(node.value, self.function.returns)}" if node.value else ""
        self.put(f"return{value}{self.stop}")

    def _If(self, node: Node, first: str = "if") -> None:
        self.put(self.opening.format(first, self.test(node.test)))
        self.block(node.body)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            return self._If(node.orelse[0], self.elseif)
        if node.orelse:
            self.put(self.otherwise)
            self.block(node.orelse)
        self.put(self.end)

    def _While(self, node: Node) -> None:
        self.put(self.opening.format("while", self.test(node.test)))
        self.block(node.body)
        self.put(self.end)

    def _Break(self, node: Node) -> None:
        self.put(f"break{self.stop}")

    def _Continue(self, node: Node) -> None:
        self.put(f"continue{self.stop}")

    def _AugAssign(self, node: Node) -> None:
        target = self.value(node.target)
        sign = "|" if isinstance(node.op, ast.BitOr) else SIGNS[type(node.op)][0]
        self.put(f"{target} {sign}= {self.value(node.value, node.target.kind)}{self.stop}")

    def value(self, node: Node, kind: Kind = None, binds: int = 0) -> str:
        """An expression as a value of a kind, its own by default, in parentheses where its surroundings bind tighter."""
        text, own = getattr(self, f"_{type(node).__name__}")(node, kind or node.kind)
        if kind == COMPLEX != node.kind:
            return self.complex(text, "0.0")
        return f"({text})" if own < binds else text

    def _Constant(self, node: Node, kind: Kind) -> tuple[str, int]:
        return self.literal(float(node.value) if kind == FLOAT else node.value), WHOLE

    def literal(self, value: Any) -> str:
        """A number or a truth value."""
        return str(value).lower() if isinstance(value, bool) else repr(value)

    def _Name(self, node: Node, kind: Kind) -> tuple[str, int]:
        if hasattr(node, "called"):
            return node.called, WHOLE
        value = self.function.known[node.id]
        for name in numbered(node.id):
            if name not in self.public and np.array_equal(self.constants.setdefault(name, value), value):
                return name, WHOLE
        raise AssertionError(node.id)

    def field(self, node: Node) -> str | None:
        """What a field of a record is called, or the array whose address is taken; None of an attribute of anything else."""
        record = node.value.kind
        if isinstance(record, Array):
            return self.value(node.value)
        if not isinstance(record, Record):
            return None
        assert not record.dropped, f"{record.name}.{node.attr} is read in {self.function.name}"
        if not isinstance(node.kind, Record):
            self.fields.setdefault(record.name, {})[node.attr] = node.kind
        if not record.fixed and node.attr in record.constant:
            return f"{record.name}_{spelt(node.attr)}"
        inside = record.name if record.fixed else self.value(node.value, None, WHOLE)
        return f"{inside}{'.' if record.fixed else self.arrow}{spelt(node.attr)}"

    def test(self, node: Node, binds: int = 0) -> str:
        """An expression as a truth value."""
        text = self.value(node, None, RELATION + 1 if node.kind == INT else binds)
        return f"{text} != 0" if node.kind == INT else text

    def _BinOp(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.kind == COMPLEX:
            return self.of_complex(node.op, node.left, node.right)
        if isinstance(node.op, ast.Pow):
            return self.power(node)
        if isinstance(node.op, ast.FloorDiv):
            return self.quotient(self.value(node.left, None, 6), self.value(node.right, None, 7)), 6
        sign, own = SIGNS[type(node.op)]
        inner = FLOAT if isinstance(node.op, ast.Div) else None
        if inner and node.left.kind == node.right.kind == INT:
            return f"{self.counted(self.value(node.left, None, UNARY))} / {self.number(node.right, inner, own + 1)}", own
        return f"{self.number(node.left, inner, own)} {sign} {self.number(node.right, inner, own + 1)}", own

    def power(self, node: Node) -> tuple[str, int]:
        """A whole power as products, in the order of numba."""
        base = self.value(node.left, None, UNARY)
        if isinstance(node.right, ast.Constant) and node.right.value in (2, 3):
            return base + " * " + (base if node.right.value == 2 else f"({base} * {base})"), 6
        assert node.right.kind == INT
        return f"{self.helper('whole_power')}({self.value(node.left)}, {self.value(node.right)})", WHOLE

    def helper(self, name: str) -> str:
        """A function that the program has besides those of the engine."""
        self.helpers[name] = None
        return name

    def number(self, node: Node, kind: Kind, binds: int) -> str:
        """A term or factor: a truth value counts as one or zero."""
        if node.kind == BOOL:
            return self.counted(self.value(node))
        return self.value(node, kind if isinstance(node, ast.Constant) else None, binds)

    def _UnaryOp(self, node: Node, kind: Kind) -> tuple[str, int]:
        inside = self.value(node.operand, None, UNARY)
        return ("!" if isinstance(node.op, ast.Not) else "-") + inside, UNARY

    def _BoolOp(self, node: Node, kind: Kind) -> tuple[str, int]:
        sign, own = ("&&", BOTH) if isinstance(node.op, ast.And) else ("||", EITHER)
        return f" {sign} ".join(self.value(each, None, RELATION) for each in node.values), own

    def _Compare(self, node: Node, kind: Kind) -> tuple[str, int]:
        (sign,), (right,) = node.ops, node.comparators
        return f"{self.value(node.left, None, 5)} {RELATIONS[type(sign)]} {self.value(right, None, 5)}", RELATION

    def _IfExp(self, node: Node, kind: Kind) -> tuple[str, int]:
        parts = (self.test(node.test, 1), self.value(node.body, kind, 1), self.value(node.orelse, kind, 1))
        return "{} ? {} : {}".format(*parts), CHOICE

    def _Call(self, node: Node, kind: Kind) -> tuple[str, int]:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
        if name == "complex":
            return self.complex(*map(self.value, node.args)), WHOLE
        if name == "len":
            return self.length(node.args[0], 0), WHOLE
        if isinstance(node.kind, Fields) and not hasattr(node.func, "called"):
            return self.tuple_of(node.args, kind)
        if hasattr(node.func, "called"):
            function = next(each for each in self.functions.values() if each.name == node.func.called)
            return f"{function.name}({', '.join(self.given_to(function, node.args))})", WHOLE
        if name in self.own:
            taken = [self.value(each) for each in node.args if not isinstance(each.kind, Record)]
            return f"{spelt(name)}({', '.join(taken)})", WHOLE
        called, taken = self.library(name, node), list(map(self.value, node.args))
        while name in ("min", "max") and len(taken) > 2:
            taken[:2] = [f"{called}({taken[0]}, {taken[1]})"]
        return f"{called}({', '.join(taken)})", WHOLE

    def given_to(self, function: Function, nodes: list[Node]) -> list[str]:
        """The arguments of a call."""
        kinds = list(function.arguments.values())
        if any(isinstance(each, ast.Starred) for each in nodes):
            return self.handed(nodes, kinds)
        pairs = [(node, kind) for node, kind in zip(nodes, kinds, strict=True) if passed(kind)]
        return self.handed([node for node, _ in pairs], [kind for _, kind in pairs])

    def _Tuple(self, node: Node, kind: Kind) -> tuple[str, int]:
        return self.tuple_of(node.elts, kind)

    def length(self, node: Node, axis: int) -> str:
        """How long an array is along an axis."""
        size = node.kind.shape[axis]
        return str(size) if size or node.kind.fixed else self.directions(node, axis)


def about(function: Function) -> str:
    """The docstring of a function, on one line."""
    return " ".join((ast.get_docstring(function.tree) or "").split())


def range_of(node: Node) -> tuple[Node | None, Node, int]:
    """Where a loop over a range begins, None for zero, its end, and its step."""
    args = node.iter.args
    if len(args) == 1:
        return None, args[0], 1
    return args[0], args[1], ast.literal_eval(args[2]) if len(args) == 3 else 1
