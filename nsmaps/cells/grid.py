"""A window of the state space in equal cells: which of them hold the images of others, and what sets of them are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from time import perf_counter
from typing import Self

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, WithCoordinates, as_box, as_states, wrap
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages, BoxMap
from nsmaps.results import Result, array

SPLITS = 5  #: times that a box of unknown or wide images is halved along every axis
WIDE = 30.0  #: an image is wide if its side exceeds so many of its box's, each measured by the window
BATCH, GROWTH = 20_000, 8  #: most cells whose images are asked for in one call, and how many times as many as in the last one
ROUNDING = 2.0**-50  #: relative: what moving an angle by whole turns may be off by


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Which cells may hold images of N others: rows of ranges, those of every source one after another."""

    source: Ints  #: shape (R,), ascending
    low: Ints  #: shape (R, n), the first cell an axis
    high: Ints  #: shape (R, n), the last one, included
    anywhere: Bools  #: shape (N,), of each source: nothing is known of its images, and it has no row
    exists: Bools  #: shape (N,), of each source: every state of it has an image, and it is known where
    stays: Bools  #: shape (N,), of each source: so it is, and all images are in the window

    def of(self, sources: Bools) -> "Targets":
        """The same with the rows of some sources only."""
        rows = sources[self.source]
        return replace(self, source=self.source[rows], low=self.low[rows], high=self.high[rows])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cells(WithCoordinates, Result):
    """A box of states divided into equal cells, numbered as C arrays are; an angle of a whole turn closes to a circle."""

    coordinates: Coordinates
    box: Floats = field(metadata=array("coordinate end", "box of all cells"))
    shape: tuple[int, ...]  #: cells an axis

    def summary(self) -> str:
        """The numbers that matter."""
        box = ", ".join(
            f"{name} in [{low:.6g}, {high:.6g}]" for name, (low, high) in zip(self.coordinates, self.box, strict=True)
        )
        return f"{' x '.join(map(str, self.shape))} cells, {box}"

    @classmethod
    def over(cls, coordinates: Sequence[str], box: BoxLike, cells: int | Sequence[int]) -> Self:
        """A box, as `as_box` takes it, in so many cells an axis. NsmapsError if either is not valid."""
        own, ends, n = Coordinates(coordinates), as_box(box, coordinates, whole_turn=True), len(coordinates)
        shape = (cells,) * n if isinstance(cells, int) else tuple(cells)
        if len(shape) != n or min(shape) < 1:
            raise NsmapsError(f"n_cells is {cells!r}; expected: a number from 1 on, or one for each of {', '.join(coordinates)}")
        return cls(own, ends, shape)

    @property
    def size(self) -> int:
        """The number of all cells."""
        return int(np.prod(self.shape))

    @property
    def circles(self) -> Bools:
        """Which axes are whole turns of an angle, shape (n,)."""
        return self.coordinates.angles & (np.ptp(self.box, axis=1) >= TWO_PI)

    def edges(self, axis: int) -> Floats:
        """Where the cells of an axis begin, and the end of the last one."""
        low, high = self.box[axis]
        return np.linspace(low, high, self.shape[axis] + 1)

    def boxes(self, numbers: Ints) -> Floats:
        """The cells of some numbers, shape (M, n, 2)."""
        places = np.unravel_index(numbers, self.shape)
        ends = [np.stack([self.edges(k)[i], self.edges(k)[i + 1]], axis=1) for k, i in enumerate(places)]
        return np.stack(ends, axis=1)

    def centres(self, numbers: Ints) -> Floats:
        """Shape (M, n)."""
        return self.boxes(numbers).mean(axis=2)

    def halved(self) -> "Cells":
        """The same window with every cell halved along each axis."""
        return Cells(self.coordinates, self.box, tuple(2 * m for m in self.shape))

    def parts(self, numbers: Ints) -> Ints:
        """The numbers, ascending, of the cells of `halved()` that some cells consist of."""
        finer, places = self.halved(), np.unravel_index(numbers, self.shape)
        sides = list(product((0, 1), repeat=len(self.shape)))
        halves = [
            np.ravel_multi_index(tuple(2 * i + s for i, s in zip(places, side, strict=True)), finer.shape) for side in sides
        ]
        return np.sort(np.concatenate(halves)).astype(np.int64)

    def numbers_of(self, states: ArrayLike) -> Ints:
        """The number of the cell of each state (N, n), shape (N,); -1 outside of the window."""
        x = as_states(states, self.coordinates)
        low, high = self.box.T
        x = np.where(self.coordinates.angles, low + wrap(x - low), x)
        inside = ((low <= x) & (x <= high)).all(axis=1)
        places = [self._place(k, x[inside, k]) for k in range(len(self.shape))]
        numbers = np.full(len(x), -1, np.int64)
        numbers[inside] = np.ravel_multi_index(tuple(places), self.shape)
        return numbers

    def hull(self, numbers: Ints) -> Floats:
        """The smallest box around some cells, shape (n, 2); on a circle it may pass the window's end."""
        hull = np.empty((len(self.shape), 2))
        for k, places in enumerate(np.unravel_index(numbers, self.shape)):
            edges, used = self.edges(k), np.unique(places)
            first, last, turn = used[0], used[-1], 0.0
            if self.circles[k] and len(used) > 1:
                gaps = np.diff(used, append=used[0] + self.shape[k])
                if np.argmax(gaps) < len(gaps) - 1 and gaps.max() > gaps[-1]:
                    widest = int(np.argmax(gaps))
                    first, last, turn = used[widest + 1], used[widest], TWO_PI
            hull[k] = edges[first], edges[last + 1] + turn
        return hull

    def targets(self, images: BoxImages) -> Targets:
        """The cells that image boxes meet. A state on the border of two cells counts as of the upper one."""
        known = np.isfinite(images.images).all(axis=(1, 2))
        source, boxes = images.source[known], images.images[known]
        row, ends = np.arange(len(boxes)), boxes
        inside = np.ones(len(boxes), bool)
        for k in range(len(self.shape)):
            row, ends, contained = self._along(k, row, ends, boxes)
            inside &= contained
        order = np.argsort(row, kind="stable")
        row, ends = row[order], ends[order]
        low = np.stack([self._place(k, ends[:, k, 0]) for k in range(len(self.shape))], axis=1)
        high = np.stack([self._place(k, ends[:, k, 1]) for k in range(len(self.shape))], axis=1)
        exists = images.bounded & ~images.empty
        stays = exists.copy()
        stays[source[~inside]] = False
        return Targets(source[row], low, high, ~images.bounded, exists, stays)

    def _along(self, axis: int, row: Ints, ends: Floats, boxes: Floats) -> tuple[Ints, Floats, Bools]:
        """Image boxes as they meet the window along one axis, an angle on every turn; and which of all lie within it."""
        a, b = self.box[axis]
        low, high = ends[:, axis].T
        if not self.coordinates.angles[axis]:
            contained = (a <= boxes[:, axis, 0]) & (boxes[:, axis, 1] <= b)
            meets = (low <= b) & (a <= high)
            return row[meets], ends[meets], contained
        slack = ROUNDING * (np.abs(low) + np.abs(high) + abs(a) + 8)
        whole = high - low + 2 * slack >= TWO_PI
        base = low - TWO_PI * np.floor((low - a) / TWO_PI) - slack
        side = high - low + 3 * slack
        rows, cut = [], []
        contained = np.full(len(boxes), bool(self.circles[axis]))
        for turn in (-1, 0, 1):
            lower = np.where(whole, a, base + turn * TWO_PI)
            upper = np.where(whole, b, base + side + turn * TWO_PI)
            meets = (lower <= b) & (a <= upper) & (~whole | (turn == 0))
            contained[row[~whole & (a <= lower) & (upper <= b)]] = True
            moved = ends[meets].copy()
            moved[:, axis] = np.stack([lower, upper], axis=1)[meets]
            rows.append(row[meets])
            cut.append(moved)
        return np.concatenate(rows), np.concatenate(cut), contained

    def _place(self, axis: int, x: Floats) -> Ints:
        return np.clip(np.searchsorted(self.edges(axis), x, side="right") - 1, 0, self.shape[axis] - 1)


def images_of(return_map: BoxMap, boxes: Floats, sides: Floats, splits: int = SPLITS) -> BoxImages:
    """The image boxes of boxes (N, n, 2), of parts of a box whose images are unknown or wide, and of parts of these.

    Args:
        sides: of the window, shape (n,), by which sides are measured.
        splits: most halvings.
    """
    found = return_map.image_boxes(boxes)
    split = ~found.bounded
    own, size = (((each[..., 1] - each[..., 0]) / sides).max(axis=1) for each in (boxes, found.images))
    wide = ~(size <= WIDE * own[found.source])
    split[found.source[wide if found.inherent is None else wide & ~found.inherent]] = True
    unknown = np.flatnonzero(split)
    if not splits or not len(unknown):
        return found
    middle = boxes[unknown].mean(axis=2)
    ends = np.stack([boxes[unknown, :, 0], middle, boxes[unknown, :, 1]])
    corners = list(product((0, 1), repeat=middle.shape[1]))
    axes = range(middle.shape[1])
    halves = [np.stack([ends[[corner[k], corner[k] + 1], :, k].T for k in axes], axis=1) for corner in corners]
    parts = images_of(return_map, np.stack(halves, axis=1).reshape(-1, middle.shape[1], 2), sides, splits - 1)
    whole = ~split[found.source]
    source = np.concatenate([found.source[whole], unknown[parts.source // len(corners)]])
    order = np.argsort(source, kind="stable")
    bounded, empty = found.bounded.copy(), found.empty.copy()
    bounded[unknown] = parts.bounded.reshape(-1, len(corners)).all(axis=1)
    empty[unknown] = parts.empty.reshape(-1, len(corners)).any(axis=1)
    images, words = (np.concatenate([getattr(found, k)[whole], getattr(parts, k)])[order] for k in ("images", "words"))
    return BoxImages(source[order], images, words, bounded, empty)


def targets_of(return_map: BoxMap, cells: Cells, numbers: Ints) -> Iterator[Targets]:
    """The targets of cells of some numbers in order, a batch at a time: ever larger ones, each for about a second at most."""
    done, size = 0, 1
    while done < len(numbers):
        begun, batch = perf_counter(), numbers[done : done + size]
        yield cells.targets(images_of(return_map, cells.boxes(batch), np.ptp(cells.box, axis=1)))
        done, size = done + size, min(GROWTH * size, BATCH) if perf_counter() - begun < 1 / GROWTH else size


def joined(batches: Sequence[Targets]) -> Targets:
    """Batches as one."""
    counts = np.cumsum([0, *(len(found.stays) for found in batches)])
    moved = [replace(found, source=found.source + count) for found, count in zip(batches, counts, strict=False)]
    return Targets(*(np.concatenate([getattr(found, field.name) for found in moved]) for field in fields(Targets)))


def painted(cells: Cells, found: Targets) -> Bools:
    """Which of all cells some target range holds, shape (size,)."""
    steps = np.zeros([m + 1 for m in cells.shape], np.int64)
    for sign, corner in _corners(found):
        np.add.at(steps, tuple(corner.T), sign)
    for k in range(steps.ndim):
        np.cumsum(steps, axis=k, out=steps)
    return (steps[tuple(slice(m) for m in cells.shape)] > 0).ravel()


def counted(cells: Cells, mask: Bools, found: Targets) -> Ints:
    """How many of the cells in a mask of all, shape (size,), each target range holds, shape (R,)."""
    sums = np.zeros([m + 1 for m in cells.shape], np.int64)
    sums[tuple(slice(1, None) for _ in cells.shape)] = mask.reshape(cells.shape)
    for k in range(sums.ndim):
        np.cumsum(sums, axis=k, out=sums)
    return np.sum([sign * sums[tuple(corner.T)] for sign, corner in _corners(found)], axis=0) * (-1) ** sums.ndim


def _corners(found: Targets) -> Iterator[tuple[int, Ints]]:
    """The corners of target ranges, of which each passed end changes the sign."""
    ends = found.low, found.high + 1
    for sides in product((0, 1), repeat=found.low.shape[1]):
        yield (-1) ** sum(sides), np.stack([ends[side][:, k] for k, side in enumerate(sides)], axis=1)
