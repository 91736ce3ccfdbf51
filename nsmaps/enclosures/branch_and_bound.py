"""Ranges over boxes by branch and bound: outer bounds, and where the extremes lie."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints

SLICES, FEW = 8, 16  #: into which a box is cut along one coordinate, more if that makes but few: a round of these costs no more
MOST_ROUNDS, MOST_BOXES = 60, 2**12  #: of cutting, and of boxes in one round


class Hulls(NamedTuple):
    """What is known of m functions on each of M boxes; the last axis of length 2 is (least, largest)."""

    outer: Floats  #: shape (M, m, 2), bounds without `margin`
    inner: Floats  #: shape (M, m, 2), values that are taken, as far as `margin` allows to say
    margin: Floats  #: shape (M, m), what is to be added to both sides, however small the box
    at: Floats  #: shape (M, m, 2, n, 2), a box within each that holds the place of the extreme
    bend: Floats  #: shape (M, n), how much each coordinate has to do with the gap between outer and inner

    @classmethod
    def joined(cls, parts: Sequence["Hulls"]) -> "Hulls":
        """The parts one after another."""
        return parts[0] if len(parts) == 1 else cls._make(map(np.concatenate, zip(*parts, strict=True)))

    def absolute(self, which: Bools, boxes: Floats) -> "Hulls":
        """The same of the absolute values of some of the functions, shape (m,), on the boxes (M, n, 2) that these are of."""
        outer, inner = (_absolute(bounds, which) for bounds in (self.outer, self.inner))
        mixed = which & (self.outer[..., 0] < 0) & (self.outer[..., 1] > 0)
        turned = which & (self.outer[..., 1] <= 0)
        at = np.where(turned[:, :, None, None, None], self.at[:, :, ::-1], self.at)
        at = np.where(mixed[:, :, None, None, None], boxes[:, None, None], at)
        return self._replace(outer=outer, inner=inner, at=at)


class Pieces(NamedTuple):
    """Parts of boxes, and what is known on each of the one function that its box is for."""

    source: Ints  #: shape (M,), number of the box
    boxes: Floats  #: shape (M, n, 2)
    outer: Floats  #: shape (M, 2), bounds without `margin`
    inner: Floats  #: shape (M, 2), values that are taken
    margin: Floats  #: shape (M,)
    at: Floats  #: shape (M, 2, n, 2)
    bend: Floats  #: shape (M, n)

    @classmethod
    def joined(cls, parts: Sequence["Pieces"]) -> "Pieces":
        """The parts one after another."""
        return parts[0] if len(parts) == 1 else cls._make(map(np.concatenate, zip(*parts, strict=True)))

    def of(self, rows: Bools) -> "Pieces":
        """The parts of some numbers."""
        return Pieces._make(each[rows] for each in self)


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """The ranges of functions over N boxes, one function each."""

    bounds: Floats  #: shape (N, 2), outer: least and largest value; infinite where nothing is known
    at: Floats  #: shape (N, 2, n, 2), a box that holds the places of the extreme
    boxes: Floats  #: shape (N, n, 2)
    pieces: Pieces  #: into which the boxes were cut


def ranges(
    hulls: Callable[[Floats], Hulls],
    boxes: Floats,
    which: Ints | int = 0,
    tolerance: float = 1e-12,
    known: Ranges | None = None,
    side: int | None = None,
) -> Ranges:
    """The ranges over boxes (N, n, 2) of one function each, by number, shape (N,).

    All boxes are cut side by side, each until the gap is below `tolerance` of its range, or there are too many pieces. The
    bounds are outer whatever the tolerance: they are those of all the pieces that were left uncut. What is `known` of the same
    functions over boxes that hold these ones is used again: only the pieces that stick out are cut off and looked at anew. What
    is known of boxes that do not hold these ones is not used.
    With `side` 0 boxes are cut for the sake of the least value alone, with 1 of the largest.
    """
    which, sides = np.broadcast_to(which, len(boxes)), [0, 1] if side is None else [side]
    look = partial(_look, hulls, which)
    kept, cut, source = _inside(known, boxes)
    taken = np.broadcast_to([np.inf, -np.inf], (len(boxes), 2)).copy()
    leaves: list[Pieces] = []
    for last in (*(False,) * MOST_ROUNDS, True):
        found = Pieces.joined([*kept, *([look(cut, source)] if len(cut) else [])])
        _join(taken, found.source, found.inner)
        slack = tolerance * (taken[:, 1] - taken[:, 0])[found.source] + 4 * found.margin
        over = np.stack([taken[found.source, 0] - found.outer[:, 0], found.outer[:, 1] - taken[found.source, 1]], axis=1)
        is_open = (over > slack[:, None])[:, sides].any(axis=1)
        if last or is_open.sum() * SLICES > MOST_BOXES:
            is_open[:] = False
        if not is_open.any():
            leaves.append(found)
            break
        leaves.append(found.of(~is_open))
        slices = max(SLICES, FEW // int(is_open.sum()))
        kept, cut, source = [], _cut(found.boxes[is_open], found.bend[is_open], slices), np.repeat(found.source[is_open], slices)
    return _ranges(boxes, taken, Pieces.joined(leaves))


def _look(hulls: Callable[[Floats], Hulls], which: Ints, boxes: Floats, source: Ints) -> Pieces:
    """What is known on parts (M, n, 2) of boxes of the functions that these are for."""
    found, rows = hulls(boxes), (np.arange(len(source)), which[source])
    return Pieces(source, boxes, found.outer[rows], found.inner[rows], found.margin[rows], found.at[rows], found.bend)


def _inside(known: Ranges | None, boxes: Floats) -> tuple[list[Pieces], Floats, Ints]:
    """The pieces known that lie within boxes (N, n, 2), and of the others the parts that do, with their sources."""
    if known is None or (boxes[..., 0] < known.boxes[..., 0]).any() or (boxes[..., 1] > known.boxes[..., 1]).any():
        return [], boxes, np.arange(len(boxes))
    pieces, ends = known.pieces, boxes[known.pieces.source]
    low, high = np.maximum(pieces.boxes[..., 0], ends[..., 0]), np.minimum(pieces.boxes[..., 1], ends[..., 1])
    whole = ((low == pieces.boxes[..., 0]) & (high == pieces.boxes[..., 1])).all(axis=1)
    meets = ((low < high) | (ends[..., 0] == ends[..., 1]) & (low == high)).all(axis=1)  # what only touches has a neighbour
    cut = meets & ~whole
    return [pieces.of(whole)], np.stack([low, high], axis=2)[cut], pieces.source[cut]


def _ranges(boxes: Floats, taken: Floats, pieces: Pieces) -> Ranges:
    sign = np.array([-1.0, 1.0])
    widened = pieces.outer + sign * pieces.margin[:, None]
    bounds = np.broadcast_to([np.inf, -np.inf], taken.shape).copy()
    _join(bounds, pieces.source, widened)
    at = np.broadcast_to([np.inf, -np.inf], (len(boxes), *pieces.at.shape[1:])).copy()
    may = sign * widened >= sign * taken[pieces.source] - pieces.margin[:, None]
    for side in (0, 1):
        _join(at[:, side], pieces.source[may[:, side]], pieces.at[may[:, side], side])
    return Ranges(bounds, at, boxes, pieces)


def _join(known: Floats, source: Ints, values: Floats) -> None:
    """Widen what is known of each source (N, ..., 2) by the least and largest of its values (M, ..., 2)."""
    np.minimum.at(known[..., 0], source, values[..., 0])
    np.maximum.at(known[..., 1], source, values[..., 1])


def _cut(boxes: Floats, bend: Floats, slices: int) -> Floats:
    """Each box in so many slices along the coordinate that bends most."""
    rows, j = np.arange(len(boxes)), bend.argmax(axis=1)
    low, high = boxes[rows, j].T
    ends = low[:, None] + (high - low)[:, None] * np.arange(slices + 1) / slices
    ends[:, -1] = high
    pieces = np.repeat(boxes[:, None], slices, axis=1)
    pieces[rows, :, j] = np.stack([ends[:, :-1], ends[:, 1:]], axis=2)
    return pieces.reshape(-1, *boxes.shape[1:])


def _absolute(bounds: Floats, which: Bools) -> Floats:
    low, high = bounds[..., 0], bounds[..., 1]
    least = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    return np.where(which[:, None], np.stack([least, np.maximum(np.abs(low), np.abs(high))], axis=-1), bounds)
