"""Auxiliary maps that are bounds: of polynomials by Bernstein form, and of maps that enclose the images of boxes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Self, cast

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.auxiliary.envelope import AnyMap, Envelope, Extremes, family, image_function
from nsmaps.auxiliary.sampled import Sampled
from nsmaps.coordinates import TWO_PI, Coordinates
from nsmaps.enclosures.branch_and_bound import Hulls, ranges
from nsmaps.enclosures.composed import bounds_of
from nsmaps.exact.enclosure.images import BoxMap
from nsmaps.reduced.fit.polymap import PolyMap

SAMPLES = 201  #: values at which an envelope is given
SIGN = 1e-3  #: gap of the range of a slope, of which the sign is wanted
TRIFLE = 1e-12  #: relative width of a value below which enclosures are not refined
FINE, DRAWN, COARSE = 1e-12, 1e-9, 1e-6  #: gaps of ranges, relative to them, below which no box is cut; the last of enclosures


@dataclass(frozen=True, slots=True, eq=False)
class Polynomial:
    """Auxiliary maps of polynomials by ranges over boxes: thin ones for the curves."""

    box: Floats  #: shape (n, 2)
    status: str
    hulls: Callable[[Floats], Hulls]  #: of the polynomials themselves
    error: Floats  #: shape (n,), by which everything is moved out
    map: PolyMap
    shift: Floats  #: shape (n,), whole turns by which its images are moved
    same: float = 1e-12

    def curves(self, index: int, x: ArrayLike) -> tuple[Floats, Floats]:
        """See AuxiliaryMaps."""
        values = np.asarray(x, float)
        boxes = np.repeat(self.box[None], len(values), axis=0)
        boxes[:, index] = values[:, None]
        lower, upper = ranges(self.hulls, boxes, index, FINE).bounds.T
        return lower + self.shift[index] - self.error[index], upper + self.shift[index] + self.error[index]

    def worst(self, intervals: Floats, known: Extremes | None = None) -> Extremes:
        """See AuxiliaryMaps."""
        found = _worst(self.hulls, self.box, intervals, FINE, known)
        return replace(found, bounds=found.bounds + self.shift[:, None] + self.error[:, None] * [-1.0, 1.0])

    def places(self, intervals: Floats, known: Floats) -> Floats:
        """See AuxiliaryMaps: those known."""
        return known

    @classmethod
    def at(cls, maps: Sequence[Self], states: Floats, side: int) -> Floats:
        """See AuxiliaryMaps."""
        k = np.arange(states.shape[1])
        boxes = np.repeat([[formulas.box] for formulas in maps], len(k), axis=1)
        boxes[:, k, k] = states[..., None]
        found = ranges(maps[0].hulls, boxes.reshape(-1, *boxes.shape[2:]), np.tile(k, len(maps)), DRAWN, side=side)
        return found.bounds[:, side].reshape(states.shape) + [
            formulas.shift + (2 * side - 1) * formulas.error for formulas in maps
        ]

    def envelopes(self) -> tuple[Envelope, ...]:
        """See AuxiliaryMaps."""
        return tuple(self._envelope(k, np.linspace(self.box[k, 0], self.box[k, 1], SAMPLES)) for k in range(len(self.box)))

    def _envelope(self, index: int, x: Floats) -> Envelope:
        lower, upper = self.curves(index, x)
        drawn = family(lambda states: self.map(states) + self.shift, index, x, self.box)
        name, slopes = self.map.coordinates[index], _slopes(self.map, index, self.box)
        others = np.arange(len(self.box)) != index
        rises, falls = slopes[others, 0] >= 0, slopes[others, 1] <= 0
        if not (rises | falls).all():
            return Envelope(name, x, lower, upper, *drawn, "numeric", self.status, None, slopes)
        held = np.full(self.box.shape, np.nan)
        held[others] = np.where(rises[:, None], self.box[others], self.box[others, ::-1])
        return Envelope(name, x, lower, upper, *drawn, "closed form", self.status, held, slopes)


def of_polynomials(polynomial: PolyMap, error: Floats, status: str, box: Floats) -> Polynomial:
    """The auxiliary maps of polynomials moved out by an error, shape (n,), angles on the turn nearest to the box's centre."""
    polynomials, centre = bounds_of(polynomial), box.mean(axis=1)
    turns = TWO_PI * np.round((polynomial(centre[None])[0] - centre) / TWO_PI)
    shift = np.where(polynomial.coordinates.angles, -turns, 0.0)
    return Polynomial(box, status, polynomials.hulls, error, polynomial, shift)


def _slopes(polynomial: PolyMap, index: int, box: Floats) -> Floats:
    """Outer bounds of the derivatives of one coordinate by the others over a box, shape (n, 2); NaN by its own."""
    polynomials = bounds_of(polynomial)
    slopes = np.full((len(box), 2), np.nan)
    for j in range(len(box)):
        if j != index:
            slopes[j] = ranges(polynomials.slope(j).hulls, box[None], index, SIGN).bounds[0]
    if polynomial.coordinates[index] not in polynomial.absolute:
        return slopes
    plain = replace(polynomials, absolute=(False,) * len(box))
    low, high = ranges(plain.hulls, box[None], index, SIGN).bounds[0]
    kink = np.where(np.isnan(slopes), np.nan, [-np.inf, np.inf])
    return slopes if low >= 0 else -slopes[:, ::-1] if high <= 0 else kink


@dataclass(frozen=True, eq=False)
class Enclosed:
    """Auxiliary maps of a map that encloses the images of boxes, as the exact one does: its worst case is a bound.

    The curves and the places of the extremes, and what follows from these, are those of samples.
    """

    map: BoxMap
    samples: int  #: an axis, of the curves
    box: Floats  #: shape (n, 2)
    status: str = "enclosed"
    same: float = 1e-5

    @cached_property
    def drawn(self) -> Sampled:
        """The same by samples."""
        return Sampled.of(cast(AnyMap, self.map), self.box, self.samples)

    @cached_property
    def _hulls(self) -> Callable[[Floats], Hulls]:
        """Bounds of the images of boxes."""
        return partial(_box_hulls, self.map, image_function(cast(AnyMap, self.map), self.box), self.box)

    def curves(self, index: int, x: ArrayLike) -> tuple[Floats, Floats]:
        """See AuxiliaryMaps."""
        return self.drawn.curves(index, x)

    @classmethod
    def at(cls, maps: Sequence[Self], states: Floats, side: int) -> Floats:
        """See AuxiliaryMaps."""
        return Sampled.at([formulas.drawn for formulas in maps], states, side)

    def worst(self, intervals: Floats, known: Extremes | None = None) -> Extremes:
        """See AuxiliaryMaps."""
        return _worst(self._hulls, self.box, intervals, COARSE, known)

    def places(self, intervals: Floats, known: Floats) -> Floats:
        """See AuxiliaryMaps: bounds hold them in wide intervals only, samples show one."""
        return np.repeat(self.drawn.found(intervals)[..., 1, None], 2, axis=3)

    def envelopes(self) -> tuple[Envelope, ...]:
        """See AuxiliaryMaps."""
        return self.drawn.envelopes()


def _worst(
    hulls: Callable[[Floats], Hulls], box: Floats, intervals: Floats, tolerance: float, known: Extremes | None = None
) -> Extremes:
    """The range of each coordinate over an interval of its own and the others' sides of a box."""
    k = np.arange(len(box))
    boxes = np.repeat(box[None], len(k), axis=0)
    boxes[k, k] = intervals
    found = ranges(hulls, boxes, k, tolerance, None if known is None else known.ranges)
    return Extremes(found.bounds, found.at[k, :, k], found)


def _box_hulls(return_map: BoxMap, taken: Callable[[Floats], Floats], box: Floats, boxes: Floats) -> Hulls:
    """What the enclosure says of boxes (M, n, 2), with angles on the turn nearest to the centre of `box`."""
    found, angles = return_map.image_boxes(boxes), Coordinates(return_map.coordinates).angles
    known = np.where(np.isfinite(found.images), found.images, 0.0)  # what has no end is on every turn
    turns = TWO_PI * np.round(((known[..., 0] + known[..., 1]) / 2 - box.mean(axis=1)) / TWO_PI)
    images = found.images - np.where(angles, turns, 0.0)[..., None]
    outer = replace(found, images=images).hulls()
    outer[found.empty | np.isnan(outer).any(axis=(1, 2))] = [-np.inf, np.inf]
    count, n = outer.shape[:2]
    corners = boxes[:, np.arange(n), _corners(n)]  # where what rises or falls is extreme
    states = np.concatenate([corners, ((boxes[..., 0] + boxes[..., 1]) / 2)[:, None]], axis=1)
    values = taken(states.reshape(-1, n)).reshape(states.shape)
    finite = np.isfinite(values)
    inner = np.empty((count, n, 2))
    inner[..., 0], inner[..., 1] = np.where(finite, values, np.inf).min(axis=1), np.where(finite, values, -np.inf).max(axis=1)
    at = np.broadcast_to(boxes[:, None, None], (count, n, 2, n, 2))
    side = np.ptp(box, axis=1)
    bend = (boxes[..., 1] - boxes[..., 0]) / np.where(side > 0, side, 1.0)
    size = np.abs(outer).max(axis=2)
    margin = TRIFLE * np.where(np.isfinite(size), size, 0.0)  # finer than which enclosures are rounding
    return Hulls(outer, inner, margin, at, bend)


@lru_cache(maxsize=16)
def _corners(n: int) -> Ints:
    """The end of each coordinate, 0 or 1, at each corner of a box in n of them, shape (2^n, n)."""
    return np.indices((2,) * n).reshape(n, -1).T
