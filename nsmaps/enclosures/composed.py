"""Outer bounds over boxes of polynomials in functions of the coordinates, such as Fourier series.

The values lie between bounds of each term over the intervals of its variables, and in the mean value form: the value in the
middle, and how far derivatives, bounded by the chain rule, can lead from there; its excess shrinks with the square of the box.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from nsmaps.arrays import Floats, Ints
from nsmaps.enclosures.bernstein import Polynomials
from nsmaps.enclosures.branch_and_bound import Hulls
from nsmaps.enclosures.first_match import enclosure_of
from nsmaps.enclosures.intervals import EPS, Interval
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.fit.variables import slopes_of

BLOCK = 2**18  #: floats of one array of terms at a time
STEP = re.compile(r"\b(floor|sign)\(")
FLOAT = 2.0**-48  #: by which a variable in floats may differ, relative to its largest value; the exact one is in its interval


@lru_cache(maxsize=64)
def bounds_of(polynomial: PolyMap) -> "Polynomials | Composed":
    """What bounds the images of a map over boxes, and their derivatives; that of maps that were used last is kept."""
    if polynomial.variables is None:
        return Polynomials.of(polynomial)
    return Composed(polynomial, tuple(name in polynomial.absolute for name in polynomial.coordinates))


@dataclass(frozen=True, eq=False)
class Composed:
    """The n images of a map with k variables over boxes, or their derivatives by one coordinate."""

    map: PolyMap
    absolute: tuple[bool, ...]  #: of which of them the absolute value is taken
    by: int | None = None  #: the coordinate of the derivatives; None for the images

    def slope(self, j: int) -> "Composed":
        """The derivatives by coordinate j, of absolute values those within."""
        return replace(self, absolute=(False,) * len(self.absolute), by=j)

    def hulls(self, boxes: Floats) -> Hulls:
        """Outer bounds over boxes (N, n, 2) without subdivision, and values that are taken there."""
        size = max(1, BLOCK // max(each.size for each in self.map.exponents))
        with np.errstate(all="ignore"):
            return Hulls.joined([self._block(boxes[k : k + size]) for k in range(0, len(boxes), size)])

    @cached_property
    def _variables(self) -> "_Variables":
        return _Variables(self.map)

    def _block(self, boxes: Floats) -> Hulls:
        (count, n), width = boxes.shape[:2], boxes[..., 1] - boxes[..., 0]
        slopes = self._variables.slopes(boxes)
        at = np.broadcast_to(boxes[:, None, None], (count, n, 2, n, 2))
        if self.by is not None:
            outer, margin, bend = slopes[:, :, self.by], np.zeros((count, n)), width
        else:
            outer, margin = self._images(boxes, slopes)
            rises, falls = slopes[..., 0] > 0, slopes[..., 1] < 0
            low, high = (np.repeat(boxes[..., end, None], 2, axis=2)[:, None] for end in (0, 1))
            first, last = (
                np.where(up[..., None], low, np.where(down[..., None], high, at[:, :, 0]))
                for up, down in ((rises, falls), (falls, rises))
            )
            at, bend = np.stack([first, last], axis=2), np.ptp(slopes, axis=3).max(axis=1) * width
        outer = np.where(np.isnan(outer).any(axis=2, keepdims=True), [-np.inf, np.inf], outer)
        bend = np.where(np.isfinite(bend).all(axis=1, keepdims=True), bend, width)
        hulls = Hulls(outer, self._taken(boxes), margin, at, bend)
        return hulls.absolute(np.array(self.absolute), boxes) if any(self.absolute) else hulls

    def _images(self, boxes: Floats, slopes: Floats) -> tuple[Floats, Floats]:
        """Bounds of the images, shape (N, n, 2), and what rounding may add, (N, n)."""
        middle = boxes.mean(axis=2)
        thin = np.repeat(middle[..., None], 2, axis=2)
        bounds, margin = self._variables.values(np.concatenate([boxes, thin]))
        plain, centred = bounds[: len(boxes)], bounds[len(boxes) :]
        reach = np.abs(boxes - middle[..., None]).max(axis=2) * (1 + 4 * EPS)
        radius = (np.abs(slopes).max(axis=3) * reach[:, None]).sum(axis=2) * (1 + 4 * EPS * (len(self.absolute) + 2))
        ends = np.fmax(plain[..., 0], centred[..., 0] - radius), np.fmin(plain[..., 1], centred[..., 1] + radius)
        return np.stack(ends, axis=-1), margin[: len(boxes)]

    def _taken(self, boxes: Floats) -> Floats:
        """The least and largest of the values in the corners and the middle, shape (N, n, 2)."""
        count, n = boxes.shape[:2]
        corners = boxes[:, np.arange(n), np.indices((2,) * n).reshape(n, -1).T]
        states = np.concatenate([corners, boxes.mean(axis=2)[:, None]], axis=1).reshape(-1, n)
        plain = replace(self.map, absolute=())
        values = plain(states) if self.by is None else plain.derivative(states)[:, :, self.by]
        values = np.where(np.isfinite(values), values, np.nan).reshape(count, -1, n)
        lowest, highest = np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)
        return np.stack([np.where(np.isnan(lowest), np.inf, lowest), np.where(np.isnan(highest), -np.inf, highest)], axis=-1)


def _anything(boxes: Floats) -> Interval:
    return np.full(len(boxes), -np.inf), np.full(len(boxes), np.inf)


class _Variables:
    """The enclosures of a map's variables and of their derivatives, and what follows from them for its images."""

    def __init__(self, polynomial: PolyMap) -> None:
        names, texts = polynomial.coordinates.names, polynomial.variables or ()
        self.map = polynomial
        self.own = [enclosure_of(text, names) for text in texts]
        self.inner = [
            list(enumerate([_anything] * len(names)))  # across a step there is no mean value form
            if STEP.search(of)
            else [(j, enclosure_of(text, names)) for j, text in enumerate(row) if text != "0"]
            for of, row in zip(texts, slopes_of(texts, names), strict=True)
        ]
        self.degree = int(max(each.max() for each in polynomial.exponents))

    def values(self, boxes: Floats) -> tuple[Floats, Floats]:
        """Bounds of each image over boxes (N, n, 2), term by term, shape (N, n, 2), and what rounding may add, (N, n)."""
        sides, low, high, growth = self._ranges(boxes)
        largest, bounds, margin = np.abs(sides).max(axis=2), np.empty((*boxes.shape[:2], 2)), np.empty(boxes.shape[:2])
        for i, (exponents, c) in enumerate(self._terms()):
            bounds[:, i] = _sum(c, *_products(exponents, low, high))
            size = np.exp(np.log(growth) @ exponents.T)
            steep = size @ (np.abs(c)[:, None] * exponents**2) / self.map.scale
            margin[:, i] = 2 * EPS * (size @ (np.abs(c) * _steps(exponents))) + FLOAT * (steep * largest).sum(axis=1)
        return bounds, margin

    def slopes(self, boxes: Floats) -> Floats:
        """Bounds of the derivative of each image by each coordinate over boxes (N, n, 2), shape (N, n, n, 2)."""
        _, low, high, growth = self._ranges(boxes)
        total = np.zeros((*boxes.shape[:2], boxes.shape[1], 2))
        rising = chebder(np.eye(self.degree + 1))
        steep = low[..., :-1] @ rising, high[..., :-1] @ rising
        inner = [[(at, np.stack(enclose(boxes), axis=-1)) for at, enclose in row] for row in self.inner]
        for i, (exponents, c) in enumerate(self._terms()):
            size = np.exp(np.log(growth) @ exponents.T)
            for j in np.flatnonzero(exponents.any(axis=0)).tolist():
                rows = exponents[:, j] > 0
                outer = _sum(c[rows], *_products(exponents[rows], low, high, j, steep))
                slack = 2 * EPS * (size[:, rows] @ (np.abs(c) * _steps(exponents) * exponents[:, j] ** 2)[rows])
                outer = (outer + slack[:, None] * [-1.0, 1.0]) / self.map.scale[j]
                for at, of in inner[j]:
                    product = np.stack(_times(outer[:, 0], outer[:, 1], of[:, 0], of[:, 1]), axis=-1)
                    total[:, i, at] += product + 4 * EPS * (len(self.own) + 2) * np.abs(product) * [-1.0, 1.0]
        return total

    def _terms(self) -> Sequence[tuple[Ints, Floats]]:
        return list(zip(self.map.exponents, self.map.coefficients, strict=True))

    def _ranges(self, boxes: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """The variables' sides (N, k, 2), the ranges of their Chebyshev polynomials (N, k, degrees), how these grow (N, k)."""
        sides = np.stack([np.stack(enclose(boxes), axis=-1) for enclose in self.own], axis=1)
        scaled = np.sort((sides - self.map.centre[:, None]) / self.map.scale[:, None], axis=2)
        reserve = 8 * EPS * np.abs(scaled).sum(axis=2)
        ends = scaled[..., 0] - reserve, scaled[..., 1] + reserve
        reach = np.maximum(np.abs(ends).max(axis=0), 1.0)
        return sides, *_chebyshev(*ends, self.degree), reach + np.sqrt(reach**2 - 1)


def _chebyshev(low: Floats, high: Floats, degree: int) -> tuple[Floats, Floats]:
    """The ranges of T_0 to T_degree over intervals, shape (..., degree + 1): values of ends, and 1 and -1 between them."""
    d = np.arange(degree + 1)
    ends = chebvander(np.stack([low, high]), degree)
    begin, end = (d * np.arccos(np.clip(x, -1, 1))[..., None] / np.pi for x in (high, low))
    first, last = np.maximum(np.ceil(begin - 1e-12 * d), 1), np.minimum(np.floor(end + 1e-12 * d), d - 1)
    odd, even = ((last > first) | ((last == first) & (first % 2 == parity)) for parity in (1, 0))
    lowest, highest = ends.min(axis=0), ends.max(axis=0)
    return np.where(odd, np.minimum(lowest, -1.0), lowest), np.where(even, np.maximum(highest, 1.0), highest)


def _products(
    exponents: Ints, low: Floats, high: Floats, by: int | None = None, steep: tuple[Floats, Floats] | None = None
) -> tuple[Floats, Floats]:
    """The ranges of products of exponents (m, k), of which those of variable `by` have the factors `steep`; shape (N, m)."""
    lowest = highest = np.ones((len(low), len(exponents)))
    for j in np.flatnonzero(exponents.any(axis=0)):
        lower, upper = steep if steep is not None and j == by else (low, high)
        lowest, highest = _times(lowest, highest, lower[:, j, exponents[:, j]], upper[:, j, exponents[:, j]])
    return lowest, highest


def _times(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """The products of numbers in [a, b] and in [c, d]."""
    w, x, y, z = a * c, a * d, b * c, b * d
    return np.minimum(np.minimum(w, x), np.minimum(y, z)), np.maximum(np.maximum(w, x), np.maximum(y, z))


def _sum(coefficients: Floats, lowest: Floats, highest: Floats) -> Floats:
    """The range of a sum of terms (N, m), shape (N, 2)."""
    rises = coefficients > 0
    return np.stack([np.where(rises, lowest, highest) @ coefficients, np.where(rises, highest, lowest) @ coefficients], axis=-1)


def _steps(exponents: Ints) -> Ints:
    """Units of rounding by which each term of a sum of Chebyshev products may err, relative to its size, shape (m,)."""
    return 10 * ((exponents + 1) ** 2).sum(axis=1) + 2 * (exponents.max(axis=0) + 1).sum() + len(exponents) + 6
