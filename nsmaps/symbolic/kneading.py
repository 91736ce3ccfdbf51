"""The topological entropy of maps of one coordinate with affine pieces, by their kneading series.

J. Milnor, W. Thurston, On iterated maps of the interval, Lect. Notes Math. 1342 (1988) 465: the entropy is the logarithm of 1/t
with the smallest zero t of the kneading determinant, a power series of the itineraries of both sides of each break.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.systems.piecewise import PiecewiseMap

TERMS = 400  #: of the series
LEAST = 0.03  #: entropy that so many terms resolve
BESIDE_ZERO = 1e-6  #: of a zero of the polynomial, where the sign of the determinant is compared


@dataclass(frozen=True, slots=True)
class Laps:
    """A map of the line that is affine between successive breaks."""

    breaks: tuple[Fraction, ...]
    slopes: tuple[Fraction, ...]  #: of each interval, one more than breaks
    shifts: tuple[Fraction, ...]

    def itinerary(self, k: int, side: int) -> tuple[list[int], list[int]]:
        """The laps of a point beside the break k, on its right (1) or left (-1), and the signs of its derivatives."""
        x, laps, signs, sign = self.breaks[k], [], [], 1
        for _ in range(TERMS):
            lap = (bisect_right if side * sign > 0 else bisect_left)(self.breaks, x)
            laps.append(lap)
            signs.append(sign)
            x, sign = self.slopes[lap] * x + self.shifts[lap], sign * (-1 if self.slopes[lap] < 0 else 1)
        return laps, signs

    def series(self, k: int, side: int) -> Floats:
        """The power series of each lap in an itinerary, shape (L, TERMS)."""
        laps, signs = self.itinerary(k, side)
        rows = np.zeros((len(self.slopes), TERMS))
        rows[laps, np.arange(TERMS)] = signs
        return rows


@checked
def topological_entropy(system: PiecewiseMap) -> float:
    """The topological entropy of a map of one coordinate whose pieces are affine; constant ones as limits of increasing ones.

    Itineraries are computed in rational numbers, those that the parameters are, and series to 400 terms: the error is about
    exp(-400 h) of an entropy h, and that of rounding. Entropies below 0.03 are not resolved, and given as zero.

    Raises:
        NsmapsError: the map has several coordinates or an angle, or a piece is not affine, or states between two breaks are in
            no piece.
    """
    laps = laps_of(PiecewiseMap.require(system, "the entropy by kneading series"))
    kneading = np.array([laps.series(k, 1) - laps.series(k, -1) for k in range(len(laps.breaks))])
    if not len(kneading):
        return 0.0
    determinant = _determinant([list(row[1:]) for row in kneading])
    zeros = np.roots(np.trim_zeros(determinant[::-1], "f"))
    real = zeros[(np.abs(zeros.imag) < BESIDE_ZERO) & (zeros.real > 0)].real
    if not real.size or real.min() > np.exp(-LEAST):
        return 0.0
    return -float(np.log(_sharpened(determinant, float(real.min()))))


def _determinant(rows: Sequence[Sequence[Floats]]) -> Floats:
    """The determinant of a matrix of power series, by its first row."""
    if len(rows) == 1:
        return rows[0][0]
    minors = (_determinant([[*row[:k], *row[k + 1 :]] for row in rows[1:]]) for k in range(len(rows)))
    terms = [(-1) ** k * np.convolve(rows[0][k], minor)[:TERMS] for k, minor in enumerate(minors)]
    return reduce(np.add, terms)


def _sharpened(series: Floats, zero: float) -> float:
    """A simple zero of a series, by bisection; a multiple one is returned as it is."""
    low, high = zero * (1 - BESIDE_ZERO), zero * (1 + BESIDE_ZERO)
    sign = np.sign(np.polyval(series[::-1], low))
    if sign == np.sign(np.polyval(series[::-1], high)):
        return zero
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if np.sign(np.polyval(series[::-1], middle)) == sign else (low, middle)
    return low


def laps_of(return_map: PiecewiseMap) -> Laps:
    """The intervals between the borders of the pieces, with the affine map on each."""
    from nsmaps.exact.piecewise.affine import borders, lines

    name = type(return_map).__name__
    if len(return_map.coordinates) != 1:
        raise NsmapsError(
            f"the topological entropy of {name}, which has {len(return_map.coordinates)} coordinates; expected: one"
        )
    breaks = borders(return_map)
    between = [(one + other) / 2 for one, other in pairwise(breaks)]
    places = [breaks[0] - 1, *between, breaks[-1] + 1] if breaks else [Fraction(0)]
    words = return_map.first_return([[float(place)] for place in places]).words.tolist()
    own = dict(zip(return_map.letters, lines(return_map), strict=True))
    if "" in words:
        raise NsmapsError(
            f"the topological entropy of {name}: states next to a border are in no piece; expected: a last piece whose "
            "condition is True"
        )
    kept = [k for k in range(len(breaks)) if words[k] != words[k + 1]]
    slopes, shifts = zip(*(own[words[k]] for k in (*kept, len(breaks))), strict=True)
    return Laps(tuple(breaks[k] for k in kept), slopes, shifts)
