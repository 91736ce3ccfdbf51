"""The engine as Julia: tuples and complex numbers are its own, entries of arrays and tuples are counted from one."""

import ast
from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

from nsmaps.exports.engine.kinds import COMPLEX, FLOW, Function, Kind
from nsmaps.exports.engine.printer import SIGNS, WHOLE, Node, Printer
from nsmaps.exports.engine.source import about

LIBRARY = {"min": "smaller", "max": "larger", "int": "whole_part", "sqrt": "square_root"}


class JuliaPrinter(Printer):
    """Julia."""

    stop = ""

    def whole(self, function: Function) -> str:
        head = f"function {function.name}({', '.join(function.arguments)})"
        own = [f"    local {', '.join(self.above)}"] if self.above else []
        text = about(function).replace("\\", "\\\\").replace('"', '\\"').replace("$", "\\$")
        return "\n".join([fill(f'"{text}"', 120), head, *own, *self.lines, "end", ""])

    def _Expr(self, node: Node) -> None:
        if not isinstance(node.value, ast.Constant):
            self.put(self.value(node.value))

    def _Return(self, node: Node) -> None:
        assert node.value is not None
        self.put(f"return {self.value(node.value, self.function.returns)}")

    def _If(self, node: Node, first: str = "if") -> None:
        self.put(f"{first} {self.value(node.test)}")
        self.block(node.body)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            return self._If(node.orelse[0], "elseif")
        if node.orelse:
            self.put("else")
            self.block(node.orelse)
        self.put("end")

    def _For(self, node: Node) -> None:
        *low, high = node.iter.args
        name = getattr(node.target, "called", "_")
        self.put(f"for {name} in {self.value(low[0]) if low else '0'}:{self.shifted(high, -1)}")
        self.block(node.body)
        self.put("end")

    def _Assign(self, node: Node) -> None:
        target, value = node.targets[0], node.value
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        for each in targets:
            self.first(each)
        names = [self.value(each) if hasattr(each, "kind") else "_" for each in targets]
        texts = self.handed(value.elts, []) if isinstance(value, ast.Tuple) and len(targets) > 1 else [self.value(value)]
        self.put(f"{', '.join(names)} = {', '.join(texts)}")

    def handed(self, nodes: Sequence[Node], kinds: Iterable[Kind]) -> list[str]:
        """Expressions, starred ones as they are: values are converted by Julia."""
        return [f"{self.value(node.value)}..." if isinstance(node, ast.Starred) else self.value(node) for node in nodes]

    def shifted(self, node: Node, by: int) -> str:
        """An integer expression plus a constant."""
        if isinstance(node, ast.Constant):
            return f"{int(node.value) + by}"  # type: ignore[arg-type]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) and isinstance(node.right, ast.Constant):
            return f"{self.value(node.left)}{_signed(int(node.right.value) + by)}"  # type: ignore[arg-type]
        return f"{self.value(node)}{_signed(by)}"

    def _Tuple(self, node: Node, kind: Kind) -> tuple[str, int]:
        return f"({', '.join(self.handed(node.elts, kind))})", WHOLE

    def _Attribute(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.attr in ("inf", "nan"):
            return {"inf": "Inf", "nan": "NaN"}[node.attr], WHOLE
        inside = self.value(node.value, None, WHOLE)
        return f"{inside}.{node.attr if node.value.kind == FLOW else node.attr[:2]}", WHOLE

    def _Subscript(self, node: Node, kind: Kind) -> tuple[str, int]:
        return f"{self.value(node.value, None, WHOLE)}[{self.shifted(node.slice, 1)}]", WHOLE

    def literal(self, value: Any) -> str:
        return super().literal(value).replace("e+", "e")

    def complex(self, real: str, imaginary: str) -> str:
        return f"complex({real}, {imaginary})"

    def of_complex(self, sign: ast.operator, left: Node, right: Node) -> tuple[str, int]:
        text, own = SIGNS[type(sign)]
        if text == "/":
            return f"complex_quotient({self.value(left, COMPLEX)}, {self.value(right, COMPLEX)})", WHOLE
        return f"{self.value(left, COMPLEX, own)} {text} {self.value(right, COMPLEX, own + 1)}", own

    def quotient(self, left: str, right: str) -> str:
        return f"div({left}, {right})"

    def counted(self, text: str) -> str:
        return f"Float64({text})"

    def library(self, name: str, kind: Kind) -> str:
        return LIBRARY.get(name, name)


def _signed(value: int) -> str:
    return f" + {value}" if value > 0 else f" - {-value}" if value < 0 else ""
