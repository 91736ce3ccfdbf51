"""Ranges over boxes by branch and bound: outer bounds, the gap to values that are taken, and where the extremes lie."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np

from nsmaps.exact.impacts import Floats
from nsmaps.reduced.polymap import Ints
from nsmaps.reduced.region import Bools

SLICES = 8  #: into which a box is cut along one coordinate
MOST_ROUNDS, MOST_BOXES = 60, 2**15  #: of cutting, and of boxes in one round


@dataclass(frozen=True, slots=True, eq=False)
class Hulls:
    """What is known of m functions on each of M boxes; the last axis of length 2 is (least, largest)."""

    outer: Floats  #: shape (M, m, 2), bounds without `margin`
    inner: Floats  #: shape (M, m, 2), values that are taken, as far as `margin` allows to say
    margin: Floats  #: shape (M, m), what is to be added to both sides, however small the box
    at: Floats  #: shape (M, m, 2, n, 2), a box within each that holds the place of the extreme
    bend: Floats  #: shape (M, n), how much each coordinate has to do with the gap between outer and inner

    @classmethod
    def joined(cls, parts: Sequence["Hulls"]) -> "Hulls":
        """The parts one after another."""
        return parts[0] if len(parts) == 1 else cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))

    def of(self, rows: Bools) -> "Hulls":
        """Some of the boxes."""
        return Hulls(*(getattr(self, f.name)[rows] for f in fields(self)))

    def moved(self, by: Floats) -> "Hulls":
        """The same of functions moved by constants, shape (m,)."""
        return replace(self, outer=self.outer + by[:, None], inner=self.inner + by[:, None])

    def absolute(self, which: Bools, boxes: Floats) -> "Hulls":
        """The same of the absolute values of some of the functions, shape (m,), on the boxes (M, n, 2) that these are of."""
        outer, inner = (_absolute(bounds, which) for bounds in (self.outer, self.inner))
        mixed = which & (self.outer[..., 0] < 0) & (self.outer[..., 1] > 0)
        turned = which & (self.outer[..., 1] <= 0)
        at = np.where(turned[:, :, None, None, None], self.at[:, :, ::-1], self.at)
        at = np.where(mixed[:, :, None, None, None], boxes[:, None, None], at)
        return replace(self, outer=outer, inner=inner, at=at)


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """The ranges of m functions over N boxes."""

    bounds: Floats  #: shape (N, m, 2), outer: least and largest value; infinite where nothing is known
    gap: Floats  #: shape (N, m, 2), from there to a value that is taken
    at: Floats  #: shape (N, m, 2, n, 2), a box that holds the places of the extreme


def ranges(
    hulls: Callable[[Floats], Hulls], boxes: Floats, tolerance: float = 1e-12, wanted: Bools | Literal[True] = True
) -> Ranges:
    """The ranges over boxes (N, n, 2), which are cut until the gap is below `tolerance` of the range, or there are too many.

    The bounds are outer whatever the tolerance: they are those of all the boxes that were left uncut. Boxes are cut for the
    sake of the bounds that are wanted, shape (N, m, 2).
    """
    pieces, source = boxes, np.arange(len(boxes))
    leaves: list[tuple[Ints, Hulls]] = []
    taken: Floats | None = None
    for _ in range(MOST_ROUNDS):
        found = hulls(pieces)
        taken = _joined(source, found.inner, len(boxes), taken)
        slack = tolerance * (taken[..., 1] - taken[..., 0])[source] + 4 * found.margin
        over = np.stack([taken[source, :, 0] - found.outer[..., 0], found.outer[..., 1] - taken[source, :, 1]], axis=2)
        is_open = ((over > slack[..., None]) & np.broadcast_to(wanted, taken.shape)[source]).any(axis=(1, 2))
        if is_open.sum() * SLICES > MOST_BOXES:
            is_open[:] = False
        leaves.append((source[~is_open], found.of(~is_open)))
        if not is_open.any():
            break
        pieces, source = _cut(pieces[is_open], found.bend[is_open]), np.repeat(source[is_open], SLICES)
    else:
        leaves.append((source, hulls(pieces)))
    assert taken is not None
    return _ranges(len(boxes), taken, np.concatenate([s for s, _ in leaves]), Hulls.joined([h for _, h in leaves]))


def _ranges(count: int, taken: Floats, source: Ints, all: Hulls) -> Ranges:
    widened = np.stack([all.outer[..., 0] - all.margin, all.outer[..., 1] + all.margin], axis=2)
    bounds = _joined(source, widened, count)
    gap = np.abs(bounds - taken)
    sign = np.array([-1.0, 1.0])
    may = sign * widened >= sign * taken[source] - all.margin[..., None]
    low, high = np.full((count, *all.at.shape[1:-1]), np.inf), np.full((count, *all.at.shape[1:-1]), -np.inf)
    np.minimum.at(low, source, np.where(may[..., None], all.at[..., 0], np.inf))
    np.maximum.at(high, source, np.where(may[..., None], all.at[..., 1], -np.inf))
    return Ranges(bounds, gap, np.stack([low, high], axis=-1))


def _joined(source: Ints, values: Floats, count: int, known: Floats | None = None) -> Floats:
    """The least and largest values of each source, together with what is known."""
    made = np.broadcast_to([np.inf, -np.inf], (count, *values.shape[1:])).copy() if known is None else known
    np.minimum.at(made[..., 0], source, values[..., 0])
    np.maximum.at(made[..., 1], source, values[..., 1])
    return made


def _cut(boxes: Floats, bend: Floats) -> Floats:
    """Each box in slices along the coordinate that bends most."""
    rows, j = np.arange(len(boxes)), bend.argmax(axis=1)
    low, high = boxes[rows, j].T
    ends = low[:, None] + (high - low)[:, None] * np.arange(SLICES + 1) / SLICES
    ends[:, -1] = high
    pieces = np.repeat(boxes[:, None], SLICES, axis=1)
    for k in range(SLICES):
        pieces[rows, k, j] = ends[:, k : k + 2]
    return pieces.reshape(-1, *boxes.shape[1:])


def _absolute(bounds: Floats, which: Bools) -> Floats:
    low, high = bounds[..., 0], bounds[..., 1]
    least = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    return np.where(which[:, None], np.stack([least, np.maximum(np.abs(low), np.abs(high))], axis=-1), bounds)
