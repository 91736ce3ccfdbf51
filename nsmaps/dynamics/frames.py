"""Frames of tangent vectors carried along orbits by derivatives, compiled."""

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def orthonormalized(columns, growth):
    """Make the columns of a frame orthonormal in place, by modified Gram-Schmidt, and write the logarithms of their lengths."""
    lost = False
    for i in range(len(columns)):
        length = math.sqrt((columns[:, i] ** 2).sum())
        growth[i] = math.log(length)
        lost = lost or length == 0.0
        columns[:, i] /= length if length != 0.0 else 1.0
        for j in range(i + 1, len(columns)):
            columns[:, j] -= columns[:, i] * (columns[:, i] * columns[:, j]).sum()
    if lost:  # a return that forgets a direction: any frame does
        for i in range(len(columns)):
            columns[i] = 0.0
            columns[i, i] = 1.0


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
