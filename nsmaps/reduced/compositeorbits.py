"""The compiled orbits of a composite map: one state at a time, with the numbers of `compositekernel` to the last bit."""

import math

import numpy as np

from nsmaps.exact.compiled import njit
from nsmaps.reduced.compositekernel import INVALID, UNCOVERED, finish, wrapped
from nsmaps.reduced.conditionkernel import TWO_PI, holds


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def piece_of(tables, x, stack):
    """The number of the first piece that holds a finite state, -1 where there is none."""
    first = tables.first_operation
    for k in range(len(first) - 1):
        if holds(tables.operation, tables.number, first[k], first[k + 1], x, stack):
            return k
    return -1


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def polynomial(tables, at, end, basis):
    """The sum of some terms: those that differ in the last coordinate alone are added up first."""
    last, total = tables.exponent.shape[1] - 1, 0.0
    while at < end:
        inner = 0.0
        for t in range(at, tables.until[at]):
            inner += tables.coefficient[t] * basis[last, tables.exponent[t, last], 0]
        for j in range(last):
            if tables.exponent[at, j] > 0:
                inner *= basis[j, tables.exponent[at, j], 0]
        total += inner
        at = tables.until[at]
    return total


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def evaluate(tables, k, state, basis, lifted):
    """The image of a state by a piece, angles not wrapped."""
    for j in range(len(state)):
        x, middle = state[j], tables.middle[k, j]
        near = x if math.isnan(middle) else x - TWO_PI * np.rint((x - middle) / TWO_PI)
        s = (near - tables.centre[k, j]) / tables.scale[k, j]
        basis[j, 0, 0], basis[j, 1, 0] = 1.0, s
        for d in range(2, tables.degree[k, j] + 1):
            basis[j, d, 0] = basis[j, d - 1, 0] * (2.0 * s) - basis[j, d - 2, 0]
        lifted[j, 0] = x - near
    for i in range(len(state)):
        value = polynomial(tables, tables.first_term[k, i], tables.first_term[k, i + 1], basis)
        value = abs(value) if tables.absolute[k, i] else value
        lifted[i, 0] = value + lifted[i, 0] if tables.angle[i] else value


@njit(cache=True, nogil=True, error_model="numpy")
def orbits(tables, work, states, turns, codes, outcome):
    """Orbits of M states, written behind them into states (n + 1, M, dim); how one ended is repeated to the last."""
    x, stack = work.x[:, 0].copy(), work.stack[:, 0].copy()
    states[1:], turns[:], codes[:] = math.nan, 0, 0
    for m in range(codes.shape[1]):
        for i in range(len(codes)):
            state, finite = states[i, m], True
            for j in range(len(x)):
                x[j] = wrapped(state[j]) if tables.angle[j] else state[j]
                finite = finite and math.isfinite(state[j])
            if not finite:
                outcome[i, m] = outcome[i - 1, m] if i > 0 else INVALID
                continue
            k = piece_of(tables, x, stack)
            if k < 0:
                outcome[i, m] = UNCOVERED
                continue
            evaluate(tables, k, state, work.basis, work.total)
            codes[i, m] = tables.word[k]
            outcome[i, m] = finish(tables.angle, work.total, 0, m, states[i + 1], turns[i])
