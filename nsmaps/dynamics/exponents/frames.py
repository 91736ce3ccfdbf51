"""Frames of tangent vectors carried along orbits by derivatives, compiled."""

import math

import numpy as np

from nsmaps.exact.engine.jit import entry, inner


@inner
def inner_product(columns, i, j):
    """The inner product of two columns."""
    total = 0.0
    for a in range(len(columns)):
        total += columns[a, i] * columns[a, j]
    return total


@inner
def filled(columns, i):
    """Write into a column what remains of the axis farthest from the previous columns, which are orthonormal."""
    axis, least = 0, math.inf
    for a in range(len(columns)):
        held = 0.0
        for b in range(i):
            held += columns[a, b] * columns[a, b]
        if held < least:
            axis, least = a, held
    for a in range(len(columns)):
        along = 0.0
        for b in range(i):
            along += columns[a, b] * columns[axis, b]
        columns[a, i] = -along
    columns[axis, i] += 1.0


@inner
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
            for a in range(dim):
                columns[a, i], columns[a, left] = columns[a, left], columns[a, i]
            length = math.sqrt(inner_product(columns, i, i))
        growth[i] = math.log(length)
        if length == 0.0:
            filled(columns, i)
            length = math.sqrt(inner_product(columns, i, i))
        for a in range(dim):
            columns[a, i] /= length
        for j in range(i + 1, dim):
            along = inner_product(columns, i, j)
            for a in range(dim):
                columns[a, j] -= columns[a, i] * along


@entry
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
            for a in range(dim):
                for b in range(dim):
                    frames[k, a, b] = columns[a, b]
