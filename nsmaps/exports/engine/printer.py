"""The engine as text of another language: what C and Julia have in common."""

import ast
from collections.abc import Iterable
from typing import Any

from nsmaps.exports.engine.kinds import BOOL, COMPLEX, FLOAT, Function, Inference, Kind
from nsmaps.exports.engine.names import spelt
from nsmaps.exports.engine.source import function_of

Node = Any  #: of a syntax tree, which has the kind that was inferred
SIGNS: dict[type, tuple[str, int]] = {ast.Add: ("+", 5), ast.Sub: ("-", 5), ast.Mult: ("*", 6), ast.Div: ("/", 6)}
RELATIONS: dict[type, str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="
}  # fmt: skip
CHOICE, EITHER, BOTH, RELATION, UNARY, WHOLE = 0, 1, 2, 4, 7, 9  #: how tightly operators bind, sums 5 and products 6


class Printer:
    """The functions that some entries of the engine reach, callees first, and their text."""

    stop: str  #: the end of a statement

    def __init__(self, own: dict[str, Kind]) -> None:
        """`own` is what those functions return that the program has in place of the engine's."""
        self.own, self.functions, self.constants = own, dict[str, Function](), dict[str, Any]()
        self.function: Function
        self.lines, self.above, self.declared = list[str](), list[str](), set[str]()
        self.depth, self.count = 0, 0

    def reach(self, name: str, compiled: Any, kinds: list[Kind]) -> Kind:
        """What a function returns; it and all that it calls are kept."""
        if name in self.own:
            return self.own[name]
        if name not in self.functions:
            function = function_of(compiled, kinds)
            Inference(function, self.reach)
            self.functions[name] = function
        known = self.functions[name]
        assert list(known.arguments.values()) == kinds, f"{name}: {kinds}"
        return known.returns

    def texts(self) -> list[str]:
        """All functions, each after those that it calls."""
        return [self.text(function) for function in self.functions.values()]

    def text(self, function: Function) -> str:
        """One function."""
        self.function, self.lines, self.count = function, [], 0
        self.declared, self.above = set(function.arguments), list[str]()
        self.block(function.tree.body)
        return self.whole(function)

    def whole(self, function: Function) -> str:
        """A function whose lines are written."""
        raise NotImplementedError

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

    def _Break(self, node: Node) -> None:
        self.put(f"break{self.stop}")

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
        assert self.constants.setdefault(node.id, value) == value, node.id
        return node.id, WHOLE

    def _BinOp(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.kind == COMPLEX:
            return self.of_complex(node.op, node.left, node.right)
        if isinstance(node.op, ast.Pow):
            assert isinstance(node.right, ast.Constant)
            power, base = node.right.value, self.value(node.left, None, UNARY)
            assert power in (2, 3)
            return base + " * " + (base if power == 2 else f"({base} * {base})"), 6
        if isinstance(node.op, ast.FloorDiv):
            return self.quotient(self.value(node.left, None, 6), self.value(node.right, None, 7)), 6
        sign, own = SIGNS[type(node.op)]
        inner = FLOAT if isinstance(node.op, ast.Div) else None
        return f"{self.number(node.left, inner, own)} {sign} {self.number(node.right, inner, own + 1)}", own

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
        parts = (self.value(node.test, None, 1), self.value(node.body, kind, 1), self.value(node.orelse, kind, 1))
        return "{} ? {} : {}".format(*parts), CHOICE

    def _Call(self, node: Node, kind: Kind) -> tuple[str, int]:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
        if name == "complex":
            return self.complex(*map(self.value, node.args)), WHOLE
        if name in self.functions or name in self.own:
            expected = list(self.functions[name].arguments.values()) if name in self.functions else [None] * len(node.args)
            return f"{spelt(name)}({', '.join(self.handed(node.args, expected))})", WHOLE
        taken = ", ".join(self.value(each, None) for each in node.args)
        called = self.library(name, node.args[0].kind)
        return f"{called}({taken})", WHOLE

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

    def library(self, name: str, kind: Kind) -> str:
        """What a function of `math`, `numpy` or Python is called."""
        raise NotImplementedError
