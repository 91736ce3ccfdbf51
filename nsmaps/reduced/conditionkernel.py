"""The stack machine that asks conditions, see `conditioncode`: of many states side by side, or of one, to the same last bit."""

import math

import numpy as np

from nsmaps.exact.compiled import njit
from nsmaps.reduced import conditioncode as code

TWO_PI = 2 * math.pi
PUSH, LOAD, NEAR, RAISE, NOT, NEG = code.PUSH, code.LOAD, code.NEAR, code.RAISE, code.NOT, code.NEG
SQRT, SIN, COS, EXP = code.SQRT, code.SIN, code.COS, code.EXP
AND, OR, BOTH = code.AND, code.OR, code.BOTH
ADD, SUB, MUL, DIV, POW = code.ADD, code.SUB, code.MUL, code.DIV, code.POW
LT, LE, GT, GE, EQ, NE = code.LT, code.LE, code.GT, code.GE, code.EQ, code.NE


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def computed(o, a, b):
    """Replace numbers by what an operation makes of them and others: a loop each, so that they run in vector instructions."""
    if o == ADD:
        for c in range(len(a)):
            a[c] += b[c]
    elif o == SUB:
        for c in range(len(a)):
            a[c] -= b[c]
    elif o == MUL:
        for c in range(len(a)):
            a[c] *= b[c]
    elif o == DIV:
        for c in range(len(a)):
            a[c] /= b[c]
    else:
        for c in range(len(a)):
            a[c] = a[c] ** b[c]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def compared(o, a, b):
    """Replace numbers by 1.0 where a comparison with others holds, or where both conditions or either do, else by 0.0."""
    if o == LT:
        for c in range(len(a)):
            a[c] = 1.0 if a[c] < b[c] else 0.0
    elif o == LE:
        for c in range(len(a)):
            a[c] = 1.0 if a[c] <= b[c] else 0.0
    elif o == GT:
        for c in range(len(a)):
            a[c] = 1.0 if a[c] > b[c] else 0.0
    elif o == GE:
        for c in range(len(a)):
            a[c] = 1.0 if a[c] >= b[c] else 0.0
    elif o in (EQ, NE):
        for c in range(len(a)):
            a[c] = 1.0 if (a[c] == b[c]) == (o == EQ) else 0.0
    else:
        for c in range(len(a)):
            a[c] = min(a[c], b[c]) if o == BOTH else max(a[c], b[c])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def changed(o, a, number):
    """Replace numbers by what an operation makes of each."""
    if o == NEAR:
        for c in range(len(a)):
            a[c] -= TWO_PI * np.rint((a[c] - number) / TWO_PI)
    elif o == RAISE:
        for c in range(len(a)):
            base = a[c]
            for _ in range(int(number) - 1):
                a[c] *= base
    elif o == NOT:
        for c in range(len(a)):
            a[c] = 1.0 - a[c]
    elif o == NEG:
        for c in range(len(a)):
            a[c] = -a[c]
    elif o == SQRT:
        for c in range(len(a)):
            a[c] = math.sqrt(a[c])
    else:
        for c in range(len(a)):
            a[c] = applied(o, a[c])


@njit(cache=True, nogil=True, error_model="numpy")
def applied(o, a):
    """A transcendental function of a number."""
    if o == SIN:
        return math.sin(a)
    if o == COS:
        return math.cos(a)
    return math.exp(a) if o == EXP else math.log(a)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def settled(o, a):
    """Whether what stands on the left of `and` or `or` decides for all."""
    decides, all = 0.0 if o == AND else 1.0, True
    for c in range(len(a)):
        all = all and a[c] == decides
    return all


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def ask(operation, number, at, end, x, count, stack):
    """Leave in the stack's first row 1.0 where the condition whose code stands in a range holds, of a block of states."""
    top = -1
    while at < end:
        o = operation[at]
        if o == PUSH:
            top += 1
            stack[top, :count] = number[at]
        elif o == LOAD:
            top += 1
            stack[top, :count] = x[int(number[at]), :count]
        elif o in (AND, OR):
            if settled(o, stack[top, :count]):
                at += int(number[at])
        elif o >= ADD:
            if math.isnan(number[at]):
                top -= 1
            else:
                stack[top + 1, :count] = number[at]
            if o >= LT:
                compared(o, stack[top, :count], stack[top + 1, :count])
            else:
                computed(o, stack[top, :count], stack[top + 1, :count])
        else:
            changed(o, stack[top, :count], number[at])
        at += 1


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def joined(o, a, b):
    """Two numbers by an operation, as `computed` and `compared` have it."""
    if o == ADD:
        return a + b
    if o == SUB:
        return a - b
    if o == MUL:
        return a * b
    if o == DIV:
        return a / b
    if o == POW:
        return a**b
    if o in (LT, LE):
        true = a < b or (o == LE and a == b)
    elif o in (GT, GE):
        true = a > b or (o == GE and a == b)
    elif o in (EQ, NE):
        true = (a == b) == (o == EQ)
    else:
        return min(a, b) if o == BOTH else max(a, b)
    return 1.0 if true else 0.0


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def altered(o, a, number):
    """One number by an operation, as `changed` has it."""
    if o == NEAR:
        return a - TWO_PI * np.rint((a - number) / TWO_PI)
    if o == RAISE:
        power = a
        for _ in range(int(number) - 1):
            power *= a
        return power
    if o == NOT:
        return 1.0 - a
    if o == NEG:
        return -a
    return math.sqrt(a) if o == SQRT else applied(o, a)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def holds(operation, number, at, end, x, stack):
    """Whether the condition whose code stands in a range holds at a state."""
    top = -1
    while at < end:
        o = operation[at]
        if o in (PUSH, LOAD):
            top += 1
            stack[top] = number[at] if o == PUSH else x[int(number[at])]
        elif o in (AND, OR):
            if stack[top] == (0.0 if o == AND else 1.0):
                at += int(number[at])
        elif o < ADD:
            stack[top] = altered(o, stack[top], number[at])
        elif math.isnan(number[at]):
            top -= 1
            stack[top] = joined(o, stack[top], stack[top + 1])
        else:
            stack[top] = joined(o, stack[top], number[at])
        at += 1
    return stack[0] != 0.0
