"""Forward invariant sets of a map given by formulas: cells of a grid whose images are all within the cells of the set.

The cells are closed boxes of equal sizes over a box of states, the last coordinate running fastest; of an angle the box is the
whole circle. A code is zero for each cell of the set, and one for all others.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from math import isfinite, prod
from typing import Any, NamedTuple

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

from nsmaps.verify.formula import UnprovedError
from nsmaps.verify.maps.formula import PiecewiseFormulas, hull, pieces_of

BITS = 64
KEYS = {"low", "high", "cells", "parts"}
MOST_PARTS = 64  #: along each coordinate of a cell, powers of two, so that ends of parts are exact

Ranges = tuple[tuple[int, int], ...]  #: of each coordinate, the first and the last of the cells that an image meets


class Cells(NamedTuple):
    """A grid of a certificate; its numbers are doubles, and exact, for an angle 0 and 2 pi."""

    low: tuple[float, ...]
    high: tuple[float, ...]
    counts: tuple[int, ...]
    parts: int  #: of a cell along each coordinate, whose images are enclosed one by one


class Invariant(NamedTuple):
    """What was proved of a set of cells."""

    cells: Cells
    size: int  #: cells of the set
    parts: int  #: whose images were enclosed


def cells_of(data: Any, formulas: PiecewiseFormulas) -> Cells:
    """The grid of a certificate; ValueError says what is wrong in it."""
    if not isinstance(data, Mapping) or set(data) != KEYS:
        raise ValueError(f"a grid has {sorted(data) if isinstance(data, Mapping) else data!r}; expected: {sorted(KEYS)}")
    low, high, counts = (tuple(data[key]) for key in ("low", "high", "cells"))
    if not len(low) == len(high) == len(counts) == len(formulas.coordinates):
        raise ValueError(f"a grid has {len(counts)} coordinates; expected: {len(formulas.coordinates)}")
    if not all(type(x) is float and isfinite(x) for x in (*low, *high)) or not all(type(k) is int and k > 0 for k in counts):
        raise ValueError("a grid needs finite decimal numbers, and numbers of cells above zero")
    if not all(angle or a < b for a, b, angle in zip(low, high, formulas.angles, strict=True)):
        raise ValueError(f"a grid is from {low} to {high}; expected: the lower ends first")
    parts = data["parts"]
    if type(parts) is not int or not 1 <= parts <= MOST_PARTS or parts & (parts - 1):
        raise ValueError(f"{parts} parts of a cell; expected: a power of two up to {MOST_PARTS}")
    return Cells(low, high, counts, parts)


def invariant(
    formulas: PiecewiseFormulas,
    cells: Cells,
    codes: NDArray[np.uint16],
    progress: Callable[[int, int], Any] = lambda done, total: None,
) -> Invariant:
    """Show that a set of cells is mapped into itself; `UnprovedError` unless it is."""
    if len(codes) != prod(cells.counts) or not (codes <= 1).all():
        raise ValueError(f"{len(codes)} codes; expected: {prod(cells.counts)}, each zero or one")
    inside = codes.reshape(cells.counts) == 0
    numbers, parts = np.argwhere(inside), 0
    if not len(numbers):
        raise ValueError("the set has no cells")
    with ctx.workprec(BITS):
        for i, number in enumerate(numbers.tolist()):
            for ranges in met(formulas, cells, number, cells.parts):
                parts += 1
                if not _filled(inside, ranges, formulas.angles):
                    raise UnprovedError(f"the images of the cell {number} are not shown to be within the set")
            if i % 256 == 0:
                progress(i, len(numbers))
    return Invariant(cells, len(numbers), parts)


def met(formulas: PiecewiseFormulas, cells: Cells, number: Sequence[int], parts: int) -> Iterator[Ranges]:
    """The cells that the images of the parts of a cell meet, of which there are `parts` along each coordinate.

    `UnprovedError` if an image leaves the grid, or may not exist.
    """
    for place in product(range(parts), repeat=len(number)):
        part = [arb(k) + (arb(j) + arb(0.5, 0.5)) / parts for k, j in zip(number, place, strict=True)]
        yield from _ranges(formulas, cells, part)


def _ranges(formulas: PiecewiseFormulas, cells: Cells, part: list[arb]) -> Iterator[Ranges]:
    """The cells that the image of a part of a cell by each piece meets; `UnprovedError` if it leaves the grid."""
    sides = [_side(formulas, cells, k) for k in range(len(part))]
    box = [low + x * width for x, (low, width) in zip(part, sides, strict=True)]
    for piece, narrow, known in pieces_of(formulas, box):
        ranges = []
        for k, (x, (low, width)) in enumerate(zip(hull(formulas, piece, narrow, known), sides, strict=True)):
            place = (x - low) / width
            first, last = place.lower().floor().unique_fmpz(), place.upper().floor().unique_fmpz()
            if first is None or last is None or not (formulas.angles[k] or 0 <= first <= last < cells.counts[k]):
                raise UnprovedError("an image leaves the grid")
            ranges.append((int(first), int(last)))
        yield tuple(ranges)


def _side(formulas: PiecewiseFormulas, cells: Cells, k: int) -> tuple[arb, arb]:
    """The lower end of a coordinate, and the width of a cell."""
    if formulas.angles[k]:
        return arb(0), 2 * arb.pi() / cells.counts[k]
    return arb(cells.low[k]), (arb(cells.high[k]) - arb(cells.low[k])) / cells.counts[k]


def indices(ranges: Ranges, counts: Sequence[int], angles: Sequence[bool]) -> tuple[NDArray[np.int64], ...]:
    """The numbers of cells in ranges, along each coordinate, angles around the circle."""
    return tuple(
        np.arange(first, min(last, first + count - 1) + 1) % count if angle else np.arange(first, last + 1)
        for (first, last), count, angle in zip(ranges, counts, angles, strict=True)
    )


def _filled(inside: NDArray[np.bool_], ranges: Ranges, angles: Sequence[bool]) -> bool:
    """Whether all cells in ranges are of the set."""
    return bool(inside[np.ix_(*indices(ranges, inside.shape, angles))].all())
