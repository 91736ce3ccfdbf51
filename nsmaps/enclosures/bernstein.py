"""Outer bounds of polynomials over boxes in Bernstein form, widened by all that rounding may have done.

On a box the polynomial is evaluated at Chebyshev points, interpolated there, and its Chebyshev coefficients are turned into
Bernstein coefficients, between whose least and largest its values lie. What rounding may add to each step is bounded as for
any order of summation (gamma_n of Higham, Accuracy and stability of numerical algorithms, section 3.1), and added.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from math import comb, log, pi, prod
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from nsmaps.arrays import Floats
from nsmaps.enclosures.branch_and_bound import Hulls
from nsmaps.enclosures.intervals import EPS
from nsmaps.reduced.fit.polymap import PolyMap, dense

if TYPE_CHECKING:
    from nsmaps.enclosures.bernstein_kernel import Tables


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials in n coordinates over boxes: sums of products of Chebyshev polynomials of (x - centre) / scale."""

    tensor: Floats  #: shape (m, degree + 1 of each coordinate), of the m polynomials
    centre: Floats  #: shape (n,)
    scale: Floats  #: shape (n,)
    absolute: tuple[bool, ...]  #: of which of them the absolute value is taken
    blur: Floats  #: shape (m,), by how much the coefficients' own rounding may move a value for |x - centre| <= scale

    @classmethod
    def of(cls, polynomial: PolyMap) -> "Polynomials":
        """The images of a map, with its coefficients unchanged."""
        tensor = dense(polynomial.exponents, polynomial.coefficients)
        absolute = tuple(name in polynomial.absolute for name in polynomial.coordinates)
        return cls(tensor, polynomial.centre, polynomial.scale, absolute, np.zeros(len(tensor)))

    def slope(self, j: int) -> "Polynomials":
        """The derivatives by coordinate j, of absolute values those within."""
        size = self.tensor.shape[1 + j]
        rising = np.moveaxis(np.abs(self.tensor), 1 + j, -1).reshape(len(self.tensor), -1, size).sum(axis=1) @ np.arange(size)
        tensor = np.asarray(chebder(self.tensor, axis=1 + j), float) / self.scale[j]
        blur = EPS * 2 * size * (size + 2) * rising / self.scale[j]
        return Polynomials(tensor, self.centre, self.scale, (False,) * len(tensor), blur)

    def hulls(self, boxes: Floats) -> Hulls:
        """Outer bounds over boxes (N, n, 2) without subdivision, and values that are taken there."""
        from nsmaps.enclosures.bernstein_kernel import bernstein_hulls, work_for

        tables, (count, n), m = self._tables, boxes.shape[:2], len(self.tensor)
        found = Hulls(*(np.zeros((count, *shape)) for shape in ((m, 2), (m, 2), (m,), (m, 2, n, 2), (n,))))
        bernstein_hulls(tables, work_for(tables, count), np.ascontiguousarray(boxes), *found)
        return found.absolute(np.array(self.absolute), boxes) if any(self.absolute) else found

    @cached_property
    def _tables(self) -> "Tables":
        """What the compiled loop takes."""
        from nsmaps.enclosures.bernstein_kernel import Tables

        sizes, m = self.tensor.shape[1:], len(self.tensor)
        points, (interpolate, convert) = np.zeros((len(sizes), max(sizes))), np.zeros((2, len(sizes), max(sizes), max(sizes)))
        for j, size in enumerate(sizes):
            points[j, :size], interpolate[j, :size, :size] = chebyshev_points(size - 1), interpolation(size - 1)
            convert[j, :size, :size] = conversion(size - 1)
        degree, highest = np.indices(sizes).reshape(len(sizes), -1), np.array(sizes)[:, None] - 1
        units = sum(np.ix_(*(10.0 * np.arange(1, size + 1) ** 2 for size in sizes)), np.full(sizes, 2.0 * sum(sizes) + 6))
        return Tables(
            terms=self.tensor.reshape(m, -1),
            weights=(np.abs(self.tensor) * units).reshape(m, -1),
            size=np.array(sizes),
            after=np.array([prod(sizes[j + 1 :]) for j in range(len(sizes))]),
            degree=degree,
            corner=((degree == 0) | (degree == highest)).all(axis=0),
            centre=self.centre,
            scale=self.scale,
            blur=self.blur,
            points=points,
            interpolation=interpolate,
            conversion=convert,
            steepest=np.take_along_axis(np.abs(convert).max(axis=2), degree, axis=1).prod(axis=0),
            lebesgue=1 + prod(2 / pi * log(size) + 1 for size in sizes),
        )


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
