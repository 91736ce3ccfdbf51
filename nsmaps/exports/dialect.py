"""Conditions of regions as source text of other languages, deciding as `Region.contains` does."""

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Angle
from nsmaps.reduced.reader import FUNCTIONS, Reader
from nsmaps.reduced.region import Box, Region, Where

OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.UAdd: "+",
    ast.USub: "-",
}


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language writes what a condition is made of."""

    name: str
    both: str
    either: str
    negate: str
    power: str = "{} ** {}"
    functions: Mapping[str, str] | None = None  #: by name, where they are called otherwise
    operators: Mapping[str, str] | None = None  #: by python's, where they are written otherwise

    def condition(self, region: Region, names: Mapping[str, str]) -> str:
        """The condition of a region on variables of the given names, by coordinate; `near(x, middle)` is the nearest turn.

        NsmapsError for a region of one's own, whose `contains` is python.
        """
        if isinstance(region, Box):
            return self._joined(
                self.both, [self._interval(name, names[name], *region.bounds[name]) for name in region.coordinates]
            )
        if not isinstance(region, Where):
            raise NsmapsError(f"the condition of a {type(region).__name__} in {self.name}; accepted: regions Box and Where")
        reader = Reader("condition", region.text, tuple(region.coordinates))
        return self._test(reader, reader.tree(), names)

    def _interval(self, name: str, variable: str, low: float, high: float) -> str:
        x = f"near({variable}, {number((low + high) / 2)})" if isinstance(name, Angle) else variable
        return self._joined(self.both, [f"({number(low)} <= {x})", f"({x} <= {number(high)})"])

    def _joined(self, sign: str, parts: list[str]) -> str:
        return parts[0] if len(parts) == 1 else f"({f' {sign} '.join(parts)})"

    def _test(self, reader: Reader, node: ast.expr, names: Mapping[str, str]) -> str:
        match node:
            case ast.BoolOp():
                sign = self.both if isinstance(node.op, ast.And) else self.either
                return self._joined(sign, [self._test(reader, part, names) for part in node.values])
            case ast.UnaryOp(op=ast.Not()):
                return f"{self.negate}({self._test(reader, node.operand, names)})"
            case ast.Compare():
                terms = [self._term(reader, part, names) for part in (node.left, *node.comparators)]
                pairs = zip(terms, node.ops, terms[1:], strict=False)
                return self._joined(self.both, [f"({a} {self._sign(op)} {b})" for a, op, b in pairs])
        raise AssertionError(f"{ast.dump(node)} was not accepted")

    def _term(self, reader: Reader, node: ast.expr, names: Mapping[str, str]) -> str:
        value = reader.term(node)
        if isinstance(value, float):  # folded in floats, as the condition itself is
            return number(value)
        inner: Callable[[ast.expr], str] = lambda part: self._term(reader, part, names)  # noqa: E731
        match node:
            case ast.Name(id=name):
                return names[reader.names[reader.column[name]]]
            case ast.BinOp(op=ast.Pow()):
                return f"({self.power.format(inner(node.left), inner(node.right))})"
            case ast.BinOp():
                return f"({inner(node.left)} {self._sign(node.op)} {inner(node.right)})"
            case ast.UnaryOp():
                return f"({self._sign(node.op)}{inner(node.operand)})"
            case ast.Call(func=ast.Name(id=name), args=[argument]):
                return f"{(self.functions or {}).get(name, name)}({inner(argument)})"
        raise AssertionError(f"{ast.dump(node)} was not accepted")

    def _sign(self, op: ast.AST) -> str:
        sign = OPERATORS[type(op)]
        return (self.operators or {}).get(sign, sign)


def number(value: float) -> str:
    """A float in as few digits as read back to it; a negative one in parentheses."""
    return repr(float(value)) if value >= 0 else f"({float(value)!r})"


PYTHON = Dialect("Python", "&", "|", "np.logical_not", functions={name: f"np.{name}" for name in FUNCTIONS})
C = Dialect("C", "&&", "||", "!", power="pow({}, {})")
JULIA = Dialect(
    "Julia",
    "&&",
    "||",
    "!",
    power="real_power({}, {})",
    functions={name: f"real_{name}" for name in ("sin", "cos", "sqrt", "log")},  # julia's own raise where there is no number
)
MATLAB = Dialect(
    "MATLAB",
    "&",
    "|",
    "~",
    power="real_power({}, {})",
    functions={"sqrt": "real_sqrt", "log": "real_log"},
    operators={"*": ".*", "/": "./", "!=": "~="},
)
