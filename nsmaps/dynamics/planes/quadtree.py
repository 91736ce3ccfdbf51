"""Adaptive refinement of a picture: a coarse grid of pixels, and finer ones where neighbours differ."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Bools, Ints

ROUNDS = 4  #: most rounds of random pixels that look for what was missed, before those that are counted
SHARE, FEWEST = 0.02, 100  #: random pixels of a round, as a share of the picture; at least so many


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """Which pixels of a picture were computed, what the others were filled from, and how many of these were found wrong."""

    source: Ints  #: shape (rows, columns), number of the pixel from which each has its kind; its own where it was computed
    computed: Bools  #: shape (rows, columns)
    probes: int  #: number of pixels that were filled, drawn at random and then computed
    differing: int  #: number of these whose kind was not the filled one


def refined(
    shape: tuple[int, int], coarse: int, kinds_of: Callable[[Ints], Ints], continued: Callable[[Ints, Ints], Bools] | None = None
) -> Refinement:
    """A picture of kinds of pixels of which few are computed.

    Every `coarse`-th pixel of each axis, and the last one, are computed first. From level to level the distance is halved: in
    cells whose corners differ all new pixels are computed, in others they are filled from the nearest ones before them. Where
    corners of a cell differ they are computed themselves, until all of them are: a border that was found is followed to its
    ends, and computed on both sides.

    What lies within cells whose four corners agree is not seen by this. Filled pixels are therefore drawn at random and
    computed, in rounds until one finds no difference, and each difference is followed like any border. Filled pixels at which
    what their sources show cannot be continued are computed, too. One more round of random pixels is counted: the share of
    filled pixels that differ is estimated from it.

    Args:
        shape: rows and columns, at least two of each.
        coarse: a power of two; with 1 every pixel is computed.
        kinds_of: the kinds, as numbers, of pixels by their numbers, shape (N,), ascending; called once for each pixel at most.
        continued: whether each of N filled pixels is of the kind of the one that it was filled from, given both numbers.
    """
    source = np.arange(np.prod(shape)).reshape(shape)
    picture = _Picture(np.zeros(shape, np.int64), source, np.zeros(shape, bool), kinds_of, continued)
    places = [_places(size, coarse) for size in shape]
    picture.compute(np.ones([len(each) for each in places], bool), *places)
    while True:
        picture.follow_borders(*places)
        if coarse == 1:
            return picture.probed()
        coarse //= 2
        finer = [_places(size, coarse) for size in shape]
        asked = _touched(picture.differ(*places), *(_around(old, new) for old, new in zip(places, finer, strict=True)))
        before = [old[np.searchsorted(old, new, side="right") - 1] for old, new in zip(places, finer, strict=True)]
        picture.fill(before, finer)
        picture.compute(asked, *finer)
        places = finer


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """The pixels that are known, and what the others were filled from; all of shape (rows, columns)."""

    kinds: Ints
    source: Ints
    known: Bools
    kinds_of: Callable[[Ints], Ints]
    continued: Callable[[Ints, Ints], Bools] | None

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

    def follow_borders(self, rows: Ints, columns: Ints) -> None:
        """Compute the corners of cells whose corners differ, until all of them are computed."""
        while self.compute(_corners(self.differ(rows, columns)), rows, columns):
            pass

    def probed(self) -> Refinement:
        """The picture, once rounds of random pixels have found what was missed, with the numbers of one more round."""
        random, rounds = np.random.default_rng(0), ROUNDS
        while self._probe(random)[1] and (rounds := rounds - 1):
            continue
        left = np.flatnonzero(~self.known)
        if self.continued is not None and len(left):
            self._compute_with_borders(left[~self.continued(left, self.source.flat[left])])
        return Refinement(self.source, self.known, *self._probe(random))

    def _compute_with_borders(self, pixels: Ints) -> None:
        """Compute some pixels, and the borders that they reveal."""
        asked = np.zeros(self.known.shape, bool)
        asked.flat[pixels] = True
        everywhere = [np.arange(size) for size in self.known.shape]
        self.compute(asked, *everywhere)
        self.follow_borders(*everywhere)

    def _probe(self, random: np.random.Generator) -> tuple[int, int]:
        """Compute random pixels and the borders that they reveal: their number, and how many differ from what was filled in."""
        left = np.flatnonzero(~self.known)
        pixels = np.sort(random.choice(left, min(len(left), max(FEWEST, int(SHARE * self.known.size))), replace=False))
        before = self.kinds.flat[pixels]
        self._compute_with_borders(pixels)
        return len(pixels), int((self.kinds.flat[pixels] != before).sum())

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
