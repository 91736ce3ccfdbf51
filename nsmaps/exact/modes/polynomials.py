"""The flow of a mode over its longest step, and the functions watched on the way, as polynomials that are linear in the start."""

import math
from typing import Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.modes.taylor import ORDER, TERMS


def bernstein() -> Floats:
    """Coefficients over [0, 1] in the basis of Bernstein of the powers of x, (ORDER + 1, TERMS); the last is there twice."""
    places = np.minimum(np.arange(TERMS), ORDER)
    return np.array([[math.comb(i, k) / math.comb(ORDER, k) for i in places.tolist()] for k in range(ORDER + 1)])


BERNSTEIN = bernstein()


def exponential_series(matrix: Floats) -> Floats:
    """The terms of the exponential of a matrix (N, N), shape (ORDER + 2, N, N), in more digits where the processor has them."""
    terms = [np.eye(len(matrix), dtype=np.longdouble)]
    for k in range(1, ORDER + 2):
        terms.append(terms[-1] @ matrix.astype(np.longdouble) / k)
    return np.array(terms)


def polynomials_of(n: int, flows: Floats, functions: Floats, modes: Ints, bounds: Floats) -> dict[str, Any]:
    """The fields of a table that describe polynomials in the time, in units of a mode's longest step.

    `flows`, shape (M, N, N), are the matrices of z' in these units, z with n states in front; `functions`, shape (S, N), are
    watched in `modes`, shape (S,), and `bounds` are those on remainders by the sizes of the features.
    """
    terms = np.array([exponential_series(flow) for flow in flows])
    series = np.einsum("si,skij->sjk", functions, terms[modes, : ORDER + 1])
    sizes, points = np.abs(series).astype(float), series @ BERNSTEIN
    weights = np.arange(ORDER + 1) * np.arange(-1, ORDER)
    changes = terms[:, 1 : ORDER + 1, :n].reshape(len(flows), ORDER, -1)
    propagators = np.zeros((len(flows), TERMS, n * flows.shape[1]))
    propagators[:, 1 : ORDER + 1] = changes
    return {
        "propagators": propagators,
        "flows": np.moveaxis(propagators, 1, 2).reshape(len(flows), n, flows.shape[1], TERMS).copy(),
        "whole": changes.sum(axis=1).astype(float),
        "series": np.pad(series.astype(float), ((0, 0), (0, 0), (0, TERMS - ORDER - 1))),
        "points": points.astype(float),
        "sizes": sizes.sum(axis=2),
        "bends": sizes @ weights,
        "left": np.einsum("si,sij->sj", bounds, np.abs(terms[modes, ORDER + 1]).astype(float)),
    }
