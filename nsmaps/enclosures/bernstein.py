"""Outer bounds of polynomials over boxes in Bernstein form, widened by all that rounding may have done.

On a box the polynomial is evaluated at Chebyshev points, interpolated there, and its Chebyshev coefficients are turned into
Bernstein coefficients, between whose least and largest its values lie. What rounding may add to each step is bounded as for
any order of summation (gamma_n of Higham, Accuracy and stability of numerical algorithms, section 3.1), and added.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import comb, log, pi, prod

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from nsmaps.arrays import Floats, Ints
from nsmaps.enclosures.branch_and_bound import Hulls
from nsmaps.reduced.fit.polymap import PolyMap, dense

EPS = 2.0**-52  #: twice the unit roundoff: a reserve of one half, for terms of second order
BLOCK = 2**20  #: floats of one array of values at a time


@dataclass(frozen=True, slots=True, eq=False)
class Polynomials:
    """Polynomials in n coordinates over boxes: sums of products of Chebyshev polynomials of (x - centre) / scale."""

    tensor: Floats  #: shape (m, degree + 1 of each coordinate), of the m polynomials
    centre: Floats  #: shape (n,)
    scale: Floats  #: shape (n,)
    absolute: tuple[bool, ...]  #: of which of them the absolute value is taken
    blur: Floats  #: shape (m,), by how much the coefficients' own rounding may move a value for |x - centre| <= scale

    @classmethod
    def of(cls, map: PolyMap) -> "Polynomials":
        """The images of a map, with its coefficients unchanged."""
        tensor = dense(map.exponents, map.coefficients)
        absolute = tuple(name in map.absolute for name in map.coordinates)
        return cls(tensor, map.centre, map.scale, absolute, np.zeros(len(tensor)))

    def slope(self, j: int) -> "Polynomials":
        """The derivatives by coordinate j, of absolute values those within."""
        size = self.tensor.shape[1 + j]
        rising = np.moveaxis(np.abs(self.tensor), 1 + j, -1).reshape(len(self.tensor), -1, size).sum(axis=1) @ np.arange(size)
        tensor = np.asarray(chebder(self.tensor, axis=1 + j), float) / self.scale[j]
        blur = EPS * 2 * size * (size + 2) * rising / self.scale[j]
        return Polynomials(tensor, self.centre, self.scale, (False,) * len(tensor), blur)

    def hulls(self, boxes: Floats) -> Hulls:
        """Outer bounds over boxes (N, n, 2) without subdivision, and values that are taken there."""
        size = max(1, BLOCK // self.tensor.size)
        return Hulls.joined([self._block(boxes[k : k + size]) for k in range(0, len(boxes), size)])

    def _block(self, boxes: Floats) -> Hulls:
        middle, half = self._scaled(boxes)
        degrees = [size - 1 for size in self.tensor.shape[1:]]
        points = [chebyshev_points(d) for d in degrees]
        with np.errstate(over="ignore", invalid="ignore"):
            bases = [chebvander(middle[:, j, None] + half[:, j, None] * t, degrees[j]) for j, t in enumerate(points)]
            values = _along(np.broadcast_to(self.tensor, (len(boxes), *self.tensor.shape)), [np.swapaxes(b, 1, 2) for b in bases])
            level = values.reshape(*values.shape[:2], -1).mean(axis=2)
            deviation = values - level.reshape(*level.shape, *(1 for _ in degrees))
            chebyshev = _along(deviation, [interpolation(d) for d in degrees])
            bernstein = _along(chebyshev, [conversion(d) for d in degrees])
            margin, own = self._margin(middle, half), self._own(deviation, chebyshev, level)
        return _hulls(boxes, level, bernstein, margin, own, self.absolute)

    def _scaled(self, boxes: Floats) -> tuple[Floats, Floats]:
        """Middles and half widths in scaled coordinates, shape (N, n), so that the boxes of them hold the given ones."""
        ends = (boxes - self.centre[:, None]) / self.scale[:, None]
        reserve = 8 * EPS * np.abs(ends).sum(axis=2)
        return ends.mean(axis=2), np.abs(ends[:, :, 1] - ends[:, :, 0]) / 2 + reserve

    def _margin(self, middle: Floats, half: Floats) -> Floats:
        """What rounding may move a value at a point by, and the interpolation through such values, shape (N, m).

        The recurrence of T_k errs by at most 3/2 k^2 units for |x| <= 1, a rounded x by 3 k^2 more; beyond, both grow like
        the k-th power of x + sqrt(x^2 - 1). Counted once more for images that are themselves evaluated in floats.
        """
        sizes = self.tensor.shape[1:]
        reach = np.maximum(np.abs(middle) + half, 1.0)
        growth = reach + np.sqrt(reach**2 - 1)
        powers = [growth[:, j, None, None] ** np.arange(1, size + 1)[:, None] for j, size in enumerate(sizes)]
        weights = np.abs(self.tensor) * (_squares(sizes) + 2 * sum(sizes) + 6)
        each = _along(np.broadcast_to(weights, (len(reach), *weights.shape)), powers).reshape(len(reach), -1)
        lebesgue = prod(2 / pi * log(size) + 1 for size in sizes)
        return (EPS * each + self.blur * np.prod(growth ** np.array(sizes), axis=1)[:, None]) * (1 + lebesgue)

    def _own(self, deviation: Floats, chebyshev: Floats, level: Floats) -> Floats:
        """What rounding may add between the values and the Bernstein coefficients, shape (N, m): it shrinks with the box."""
        sizes = deviation.shape[2:]
        steps = EPS * sum(size + 4 for size in sizes)
        swing = np.abs(deviation).reshape(*level.shape, -1).max(axis=2)
        largest = _along(np.abs(chebyshev), [np.abs(conversion(size - 1)).max(axis=1)[:, None] for size in sizes])
        return steps * (2 ** len(sizes) * prod(sizes) * swing + largest.reshape(level.shape)) + EPS * (np.abs(level) + swing)


@lru_cache(maxsize=64)
def _squares(sizes: tuple[int, ...]) -> Floats:
    """Ten times the sum of the squares of one more than each degree, shape `sizes`."""
    return np.asarray(sum(np.ix_(*(10.0 * np.arange(1, size + 1) ** 2 for size in sizes)), np.zeros(sizes)))


@lru_cache(maxsize=64)
def chebyshev_points(degree: int) -> Floats:
    """The zeros of T_(degree + 1), ascending."""
    return -np.cos((2 * np.arange(degree + 1) + 1) * pi / (2 * degree + 2))


@lru_cache(maxsize=64)
def interpolation(degree: int) -> Floats:
    """From values at the Chebyshev points to Chebyshev coefficients: shape (degree + 1, degree + 1), a row a point."""
    rows = 2 * chebvander(chebyshev_points(degree), degree) / (degree + 1)
    rows[:, 0] /= 2
    return rows


@lru_cache(maxsize=64)
def conversion(degree: int) -> Floats:
    """The Bernstein coefficients of T_k on [-1, 1], raised to the degree: row k for T_k; exact, rounded once.

    >>> conversion(2)
    array([[ 1.,  1.,  1.],
           [-1.,  0.,  1.],
           [ 1., -3.,  1.]])
    """
    rows = []
    for k in range(degree + 1):
        row = [Fraction((-1) ** (k - j) * comb(2 * k, 2 * j), comb(k, j)) for j in range(k + 1)]
        for d in range(k + 1, degree + 1):  # the same polynomial with coefficients of one degree more
            ends = [Fraction(0), *row, Fraction(0)]
            row = [Fraction(j, d) * ends[j] + (1 - Fraction(j, d)) * ends[j + 1] for j in range(d + 1)]
        rows.append([float(value) for value in row])
    return np.array(rows)


@lru_cache(maxsize=64)
def _corners(sizes: tuple[int, ...]) -> Ints:
    """The places of the corners of an array of these sizes, when it is flat."""
    corners = np.indices((2,) * len(sizes)).reshape(len(sizes), -1)
    return np.ravel_multi_index(tuple(corners * (np.array(sizes) - 1)[:, None]), sizes)


def _along(values: Floats, matrices: list[Floats]) -> Floats:
    """Values (N, m, sizes) with a matrix applied along each of the last axes, the same for all rows or one for each."""
    for j, matrix in enumerate(matrices):
        before, size, after = values.shape[: 2 + j], values.shape[2 + j], values.shape[3 + j :]
        if after:
            turned = np.swapaxes(matrix, -1, -2)
            product = (turned if matrix.ndim == 2 else turned[:, None]) @ values.reshape(len(values), -1, size, prod(after))
        else:
            product = values.reshape(len(values), -1, size) @ matrix
        values = product.reshape(*before, matrix.shape[-1], *after)
    return values


def _hulls(boxes: Floats, level: Floats, bernstein: Floats, margin: Floats, own: Floats, absolute: tuple[bool, ...]) -> Hulls:
    """Bounds and places from Bernstein coefficients about a level: the extreme of a corner is taken at the corner."""
    (count, n), sizes = boxes.shape[:2], bernstein.shape[2:]
    flat = bernstein.reshape(*level.shape, -1)
    taken = flat[:, :, _corners(sizes)]
    outer, inner, best = np.empty((*level.shape, 2)), np.empty((*level.shape, 2)), np.empty((*level.shape, 2), np.intp)
    outer[..., 0], outer[..., 1] = flat.min(axis=2) + level - own, flat.max(axis=2) + level + own
    inner[..., 0], inner[..., 1] = taken.min(axis=2) + level, taken.max(axis=2) + level
    best[..., 0], best[..., 1] = flat.argmin(axis=2), flat.argmax(axis=2)
    places = np.unravel_index(best, sizes)
    sharp = np.logical_and.reduce([(place == 0) | (place == size - 1) for place, size in zip(places, sizes, strict=True)])
    at, bend, rising = np.empty((*best.shape, n, 2)), np.zeros((count, n)), np.empty((*level.shape, 2), bool)
    for j, (place, size) in enumerate(zip(places, sizes, strict=True)):
        steps = np.diff(bernstein, axis=2 + j)
        rise = steps.reshape(*level.shape, -1)
        rising[..., 0], rising[..., 1] = (rise > 0).all(axis=2), (rise < 0).all(axis=2)
        corner, high = sharp & (size > 1), place == size - 1
        first, last = boxes[:, j, 0, None, None], boxes[:, j, 1, None, None]
        at[..., j, 1] = np.where(corner & ~high | rising, first, last)  # a monotone coordinate is extreme at its ends
        at[..., j, 0] = np.where(corner & high | rising[..., ::-1], last, first)
        if size > 2:
            bend[:, j] = np.abs(np.diff(steps, axis=2 + j)).reshape(count, -1).max(axis=1)
    hulls = Hulls(outer, inner, margin, at, bend)
    return hulls.absolute(np.array(absolute), boxes) if any(absolute) else hulls
