"""Outer images of boxes under fitted maps: polynomials in Bernstein form, and composite maps of such pieces."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import overload

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI, Coordinates
from nsmaps.enclosures.composed import bounds_of
from nsmaps.enclosures.first_match import Winners, turns_of
from nsmaps.enclosures.intervals import ROUNDING
from nsmaps.enclosures.sides import first_sides
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.enclosure.images import BoxImages, BoxMap, as_boxes
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap

EVERYWHERE = "0 == 0"
Fitted = PolyMap | CompositeMap | PiecewiseMap
Boxed = BoxMap | ReturnMap | PolyMap  #: what `box_map` takes


def name_of(return_map: object) -> str:
    """The default name of a map in results; a composite map is composed of fitted maps, polynomials of one piece each.

    A map of another class has the name of this, such as `map Lozi`.
    """
    if isinstance(return_map, FlowSystem):
        return "exact map"
    if isinstance(return_map, PolyMap):
        return "fitted map"
    return return_map.title if isinstance(return_map, CompositeMap) else f"map {type(return_map).__name__}"


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """Parts of boxes, whose angles were moved by whole turns."""

    source: Ints  #: shape (M,), number of the box
    boxes: Floats  #: shape (M, n, 2)
    turns: Ints  #: shape (M, n), by how many turns an angle was before

    def of(self, rows: Bools) -> "Parts":
        """The parts of some numbers."""
        return Parts(self.source[rows], self.boxes[rows], self.turns[rows])

    def near(self, middle: Floats) -> "Parts":
        """The same in parts whose angles are within half a turn of a middle, shape (n,); NaN leaves a coordinate alone."""
        parts = self
        for k in np.flatnonzero(np.isfinite(middle)):
            parts = parts._near(int(k), float(middle[k]))
        return parts

    def back(self) -> "Parts":
        """The same with angles where they were before."""
        return Parts(self.source, moved(self.boxes, self.turns), np.zeros_like(self.turns))

    def _near(self, k: int, middle: float) -> "Parts":
        low, high = self.boxes[:, k].T
        start, end = middle - TWO_PI / 2, middle + TWO_PI / 2
        there = (start <= low) & (high <= end)
        slack = np.where(there, 0.0, ROUNDING * (np.abs(low) + np.abs(high) + abs(middle) + TWO_PI))
        first = np.floor((low - slack - start) / TWO_PI).astype(np.int64)
        last = np.floor((high + slack - start) / TWO_PI).astype(np.int64)
        if not (first.any() or last.any()):
            return self
        last = np.minimum(last, first + 2)  # more than a whole turn meets nothing new
        count = last - first + 1
        rows = np.repeat(np.arange(len(low)), count)
        turn = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count) + first[rows]
        boxes, turns = self.boxes[rows].copy(), self.turns[rows].copy()
        boxes[:, k, 0] = np.maximum(low[rows] - TWO_PI * turn - slack[rows], start)
        boxes[:, k, 1] = np.minimum(high[rows] - TWO_PI * turn + slack[rows], end)
        turns[:, k] += turn
        return Parts(self.source[rows], boxes, turns).of(boxes[:, k, 0] <= boxes[:, k, 1])


@dataclass(frozen=True, slots=True, eq=False)
class FittedBoxes(ReturnMap):
    """A composite map as one that encloses the images of boxes; of states it has the images that the map has."""

    map: CompositeMap
    winners: Winners
    sides: tuple[Floats, ...]  #: of each piece a box (n, 2) that holds the states of which it is the first

    @classmethod
    def of(cls, polynomial: Fitted) -> "FittedBoxes":
        """Of a PolyMap, one piece that holds everywhere: angles are on the turn nearest to where it was fitted.

        Maps given by formulas are enclosed at the values of their parameters, of which the rounding is not counted.
        """
        if isinstance(polynomial, PolyMap):
            everywhere = ConditionRegion(coordinates=polynomial.coordinates, text=EVERYWHERE)
            polynomial = CompositeMap(polynomial.coordinates, (), (Piece("fitted", everywhere, polynomial),))
        if isinstance(polynomial, PiecewiseMap):
            from nsmaps.reduced.composite.formulas import composite_of

            polynomial = composite_of(polynomial)
        regions = [piece.region for piece in polynomial.pieces]
        return cls(polynomial, Winners.of(regions), tuple(first_sides(regions)))

    @property
    def coordinates(self) -> Coordinates:
        """The names of the n coordinates."""
        return self.map.coordinates

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """As `CompositeMap.first_return`."""
        return self.map.first_return(states, derivative)

    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2), rounding included: one box a piece that may hold a state of the box.

        Of a piece whose region is a `Box` the image is that of the common part. A box is `empty` if a state of it may lie in
        no piece; not `bounded` if a polynomial overflows there.
        """
        given = as_boxes(boxes, self.coordinates)
        angles = self.coordinates.angles
        count, n = given.shape[:2]
        whole = Parts(np.arange(count), given, np.zeros((count, n), np.int64)).near(np.where(angles, np.pi, np.nan))
        wins, none = self.winners(whole.boxes)
        empty, bounded = np.zeros(count, bool), np.ones(count, bool)
        empty[whole.source[none]] = True
        found = [(np.empty(0, np.int64), np.empty((0, n, 2)), np.empty(0, np.str_))]
        for k in np.flatnonzero(wins.any(axis=0)).tolist():
            piece = self.map.pieces[k]
            for part in _common(piece, _inside(whole.of(wins[:, k]), self.sides[k])):
                source, images = _images(piece.map, part)
                found.append((source, images, np.full(len(source), piece.word)))
        source, images, words = (np.concatenate(each) for each in zip(*found, strict=True))
        if not np.isfinite(images).all():
            lost = np.unique(source[~np.isfinite(images).all(axis=(1, 2))])
            bounded[lost], empty[lost] = False, True
            kept = bounded[source]
            source = np.concatenate([source[kept], lost])
            images = np.concatenate([images[kept], np.broadcast_to([-np.inf, np.inf], (len(lost), n, 2))])
            words = np.concatenate([words[kept], np.full(len(lost), "")])
        order = np.argsort(source, kind="stable")
        return BoxImages(source[order], images[order], words[order], bounded, empty)


@overload
@checked
def box_map(system: Fitted) -> FittedBoxes: ...
@overload
def box_map(system: Boxed) -> BoxMap: ...
def box_map(system: Boxed) -> BoxMap:
    """A map that encloses the images of boxes: itself where it does, as exact systems, and `FittedBoxes` of a fitted one.

    Raises:
        NsmapsError: the map does neither, as a ParametricMap: its map at a value is one.
    """
    if isinstance(system, BoxMap):
        return system
    if isinstance(system, Fitted):
        return FittedBoxes.of(system)
    accepted = (
        "an exact system, a map given by formulas, a PolyMap, a CompositeMap (of a ParametricMap, that at a value), "
        "any map with `image_boxes`"
    )
    raise NsmapsError(f"a {type(system).__name__} encloses no images of boxes; expected: {accepted}")


def _common(piece: Piece, whole: Parts) -> Iterator[Parts]:
    """What boxes of angles in [0, 2 pi) have in common with a piece's region, if that is a box; else all of them."""
    if type(piece.region) is not Box or not len(whole.source):
        yield from [whole][: len(whole.source)]
        return
    angles = piece.region.coordinates.angles
    parts = [whole]
    for k, (low, high) in enumerate(piece.region.array.tolist()):
        if angles[k] and high - low > TWO_PI * (1 - 1e-9):
            continue
        turns = turns_of(low, high) if angles[k] else (0,)
        parts = [_cut(part, k, low - TWO_PI * turn, high - TWO_PI * turn, turn != 0) for part in parts for turn in turns]
    yield from (part for part in parts if len(part.source))


def _inside(parts: Parts, box: Floats) -> Parts:
    """The parts that meet a box (n, 2), of which the common part is left."""
    for k in np.flatnonzero(np.isfinite(box).any(axis=1)).tolist():
        low, high = box[k].tolist()
        parts = _cut(parts, k, low, high, False)
    return parts


def _cut(parts: Parts, k: int, low: float, high: float, is_moved: bool) -> Parts:
    """The parts of which a coordinate is between two ends, which rounding may have moved."""
    slack = 4 * ROUNDING * (abs(low) + abs(high) + TWO_PI) if is_moved else 0.0
    boxes = parts.boxes.copy()
    boxes[:, k, 0] = np.maximum(boxes[:, k, 0], low - slack)
    boxes[:, k, 1] = np.minimum(boxes[:, k, 1], high + slack)
    return Parts(parts.source, boxes, parts.turns).of(boxes[:, k, 0] <= boxes[:, k, 1])


def _images(polynomial: PolyMap, parts: Parts) -> tuple[Ints, Floats]:
    """The images of parts, moved by the turns of these, of a map whose angles are nearest to where it was fitted."""
    here = np.where(np.isfinite(polynomial.middle), parts.turns, 0)
    parts = Parts(parts.source, moved(parts.boxes, parts.turns - here), here).near(polynomial.middle)
    found = bounds_of(polynomial).hulls(parts.boxes)
    images = found.outer + found.margin[:, :, None] * [-1.0, 1.0]
    absolute = np.array([name in polynomial.absolute for name in polynomial.coordinates])
    images[:, absolute, 0] = np.maximum(images[:, absolute, 0], 0.0)
    return parts.source, moved(images, parts.turns)


def moved(boxes: Floats, turns: Ints) -> Floats:
    """Boxes (M, n, 2) moved by whole turns (M, n), with what rounding may do added."""
    if not turns.any():
        return boxes
    shift = TWO_PI * turns[:, :, None]
    slack = 4 * ROUNDING * (np.abs(boxes).max(axis=2, keepdims=True) + np.abs(shift) + TWO_PI) * [-1.0, 1.0]
    return np.where(shift == 0, boxes, boxes + shift + slack)
