"""The compiled returns of a composite map: the piece that contains each state, then its polynomials, for blocks of states."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.flight.remainders import wave
from nsmaps.exact.engine.jit import inlined, long_entry
from nsmaps.exact.outcome import Outcome
from nsmaps.reduced.conditions.interpreter import evaluate_condition

BLOCK = 512  #: states of a block
MOST_TURNS = 2.0**31 - 1
RETURNED, UNCOVERED = int(Outcome.returned), int(Outcome.uncovered)
ESCAPED, INVALID = int(Outcome.escaped), int(Outcome.invalid)
ITSELF, SINE, COSINE = range(3)  #: kinds of variables of one coordinate; waves are those of an angle near the turn of a fit
NOWHERE, NO_STATE = -1, -2  #: in place of a piece: in none; NaN or infinite


class CompositeTables(NamedTuple):
    """A composite map of P pieces over n coordinates in arrays: C operations, T terms of polynomials in at most K variables."""

    angle: NDArray[np.bool_]  #: shape (n,)
    operation: Ints  #: shape (C,), of conditions, and of variables that are formulas
    number: Floats  #: shape (C,), that of each operation
    first_operation: Ints  #: shape (P + 1,), where the condition of each piece begins
    depth: int  #: places on the stack that the conditions need
    middle: Floats  #: shape (P, n), where the piece was fitted, of angles; NaN where the turn does not matter
    variables: Ints  #: shape (P,), number of variables of each piece
    column: Ints  #: shape (P, K), the coordinate that a variable is, or is the wave of; -1 if it is another formula
    kind: Ints  #: shape (P, K), which it is of that coordinate: itself, its SINE or COSINE
    first_formula: Ints  #: shape (P, K + 1), where the operations of each variable begin
    centre: Floats  #: shape (P, K)
    scale: Floats  #: shape (P, K)
    absolute: NDArray[np.bool_]  #: shape (P, n)
    degree: Ints  #: shape (P, K), the highest of each variable
    first_term: Ints  #: shape (P, n + 1), where the terms of each output begin
    exponent: Ints  #: shape (T, K), of each output in the order of the first variable, then of the next
    coefficient: Floats  #: shape (T,)
    until: Ints  #: shape (T,), where those that differ in the last variable alone end
    word: Ints  #: shape (P,), the code of each piece's word


class Work(NamedTuple):
    """Memory for the numbers of a block of states."""

    x: Floats  #: shape (n, BLOCK), the states that no piece contains so far, angles in [0, 2 pi)
    left: Ints  #: shape (BLOCK,), their numbers
    stack: Floats  #: shape (max(depth, 1), BLOCK)
    held: Ints  #: shape (BLOCK,), the numbers of the states that a piece contains
    near: Floats  #: shape (n, BLOCK), those states, angles on the turn of the piece's fit
    turn: Floats  #: shape (n, BLOCK), radians by which an angle exceeds that turn
    basis: Floats  #: shape (K, degrees, BLOCK), Chebyshev polynomials
    group: Floats  #: shape (BLOCK,), the sum of terms that differ in the last variable alone
    total: Floats  #: shape (n, BLOCK), images, angles not wrapped


@inlined
def wrapped(x):
    """An angle reduced to [0, 2 pi), to the last bit as by the remainder, which takes longer."""
    if 0.0 <= x < TWO_PI:
        return x + 0.0  # of -0.0 it is 0.0
    if TWO_PI <= x < 2.0 * TWO_PI:
        return x - TWO_PI
    angle = x + TWO_PI if -TWO_PI <= x < 0.0 else x % TWO_PI
    return angle if angle < TWO_PI else 0.0


@inlined
def load(tables, work, states, begin, end, piece):
    """Read the states from `begin` to `end` into the block; the number of those that are finite."""
    count = 0
    for i in range(begin, end):
        finite = True
        for j in range(len(tables.angle)):
            x = states[i, j]
            finite = finite and math.isfinite(x)
            work.x[j, count] = wrapped(x) if tables.angle[j] else x
        if not finite:
            piece[i] = NO_STATE
            continue
        piece[i] = NOWHERE
        work.left[count] = i
        count += 1
    return count


@inlined
def divide(tables, work, k, count, piece):
    """Divide the remaining states into those that piece k contains, now in `work.held`, and the others: the numbers of both."""
    x, left, held, first = work.x, work.left, work.held, tables.first_operation
    evaluate_condition(tables.operation, tables.number, first[k], first[k + 1], x, count, work.stack)
    many, kept = 0, 0
    for c in range(count):
        i = left[c]
        if work.stack[0, c] != 0.0:
            piece[i] = k
            held[many] = i
            many += 1
        else:
            left[kept] = i
            for j in range(len(x)):
                x[j, kept] = x[j, c]
            kept += 1
    return many, kept


@long_entry
def pieces_of(tables, work, states, piece):
    """Write the number of the first piece that contains each state, shape (N, n), or NOWHERE or NO_STATE."""
    for begin in range(0, len(states), BLOCK):
        count = load(tables, work, states, begin, min(begin + BLOCK, len(states)), piece)
        for k in range(len(tables.word)):
            if count > 0:
                _, count = divide(tables, work, k, count, piece)


@inlined
def own_values(kind, x, value, count):
    """Write a coordinate, or its sine or cosine, of `count` states; each has a loop that runs in vector instructions."""
    if kind == SINE:
        for c in range(count):
            value[c] = wave(x[c])[1]
    elif kind == COSINE:
        for c in range(count):
            value[c] = 1.0 + wave(x[c])[0]
    else:
        for c in range(count):
            value[c] = x[c]


@inlined
def chebyshev(tables, work, k, states, count):
    """Write the Chebyshev polynomials of the variables of the states that piece k contains, and the turns of their angles."""
    near, basis = work.near, work.basis
    for j in range(len(tables.angle)):
        middle = tables.middle[k, j]
        turned = not math.isnan(middle)
        for c in range(count):
            x = states[work.held[c], j]
            near[j, c] = x - TWO_PI * np.rint((x - middle) / TWO_PI) if turned else x
            work.turn[j, c] = x - near[j, c]
    for j in range(tables.variables[k]):
        column, centre, scale = tables.column[k, j], tables.centre[k, j], tables.scale[k, j]
        if column < 0:
            first = tables.first_formula[k]
            evaluate_condition(tables.operation, tables.number, first[j], first[j + 1], near, count, work.stack)
            for c in range(count):
                basis[j, 1, c] = work.stack[0, c]
        else:
            own_values(tables.kind[k, j], near[column], basis[j, 1], count)
        for c in range(count):
            basis[j, 0, c], basis[j, 1, c] = 1.0, (basis[j, 1, c] - centre) / scale
        for d in range(2, tables.degree[k, j] + 1):
            for c in range(count):
                basis[j, d, c] = basis[j, d - 1, c] * (2.0 * basis[j, 1, c]) - basis[j, d - 2, c]


@inlined
def polynomial(tables, work, k, i, count):
    """Write output i of piece k, angles not wrapped: terms that differ in the last variable alone are added up first."""
    basis, group, total, last = work.basis, work.group, work.total, tables.variables[k] - 1
    at, end = tables.first_term[k, i], tables.first_term[k, i + 1]
    for c in range(count):
        total[i, c] = 0.0
    while at < end:
        for c in range(count):
            group[c] = 0.0
        for t in range(at, tables.until[at]):
            coefficient, d = tables.coefficient[t], tables.exponent[t, last]
            for c in range(count):
                group[c] += coefficient * basis[last, d, c]
        for j in range(last):
            d = tables.exponent[at, j]
            if d > 0:
                for c in range(count):
                    group[c] *= basis[j, d, c]
        for c in range(count):
            total[i, c] += group[c]
        at = tables.until[at]
    for c in range(count):
        value = abs(total[i, c]) if tables.absolute[k, i] else total[i, c]
        total[i, c] = value + work.turn[i, c] if tables.angle[i] else value


@inlined
def write_image(tables, lifted, c, i, image, turns):
    """Write one image, angles wrapped, and its whole turns, of the numbers (n, BLOCK); the outcome."""
    finite = True
    for j in range(len(lifted)):
        finite = finite and math.isfinite(lifted[j, c])
    for j in range(len(lifted)):
        turns[i, j], image[i, j] = 0, lifted[j, c] if finite else math.nan
        if finite and tables.angle[j]:
            image[i, j] = wrapped(lifted[j, c])
            turns[i, j] = min(max(np.rint((lifted[j, c] - image[i, j]) / TWO_PI), -MOST_TURNS - 1.0), MOST_TURNS)
    return RETURNED if finite else ESCAPED


@inlined
def write_none(i, image, turns):
    """Write that a state has no image."""
    for j in range(image.shape[1]):
        turns[i, j], image[i, j] = 0, math.nan


@inlined
def advance(tables, work, states, begin, end, piece, image, turns, codes, outcome):
    """Write the fields of `Returns` for the states from `begin` to `end`, at most BLOCK of them."""
    count = load(tables, work, states, begin, end, piece)
    for k in range(len(tables.word)):
        if count == 0:
            break
        held, count = divide(tables, work, k, count, piece)
        if held == 0:
            continue
        chebyshev(tables, work, k, states, held)
        for i in range(len(tables.angle)):
            polynomial(tables, work, k, i, held)
        for c in range(held):
            i = work.held[c]
            codes[i], outcome[i] = tables.word[k], write_image(tables, work.total, c, i, image, turns)
    for i in range(begin, end):
        if piece[i] < 0:
            write_none(i, image, turns)
            codes[i], outcome[i] = 0, INVALID if piece[i] == NO_STATE else UNCOVERED


@long_entry
def orbits(tables, work, start, piece, image, turns, codes, outcome):
    """Write the fields of `Returns` for the first n returns of M states (M, dim), each array of shape (n, M, ...).

    The outcome that ended an orbit is repeated to the last return.
    """
    for begin in range(0, len(start), BLOCK):
        end = min(begin + BLOCK, len(start))
        for i in range(len(outcome)):
            states = start if i == 0 else image[i - 1]
            advance(tables, work, states, begin, end, piece[i], image[i], turns[i], codes[i], outcome[i])
            if i > 0:
                for m in range(begin, end):
                    if piece[i, m] == NO_STATE:
                        outcome[i, m] = outcome[i - 1, m]
