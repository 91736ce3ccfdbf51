"""From text to a checked syntax tree: Python parses a condition, formula or number, then every node is checked against a list.

Text is never evaluated: a node that is not on the list is a ConditionError that states its column.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from keyword import kwlist
from typing import NoReturn
from unicodedata import normalize

from nsmaps.errors import ConditionError, near_match

LONGEST, DEEPEST, HIGHEST = 10_000, 100, 10_000  #: characters of a text, levels of nesting, powers written out

CONSTANTS = {"pi": math.pi, "e": math.e}
FUNCTIONS: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "exp", "log")},
    **{name: getattr(math, name) for name in ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")},
    **{"abs": abs, "sign": lambda x: float((x > 0) - (x < 0)), "floor": lambda x: float(math.floor(x)), "min": min, "max": max},
}
SEVERAL = ("min", "max")  #: functions of two numbers or more
CAPITAL = ("abs", "min", "max")  #: functions whose names sympy writes with a capital
ARITHMETIC: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)
OPERATORS = ("and", "or", "not")
WORDS = frozenset(kwlist).difference(OPERATORS)  #: of Python, which may be names here
WIDE = 0xFF00 - 0x20  #: from a letter to its full-width form, which Python reads as the same letter, though not in its own words
HINTS = {"^": "a power is written **", "&": "write and", "|": "write or", "!": "write not", "=": "equality is =="}


def as_name(word: str) -> str:
    """A word as Python takes it for a name, also where it is one of its own."""
    return chr(ord(word[0]) + WIDE) + word[1:] if word in WORDS else word


class Reader:
    """One text, of a `kind` that its errors name, on its way from characters to a checked tree over named columns."""

    def __init__(
        self, kind: str, text: str, names: tuple[str, ...], functions: Mapping[str, Callable[..., float]] = FUNCTIONS
    ) -> None:
        self.kind, self.names, self.functions = kind, names, functions
        if not isinstance(text, str):
            raise ConditionError(f"{text!r} is a {type(text).__name__}; expected: a {kind} as text")
        self.text = "".join(" " if character.isspace() else character for character in text)
        self.column = {normalize("NFKC", name): k for k, name in enumerate(names)}  # as Python normalises names
        self.plain = re.sub(
            r"\w+", lambda word: as_name(word[0]) if word[0] in self.column else word[0], self.text
        )  #: for Python

    def fail(self, at: ast.expr | int, what: str) -> NoReturn:
        """Raise the ConditionError for a node, or for a column that counts from one."""
        if not isinstance(at, int):
            lead = len(self.text) - len(self.text.lstrip())
            before = self.plain.lstrip().encode()[: at.col_offset]
            at = lead + len(before.decode(errors="replace")) + 1
        start = max(0, at - 40)
        shown = ("..." if start else "") + self.text[start : at + 40] + ("..." if len(self.text) > at + 40 else "")
        number = f"numbers, pi, e, + - * / **, parentheses, {', '.join(self.functions)}"
        condition = f"the coordinates {', '.join(self.names)}; < <= > >= == !=; and, or, not; {number}"
        accepted = {"condition": condition, "formula": f"{', '.join(self.names)}; {number}"}.get(self.kind, number)
        error = ConditionError(f"{self.kind} {shown!r}, column {at}: {what}; expected: {accepted}")
        error.column = at - 1  # from zero, for who knows where in a file the text stands
        raise error

    def tree(self) -> ast.expr:
        """The parsed text, not yet checked."""
        text = self.text.strip()
        if not text or len(self.text) > LONGEST:
            self.fail(1, f"{len(self.text)} characters; expected: at most {LONGEST}" if text else "is empty")
        if "#" in self.text or "\\" in self.text:  # Python would drop a comment silently
            self.fail(min(k for k, c in enumerate(self.text, 1) if c in "#\\"), "this character is not allowed")
        try:
            return ast.parse(self.plain.strip(), mode="eval").body
        except SyntaxError as error:
            at = max(1, min(error.offset or len(text), len(text)))  # zero: the text ended too early
            operators = ", ".join(name for name in OPERATORS if name in self.column)
            hint = f"where {operators} is an operator, no name: rename it" if operators else HINTS.get(text[at - 1], "")
            lead = len(self.text) - len(self.text.lstrip())
            self.fail(lead + at, f"cannot be read ({error.msg})" + (f", {hint}" if hint else ""))
        except (ValueError, RecursionError, MemoryError, OverflowError):
            self.fail(1, "cannot be read (too deeply nested, or no text)")

    def check_value(self, node: ast.expr) -> None:
        """A ConditionError unless a tree is a number or a formula of the columns that can be written out."""
        self.value(node)
        if self.weight(node) > HIGHEST:
            self.fail(node, f"{self.source(node)} is too high a power; at most {HIGHEST} is written out")

    def check(self, node: ast.expr, depth: int = 0) -> None:
        """A ConditionError unless a tree is a condition."""
        self.guard(node, depth)
        match node:
            case ast.Compare():
                self.check_comparison(node, depth)
            case ast.BoolOp(values=parts) | ast.UnaryOp(op=ast.Not(), operand=ast.expr() as parts):
                for part in parts if isinstance(parts, list) else [parts]:
                    self.check(part, depth + 1)
            case _:
                self.value(node, depth)  # an operand that is not a number is reported first
                self.fail(node, f"{self.source(node)} is a number where a condition is needed")

    def check_comparison(self, node: ast.Compare, depth: int) -> None:
        """A ConditionError unless every operand of a chain of comparisons is a number."""
        for op, right in zip(node.ops, node.comparators, strict=True):
            if not isinstance(op, COMPARISONS):
                self.fail(right, "only < <= > >= == != compare")
        for part in (node.left, *node.comparators):
            self.value(part, depth + 1)
        for part in (node.left, *node.comparators):
            self.check_value(part)

    def value(self, node: ast.expr, depth: int = 0) -> float | None:
        """The value of an arithmetic expression, in floats; None if it depends on a coordinate."""
        self.guard(node, depth)
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self.constant(node, float, value)
            case ast.Name(id=name):
                return self.name(node, name)
            case ast.UnaryOp(op=op, operand=operand) if type(op) in ARITHMETIC:
                return self.apply(node, ARITHMETIC[type(op)], [operand], depth)
            case ast.BinOp(op=op) if type(op) in ARITHMETIC:
                return self.apply(node, ARITHMETIC[type(op)], [node.left, node.right], depth)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords):
                if name not in self.functions:
                    self.fail(node, f"there is no function {name!r}{near_match(name, self.functions)}")
                several = name in SEVERAL
                if keywords or (len(args) < 2 if several else len(args) != 1):
                    self.fail(node, f"{name} takes {'two numbers or more' if several else 'one number'}")
                return self.apply(node, self.functions[name], args, depth)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                self.fail(node, f"{self.source(node)} is a condition where a number is needed")
            case ast.BinOp(op=ast.BitXor()):
                self.fail(node, f"{self.source(node)} is not allowed: {HINTS['^']}")
            case ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                self.fail(node, f"{self.source(node)} is not allowed: write and, or")
        self.fail(node, f"{self.source(node)} is not allowed")

    def name(self, node: ast.Name, name: str) -> float | None:
        """A coordinate, which goes before a constant of the same name, or a constant."""
        if name in self.column:
            return None
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in self.functions:
            self.fail(node, f"{name} needs a number in parentheses")
        self.fail(node, f"unknown name {name!r}{near_match(name, [*self.names, *CONSTANTS, *self.functions])}")

    def apply(self, node: ast.expr, function: Callable[..., float], parts: list[ast.expr], depth: int) -> float | None:
        """An operation on its parts: its value if they are all constant, in floats, so 9**9**9 costs nothing."""
        values = [self.value(part, depth + 1) for part in parts]
        numbers = [value for value in values if value is not None]
        if len(numbers) == len(values):
            return self.constant(node, function, *numbers)
        if function is operator.truediv and values[1] == 0.0:
            self.fail(parts[1], "divides by zero")
        return None

    def constant(self, node: ast.expr, function: Callable[..., float], *values: float) -> float:
        """The value of a constant expression, which must be real and finite."""
        try:
            value = function(*values)
        except (ArithmeticError, ValueError):
            value = math.nan
        if not isinstance(value, float) or not math.isfinite(value):
            self.fail(node, f"{self.source(node)} has no finite real value")
        return value

    def weight(self, node: ast.expr) -> float:
        """A bound on the growth of the exact form of an expression: powers multiply, other operations add."""
        if self.value(node) is not None:
            return 1.0
        if isinstance(node, ast.Call):
            return sum(map(self.weight, node.args))
        weights = [self.weight(part) for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            power = self.value(node.right)
            return sum(weights) if power is None else weights[0] * max(1.0, abs(power))
        return sum(weights) or 1.0

    def guard(self, node: ast.expr, depth: int) -> None:
        """Refuse nesting beyond a limit."""
        if depth > DEEPEST:
            self.fail(node, f"nested deeper than {DEEPEST} levels")

    def source(self, node: ast.expr) -> str:
        """The text of a node, shortened."""
        text = normalize("NFKC", ast.get_source_segment(self.plain.strip(), node) or "")
        return repr(text if len(text) <= 40 else text[:37] + "...")
