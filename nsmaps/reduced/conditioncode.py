"""Regions as code for a small stack machine, which compiled loops run: see `compositekernel.holds`."""

import ast
from typing import Any

from nsmaps.exact.impacts import Angle
from nsmaps.reduced.reader import Reader
from nsmaps.reduced.region import Box, Region, Where

PUSH, LOAD, NEAR, NOT, AND, OR = range(6)  #: a number, a coordinate, its turn nearest to a number; jumps if false, if true
ADD, SUB, MUL, DIV, POW, NEG, SQRT, SIN, COS, EXP, LOG = range(6, 17)
LT, LE, GT, GE, EQ, NE = range(17, 23)

OPERATIONS: dict[type[ast.AST], int] = {
    **{ast.Add: ADD, ast.Sub: SUB, ast.Mult: MUL, ast.Div: DIV, ast.Pow: POW, ast.USub: NEG},
    **{ast.Lt: LT, ast.LtE: LE, ast.Gt: GT, ast.GtE: GE, ast.Eq: EQ, ast.NotEq: NE},
}
FUNCTIONS = {"sqrt": SQRT, "sin": SIN, "cos": COS, "exp": EXP, "log": LOG}

Code = list[tuple[int, float]]  #: operations, each with a number: what is pushed, which coordinate, how far to jump


def code_of(region: Region) -> Code | None:
    """The code that leaves 1.0 on the stack where a region holds a finite state, else 0.0; None of a region of another class."""
    if type(region) is Box:
        return _box(region)
    if type(region) is Where:
        reader = Reader("condition", region.text, region.coordinates)
        return _test(reader, reader.tree())
    return None


def _box(box: Box) -> Code:
    """As `Box.contains`."""
    tests: list[Code] = []
    for j, (name, (lower, upper)) in enumerate(zip(box.coordinates, box.array.tolist(), strict=True)):
        place: Code = [(LOAD, j), (NEAR, (lower + upper) / 2)] if isinstance(name, Angle) else [(LOAD, j)]
        tests += [[*place, (PUSH, lower), (GE, 0)], [*place, (PUSH, upper), (LE, 0)]]
    return _joined(AND, tests)


def _joined(how: int, tests: list[Code]) -> Code:
    """The tests in order, of which the first that is false (AND) or true (OR) decides."""
    code = tests[-1]
    for test in reversed(tests[:-1]):
        code = [*test, (how, float(len(code))), *code]
    return code


def _test(reader: Reader, node: ast.expr) -> Code:
    """A condition that the reader has accepted."""
    match node:
        case ast.Compare(left=left, ops=ops, comparators=rights):
            terms = [_term(reader, part) for part in (left, *rights)]
            relations = zip(ops, terms, terms[1:], strict=False)
            return _joined(AND, [[*a, *b, (OPERATIONS[type(op)], 0)] for op, a, b in relations])
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
            return [*_term(reader, left), *_term(reader, right), (OPERATIONS[type(op)], 0)]
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return [*_term(reader, argument), (FUNCTIONS[name], 0)]
    raise AssertionError(f"{ast.dump(node)} was not accepted")
