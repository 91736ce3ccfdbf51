"""The compiled returns of a composite map: which piece holds a state, then its polynomials, again and again."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nsmaps.exact.impacts import Outcome
from nsmaps.reduced import conditioncode as code

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TWO_PI = 2 * math.pi
MOST_TURNS = 2.0**31 - 1
RETURNED, UNCOVERED = int(Outcome.returned), int(Outcome.uncovered)
ESCAPED, INVALID = int(Outcome.escaped), int(Outcome.invalid)
PUSH, LOAD, NEAR, NOT, AND, OR = code.PUSH, code.LOAD, code.NEAR, code.NOT, code.AND, code.OR
ADD, SUB, MUL, DIV, POW, NEG = code.ADD, code.SUB, code.MUL, code.DIV, code.POW, code.NEG
SQRT, SIN, COS, EXP, LOG = code.SQRT, code.SIN, code.COS, code.EXP, code.LOG
LT, LE, GT, GE, EQ, NE = code.LT, code.LE, code.GT, code.GE, code.EQ, code.NE


class Tables(NamedTuple):
    """A composite map of P pieces over n coordinates in arrays: C operations of conditions, T terms of polynomials."""

    angle: NDArray[np.bool_]  #: shape (n,)
    operation: Ints  #: shape (C,)
    number: Floats  #: shape (C,), that of each operation
    first_operation: Ints  #: shape (P + 1,), where the condition of each piece begins
    middle: Floats  #: shape (P, n), where the piece was fitted, of angles; NaN where the turn does not matter
    centre: Floats  #: shape (P, n)
    scale: Floats  #: shape (P, n)
    absolute: NDArray[np.bool_]  #: shape (P, n)
    degree: Ints  #: shape (P, n), the highest of each coordinate
    first_term: Ints  #: shape (P, n + 1), where the terms of each output begin
    exponent: Ints  #: shape (T, n)
    coefficient: Floats  #: shape (T,)
    word: Ints  #: shape (P,), the code of each piece's word


class Work(NamedTuple):
    """Where numbers are put meanwhile."""

    stack: Floats  #: as many as a condition can need
    x: Floats  #: shape (n,), the state
    lifted: Floats  #: shape (n,), its image, angles not wrapped
    basis: Floats  #: shape (n, degrees), Chebyshev polynomials


@njit(cache=True, nogil=True, error_model="numpy")
def power(a, b):
    """As NumPy has it, with the powers that it treats apart."""
    if b == 2.0:
        return a * a
    if b == 0.5:
        return math.sqrt(a)
    return 1.0 / a if b == -1.0 else a**b


@njit(cache=True, nogil=True, error_model="numpy")
def joined(o, a, b):
    """Two numbers by an operation or a comparison."""
    if o == ADD:
        return a + b
    if o == SUB:
        return a - b
    if o == MUL:
        return a * b
    if o == DIV:
        return a / b
    if o == POW:
        return power(a, b)
    if o in (LT, LE):
        true = a < b or (o == LE and a == b)
    elif o in (GT, GE):
        true = a > b or (o == GE and a == b)
    else:
        true = (a == b) == (o == EQ)
    return 1.0 if true else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def changed(o, a, number):
    """One number by an operation."""
    if o == NEAR:
        return a - TWO_PI * np.rint((a - number) / TWO_PI)
    if o == NOT:
        return 1.0 if a == 0.0 else 0.0
    if o == NEG:
        return -a
    if o == SQRT:
        return math.sqrt(a)
    if o == SIN:
        return math.sin(a)
    if o == COS:
        return math.cos(a)
    return math.exp(a) if o == EXP else math.log(a)


@njit(cache=True, nogil=True, error_model="numpy")
def holds(operation, number, at, end, x, stack):
    """Whether the condition whose code stands in a range holds at a state."""
    top = -1
    while at < end:
        o = operation[at]
        if o == PUSH:
            top += 1
            stack[top] = number[at]
        elif o == LOAD:
            top += 1
            stack[top] = x[int(number[at])]
        elif o in (AND, OR):
            if (stack[top] == 0.0) == (o == AND):
                at += int(number[at])
            else:
                top -= 1
        elif o in (ADD, SUB, MUL, DIV, POW) or o >= LT:
            top -= 1
            stack[top] = joined(o, stack[top], stack[top + 1])
        else:
            stack[top] = changed(o, stack[top], number[at])
        at += 1
    return stack[0] != 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def piece_of(tables, x, stack):
    """The number of the first piece that holds a finite state, -1 where there is none."""
    first = tables.first_operation
    for k in range(len(first) - 1):
        if holds(tables.operation, tables.number, first[k], first[k + 1], x, stack):
            return k
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def chebyshev(degree, s, basis):
    """Chebyshev polynomials up to a degree."""
    basis[0] = 1.0
    if degree > 0:
        basis[1] = s
    for d in range(2, degree + 1):
        basis[d] = basis[d - 1] * (2.0 * s) - basis[d - 2]


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate(tables, k, work):
    """The image of a state by a piece, angles not wrapped; whether it is finite."""
    n, finite = len(work.x), True
    for j in range(n):
        near = work.x[j]
        if not math.isnan(tables.middle[k, j]):
            near = changed(NEAR, near, tables.middle[k, j])
        chebyshev(tables.degree[k, j], (near - tables.centre[k, j]) / tables.scale[k, j], work.basis[j])
        work.lifted[j] = work.x[j] - near if tables.angle[j] else 0.0
    for i in range(n):
        total = 0.0
        for t in range(tables.first_term[k, i], tables.first_term[k, i + 1]):
            term = tables.coefficient[t]
            for j in range(n):
                term *= work.basis[j, tables.exponent[t, j]]
            total += term
        work.lifted[i] += abs(total) if tables.absolute[k, i] else total
        finite = finite and math.isfinite(work.lifted[i])
    return finite


@njit(cache=True, nogil=True, error_model="numpy")
def step(tables, work, x, image, turns):
    """How the first return of one state ends, and the word of its piece; its image and its turns are written."""
    image[:] = math.nan
    turns[:] = 0
    for j in range(len(x)):
        if not math.isfinite(x[j]):
            return INVALID, 0
        work.x[j] = x[j] % TWO_PI if tables.angle[j] else x[j]
        if tables.angle[j] and work.x[j] >= TWO_PI:
            work.x[j] = 0.0
    k = piece_of(tables, work.x, work.stack)
    if k < 0:
        return UNCOVERED, 0
    work.x[:] = x
    if not evaluate(tables, k, work):
        return ESCAPED, tables.word[k]
    for i in range(len(x)):
        image[i] = work.lifted[i]
        if tables.angle[i]:
            angle = work.lifted[i] % TWO_PI
            image[i] = angle if angle < TWO_PI else 0.0
            turns[i] = min(max(np.rint((work.lifted[i] - image[i]) / TWO_PI), -MOST_TURNS - 1), MOST_TURNS)
    return RETURNED, tables.word[k]


@njit(cache=True, nogil=True, error_model="numpy")
def orbits(tables, work, states, turns, codes, outcome):
    """Orbits of M states, written behind them into states (n + 1, M, dim); how one ended is repeated to the last."""
    n, m = codes.shape
    for k in range(m):
        for i in range(n):
            outcome[i, k], codes[i, k] = step(tables, work, states[i, k], states[i + 1, k], turns[i, k])
            if i > 0 and outcome[i, k] == INVALID:
                outcome[i, k] = outcome[i - 1, k]
