"""Ranges over boxes by branch and bound: outer bounds, and where the extremes lie."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from nsmaps.enclosures.ranges_kernel import Pieces

MOST_ROUNDS = 60  #: of cutting


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
        outer, inner, at = self.outer.copy(), self.inner.copy(), self.at.copy()
        for k in np.flatnonzero(which):
            mixed = (self.outer[:, k, 0] < 0) & (self.outer[:, k, 1] > 0)
            turned = self.outer[:, k, 1] <= 0
            at[turned, k] = self.at[turned, k, ::-1]
            at[mixed, k] = boxes[mixed, None]
            outer[:, k], inner[:, k] = _absolute(*outer[:, k].T), _absolute(*inner[:, k].T)
        return self._replace(outer=outer, inner=inner, at=at)


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """The ranges of functions over N boxes, one function each."""

    bounds: Floats  #: shape (N, 2), outer: least and largest value; infinite where nothing is known
    at: Floats  #: shape (N, 2, n, 2), a box that holds the places of the extreme
    boxes: Floats  #: shape (N, n, 2)
    pieces: "Pieces"  #: into which the boxes were cut


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
    from nsmaps.enclosures.ranges_kernel import Aim, Parts, Pieces, conclude, inside, refine

    count, n = boxes.shape[:2]
    aim = Aim(np.full(count, which), np.array([side != 1, side != 0]), tolerance, _nowhere(count))
    pieces, parts, begin, end = Pieces.room(0, n), Parts(np.arange(count), boxes), 0, 0
    if known is not None and not ((boxes[..., 0] < known.boxes[..., 0]).any() or (boxes[..., 1] > known.boxes[..., 1]).any()):
        pieces, parts = Pieces.room(len(known.pieces.source), n), Parts.room(len(known.pieces.source), n)
        end, left = inside(known.pieces, boxes, pieces, parts)
        parts = parts.first(left)
    for k in range(MOST_ROUNDS + 1):
        found = hulls(parts.boxes) if len(parts.source) else _nothing(n)
        pieces = pieces.enlarged(end, end + len(parts.source))
        finer = Parts.finer_than(end - begin + len(parts.source) if k < MOST_ROUNDS else 0, n)
        end, left = refine(aim, pieces, (begin, end), Hulls(*map(np.ascontiguousarray, found)), parts, finer)
        if not left:
            break
        begin, parts = end, finer.first(left)
    pieces, bounds, at = pieces.first(end), _nowhere(count), _nowhere(count, 2, n)
    conclude(pieces, aim.taken, bounds, at)
    return Ranges(bounds, at, boxes, pieces)


def _nowhere(*shape: int) -> Floats:
    """Intervals without a point, which others widen."""
    found = np.empty((*shape, 2))
    found[..., 0], found[..., 1] = np.inf, -np.inf
    return found


@lru_cache(maxsize=16)
def _nothing(n: int) -> Hulls:
    """What is known on no box."""
    return Hulls(*(np.empty((0, *shape)) for shape in ((1, 2), (1, 2), (1,), (1, 2, n, 2), (n,))))


def _absolute(low: Floats, high: Floats) -> Floats:
    least = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    return np.stack([least, np.maximum(np.abs(low), np.abs(high))], axis=-1)
