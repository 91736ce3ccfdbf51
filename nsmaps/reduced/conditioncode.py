"""Regions as code for a small stack machine, which compiled loops run: see `compositekernel.holds`."""

import ast
import math
from typing import Any

from nsmaps.exact.impacts import TWO_PI, Angle
from nsmaps.reduced.reader import Reader
from nsmaps.reduced.region import Box, Region, Where

PUSH, LOAD, AND, OR = range(4)  #: a number, a coordinate; jumps where what is on top decides for all states, false or true
NEAR, RAISE, NOT, NEG, SQRT, SIN, COS, EXP, LOG = range(4, 13)  #: of one: the turn of an angle nearest to, a power of, a number
ADD, SUB, MUL, DIV, POW = range(13, 18)
LT, LE, GT, GE, EQ, NE, BOTH, EITHER = range(18, 26)
HIGHEST = 16  #: power that is multiplied out

OPERATIONS: dict[type[ast.AST], int] = {
    **{ast.Add: ADD, ast.Sub: SUB, ast.Mult: MUL, ast.Div: DIV, ast.Pow: POW, ast.USub: NEG},
    **{ast.Lt: LT, ast.LtE: LE, ast.Gt: GT, ast.GtE: GE, ast.Eq: EQ, ast.NotEq: NE},
}
FUNCTIONS = {"sqrt": SQRT, "sin": SIN, "cos": COS, "exp": EXP, "log": LOG}

JOINS = {AND: BOTH, OR: EITHER}
TURNED = {ADD: ADD, MUL: MUL, LT: GT, LE: GE, GT: LT, GE: LE, EQ: EQ, NE: NE}  #: what serves with its operands exchanged

#: Operations, each with a number: what is pushed, which coordinate, how far to jump; of two numbers the second, NaN where it is
#: on the stack.
Code = list[tuple[int, float]]


def code_of(region: Region) -> Code | None:
    """The code that leaves 1.0 on the stack where a region holds a finite state, else 0.0; None of a region of another class.

    Angles are to be in [0, 2 pi). On a curve of third degree and above rounding may decide otherwise than in `contains`.
    """
    if type(region) is Box:
        return _box(region)
    if type(region) is Where:
        reader = Reader("condition", region.text, region.coordinates)
        return _test(reader, reader.tree())
    return None


def depth_of(code: Code) -> int:
    """How many places on the stack a code needs."""
    deepest = depth = 0
    for operation, number in code:
        depth += 1 if operation in (PUSH, LOAD) else -1 if operation >= ADD and math.isnan(number) else 0
        deepest = max(deepest, depth)
    return deepest + 1  # for a second number that is not pushed


def _box(box: Box) -> Code:
    """As `Box.contains`, of angles in [0, 2 pi): these have no nearer turn in sides within it."""
    tests: list[Code] = []
    for j, (name, (lower, upper)) in enumerate(zip(box.coordinates, box.array.tolist(), strict=True)):
        turns = isinstance(name, Angle) and not 0 <= lower < upper < TWO_PI
        place: Code = [(LOAD, j), (NEAR, (lower + upper) / 2)] if turns else [(LOAD, j)]
        tests += [[*place, (GE, lower)], [*place, (LE, upper)]]
    return _joined(AND, tests)


def _joined(how: int, tests: list[Code]) -> Code:
    """The tests in order, of which the first that is false (AND) or true (OR) decides."""
    code = tests[-1]
    for test in reversed(tests[:-1]):
        code = [*test, (how, len(code) + 1), *code, (JOINS[how], math.nan)]
    return code


def _of_two(operation: int, left: Code, right: Code) -> Code:
    """An operation on two terms, of which one that is a number need not be pushed."""
    if len(right) == 1 and right[0][0] == PUSH:
        number = right[0][1]
        return [*left, _power(number) if operation == POW else (operation, number)]
    if len(left) == 1 and left[0][0] == PUSH and operation in TURNED:
        return [*right, (TURNED[operation], left[0][1])]
    return [*left, *right, (operation, math.nan)]


def _test(reader: Reader, node: ast.expr) -> Code:
    """A condition that the reader has accepted."""
    match node:
        case ast.Compare(left=left, ops=ops, comparators=rights):
            terms = [_term(reader, part) for part in (left, *rights)]
            relations = zip(ops, terms, terms[1:], strict=False)
            return _joined(AND, [_of_two(OPERATIONS[type(op)], a, b) for op, a, b in relations])
        case ast.BoolOp(op=op, values=values):
            return _joined(AND if isinstance(op, ast.And) else OR, [_test(reader, part) for part in values])
        case ast.UnaryOp(operand=operand):
            return [*_test(reader, operand), (NOT, 0)]
    raise AssertionError(f"{ast.dump(node)} was not accepted")


def _term(reader: Reader, node: ast.expr) -> Code:
    """An arithmetic expression that the reader has accepted; what is constant is one number."""
    value: Any = reader.term(node)
    if isinstance(value, float):
        return [(PUSH, value)]
    match node:
        case ast.Name(id=name):
            return [(LOAD, reader.column[name])]
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _term(reader, operand)
        case ast.UnaryOp(op=op, operand=operand):
            return [*_term(reader, operand), (OPERATIONS[type(op)], 0)]
        case ast.BinOp(op=op, left=left, right=right):
            return _of_two(OPERATIONS[type(op)], _term(reader, left), _term(reader, right))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return [*_term(reader, argument), (FUNCTIONS[name], 0)]
    raise AssertionError(f"{ast.dump(node)} was not accepted")


def _power(power: float) -> tuple[int, float]:
    """What raises a number to a constant power: whole ones are multiplied out, and NumPy has the same root and inverse."""
    if power in range(1, HIGHEST + 1):
        return RAISE, power
    return (SQRT, 0) if power == 0.5 else (POW, power)
