"""Regions as code for a small stack machine, which compiled loops execute: see `nsmaps.reduced.conditions.interpreter`."""

import math
from collections.abc import Sequence

from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.files.expressions import FUNCTIONS as NAMES
from nsmaps.reduced.conditions.fold import Algebra, fold, fold_term
from nsmaps.reduced.conditions.region import Box, Region, as_condition

PUSH, LOAD, AND, OR = range(4)  #: a number, a coordinate; jumps where the top of the stack decides for all states, false or true
NEAR, RAISE, NOT, NEG, SQRT, SIN, COS, EXP, LOG = range(4, 13)  #: of one: the turn of an angle nearest to, a power of, a number
TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ABS, SIGN, FLOOR = range(13, 23)  #: of one too
ADD, SUB, MUL, DIV, POW, MIN, MAX = range(23, 30)
LT, LE, GT, GE, EQ, NE, BOTH, EITHER = range(30, 38)
HIGHEST = 16  #: power that is multiplied out

OPERATIONS = {
    **{"+": ADD, "-": SUB, "*": MUL, "/": DIV, "**": POW},
    **{"<": LT, "<=": LE, ">": GT, ">=": GE, "==": EQ, "!=": NE},
}
FUNCTIONS = dict(zip(NAMES, [*range(SQRT, ADD), MIN, MAX], strict=True))

JOINS = {AND: BOTH, OR: EITHER}
TURNED = {**{o: o for o in (ADD, MUL, MIN, MAX, EQ, NE)}, LT: GT, LE: GE, GT: LT, GE: LE}  #: with exchanged operands

#: Operations, each with a number: what is pushed, which coordinate, how far to jump; of two numbers the second, NaN where it is
#: on the stack.
Code = list[tuple[int, float]]


def code_of(region: Region) -> Code:
    """The code that leaves 1.0 on the stack where a region contains a finite state, otherwise 0.0.

    Angles are expected in [0, 2 pi). On a curve of third degree and above rounding may decide otherwise than in `contains`.
    """
    if type(region) is Box:
        return _box(region)
    return fold(as_condition(region).text, region.coordinates, _Codes())


def code_of_term(text: str, names: Sequence[str]) -> Code:
    """The code that leaves the value of a formula in named coordinates on the stack."""
    return fold_term(text, names, _Codes())


def depth_of(code: Code) -> int:
    """The number of places on the stack that a code needs."""
    deepest = depth = 0
    for operation, number in code:
        depth += 1 if operation in (PUSH, LOAD) else -1 if operation >= ADD and math.isnan(number) else 0
        deepest = max(deepest, depth)
    return deepest + 1  # for a second number that is not pushed


def _box(box: Box) -> Code:
    """As `Box.contains`, of angles in [0, 2 pi): these have no nearer turn in sides within it."""
    tests: list[Code] = []
    for j, (name, (lower, upper)) in enumerate(zip(box.coordinates, box.array.tolist(), strict=True)):
        turns = is_angle(name) and not 0 <= lower < upper < TWO_PI
        place: Code = [(LOAD, j), (NEAR, (lower + upper) / 2)] if turns else [(LOAD, j)]
        tests += [[*place, (GE, lower)], [*place, (LE, upper)]]
    return _joined(AND, tests)


def _joined(how: int, tests: Sequence[Code]) -> Code:
    """The tests in order; the first that is false (AND) or true (OR) decides."""
    code = tests[-1]
    for test in reversed(tests[:-1]):
        code = [*test, (how, len(code) + 1), *code, (JOINS[how], math.nan)]
    return code


def _of_two(operation: int, left: Code, right: Code) -> Code:
    """An operation on two terms; one that is a number need not be pushed."""
    if len(right) == 1 and right[0][0] == PUSH:
        number = right[0][1]
        return [*left, _power(number) if operation == POW else (operation, number)]
    if len(left) == 1 and left[0][0] == PUSH and operation in TURNED:
        return [*right, (TURNED[operation], left[0][1])]
    return [*left, *right, (operation, math.nan)]


def _power(power: float) -> tuple[int, float]:
    """What raises a number to a constant power: whole ones are multiplied out, and NumPy has the same root and inverse."""
    if power in range(1, HIGHEST + 1):
        return RAISE, power
    return (SQRT, 0) if power == 0.5 else (POW, power)


class _Codes(Algebra[Code, Code]):
    """Code that leaves a term, or 1.0 or 0.0 of a test, on the stack."""

    def number(self, value: float) -> Code:
        return [(PUSH, value)]

    def coordinate(self, column: int) -> Code:
        return [(LOAD, column)]

    def signed(self, sign: str, term: Code) -> Code:
        return [*term, (NEG, 0)] if sign == "-" else term

    def arithmetic(self, operator: str, left: Code, right: Code) -> Code:
        return _of_two(OPERATIONS[operator], left, right)

    def function(self, name: str, *arguments: Code) -> Code:
        code = FUNCTIONS[name]
        return _of_two(code, *arguments) if code in (MIN, MAX) else [*arguments[0], (code, 0)]

    def relation(self, operator: str, left: Code, right: Code) -> Code:
        return _of_two(OPERATIONS[operator], left, right)

    def conjunction(self, tests: Sequence[Code]) -> Code:
        return _joined(AND, tests)

    def disjunction(self, tests: Sequence[Code]) -> Code:
        return _joined(OR, tests)

    def negation(self, test: Code) -> Code:
        return [*test, (NOT, 0)]
