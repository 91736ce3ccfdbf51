"""The compiled steps of branch and bound: what is kept, compared and cut between two looks at an enclosure."""

from math import isnan
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.exact.engine.jit import entry, inner

SLICES, FEW = 8, 16  #: into which a box is cut along one coordinate, more if that makes but few: a round of these costs no more
MOST_BOXES = 2**12  #: in one round


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
    def room(cls, count: int, n: int) -> "Pieces":
        """Memory for so many pieces in n coordinates."""
        outer, inner, at = np.empty((count, 2)), np.empty((count, 2)), np.empty((count, 2, n, 2))
        return cls(np.empty(count, np.int64), np.empty((count, n, 2)), outer, inner, np.empty(count), at, np.empty((count, n)))

    def first(self, count: int) -> "Pieces":
        """The first so many."""
        return Pieces._make(each[:count] for each in self)

    def enlarged(self, used: int, count: int) -> "Pieces":
        """The same with room for so many, of which some are used."""
        if count <= len(self.source):
            return self
        larger = Pieces.room(2 * count, self.boxes.shape[1])
        for each, other in zip(self, larger, strict=True):
            other[:used] = each[:used]
        return larger


class Parts(NamedTuple):
    """Parts of boxes that are to be looked at."""

    source: Ints  #: shape (M,), number of the box
    boxes: Floats  #: shape (M, n, 2)

    @classmethod
    def room(cls, count: int, n: int) -> "Parts":
        """Memory for so many parts in n coordinates."""
        return cls(np.empty(count, np.int64), np.empty((count, n, 2)))

    @classmethod
    def finer_than(cls, pieces: int, n: int) -> "Parts":
        """Memory for the parts into which so many pieces are cut; none for none."""
        return cls.room(min(max(SLICES * pieces, FEW), MOST_BOXES) if pieces else 0, n)

    def first(self, count: int) -> "Parts":
        """The first so many."""
        return Parts(self.source[:count], self.boxes[:count])


class Aim(NamedTuple):
    """What is sought over N boxes."""

    which: Ints  #: shape (N,), the function of each
    sides: Bools  #: shape (2,), whether the least and the largest value are wanted
    tolerance: float  #: gap, as a share of a range, that is left
    taken: Floats  #: shape (N, 2), the least and largest value that are known to be taken


@inner
def lesser(a, b):
    """The lesser of two numbers, NaN if one is."""
    return a if a < b or isnan(a) else b


@inner
def greater(a, b):
    """The greater of two numbers, NaN if one is."""
    return a if a > b or isnan(a) else b


@inner
def copy(given, i, pieces, k):
    """Copy piece i of some to place k of others."""
    pieces.source[k], pieces.margin[k] = given.source[i], given.margin[i]
    for side in range(2):
        pieces.outer[k, side], pieces.inner[k, side] = given.outer[i, side], given.inner[i, side]
    for j in range(given.boxes.shape[1]):
        pieces.bend[k, j] = given.bend[i, j]
        for end in range(2):
            pieces.boxes[k, j, end] = given.boxes[i, j, end]
            for side in range(2):
                pieces.at[k, side, j, end] = given.at[i, side, j, end]


@entry
def inside(known, boxes, pieces, parts):
    """Copy the known pieces that lie within boxes (N, n, 2), and of the others the parts that do: how many there are of both."""
    kept = cut = 0
    for i in range(len(known.source)):
        whole = meets = True
        for j in range(boxes.shape[1]):
            begin, end = boxes[known.source[i], j, 0], boxes[known.source[i], j, 1]
            low, high = max(known.boxes[i, j, 0], begin), min(known.boxes[i, j, 1], end)
            whole &= low == known.boxes[i, j, 0] and high == known.boxes[i, j, 1]
            meets &= low < high or (begin == end and low == high)  # what only touches has a neighbour
            parts.boxes[cut, j, 0], parts.boxes[cut, j, 1] = low, high
        if whole:
            copy(known, i, pieces, kept)
            kept += 1
        elif meets:
            parts.source[cut] = known.source[i]
            cut += 1
    return kept, cut


@inner
def look(aim, hulls, parts, pieces, k):
    """Write what is known on parts, of the functions that their boxes are for, from piece k on."""
    for i in range(len(parts.source)):
        f = aim.which[parts.source[i]]
        pieces.source[k + i], pieces.margin[k + i] = parts.source[i], hulls.margin[i, f]
        for side in range(2):
            pieces.outer[k + i, side], pieces.inner[k + i, side] = hulls.outer[i, f, side], hulls.inner[i, f, side]
        for j in range(parts.boxes.shape[1]):
            pieces.bend[k + i, j] = hulls.bend[i, j]
            for end in range(2):
                pieces.boxes[k + i, j, end] = parts.boxes[i, j, end]
                for side in range(2):
                    pieces.at[k + i, side, j, end] = hulls.at[i, f, side, j, end]


@inner
def widen(taken, pieces, begin, end):
    """Widen what is taken by the values of some pieces."""
    for k in range(begin, end):
        s = pieces.source[k]
        taken[s, 0], taken[s, 1] = lesser(taken[s, 0], pieces.inner[k, 0]), greater(taken[s, 1], pieces.inner[k, 1])


@inner
def is_open(aim, pieces, k):
    """Whether the values of a piece may go beyond what is taken by more than is left."""
    low, high = aim.taken[pieces.source[k], 0], aim.taken[pieces.source[k], 1]
    slack = aim.tolerance * (high - low) + 4 * pieces.margin[k]
    below, above = low - pieces.outer[k, 0] > slack, pieces.outer[k, 1] - high > slack
    return (aim.sides[0] and below) or (aim.sides[1] and above)


@inner
def most_bent(bend):
    """The number of the largest (n,), or of the first that is NaN."""
    found = 0
    for j in range(len(bend)):
        if bend[j] > bend[found] or (isnan(bend[j]) and not isnan(bend[found])):
            found = j
    return found


@inner
def cut(pieces, k, slices, parts, place):
    """Write a piece in so many slices along the coordinate that bends most."""
    along = most_bent(pieces.bend[k])
    low, high = pieces.boxes[k, along, 0], pieces.boxes[k, along, 1]
    for s in range(slices):
        parts.source[place + s] = pieces.source[k]
        for j in range(pieces.boxes.shape[1]):
            for end in range(2):
                parts.boxes[place + s, j, end] = pieces.boxes[k, j, end]
        parts.boxes[place + s, along, 0] = low + (high - low) * s / slices
        parts.boxes[place + s, along, 1] = high if s + 1 == slices else low + (high - low) * (s + 1) / slices


@entry
def refine(aim, pieces, compared, hulls, parts, finer):
    """Add parts that were looked at to the pieces, and write finer parts of those that stay open.

    Returns how many pieces there are then, all compared, and how many finer parts.

    Args:
        aim: an Aim.
        pieces: those known so far, with room for the parts.
        compared: of how many of these the values are compared with those of others, and how many there are.
        hulls: the Hulls on `parts`.
        finer: room for parts; no piece stays open if there is none, or if they would be too many.
    """
    begin, end = compared
    look(aim, hulls, parts, pieces, end)
    end += len(parts.source)
    widen(aim.taken, pieces, begin, end)
    count = 0
    for k in range(begin, end):
        count += is_open(aim, pieces, k)
    if not count or count * SLICES > MOST_BOXES or not len(finer.source):
        return end, 0
    slices, closed, place = max(SLICES, FEW // count), begin, 0
    for k in range(begin, end):
        if is_open(aim, pieces, k):
            cut(pieces, k, slices, finer, place)
            place += slices
        else:
            copy(pieces, k, pieces, closed)
            closed += 1
    return closed, place


@entry
def conclude(pieces, taken, bounds, at):
    """Widen bounds (N, 2) by all pieces of each box, and boxes (N, 2, n, 2) by the places of its extremes."""
    for k in range(len(pieces.source)):
        s, margin = pieces.source[k], pieces.margin[k]
        low, high = pieces.outer[k, 0] - margin, pieces.outer[k, 1] + margin
        bounds[s, 0], bounds[s, 1] = lesser(bounds[s, 0], low), greater(bounds[s, 1], high)
        for side in range(2):
            if (side == 0 and -low >= -taken[s, 0] - margin) or (side == 1 and high >= taken[s, 1] - margin):
                for j in range(at.shape[2]):
                    at[s, side, j, 0] = lesser(at[s, side, j, 0], pieces.at[k, side, j, 0])
                    at[s, side, j, 1] = greater(at[s, side, j, 1], pieces.at[k, side, j, 1])
