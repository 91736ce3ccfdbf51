"""The compiled returns of a composite map: which piece holds each state, then its polynomials, for many states side by side."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.exact.compiled import njit
from nsmaps.exact.impacts import Outcome
from nsmaps.reduced.conditionkernel import TWO_PI, ask
from nsmaps.reduced.stripkernel import by_leaf

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 512  #: states side by side
MOST_TURNS = 2.0**31 - 1
RETURNED, UNCOVERED = int(Outcome.returned), int(Outcome.uncovered)
ESCAPED, INVALID = int(Outcome.escaped), int(Outcome.invalid)
NOWHERE, NO_STATE = -1, -2  #: instead of a piece: in none; NaN or infinite


class Tables(NamedTuple):
    """A composite map of P pieces over n coordinates in arrays: C operations of conditions, T terms of polynomials."""

    angle: NDArray[np.bool_]  #: shape (n,)
    operation: Ints  #: shape (C,), none where the regions are asked in Python
    number: Floats  #: shape (C,), that of each operation
    first_operation: Ints  #: shape (P + 1,), where the condition of each piece begins
    depth: int  #: places on the stack that the conditions need
    middle: Floats  #: shape (P, n), where the piece was fitted, of angles; NaN where the turn does not matter
    centre: Floats  #: shape (P, n)
    scale: Floats  #: shape (P, n)
    absolute: NDArray[np.bool_]  #: shape (P, n)
    degree: Ints  #: shape (P, n), the highest of each coordinate
    first_term: Ints  #: shape (P, n + 1), where the terms of each output begin
    exponent: Ints  #: shape (T, n), of each output in the order of the first coordinate, then of the next
    coefficient: Floats  #: shape (T,)
    until: Ints  #: shape (T,), where those that differ in the last coordinate alone end
    word: Ints  #: shape (P,), the code of each piece's word


class Work(NamedTuple):
    """Where numbers of a block of states are put meanwhile."""

    x: Floats  #: shape (n, BLOCK), states
    stack: Floats  #: shape (depth, BLOCK)
    left: Ints  #: shape (BLOCK,), the states that no piece holds so far
    basis: Floats  #: shape (n, degrees, BLOCK), Chebyshev polynomials
    inner: Floats  #: shape (BLOCK,)
    total: Floats  #: shape (n, BLOCK), images, angles not wrapped


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def wrapped(x):
    """An angle brought to [0, 2 pi), to the last bit as by the remainder, which takes longer."""
    if 0.0 <= x < TWO_PI:
        return x + 0.0  # of -0.0 it is 0.0
    if TWO_PI <= x < 2.0 * TWO_PI:
        return x - TWO_PI
    angle = x + TWO_PI if -TWO_PI <= x < 0.0 else x % TWO_PI
    return angle if angle < TWO_PI else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def pieces_of(tables, work, states, piece):
    """Write the number of the first piece that holds each state, shape (N, n), or NOWHERE or NO_STATE."""
    x, left, angle, first = work.x, work.left, tables.angle, tables.first_operation
    for begin in range(0, len(states), BLOCK):
        count = 0
        for i in range(begin, min(begin + BLOCK, len(states))):
            finite = True
            for j in range(len(angle)):
                x[j, count] = wrapped(states[i, j]) if angle[j] else states[i, j]
                finite = finite and math.isfinite(states[i, j])
            piece[i] = NOWHERE if finite else NO_STATE
            if finite:
                left[count] = i
                count += 1
        for k in range(len(first) - 1):
            if count == 0:
                break
            ask(tables.operation, tables.number, first[k], first[k + 1], x, count, work.stack)
            kept = 0
            for c in range(count):
                if work.stack[0, c] != 0.0:
                    piece[left[c]] = k
                else:
                    left[kept] = left[c]
                    for j in range(len(x)):
                        x[j, kept] = x[j, c]
                    kept += 1
            count = kept


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def chebyshev(degree, basis):
    """Chebyshev polynomials from the second on up to a degree, of a block."""
    basis[0] = 1.0
    for d in range(2, degree + 1):
        for c in range(basis.shape[1]):
            basis[d, c] = basis[d - 1, c] * (2.0 * basis[1, c]) - basis[d - 2, c]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def polynomial(tables, at, end, basis, inner, total):
    """The sum of some terms, of a block: those that differ in the last coordinate alone are added up first."""
    n = tables.exponent.shape[1]
    total[:] = 0.0
    while at < end:
        inner[:] = 0.0
        for t in range(at, tables.until[at]):
            term, last = tables.coefficient[t], basis[n - 1, tables.exponent[t, n - 1]]
            for c in range(len(inner)):
                inner[c] += term * last[c]
        for j in range(n - 1):
            if tables.exponent[at, j] > 0:
                factor = basis[j, tables.exponent[at, j]]
                for c in range(len(inner)):
                    inner[c] *= factor[c]
        at = tables.until[at]
        for c in range(len(inner)):
            total[c] += inner[c]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def evaluate(tables, k, work, states, order):
    """Images by one piece of some of the states, angles not wrapped, written into `work.total`."""
    n, count = states.shape[1], len(order)
    for j in range(n):
        centre, scale, middle = tables.centre[k, j], tables.scale[k, j], tables.middle[k, j]
        basis, turned = work.basis[j, :, :count], not math.isnan(middle)
        for c in range(count):
            x = states[order[c], j]
            near = x - TWO_PI * np.rint((x - middle) / TWO_PI) if turned else x
            basis[1, c], work.x[j, c] = (near - centre) / scale, x - near
        chebyshev(tables.degree[k, j], basis)
    for i in range(n):
        at, end, total = tables.first_term[k, i], tables.first_term[k, i + 1], work.total[i, :count]
        polynomial(tables, at, end, work.basis[:, :, :count], work.inner[:count], total)
        for c in range(count):
            value = abs(total[c]) if tables.absolute[k, i] else total[c]
            total[c] = value + work.x[i, c] if tables.angle[i] else value


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def finish(angle, lifted, c, i, image, turns):
    """Write one of the images of a block, angles wrapped, and its whole turns; the outcome."""
    for j in range(len(lifted)):
        if not math.isfinite(lifted[j, c]):
            return ESCAPED
    for j in range(len(lifted)):
        image[i, j] = lifted[j, c]
        if angle[j]:
            image[i, j] = wrapped(lifted[j, c])
            turns[i, j] = min(max(np.rint((lifted[j, c] - image[i, j]) / TWO_PI), -MOST_TURNS - 1.0), MOST_TURNS)
    return RETURNED


@njit(cache=True, nogil=True, error_model="numpy")
def images(tables, work, states, piece, image, turns, codes, outcome):
    """Write what `Returns` holds of states (N, n) whose pieces are known."""
    image[:] = math.nan
    turns[:], codes[:] = 0, 0
    for i in range(len(piece)):
        outcome[i] = INVALID if piece[i] == NO_STATE else UNCOVERED
    order, first = by_leaf(piece, len(tables.word))
    for k in range(len(tables.word)):
        for begin in range(first[k], first[k + 1], BLOCK):
            block = order[begin : min(begin + BLOCK, first[k + 1])]
            evaluate(tables, k, work, states, block)
            for c in range(len(block)):
                i = block[c]
                codes[i] = tables.word[k]
                outcome[i] = finish(tables.angle, work.total, c, i, image, turns)
