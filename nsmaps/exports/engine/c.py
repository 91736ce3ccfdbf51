"""The engine as C99: tuples are structures, complex numbers too, and variables are declared on top of a function."""

import ast
import re
from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

import numpy as np

from nsmaps.exports.engine.kinds import BOOL, COMPLEX, FLOAT, INT, OPEN, Array, Fields, Function, Kind, Record, array_of, passed
from nsmaps.exports.engine.printer import SIGNS, WHOLE, Node, Printer, about, range_of
from nsmaps.exports.engine.pruning import indices

TYPES = {FLOAT: "double ", INT: "int64_t ", BOOL: "bool ", COMPLEX: "complex_number "}
LETTERS = {FLOAT: "d", INT: "i", BOOL: "b", COMPLEX: "c"}
LIBRARY = {"int": "(int64_t)"}
HELPERS = {("min", FLOAT): "smaller", ("max", FLOAT): "larger", ("min", INT): "smaller_whole", ("max", INT): "larger_whole"}
DIRECTIONS = "directions"  #: how many directions of derivatives there are


class CPrinter(Printer):
    """C99."""

    stop, arrow = ";", "->"
    opening, elseif, otherwise, end = "{} ({}) {{", "} else if", "} else {", "}"

    def __init__(self, own: dict[str, Kind], max_directions: int = 0) -> None:
        """With room for at most so many directions of derivatives."""
        super().__init__(own)
        self.structures: dict[str, Kind] = {}
        self.max_directions = max_directions

    def type_of(self, kind: Kind) -> str:
        """The type of a kind, to be followed by a name."""
        return f"{self.structure(kind)} " if isinstance(kind, tuple) else TYPES[kind] if kind else "void "

    def variable(self, kind: Kind, name: str) -> str:
        """The declaration of a variable or an argument; arrays are pointers."""
        if isinstance(kind, Record):
            return f"{kind.name} *{name}"
        if not isinstance(kind, Array):
            return self.type_of(kind) + name
        pointer = f"(*{name}){self.extents(kind.shape[1:])}" if len(kind.shape) > 1 else f"*{name}"
        return f"{'const ' * kind.fixed}{TYPES[kind.of]}{pointer}"

    def extents(self, shape: Sequence[int]) -> str:
        """A shape behind the name of an array."""
        return "".join(f"[{size or self.max_directions}]" for size in shape)

    def member(self, kind: Kind, name: str) -> str:
        """The declaration of a number or an array that holds its entries."""
        if isinstance(kind, Array):
            return f"{TYPES[kind.of]}{name}{self.extents(kind.shape)}"
        return self.type_of(kind) + name

    def constant(self, name: str, value: Any) -> str:
        """The definition of a constant."""
        if not isinstance(value, np.ndarray):
            return f"#define {name} {self.literal(value)}"
        return f"static const {self.member(array_of(value, True), name)} = {self.entries(value)};"

    def entries(self, value: Any) -> str:
        """A number or an array as initial value."""
        if not isinstance(value, np.ndarray):
            return value.hex() if isinstance(value, float) else self.literal(value)
        if value.ndim > 1:
            return "{\n" + ",\n".join(map(self.entries, value)) + "\n}"
        return fill("{" + ", ".join(map(self.entries, value.tolist())) + "}", 126, break_on_hyphens=False)

    def structure(self, kind: Sequence[Kind]) -> str:
        """The name of the structure of a tuple, whose members are m0, m1, ...; those within it are kept before it."""
        parts = [self.structure(each) if isinstance(each, tuple) else LETTERS[each] for each in kind]
        name = "tuple_" + "".join(part.replace("tuple_", "_") + "_" if "_" in part else part for part in parts).strip("_")
        self.structures.setdefault(name, tuple(kind))
        return name

    def structures_text(self) -> str:
        """The declarations of all structures that were named so far."""
        rows = []
        for name, kind in self.structures.items():
            members = " ".join(f"{self.type_of(each)}m{k};" for k, each in enumerate(kind))
            rows.append(f"typedef struct {{ {members} }} {name};")
        return "\n".join(rows)

    def whole(self, function: Function) -> str:
        kept = [(name, kind) for name, kind in function.arguments.items() if passed(kind)]
        taken = [self.variable(kind, name) for name, kind in kept] + [f"int64_t {DIRECTIONS}"] * open_shapes(function)
        head = f"static {self.type_of(function.returns)}{function.name}({', '.join(taken)})"
        own = [f"    {self.variable(function.variables[name], name)};" for name in self.above]
        body = "\n".join(self.lines)
        unused = [f"    (void){name};" for name, _ in kept if not re.search(rf"\b{name}\b", body)]
        return "\n".join([self.comment(function), head, "{", *own, *unused, body, "}", ""])

    def comment(self, function: Function) -> str:
        """The docstring of a function as a comment."""
        return f"/* {fill(about(function).replace('*/', '* /'), 116, subsequent_indent='   ')} */"

    def given(self, target: Node, text: str) -> None:
        """An assignment; a variable is declared by its first one, or on top of the function if that is in a block."""
        name = self.first(target)
        self.put(f"{self.variable(self.function.variables[name], name) if name else self.value(target)} = {text};")

    def _For(self, node: Node) -> None:
        low, high, by = range_of(node)
        name = getattr(node.target, "called", "count")
        start = f"{self.variable(INT, name)} = {self.value(low) if low else 0}"
        step = f"++{name}" if by == 1 else f"{name} += {by}" if by > 0 else f"{name} -= {-by}"
        self.put(f"for ({start}; {name} {'<' if by > 0 else '>'} {self.value(high, None, 5)}; {step}) {{")
        self.block(node.body)
        self.put("}")

    def _Assign(self, node: Node) -> None:
        target, value = node.targets[0], node.value
        if not isinstance(target, ast.Tuple):
            return self.given(target, self.value(value, self.kind_of(target)))
        if not isinstance(value, ast.Tuple):
            held = self.held(value)
            values = [f"{held}.m{k}" for k in range(len(target.elts))]
        else:
            values = self.handed(value.elts, map(self.kind_of, target.elts))
            values = self.beforehand(target.elts, values)
        for each, text in zip(target.elts, values, strict=True):
            if self.kind_of(each) is not None:
                self.given(each, text)

    def beforehand(self, targets: Sequence[Node], values: list[str]) -> list[str]:
        """Values that are read before the targets are written: by names of their own where one target stands in a later value."""
        kinds = [self.kind_of(each) for each in targets]
        texts = [self.value(each) if kind is not None else "_" for each, kind in zip(targets, kinds, strict=True)]
        if not any(_stands_in(text, later) for k, text in enumerate(texts) for later in values[k + 1 :]):
            return values
        return [self.named(kind or FLOAT, value) for kind, value in zip(kinds, values, strict=True)]

    def kind_of(self, target: Node) -> Kind:
        """The kind of what is assigned to, None for a value that is not kept."""
        if not isinstance(target, ast.Name):
            return target.kind
        called = getattr(target, "called", None)
        return ({**self.function.arguments, **self.function.variables})[called] if called else None

    def held(self, node: Node) -> str:
        """The name of a variable that holds a tuple."""
        return getattr(node, "called", None) or self.named(node.kind, self.value(node))

    def named(self, kind: Kind, text: str) -> str:
        """A new variable with this value."""
        self.count += 1
        self.put(f"const {self.type_of(kind)}got{self.count} = {text};")
        return f"got{self.count}"

    def handed(self, nodes: Sequence[Node], kinds: Iterable[Kind]) -> list[str]:
        """Expressions as values of these kinds, those of starred tuples too."""
        found, kinds = list[str](), iter(kinds)
        each: Node
        for each in nodes:
            if isinstance(each, ast.Starred):
                whole: Node = each.value
                held = self.held(whole)
                found += [f"{held}.m{k}" for k, _ in zip(range(len(whole.kind)), kinds, strict=False)]
            else:
                found.append(self.value(each, next(kinds)))
        return found

    def tuple_of(self, nodes: list[Node], kind: Kind) -> tuple[str, int]:
        return f"({self.structure(kind)}){{{', '.join(self.handed(nodes, kind))}}}", WHOLE

    def _Attribute(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.attr in ("inf", "nan"):
            return {"inf": "INFINITY", "nan": "NAN"}[node.attr], WHOLE
        if (field := self.field(node)) is not None:
            return field, WHOLE
        part = f"m{node.value.kind.names.index(node.attr)}" if isinstance(node.value.kind, Fields) else node.attr[:2]
        return f"{self.value(node.value, None, WHOLE)}.{part}", WHOLE

    def _Subscript(self, node: Node, kind: Kind) -> tuple[str, int]:
        if getattr(node.value, "attr", "") == "shape":
            return self.length(node.value.value, node.slice.value), WHOLE
        inside = self.value(node.value, None, WHOLE)
        if not isinstance(node.value.kind, Array):
            return f"{inside}.m{self.value(node.slice)}", WHOLE
        return inside + "".join(f"[{self.value(each)}]" for each in indices(node.slice)), WHOLE

    def directions(self, node: Node, axis: int) -> str:
        records = [name for name, kind in self.function.arguments.items() if isinstance(kind, Record) and not kind.fixed]
        return f"{records[0]}->{DIRECTIONS}" if records else DIRECTIONS

    def given_to(self, function: Function, nodes: list[Node]) -> list[str]:
        return [*super().given_to(function, nodes), *[self.directions(nodes[0], 0)] * open_shapes(function)]

    def literal(self, value: Any) -> str:
        if isinstance(value, float) and not np.isfinite(value):
            return "NAN" if value != value else "INFINITY" if value > 0 else "-INFINITY"
        if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 2**31:
            return f"INT64_C({value})"
        return super().literal(value)

    def complex(self, real: str, imaginary: str) -> str:
        return f"(complex_number){{{real}, {imaginary}}}"

    def of_complex(self, sign: ast.operator, left: Node, right: Node) -> tuple[str, int]:
        name = {"+": "sum", "-": "difference", "*": "product", "/": "quotient"}[SIGNS[type(sign)][0]]
        called = self.helper(f"complex_{name}")
        return f"{called}({self.value(left, COMPLEX)}, {self.value(right, COMPLEX)})", WHOLE

    def quotient(self, left: str, right: str) -> str:
        return f"{left} / {right}"

    def counted(self, text: str) -> str:
        return f"(double){text}"

    def library(self, name: str, node: Node) -> str:
        if name == "abs":
            return self.helper("complex_size") if node.args[0].kind == COMPLEX else "fabs"
        if name in ("min", "max"):
            return self.helper(HELPERS[name, node.kind])
        return f"({TYPES[INT].strip()}){name}" if (name, node.kind) == ("floor", INT) else LIBRARY.get(name, name)


def open_shapes(function: Function) -> bool:
    """Whether a function takes arrays by directions of derivatives, and no memory that says how many there are."""
    kinds = function.arguments.values()
    memory = any(isinstance(kind, Record) and not kind.fixed for kind in kinds)
    return not memory and any(isinstance(kind, Array) and not kind.fixed and OPEN in kind.shape for kind in kinds)


def _stands_in(text: str, other: str) -> bool:
    """True if a variable or an entry of an array stands in a text."""
    at = other.find(text)
    while at >= 0:
        before, after = other[at - 1 : at], other[at + len(text) : at + len(text) + 1]
        if not (before.isalnum() or before in ("_", ".")) and not (after.isalnum() or after == "_"):
            return True
        at = other.find(text, at + 1)
    return False
