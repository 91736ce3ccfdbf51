"""Frames of tangent vectors carried along orbits by derivatives, compiled."""

import math

import numpy as np

from nsmaps.exact.compiling.compiled import njit


@njit(cache=True, nogil=True, error_model="numpy")
def inner_product(columns, i, j):
    """The inner product of two columns."""
    total = 0.0
    for a in range(len(columns)):
        total += columns[a, i] * columns[a, j]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def orthonormalized(columns, growth):
    """Make the columns of a frame orthonormal in place, by modified Gram-Schmidt, and write the logarithms of their lengths.

    Columns of zero length, where a return is constant in a direction, come last, and are replaced by remaining directions.
    """
    dim = len(columns)
    left = dim
    for i in range(dim):
        length = math.sqrt(inner_product(columns, i, i))
        while length == 0.0 and i + 1 < left:
            left -= 1
            columns[:, i], columns[:, left] = columns[:, left].copy(), columns[:, i].copy()
            length = math.sqrt(inner_product(columns, i, i))
        growth[i] = math.log(length)
        if length == 0.0:
            axis = np.argmin((columns[:, :i] ** 2).sum(axis=1))  # the farthest from the previous columns
            columns[:, i] = -(columns[:, :i] * columns[axis, :i]).sum(axis=1)
            columns[axis, i] += 1.0
            length = math.sqrt(inner_product(columns, i, i))
        for a in range(dim):
            columns[a, i] /= length
        for j in range(i + 1, dim):
            along = inner_product(columns, i, j)
            for a in range(dim):
                columns[a, j] -= columns[a, i] * along


@njit(cache=True, nogil=True, error_model="numpy")
def carried(derivatives, frames, growth):
    """Carry M frames, shape (M, dim, dim), through n derivatives, shape (n, M, dim, dim), in place; write (n, M, dim) growths."""
    dim = frames.shape[1]
    columns = np.empty((dim, dim))
    for i in range(len(derivatives)):
        for k in range(len(frames)):
            for a in range(dim):
                for b in range(dim):
                    total = 0.0
                    for c in range(dim):
                        total += derivatives[i, k, a, c] * frames[k, c, b]
                    columns[a, b] = total
            orthonormalized(columns, growth[i, k])
            frames[k] = columns
