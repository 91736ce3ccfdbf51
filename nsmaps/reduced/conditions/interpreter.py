"""The stack machine that evaluates conditions, in the code of `bytecode`, for blocks of states."""

import math

import numpy as np

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.reduced.conditions import bytecode as code

PUSH, LOAD, NEAR, RAISE, NOT, NEG = code.PUSH, code.LOAD, code.NEAR, code.RAISE, code.NOT, code.NEG
SQRT, SIN, COS, EXP, LOG, TAN = code.SQRT, code.SIN, code.COS, code.EXP, code.LOG, code.TAN
ASIN, ACOS, ATAN, SINH, COSH = code.ASIN, code.ACOS, code.ATAN, code.SINH, code.COSH
ABS, SIGN, FLOOR = code.ABS, code.SIGN, code.FLOOR
AND, OR, BOTH = code.AND, code.OR, code.BOTH
ADD, SUB, MUL, DIV, POW, MIN = code.ADD, code.SUB, code.MUL, code.DIV, code.POW, code.MIN
LT, LE, GT, GE, EQ, NE = code.LT, code.LE, code.GT, code.GE, code.EQ, code.NE


@inlined
def calculate(o, stack, a, b, count):
    """Replace a row of the stack by its sum, difference, product, quotient or power with another row, or the smaller or larger.

    Each operation has a loop of its own, here and below, so that it runs in vector instructions.
    """
    if o == ADD:
        for c in range(count):
            stack[a, c] += stack[b, c]
    elif o == SUB:
        for c in range(count):
            stack[a, c] -= stack[b, c]
    elif o == MUL:
        for c in range(count):
            stack[a, c] *= stack[b, c]
    elif o == DIV:
        for c in range(count):
            stack[a, c] /= stack[b, c]
    elif o == POW:
        for c in range(count):
            stack[a, c] = stack[a, c] ** stack[b, c]
    else:
        for c in range(count):
            first = stack[a, c] < stack[b, c] if o == MIN else stack[a, c] > stack[b, c]
            stack[a, c] = stack[a, c] if first or math.isnan(stack[a, c]) else stack[b, c]


@inlined
def compare(o, stack, a, b, count):
    """Replace a row of the stack by 1.0 where a comparison with another row, or both rows, or either is true, else by 0.0."""
    less, more = (b, a) if o in (GT, GE) else (a, b)
    if o in (LT, GT):
        for c in range(count):
            stack[a, c] = 1.0 if stack[less, c] < stack[more, c] else 0.0
    elif o in (LE, GE):
        for c in range(count):
            stack[a, c] = 1.0 if stack[less, c] <= stack[more, c] else 0.0
    elif o in (EQ, NE):
        for c in range(count):
            stack[a, c] = 1.0 if (stack[a, c] == stack[b, c]) == (o == EQ) else 0.0
    else:
        for c in range(count):
            stack[a, c] = min(stack[a, c], stack[b, c]) if o == BOTH else max(stack[a, c], stack[b, c])


@inlined
def transform(o, stack, a, count, number):
    """Replace a row of the stack by a function of it."""
    if o == NEAR:
        for c in range(count):
            stack[a, c] -= TWO_PI * np.rint((stack[a, c] - number) / TWO_PI)
    elif o == NOT:
        for c in range(count):
            stack[a, c] = 1.0 - stack[a, c]
    elif o == NEG:
        for c in range(count):
            stack[a, c] = -stack[a, c]
    elif o == SQRT:
        for c in range(count):
            stack[a, c] = math.sqrt(stack[a, c])
    elif o == ABS:
        for c in range(count):
            stack[a, c] = abs(stack[a, c])
    elif o == FLOOR:
        for c in range(count):
            stack[a, c] = np.floor(stack[a, c])
    elif o == SIGN:
        for c in range(count):
            x = stack[a, c]
            stack[a, c] = 1.0 if x > 0.0 else -1.0 if x < 0.0 else x
    else:
        for c in range(count):
            stack[a, c] = power(stack[a, c], number) if o == RAISE else transcendental(o, stack[a, c])


@inner
def power(base, exponent):
    """A whole power of a number, multiplied out."""
    product = base
    for _ in range(int(exponent) - 1):
        product *= base
    return product


@inner
def transcendental(o, x):
    """A function of a number, NaN where it is not real."""
    if o == SIN:
        return math.sin(x)
    if o == COS:
        return math.cos(x)
    if o == EXP:
        return math.exp(x)
    if o == LOG:
        return math.log(x)
    if o == TAN:
        return math.tan(x)
    if o in (ASIN, ACOS):
        return math.asin(x) if o == ASIN else math.acos(x)
    if o == ATAN:
        return math.atan(x)
    if o == SINH:
        return math.sinh(x)
    return math.cosh(x) if o == COSH else math.tanh(x)


@inlined
def decided(o, stack, a, count):
    """True if the left operand of `and` or `or` decides the result at every state."""
    decisive = 0.0 if o == AND else 1.0
    same = True
    for c in range(count):
        same = same and stack[a, c] == decisive
    return same


@inner
def evaluate_condition(operations, numbers, begin, end, x, count, stack):
    """Write into the first row of the stack 1.0 where the condition of operations `begin` to `end` is true, else 0.0.

    The states are the first `count` columns of `x`, shape (n, N); `stack` has the shape (depth, N).
    """
    top, at = np.int64(-1), begin  # a literal would have what is called below compiled a second time
    while at < end:
        o, number = operations[at], numbers[at]
        if o in (AND, OR):
            if decided(o, stack, top, count):
                at += int(number)
        elif o < NEAR:
            top += 1
            for c in range(count):
                stack[top, c] = number if o == PUSH else x[int(number), c]
        elif o < ADD:
            transform(o, stack, top, count, number)
        else:
            if math.isnan(number):
                top -= 1
            else:
                for c in range(count):
                    stack[top + 1, c] = number
            if o < LT:
                calculate(o, stack, top, top + 1, count)
            else:
                compare(o, stack, top, top + 1, count)
        at += 1
