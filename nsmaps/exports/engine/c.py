"""The engine as C99: tuples are structures, complex numbers too, and variables are declared on top of a function."""

import ast
from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

from nsmaps.exports.engine.kinds import ARRAYS, BOOL, COMPLEX, FLOAT, FLOW, INT, Function, Kind
from nsmaps.exports.engine.printer import SIGNS, WHOLE, Node, Printer
from nsmaps.exports.engine.source import about

TYPES = {FLOAT: "double ", INT: "int64_t ", BOOL: "bool ", COMPLEX: "complex_number ", FLOW: "const flow *"}
TYPES |= {"table": "const double *", "flight": "double *"}
LETTERS = {FLOAT: "d", INT: "i", BOOL: "b", COMPLEX: "c"}
LIBRARY = {"min": "smaller", "max": "larger", "int": "(int64_t)", "hypot": "hypot"}


class CPrinter(Printer):
    """C99."""

    stop = ";"

    def __init__(self, own: dict[str, Kind]) -> None:
        super().__init__(own)
        self.structures: dict[str, Kind] = {}

    def type_of(self, kind: Kind) -> str:
        """The type of a kind, to be followed by a name."""
        return f"{self.structure(kind)} " if isinstance(kind, tuple) else TYPES[kind] if kind else "void "

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
        taken = ", ".join(self.type_of(kind) + name for name, kind in function.arguments.items())
        head = f"static {self.type_of(function.returns)}{function.name}({taken})"
        kinds = {name: self.type_of(function.variables[name]) for name in self.above}
        sorts = {kind: [name for name in kinds if kinds[name] == kind] for kind in kinds.values()}
        own = [f"    {kind}{', '.join(names)};" for kind, names in sorts.items()]
        read = {each.called for each in ast.walk(function.tree) if hasattr(each, "called")}
        unused = [f"    (void){name};" for name in function.arguments if name not in read]
        comment = fill(about(function).replace("*/", "* /"), 116, subsequent_indent="   ")
        return "\n".join([f"/* {comment} */", head, "{", *own, *unused, *self.lines, "}", ""])

    def given(self, target: Node, text: str) -> None:
        """An assignment; a variable is declared by its first one, or on top of the function if that is in a block."""
        name = self.first(target)
        self.put(f"{self.type_of(self.function.variables[name]) if name else ''}{self.value(target)} = {text};")

    def _Expr(self, node: Node) -> None:
        if not isinstance(node.value, ast.Constant):
            self.put(f"{self.value(node.value)};")

    def _Return(self, node: Node) -> None:
        assert node.value is not None
        self.put(f"return {self.value(node.value, self.function.returns)};")

    def _If(self, node: Node, first: str = "if") -> None:
        self.put(f"{first} ({self.value(node.test)}) {{")
        self.block(node.body)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            return self._If(node.orelse[0], "} else if")
        if node.orelse:
            self.put("} else {")
            self.block(node.orelse)
        self.put("}")

    def _For(self, node: Node) -> None:
        low, high = (["0"] + [self.value(each) for each in node.iter.args])[-2:]
        name = getattr(node.target, "called", "count")
        self.put(f"for (int64_t {name} = {low}; {name} < {high}; ++{name}) {{")
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
            return FLOAT
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

    def _Tuple(self, node: Node, kind: Kind) -> tuple[str, int]:
        return f"({self.structure(kind)}){{{', '.join(self.handed(node.elts, kind))}}}", WHOLE

    def _Attribute(self, node: Node, kind: Kind) -> tuple[str, int]:
        if node.attr in ("inf", "nan"):
            return {"inf": "INFINITY", "nan": "NAN"}[node.attr], WHOLE
        inside = self.value(node.value, None, WHOLE)
        return (f"{inside}->{node.attr}" if node.value.kind == FLOW else f"{inside}.{node.attr[:2]}"), WHOLE

    def _Subscript(self, node: Node, kind: Kind) -> tuple[str, int]:
        inside, at = self.value(node.value), self.value(node.slice)
        return (f"{inside}[{at}]" if node.value.kind in ARRAYS else f"{inside}.m{at}"), WHOLE

    def literal(self, value: Any) -> str:
        if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 2**31:
            return f"INT64_C({value})"
        return super().literal(value)

    def complex(self, real: str, imaginary: str) -> str:
        return f"(complex_number){{{real}, {imaginary}}}"

    def of_complex(self, sign: ast.operator, left: Node, right: Node) -> tuple[str, int]:
        name = {"+": "sum", "-": "difference", "*": "product", "/": "quotient"}[SIGNS[type(sign)][0]]
        return f"complex_{name}({self.value(left, COMPLEX)}, {self.value(right, COMPLEX)})", WHOLE

    def quotient(self, left: str, right: str) -> str:
        return f"{left} / {right}"

    def counted(self, text: str) -> str:
        return f"(double){text}"

    def library(self, name: str, kind: Kind) -> str:
        if name == "abs":
            return "complex_size" if kind == COMPLEX else "fabs"
        return LIBRARY.get(name, name)


def _stands_in(text: str, other: str) -> bool:
    """True if a variable or an entry of an array stands in a text."""
    at = other.find(text)
    while at >= 0:
        before, after = other[at - 1 : at], other[at + len(text) : at + len(text) + 1]
        if not (before.isalnum() or before in ("_", ".")) and not (after.isalnum() or after == "_"):
            return True
        at = other.find(text, at + 1)
    return False
