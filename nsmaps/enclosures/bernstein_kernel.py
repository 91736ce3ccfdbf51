"""The compiled loop over boxes of polynomials in Bernstein form: for blocks of boxes, a column each.

What is done with each box is the same in every block, operation by operation; loops over columns become vector instructions.
"""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.enclosures.intervals import EPS
from nsmaps.exact.engine.jit import entry, inner

BLOCK = 32  #: most boxes of a block


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
    """Memory for a block of B boxes."""

    values: Floats  #: shape (m S, B), values at the Chebyshev points, and what follows from them
    spare: Floats  #: shape (m S, B)
    basis: Floats  #: shape (n, K, K, B), T_k in row k, at the points in columns
    growth: Floats  #: shape (n, K, B), bounds of T_0 to T_(K - 1), also beyond [-1, 1]
    level: Floats  #: shape (m, B), the mean of the values
    own: Floats  #: shape (m, B), what rounding may add between the values and the Bernstein coefficients
    margin: Floats  #: shape (m, B), what it may move a value by
    row: Floats  #: shape (8, B), of numbers of each box
    place: Ints  #: shape (2, B), numbers of the least and the largest Bernstein coefficient
    monotone: Bools  #: shape (2, B), whether coefficients rise, and whether they fall


def work_for(tables: Tables, count: int) -> Work:
    """Memory for blocks of `count` boxes, or of fewer where these are many."""
    (m, terms), (n, k), size = tables.terms.shape, tables.points.shape, max(1, min(count, BLOCK))
    shapes = (m * terms,), (m * terms,), (n, k, k), (n, k), (m,), (m,), (m,), (8,)
    numbers = [np.empty((*shape, size)) for shape in shapes]
    return Work._make([*numbers, np.empty((2, size), np.int64), np.empty((2, size), bool)])


@inner
def add_product(total, row, weight, count):
    """Add a row (B,) times a number to a total (B,)."""
    for i in range(count):
        total[i] += row[i] * weight


@inner
def add_products(total, row, weight, count):
    """The same, times a number for each box, shape (B,)."""
    for i in range(count):
        total[i] += row[i] * weight[i]


@inner
def transform(tables, j, matrix, add, work, count):
    """Sum over the first index of a matrix, shape (K, K) or (K, K, B), along coordinate j of `work.values`; `add` adds a term."""
    source, target, size, after = work.values, work.spare, tables.size[j], tables.after[j]
    for begin in range(0, len(source), size * after):
        for q in range(size):
            for a in range(begin, begin + after):
                total = target[a + q * after]
                for i in range(count):
                    total[i] = 0.0
                for p in range(size):
                    add(total, source[a + p * after], matrix[p, q], count)
    for s in range(len(target)):
        for i in range(count):
            source[s, i] = target[s, i]


@inner
def transform_all(tables, matrices, add, work, count):
    """The same along all coordinates, by matrices (n, K, K) or (n, K, K, B)."""
    for j in range(len(tables.size)):
        transform(tables, j, matrices[j], add, work, count)


@inner
def write_basis(tables, j, boxes, work, count):
    """Chebyshev polynomials at the points of coordinate j, and their bounds; the scaled boxes hold the given ones."""
    basis, growth, size = work.basis[j], work.growth[j], tables.size[j]
    middle, half, factor = work.row[0], work.row[1], work.row[2]
    for i in range(count):
        low, high = (boxes[i, j, 0] - tables.centre[j]) / tables.scale[j], (boxes[i, j, 1] - tables.centre[j]) / tables.scale[j]
        middle[i], half[i] = (low + high) / 2, abs(high - low) / 2 + 8 * EPS * (abs(low) + abs(high))
        reach = max(abs(middle[i]) + half[i], 1.0)
        growth[0, i], factor[i] = 1.0, reach + math.sqrt(reach**2 - 1)
    for k in range(1, size):
        for i in range(count):
            growth[k, i] = growth[k - 1, i] * factor[i]
    for q in range(size):
        for i in range(count):
            basis[0, q, i] = 1.0
        for i in range(count if size > 1 else 0):
            basis[1, q, i] = middle[i] + half[i] * tables.points[j, q]
        for k in range(2, size):
            for i in range(count):
                basis[k, q, i] = 2 * basis[1, q, i] * basis[k - 1, q, i] - basis[k - 2, q, i]


@inner
def evaluate(tables, boxes, work, count):
    """Values at the Chebyshev points of boxes (B, n, 2), less their mean."""
    m, terms = tables.terms.shape
    for j in range(len(tables.size)):
        write_basis(tables, j, boxes, work, count)
    for k in range(m):
        for s in range(terms):
            for i in range(count):
                work.values[k * terms + s, i] = tables.terms[k, s]
    transform_all(tables, work.basis, add_products, work, count)
    for k in range(m):
        level = work.level[k]
        for i in range(count):
            level[i] = 0.0
        for s in range(k * terms, (k + 1) * terms):
            for i in range(count):
                level[i] += work.values[s, i]
        for i in range(count):
            level[i] /= terms
        for s in range(k * terms, (k + 1) * terms):
            for i in range(count):
                work.values[s, i] -= level[i]


@inner
def margins(tables, work, count, margin):
    """What rounding may move a value at a point by, and the interpolation through such values.

    The recurrence of T_k errs by at most 3/2 k^2 units for |x| <= 1, a rounded x by 3 k^2 more; beyond, both grow like
    the k-th power of x + sqrt(x^2 - 1). Counted once more for images that are themselves evaluated in floats.
    """
    (m, terms), product, highest = tables.terms.shape, work.row[0], work.row[1]
    for i in range(count):
        highest[i] = 1.0
    for j in range(len(tables.size)):
        for i in range(count):
            highest[i] *= work.growth[j, tables.size[j] - 1, i]
    for k in range(m):
        for i in range(count):
            work.margin[k, i] = 0.0
    for s in range(terms):
        for i in range(count):
            product[i] = 1.0
        for j in range(len(tables.size)):
            growth = work.growth[j, tables.degree[j, s]]
            for i in range(count):
                product[i] *= growth[i]
        for k in range(m):
            weight, total = tables.weights[k, s], work.margin[k]
            for i in range(count):
                total[i] += product[i] * weight
    for k in range(m):
        for i in range(count):
            margin[i, k] = (EPS * work.margin[k, i] + tables.blur[k] * highest[i]) * tables.lebesgue


@inner
def roundings(tables, k, work, count):
    """What rounding may add between the values of polynomial k and its Bernstein coefficients: it shrinks with the box.

    `work.own` holds the largest absolute value, `work.values` Chebyshev coefficients.
    """
    terms, steps, copies, largest = tables.terms.shape[1], 0, 1, work.row[0]
    for size in tables.size:
        steps += size + 4
        copies *= 2 * size
    for i in range(count):
        largest[i] = 0.0
    for s in range(terms):
        for i in range(count):
            largest[i] += abs(work.values[k * terms + s, i]) * tables.steepest[s]
    for i in range(count):
        swing = work.own[k, i]
        work.own[k, i] = EPS * steps * (copies * swing + largest[i]) + EPS * (abs(work.level[k, i]) + swing)


@inner
def swings(tables, work, count):
    """The largest absolute value of each polynomial, as `work.own`."""
    m, terms = tables.terms.shape
    for k in range(m):
        for i in range(count):
            work.own[k, i] = 0.0
        for s in range(k * terms, (k + 1) * terms):
            for i in range(count):
                work.own[k, i] = max(work.own[k, i], abs(work.values[s, i]))


@inner
def bounds(tables, k, work, count, outer, taken):
    """Bounds from the Bernstein coefficients of polynomial k, and its values at corners; the places of the extremes."""
    terms, flat = tables.terms.shape[1], work.values
    least, largest, low, high, total = work.row[0], work.row[1], work.row[2], work.row[3], work.row[4]
    for i in range(count):
        least[i] = largest[i] = flat[k * terms, i]
        low[i], high[i], total[i], work.place[0, i], work.place[1, i] = np.inf, -np.inf, 0.0, 0, 0
    for s in range(terms):
        row = flat[k * terms + s]
        if tables.corner[s]:
            for i in range(count):
                low[i], high[i] = min(low[i], row[i]), max(high[i], row[i])
        for i in range(count):
            total[i] += row[i]
            work.place[0, i] = s if row[i] < least[i] else work.place[0, i]
            work.place[1, i] = s if row[i] > largest[i] else work.place[1, i]
            least[i] = row[i] if row[i] < least[i] else least[i]
            largest[i] = row[i] if row[i] > largest[i] else largest[i]
    for i in range(count):
        unknown, level, own = math.isnan(total[i]), work.level[k, i], work.own[k, i]  # overflow
        outer[i, k, 0] = np.nan if unknown else least[i] + level - own
        outer[i, k, 1] = np.nan if unknown else largest[i] + level + own
        taken[i, k, 0], taken[i, k, 1] = low[i] + level, high[i] + level


@inner
def steps_of(tables, k, j, work, count):
    """Whether Bernstein coefficients rise or fall everywhere along coordinate j; their largest second differences in row 0."""
    terms, size, after, bend = tables.terms.shape[1], tables.size[j], tables.after[j], work.row[0]
    rises, falls = work.monotone[0], work.monotone[1]
    for i in range(count):
        rises[i], falls[i], bend[i] = True, True, 0.0
    for s in range(terms):
        place, here = tables.degree[j, s], work.values[k * terms + s]
        if place + 1 < size:
            there = work.values[k * terms + s + after]
            for i in range(count):
                rises[i] &= there[i] - here[i] > 0
                falls[i] &= there[i] - here[i] < 0
            if place + 2 < size:
                beyond = work.values[k * terms + s + 2 * after]
                for i in range(count):
                    bend[i] = max(bend[i], abs(beyond[i] - there[i] - (there[i] - here[i])))


@inner
def locate(tables, k, boxes, work, count, at, bend):
    """Boxes that hold the places of both extremes of polynomial k: an end where there is a corner or all is monotone."""
    for j in range(len(tables.size)):
        steps_of(tables, k, j, work, count)
        size, bent = tables.size[j], work.row[0]
        for i in range(count):
            bend[i, j] = max(bend[i, j], bent[i])
            low, high = boxes[i, j, 0], boxes[i, j, 1]
            for side in range(2):
                place = work.place[side, i]
                sharp, last = size > 1 and tables.corner[place], tables.degree[j, place] == size - 1
                at[i, k, side, j, 1] = low if (sharp and not last) or work.monotone[side, i] else high
                at[i, k, side, j, 0] = high if (sharp and last) or work.monotone[1 - side, i] else low


@entry
def bernstein_hulls(tables, work, boxes, outer, taken, margin, at, bend):
    """Write the fields of `Hulls` of m polynomials over boxes (N, n, 2)."""
    m, size = work.level.shape
    for begin in range(0, len(boxes), size):
        end = min(begin + size, len(boxes))
        given, count = boxes[begin:end], end - begin
        evaluate(tables, given, work, count)
        margins(tables, work, count, margin[begin:end])
        swings(tables, work, count)
        transform_all(tables, tables.interpolation, add_product, work, count)
        for k in range(m):
            roundings(tables, k, work, count)
        transform_all(tables, tables.conversion, add_product, work, count)
        for k in range(m):
            bounds(tables, k, work, count, outer[begin:end], taken[begin:end])
            locate(tables, k, given, work, count, at[begin:end], bend[begin:end])
