"""Adaptive refinement of a picture: a coarse grid of pixels, and finer ones where neighbours differ."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints


def refined(shape: tuple[int, int], coarse: int, kinds_of: Callable[[Ints], Ints]) -> tuple[Ints, Bools]:
    """A picture of kinds of pixels of which few are computed.

    Every `coarse`-th pixel of each axis, and the last one, are computed first. From level to level the distance is halved: in
    cells whose corners differ all new pixels are computed, in others they are filled from the nearest ones before them. Where
    corners of a cell differ they are computed themselves, until all of them are: a border that was found is followed to its
    ends, and computed on both sides. What lies within cells whose four corners agree is not found.

    Args:
        shape: rows and columns, at least two of each.
        coarse: a power of two; with 1 every pixel is computed.
        kinds_of: the kinds, as numbers, of pixels by their numbers, shape (N,), ascending; called once for each pixel at most.

    Returns:
        The number of the pixel from which each was filled, its own where it was computed, shape (rows, columns), and whether it
        was.
    """
    picture = _Picture(np.zeros(shape, np.int64), np.arange(np.prod(shape)).reshape(shape), np.zeros(shape, bool), kinds_of)
    places = [_places(size, coarse) for size in shape]
    picture.compute(np.ones([len(each) for each in places], bool), *places)
    while True:
        while picture.compute(_corners(picture.differ(*places)), *places):
            pass
        if coarse == 1:
            return picture.source, picture.known
        coarse //= 2
        finer = [_places(size, coarse) for size in shape]
        asked = _touched(picture.differ(*places), *(_around(old, new) for old, new in zip(places, finer, strict=True)))
        before = [old[np.searchsorted(old, new, side="right") - 1] for old, new in zip(places, finer, strict=True)]
        picture.fill(before, finer)
        picture.compute(asked, *finer)
        places = finer


def interpolated(values: Floats, known: Bools, shape: tuple[int, int]) -> Floats:
    """Values of pixels (N, ...), of which those that are not known are linear between known ones, on triangles.

    Where a known one is not finite they remain as they were filled.
    """
    if known.all() or not values.size:
        return values
    from scipy.interpolate import LinearNDInterpolator

    good = np.isfinite(values.reshape(len(values), -1)).all(axis=1)
    finite, left = known & good, np.flatnonzero(~known & good)
    if len(left):
        points = np.column_stack(np.unravel_index(np.flatnonzero(finite), shape))
        between = LinearNDInterpolator(points, values[finite])(np.column_stack(np.unravel_index(left, shape)))
        values = values.copy()
        values[left] = np.where(np.isfinite(between), between, values[left])
    return values


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """The pixels that are known, and what the others were filled from; all of shape (rows, columns)."""

    kinds: Ints
    source: Ints
    known: Bools
    kinds_of: Callable[[Ints], Ints]

    def compute(self, asked: Bools, rows: Ints, columns: Ints) -> bool:
        """Compute those pixels asked for, in some rows and columns, that are not known; whether there were any."""
        here = np.ix_(rows, columns)
        pixels = (rows[:, None] * self.kinds.shape[1] + columns)[asked & ~self.known[here]]
        if len(pixels):
            self.kinds.flat[pixels], self.source.flat[pixels], self.known.flat[pixels] = self.kinds_of(pixels), pixels, True
        return bool(len(pixels))

    def differ(self, rows: Ints, columns: Ints) -> Bools:
        """The cells between these rows and columns whose corners differ."""
        at = self.kinds[np.ix_(rows, columns)]
        one = at[:-1, :-1]
        return np.asarray((at[1:, :-1] != one) | (at[:-1, 1:] != one) | (at[1:, 1:] != one))

    def fill(self, before: list[Ints], places: list[Ints]) -> None:
        """Fill pixels that are not known from those before them."""
        here, there = np.ix_(*places), np.ix_(*before)
        left = ~self.known[here]
        for table in (self.kinds, self.source):
            table[here] = np.where(left, table[there], table[here])


def _places(size: int, step: int) -> Ints:
    """Every `step`-th place of an axis, and the last one."""
    return np.unique(np.append(np.arange(0, size, step), size - 1))


def _corners(cells: Bools) -> Bools:
    """The corners of some cells."""
    padded = np.pad(cells, 1)
    return np.asarray(padded[1:, 1:] | padded[1:, :-1] | padded[:-1, 1:] | padded[:-1, :-1])


def _around(places: Ints, finer: Ints) -> tuple[Ints, Ints]:
    """The cells before and after each place of a finer axis, counted from 1; the same one of a place within it."""
    after = np.searchsorted(places, finer, side="right")
    return np.where(places[after - 1] == finer, after - 1, after), after


def _touched(cells: Bools, rows: tuple[Ints, Ints], columns: tuple[Ints, Ints]) -> Bools:
    """The places of a finer grid in or on the edge of some cells."""
    padded = np.pad(cells, 1)
    return np.asarray(np.any([padded[np.ix_(row, column)] for row in rows for column in columns], axis=0))
