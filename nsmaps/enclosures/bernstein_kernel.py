"""The compiled loop over boxes of polynomials in Bernstein form."""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.enclosures.intervals import EPS
from nsmaps.exact.engine.jit import entry, inner


class Tables(NamedTuple):
    """m polynomials in n coordinates: sums of S products of Chebyshev polynomials of degrees below K."""

    terms: Floats  #: shape (m, S), their coefficients, the degree of the last coordinate fastest
    weights: Floats  #: shape (m, S), absolute coefficients times the units by which rounding may move each product
    size: Ints  #: shape (n,), degrees of each coordinate, zero included
    after: Ints  #: shape (n,), places from one degree of a coordinate to the next
    degree: Ints  #: shape (n, S), of each coordinate in each product
    corner: Bools  #: shape (S,), whether each of these is least or highest
    centre: Floats  #: shape (n,)
    scale: Floats  #: shape (n,)
    blur: Floats  #: shape (m,), by how much the coefficients' own rounding may move a value for |x - centre| <= scale
    points: Floats  #: shape (n, K), the zeros of T_size
    interpolation: Floats  #: shape (n, K, K), from values there to Chebyshev coefficients, a row a point
    conversion: Floats  #: shape (n, K, K), the Bernstein coefficients of T_k in row k
    steepest: Floats  #: shape (S,), the largest absolute Bernstein coefficient of each product
    lebesgue: float  #: one and the Lebesgue constant of the interpolation


class Work(NamedTuple):
    """Memory for one box."""

    values: Floats  #: shape (m S,), values at the Chebyshev points, and what follows from them
    spare: Floats  #: shape (m S,)
    basis: Floats  #: shape (n, K, K), T_k in row k, at the points in columns
    growth: Floats  #: shape (n, K), bounds of T_0 to T_(K - 1), also beyond [-1, 1]
    level: Floats  #: shape (m,), the mean of the values
    own: Floats  #: shape (m,), what rounding may add between the values and the Bernstein coefficients


@inner
def transform(matrix, size, after, source, target):
    """Sum over the first index of a matrix (size, size) along one axis of an array (..., size, after), flattened as `source`."""
    for begin in range(0, len(source), size * after):
        for q in range(size):
            for a in range(begin, begin + after):
                total = 0.0
                for p in range(size):
                    total += source[a + p * after] * matrix[p, q]
                target[a + q * after] = total


@inner
def transform_all(tables, matrices, work):
    """Apply a matrix (n, K, K) along each axis to `work.values`, in place."""
    for j in range(len(tables.size)):
        transform(matrices[j], tables.size[j], tables.after[j], work.values, work.spare)
        for s in range(len(work.spare)):
            work.values[s] = work.spare[s]


@inner
def evaluate(tables, box, work):
    """Values at the Chebyshev points of a box (n, 2), less their mean; the scaled box that is used holds the given one."""
    m, terms = tables.terms.shape
    for j in range(len(box)):
        low, high = (box[j, 0] - tables.centre[j]) / tables.scale[j], (box[j, 1] - tables.centre[j]) / tables.scale[j]
        middle, half = (low + high) / 2, abs(high - low) / 2 + 8 * EPS * (abs(low) + abs(high))
        reach = max(abs(middle) + half, 1.0)
        work.growth[j, 0] = 1.0
        for k in range(1, tables.size[j]):
            work.growth[j, k] = work.growth[j, k - 1] * (reach + math.sqrt(reach**2 - 1))
        basis = work.basis[j]
        for q in range(tables.size[j]):
            x = middle + half * tables.points[j, q]
            basis[0, q] = 1.0
            for k in range(1, tables.size[j]):
                basis[k, q] = x if k == 1 else 2 * x * basis[k - 1, q] - basis[k - 2, q]
    for i in range(m):
        for s in range(terms):
            work.values[i * terms + s] = tables.terms[i, s]
    transform_all(tables, work.basis, work)
    for i in range(m):
        work.level[i] = work.values[i * terms : (i + 1) * terms].mean()
        for s in range(i * terms, (i + 1) * terms):
            work.values[s] -= work.level[i]


@inner
def margins(tables, work, margin):
    """What rounding may move a value at a point by, and the interpolation through such values, shape (m,).

    The recurrence of T_k errs by at most 3/2 k^2 units for |x| <= 1, a rounded x by 3 k^2 more; beyond, both grow like
    the k-th power of x + sqrt(x^2 - 1). Counted once more for images that are themselves evaluated in floats.
    """
    m, terms = tables.terms.shape
    highest = 1.0
    for j in range(len(tables.size)):
        highest *= work.growth[j, tables.size[j] - 1]
    for i in range(m):
        margin[i] = 0.0
    for s in range(terms):
        size = 1.0
        for j in range(len(tables.size)):
            size *= work.growth[j, tables.degree[j, s]]
        for i in range(m):
            margin[i] += size * tables.weights[i, s]
    for i in range(m):
        margin[i] = (EPS * margin[i] + tables.blur[i] * highest) * tables.lebesgue


@inner
def roundings(tables, swing, chebyshev, level):
    """What rounding may add between values, of absolute value `swing`, and Bernstein coefficients: it shrinks with the box."""
    steps, copies, largest = 0, 1, 0.0
    for size in tables.size:
        steps += size + 4
        copies *= 2 * size
    for s in range(len(chebyshev)):
        largest += abs(chebyshev[s]) * tables.steepest[s]
    return EPS * steps * (copies * swing + largest) + EPS * (abs(level) + swing)


@inner
def bounds(tables, flat, level, own, outer, taken):
    """Bounds from Bernstein coefficients (S,) about a level, and the values at corners; the places of the extremes."""
    least, largest, low, high = 0, 0, np.inf, -np.inf
    for s in range(len(flat)):
        if tables.corner[s]:
            low, high = min(low, flat[s]), max(high, flat[s])
        if flat[s] < flat[least]:
            least = s
        if flat[s] > flat[largest]:
            largest = s
    unknown = math.isnan(flat.sum())  # overflow
    outer[0] = np.nan if unknown else flat[least] + level - own
    outer[1] = np.nan if unknown else flat[largest] + level + own
    taken[0], taken[1] = low + level, high + level
    return least, largest


@inner
def steps_of(tables, flat, j):
    """Whether Bernstein coefficients (S,) rise or fall everywhere along coordinate j, and their largest second difference."""
    size, after, rises, falls, bend = tables.size[j], tables.after[j], True, True, 0.0
    for s in range(len(flat)):
        place = tables.degree[j, s]
        if place + 1 < size:
            step = flat[s + after] - flat[s]
            rises &= step > 0
            falls &= step < 0
            if place + 2 < size:
                bend = max(bend, abs(flat[s + 2 * after] - flat[s + after] - step))
    return rises, falls, bend


@inner
def locate(tables, flat, extremes, box, at, bend):
    """A box (n, 2) that holds the place of each of the extremes: an end where there is a corner or all is monotone."""
    for j in range(len(box)):
        size = tables.size[j]
        rises, falls, bent = steps_of(tables, flat, j)
        bend[j] = max(bend[j], bent)
        for side in range(2):
            sharp = size > 1 and tables.corner[extremes[side]]
            high = tables.degree[j, extremes[side]] == size - 1
            to_first, to_last = (rises, falls) if side == 0 else (falls, rises)
            at[side, j, 1] = box[j, 0] if (sharp and not high) or to_first else box[j, 1]
            at[side, j, 0] = box[j, 1] if (sharp and high) or to_last else box[j, 0]


@entry
def bernstein_hulls(tables, work, boxes, outer, taken, margin, at, bend):
    """Write the fields of `Hulls` of m polynomials over boxes (N, n, 2)."""
    m, terms = tables.terms.shape
    for i in range(len(boxes)):
        evaluate(tables, boxes[i], work)
        margins(tables, work, margin[i])
        for k in range(m):
            work.own[k] = 0.0
            for s in range(k * terms, (k + 1) * terms):
                work.own[k] = max(work.own[k], abs(work.values[s]))
        transform_all(tables, tables.interpolation, work)
        for k in range(m):
            chebyshev = work.values[k * terms : (k + 1) * terms]
            work.own[k] = roundings(tables, work.own[k], chebyshev, work.level[k])
        transform_all(tables, tables.conversion, work)
        for k in range(m):
            flat = work.values[k * terms : (k + 1) * terms]
            extremes = bounds(tables, flat, work.level[k], work.own[k], outer[i, k], taken[i, k])
            locate(tables, flat, extremes, boxes[i], at[i, k], bend[i])
