"""The engine as Julia: tuples and complex numbers are its own, entries of arrays and tuples are counted from one."""

import ast
from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

import numpy as np

from nsmaps.exports.engine.kinds import COMPLEX, INT, Array, Fields, Function, Kind, passed
from nsmaps.exports.engine.printer import SIGNS, WHOLE, Node, Printer, about, range_of
from nsmaps.exports.engine.pruning import indices

LIBRARY = {"min": "smaller", "max": "larger", "int": "whole_part", "sqrt": "square_root"}
TYPES = {"f": "Float64", "i": "Int64", "b": "Bool"}


class JuliaPrinter(Printer):
    """Julia."""

    stop, arrow = "", "."
    opening, elseif, otherwise, end = "{} {}", "elseif", "else", "end"

    def constant(self, name: str, value: Any) -> str:
        """The definition of a constant."""
        return f"const {name} = {self.entries(value)}"

    def entries(self, value: Any) -> str:
        """A number, or an array whose last axis comes first, as the entries of one follow one another in memory."""
        if not isinstance(value, np.ndarray):
            return self.literal(value)
        numbers = ", ".join(map(self.literal, value.ravel().tolist()))
        text = fill(f"{TYPES[value.dtype.kind]}[{numbers}]", 126, break_on_hyphens=False)
        return f"reshape({text}, {', '.join(map(str, reversed(value.shape)))})" if value.ndim > 1 else text

    def whole(self, function: Function) -> str:
        taken = [name for name, kind in function.arguments.items() if passed(kind)]
        head = f"function {function.name}({', '.join(taken)})"
        own = [f"    local {', '.join(self.above)}"] if self.above else []
        text = about(function).replace("\\", "\\\\").replace('"', '\\"').replace("$", "\\$")
        return "\n".join([fill(f'"{text}"', 120), head, *own, *self.lines, "end", ""])

    def _For(self, node: Node) -> None:
        low, high, by = range_of(node)
        name, step = getattr(node.target, "called", "_"), "" if by == 1 else f"{by}:"
        self.put(f"for {name} in {self.value(low, None, 1) if low else 0}:{step}{self.shifted(high, -1 if by > 0 else 1)}")
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
        return f"{self.value(node, None, 5)}{_signed(by)}"

    def tuple_of(self, nodes: list[Node], kind: Kind) -> tuple[str, int]:
        return f"({', '.join(self.handed(nodes, kind))})", WHOLE

    def _Attribute(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.attr in ("inf", "nan"):
            return {"inf": "Inf", "nan": "NaN"}[node.attr], WHOLE
        if (field := self.field(node)) is not None:
            return field, WHOLE
        inside = self.value(node.value, None, WHOLE)
        if isinstance(node.value.kind, Fields):
            return f"{inside}[{node.value.kind.names.index(node.attr) + 1}]", WHOLE
        return f"{inside}.{node.attr[:2]}", WHOLE

    def _Subscript(self, node: Node, kind: Kind) -> tuple[str, int]:
        if getattr(node.value, "attr", "") == "shape":
            return self.length(node.value.value, node.slice.value), WHOLE
        inside, at = self.value(node.value, None, WHOLE), [self.shifted(each, 1) for each in reversed(indices(node.slice))]
        if isinstance(node.kind, Array):
            return f"view({inside}, {', '.join([':'] * len(node.kind.shape) + at)})", WHOLE
        return f"{inside}[{', '.join(at)}]", WHOLE

    def directions(self, node: Node, axis: int) -> str:
        return f"Base.size({self.value(node)}, {len(node.kind.shape) - axis})"

    def literal(self, value: Any) -> str:
        return super().literal(value).replace("e+", "e").replace("inf", "Inf").replace("nan", "NaN")

    def complex(self, real: str, imaginary: str) -> str:
        return f"complex({real}, {imaginary})"

    def of_complex(self, sign: ast.operator, left: Node, right: Node) -> tuple[str, int]:
        text, own = SIGNS[type(sign)]
        if text == "/":
            return f"{self.helper('complex_quotient')}({self.value(left, COMPLEX)}, {self.value(right, COMPLEX)})", WHOLE
        return f"{self.value(left, COMPLEX, own)} {text} {self.value(right, COMPLEX, own + 1)}", own

    def quotient(self, left: str, right: str) -> str:
        return f"div({left}, {right})"

    def counted(self, text: str) -> str:
        return f"Float64({text})"

    def library(self, name: str, node: Node) -> str:
        return "whole_floor" if (name, node.kind) == ("floor", INT) else LIBRARY.get(name, name)


def _signed(value: int) -> str:
    return f" + {value}" if value > 0 else f" - {-value}" if value < 0 else ""
