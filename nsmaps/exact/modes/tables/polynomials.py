"""The flow of a mode over its longest step, and the functions watched on the way, as polynomials that are linear in the start."""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.modes.tables.taylor import ORDER, TERMS

PLACES = np.minimum(np.arange(TERMS), ORDER).tolist()
#: coefficients over [0, 1] in the basis of Bernstein of the powers of x, (ORDER + 1, TERMS); the last is there twice
BERNSTEIN = np.array([[math.comb(i, k) / math.comb(ORDER, k) for i in PLACES] for k in range(ORDER + 1)])
LEFT_OUT = ORDER + 1  #: number of the first term that series do not have


def exponential_series(matrices: Floats) -> Floats:
    """The terms of the exponentials of matrices (M, N, N), shape (M, ORDER + 2, N, N), in more digits where there are any."""
    precise = matrices.astype(np.longdouble)
    terms = np.empty((ORDER + 2, *matrices.shape), np.longdouble)
    terms[:1] = np.eye(matrices.shape[1])
    for k, (before, term) in enumerate(pairwise(terms), start=1):
        np.matmul(before, precise, out=term)
        term /= k
    return np.ascontiguousarray(terms.swapaxes(0, 1))


def features_used(series: Floats) -> tuple[Ints, Ints]:
    """The features of polynomials (.., N, TERMS), those with more terms first, and how many have a term of a degree or above."""
    lengths = (np.arange(1, series.shape[-1] + 1) * (series != 0.0)).max(axis=-1)
    order = np.argsort(-lengths, axis=-1, kind="stable")
    return order, (lengths[..., None] > np.arange(series.shape[-1])).sum(axis=-2)


def twins_of(n: int, functions: Floats, modes: Ints) -> tuple[Ints, Floats]:
    """For each function (S, N) one of its mode that differs by a sign and a constant only, and the sign.

    It stands before it, with no others between them than such ones; a function without one is its own.
    """
    plain, twins, signs = np.delete(functions, n, axis=1), np.arange(len(functions)), np.ones(len(functions))
    for before, f in pairwise(range(len(functions))):
        g = twins[before]
        for sign in (-1.0, 1.0) if modes[f] == modes[g] else ():
            if np.array_equal(plain[f], sign * plain[g]):
                twins[f], signs[f] = g, sign
    return twins, signs


def differences(flows: Floats) -> tuple[Floats, Ints, Ints]:
    """The flows of states (M, n, N, TERMS), of some less that of another state where this has less than half of the terms.

    The numbers of these other states, (M, n), are their own for the rest; in the order given, (M, n), they come first.
    """
    flows, bases = flows.copy(), np.tile(np.arange(flows.shape[1]), (len(flows), 1))
    for rows, base in zip(flows, bases, strict=True):
        whole = rows.copy()
        for i, row in enumerate(whole):
            others = [j for j in range(len(rows)) if j != i and base[j] == j and i not in base[:i]]
            counts = [np.count_nonzero(row - whole[j]) for j in others]
            if others and 2 * min(counts) < np.count_nonzero(row):
                base[i] = others[int(np.argmin(counts))]
                rows[i] = row - whole[base[i]]
    return flows, bases, np.argsort(bases != np.arange(flows.shape[1]), axis=1, kind="stable")


def polynomials_of(n: int, flows: Floats, functions: Floats, modes: Ints, bounds: Floats) -> dict[str, Any]:
    """The fields of a table that describe polynomials in the time, in units of a mode's longest step.

    `flows`, shape (M, N, N), are the matrices of z' in these units, z with n states in front; `functions`, shape (S, N), are
    watched in `modes`, shape (S,), and `bounds` are those on remainders by the sizes of the features.
    """
    terms = exponential_series(flows)
    series = np.einsum("si,skij->sjk", functions, terms[modes, : ORDER + 1])
    sizes, points, bare = np.abs(series).astype(float), series @ BERNSTEIN, series[:, n].copy()
    bare[:, :1] = 0.0
    shapes = points.copy()
    shapes[:, n] = bare @ BERNSTEIN
    twins, signs = twins_of(n, functions, modes)
    weights = np.arange(ORDER + 1) * np.arange(-1, ORDER)
    changes = terms[:, 1 : ORDER + 1, :n].reshape(len(flows), ORDER, -1)
    propagators = np.zeros((len(flows), TERMS, n * flows.shape[1]))
    propagators[:, 1 : ORDER + 1] = changes
    by_feature = np.moveaxis(propagators, 1, 2).reshape(len(flows), n, flows.shape[1], TERMS)
    parts, bases, order = differences(by_feature)
    in_time = np.pad(series.astype(float), ((0, 0), (0, 0), (0, TERMS - ORDER - 1)))
    return {
        "propagators": propagators,
        "flows": parts,
        "flow_features": features_used(parts),
        "flow_bases": bases,
        "flow_order": order,
        "whole": changes.sum(axis=1).astype(float),
        "series": in_time,
        "series_features": features_used(in_time),
        "points": points.astype(float),
        "shapes": shapes.astype(float),
        "twins": twins,
        "signs": signs,
        "sizes": sizes.sum(axis=2),
        "bends": sizes @ weights,
        "left": np.einsum("si,sij->sj", bounds, np.abs(terms[modes, LEFT_OUT]).astype(float)),
    }
