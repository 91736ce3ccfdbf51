"""Frames of tangent vectors carried along orbits by derivatives, compiled."""

import math

import numpy as np

from nsmaps.exact.compiled import njit


@njit(cache=True, nogil=True, error_model="numpy")
def orthonormalized(columns, growth):
    """Make the columns of a frame orthonormal in place, by modified Gram-Schmidt, and write the logarithms of their lengths.

    Columns that have no length, where a return forgets a direction, go last, and turn to directions that are left.
    """
    left = len(columns)
    for i in range(len(columns)):
        length = math.sqrt((columns[:, i] ** 2).sum())
        while length == 0.0 and i + 1 < left:
            left -= 1
            columns[:, i], columns[:, left] = columns[:, left].copy(), columns[:, i].copy()
            length = math.sqrt((columns[:, i] ** 2).sum())
        growth[i] = math.log(length)
        if length == 0.0:
            axis = np.argmin((columns[:, :i] ** 2).sum(axis=1))  # the farthest from the columns before
            columns[:, i] = -(columns[:, :i] * columns[axis, :i]).sum(axis=1)
            columns[axis, i] += 1.0
            length = math.sqrt((columns[:, i] ** 2).sum())
        columns[:, i] /= length
        for j in range(i + 1, len(columns)):
            columns[:, j] -= columns[:, i] * (columns[:, i] * columns[:, j]).sum()


@njit(cache=True, nogil=True, error_model="numpy")
def carried(derivatives, frames, growth):
    """Carry M frames, shape (M, dim, dim), through n derivatives, shape (n, M, dim, dim), in place; write (n, M, dim) growths."""
    dim = frames.shape[1]
    columns = np.empty((dim, dim))
    for i in range(len(derivatives)):
        for k in range(len(frames)):
            for a in range(dim):
                for b in range(dim):
                    columns[a, b] = (derivatives[i, k, a] * frames[k, :, b]).sum()
            frames[k] = columns
            orthonormalized(frames[k], growth[i, k])
