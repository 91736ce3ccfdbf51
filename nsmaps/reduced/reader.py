"""From text to closures: a condition or number is parsed by python, then every node is checked against a short list.

Text is never evaluated: whatever is not on the list is a ConditionError that names its column.
"""

import ast
import math
import operator
from collections.abc import Callable
from typing import Any, NoReturn, TypeAlias
from unicodedata import normalize

import numpy as np

from nsmaps.errors import ConditionError, near_match

Evaluate: TypeAlias = Callable[[Any], Any]  #: the columns of a batch of states, shape (n, N) -> one value a state

LONGEST, DEEPEST, HIGHEST = 1000, 100, 10_000  #: characters of a text, levels of nesting, powers written out

CONSTANTS = {"pi": math.pi, "e": math.e}
FUNCTIONS: dict[str, tuple[Callable[[float], float], Callable[[Any], Any]]] = {
    "sqrt": (math.sqrt, np.sqrt),
    "sin": (math.sin, np.sin),
    "cos": (math.cos, np.cos),
    "exp": (math.exp, np.exp),
    "log": (math.log, np.log),
}
ARITHMETIC: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
COMPARISONS: dict[type[ast.AST], tuple[Callable[[Any, Any], Any], str]] = {
    ast.Lt: (operator.lt, "Lt"),
    ast.LtE: (operator.le, "Le"),
    ast.Gt: (operator.gt, "Gt"),
    ast.GtE: (operator.ge, "Ge"),
    ast.Eq: (operator.eq, "Eq"),
    ast.NotEq: (operator.ne, "Ne"),
}
HINTS = {"^": "a power is written **", "&": "write and", "|": "write or", "!": "write not", "=": "equality is =="}


class Reader:
    """One text, of a `kind` that its errors name, on its way from characters to closures over named columns."""

    def __init__(self, kind: str, text: str, names: tuple[str, ...]) -> None:
        self.kind, self.names = kind, names
        if not isinstance(text, str):
            raise ConditionError(f"{text!r} is a {type(text).__name__}; accepted: a {kind} as text")
        self.text = "".join(" " if character.isspace() else character for character in text)
        self.column = {normalize("NFKC", name): k for k, name in enumerate(names)}  # as python normalizes names

    def fail(self, at: ast.expr | int, what: str) -> NoReturn:
        """Raise the ConditionError for a node, or for a column that counts from one."""
        if not isinstance(at, int):
            lead = len(self.text) - len(self.text.lstrip())
            before = self.text.lstrip().encode()[: at.col_offset]
            at = lead + len(before.decode(errors="replace")) + 1
        start = max(0, at - 40)
        shown = ("..." if start else "") + self.text[start : at + 40] + ("..." if len(self.text) > at + 40 else "")
        number = f"numbers, pi, e, + - * / **, parentheses, {', '.join(FUNCTIONS)}"
        condition = f"the coordinates {', '.join(self.names)}; < <= > >= == !=; and, or, not; {number}"
        accepted = condition if self.names else number
        error = ConditionError(f"{self.kind} {shown!r}, column {at}: {what}; accepted: {accepted}")
        error.column = at - 1  # from zero, for who knows where in a file the text stands
        raise error

    def tree(self) -> ast.expr:
        """The parsed text, of which nothing is trusted yet."""
        text = self.text.strip()
        if not text or len(self.text) > LONGEST:
            self.fail(1, f"{len(self.text)} characters; at most {LONGEST} are read" if text else "is empty")
        if "#" in self.text or "\\" in self.text:  # python would drop a comment in silence
            self.fail(min(k for k, c in enumerate(self.text, 1) if c in "#\\"), "this character is not read")
        try:
            return ast.parse(text, mode="eval").body
        except SyntaxError as error:
            at = max(1, min(error.offset or len(text), len(text)))  # zero: the text ended too early
            hint = HINTS.get(text[at - 1], "")
            lead = len(self.text) - len(self.text.lstrip())
            self.fail(lead + at, f"cannot be read ({error.msg})" + (f", {hint}" if hint else ""))
        except (ValueError, RecursionError, MemoryError, OverflowError):
            self.fail(1, "cannot be read (too deeply nested, or no text)")

    def test(self, node: ast.expr, depth: int = 0) -> Evaluate:
        """The closure of a condition."""
        self.guard(node, depth)
        match node:
            case ast.Compare():
                return self.comparison(node, depth)
            case ast.BoolOp():
                parts = [self.test(part, depth + 1) for part in node.values]
                reduce = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
                return lambda x: _chain(reduce, [part(x) for part in parts])
            case ast.UnaryOp(op=ast.Not()):
                inner = self.test(node.operand, depth + 1)
                return lambda x: np.logical_not(inner(x))
        self.term(node, depth)  # what is no number either says so first
        self.fail(node, f"{self.source(node)} is a number where a condition is needed")

    def comparison(self, node: ast.Compare, depth: int) -> Evaluate:
        """The closure of a chain of comparisons, every operand evaluated once."""
        for op, right in zip(node.ops, node.comparators, strict=True):
            if type(op) not in COMPARISONS:
                self.fail(right, "only < <= > >= == != compare")
        relations = [COMPARISONS[type(op)][0] for op in node.ops]
        terms = [_closure(self.term(part, depth + 1)) for part in (node.left, *node.comparators)]
        for part in (node.left, *node.comparators):
            if self.weight(part) > HIGHEST:
                self.fail(part, f"{self.source(part)} is too high a power; at most {HIGHEST} is written out")

        def holds(x: Any) -> Any:
            values = [term(x) for term in terms]
            pairs = zip(relations, values, values[1:], strict=False)
            return _chain(np.logical_and, [relation(a, b) for relation, a, b in pairs])

        return holds

    def term(self, node: ast.expr, depth: int = 0) -> float | Evaluate:
        """An arithmetic expression: its value where it is constant, otherwise its closure."""
        self.guard(node, depth)
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self.constant(node, float, value)
            case ast.Name(id=name):
                return self.name(node, name)
            case ast.UnaryOp(op=op, operand=operand) if type(op) in ARITHMETIC:
                return self.apply(node, ARITHMETIC[type(op)], ARITHMETIC[type(op)], [operand], depth)
            case ast.BinOp(op=op) if type(op) in ARITHMETIC:
                return self.apply(node, ARITHMETIC[type(op)], ARITHMETIC[type(op)], [node.left, node.right], depth)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords):
                if name not in FUNCTIONS:
                    self.fail(node, f"there is no function {name!r}{near_match(name, FUNCTIONS)}")
                if len(args) != 1 or keywords:
                    self.fail(node, f"{name} takes one number")
                return self.apply(node, *FUNCTIONS[name], args, depth)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                self.fail(node, f"{self.source(node)} is a condition where a number is needed")
            case ast.BinOp(op=ast.BitXor()):
                self.fail(node, f"{self.source(node)} is not read: {HINTS['^']}")
            case ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
                self.fail(node, f"{self.source(node)} is not read: write and, or")
        self.fail(node, f"{self.source(node)} is not read")

    def name(self, node: ast.Name, name: str) -> float | Evaluate:
        """A coordinate, which goes before a constant of the same name, or a constant."""
        if name in self.column:
            return operator.itemgetter(self.column[name])
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in FUNCTIONS:
            self.fail(node, f"{name} needs a number in parentheses")
        self.fail(node, f"unknown name {name!r}{near_match(name, [*self.names, *CONSTANTS, *FUNCTIONS])}")

    def apply(
        self, node: ast.expr, scalar: Evaluate, batch: Callable[..., Any], parts: list[ast.expr], depth: int
    ) -> float | Evaluate:
        """An operation on its parts: done at once if they are all constant, in floats, so 9**9**9 costs nothing."""
        terms = [self.term(part, depth + 1) for part in parts]
        numbers = [term for term in terms if isinstance(term, float)]
        if len(numbers) == len(terms):
            return self.constant(node, scalar, *numbers)
        if batch is operator.truediv and terms[1] == 0.0:
            self.fail(parts[1], "divides by zero")
        closures = [_closure(term) for term in terms]
        if len(closures) == 1:
            (only,) = closures
            return lambda x: batch(only(x))
        left, right = closures
        return lambda x: batch(left(x), right(x))

    def constant(self, node: ast.expr, function: Callable[..., Any], *values: float) -> float:
        """The value of a constant expression, which must be real and finite."""
        try:
            value = function(*values)
        except (ArithmeticError, ValueError):
            value = math.nan
        if not isinstance(value, float) or not math.isfinite(value):
            self.fail(node, f"{self.source(node)} has no finite real value")
        return value

    def weight(self, node: ast.expr) -> float:
        """How large the exact form of an expression may grow: powers multiply, all else adds up."""
        if isinstance(self.term(node), float):
            return 1.0
        if isinstance(node, ast.Call):
            return self.weight(node.args[0])
        weights = [self.weight(part) for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            power = self.term(node.right)
            return weights[0] * max(1.0, abs(power)) if isinstance(power, float) else sum(weights)
        return sum(weights) or 1.0

    def guard(self, node: ast.expr, depth: int) -> None:
        """Refuse what is nested too deeply for a reader, man or machine."""
        if depth > DEEPEST:
            self.fail(node, f"nested deeper than {DEEPEST} levels")

    def source(self, node: ast.expr) -> str:
        """The text of a node, shortened."""
        text = ast.get_source_segment(self.text.strip(), node) or ""
        return repr(text if len(text) <= 40 else text[:37] + "...")


def _closure(term: float | Evaluate) -> Evaluate:
    return (lambda x: term) if isinstance(term, float) else term


def _chain(join: Callable[[Any, Any], Any], parts: list[Any]) -> Any:
    result = parts[0]
    for part in parts[1:]:
        result = join(result, part)
    return result
