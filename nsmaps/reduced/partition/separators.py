"""The edges of a return map in a cell, found by bisection, and curves or surfaces that separate its words or sheets."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import comb

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.continuation.bisection import bisect_change
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.reduced.partition.cell import Cut, Sample, powers, rounded

BISECTIONS = 40
MOST_EDGES = 400  #: pairs of neighbours between which borders are sought
MOST_BORDERS = 4  #: borders between two neighbours on a grid
SEPARATOR_ORDER = 4  #: highest degree of a curve between words
SMALLEST = 0.02  #: share of a cell's states that a curve must leave on each side
FEWEST = 6  #: points of an edge to which a curve is fitted
WORTH = 0.004  #: share of misplaced states that a further degree of a curve must save


@dataclass(frozen=True, slots=True, eq=False)
class Sheets:
    """The smooth sheets of a map in a cell: a number for each grid point, and points on the edges between them."""

    number: Ints  #: shape (grid.size,), -1 outside of the cell
    points: Floats  #: shape (K, n), places on edges
    pair: Ints  #: shape (K, 2), the sheets on both sides


def sheets(return_map: ReturnMap, sample: Sample, jump: float) -> Sheets:
    """The sheets of a map over a cell's grid: the word or family changes from one to the next, or the image jumps.

    Neighbours on the grid whose itineraries differ have a border between them, which bisection finds. It is an edge if the
    words or families on its sides differ or their images differ by more than `jump` (a graze of the base wall), but not at the
    birth of a pair of turning points. Two sides that are joined around the end of an edge are one sheet.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = _neighbours(sample)
    pieces = sample.sorting.pieces(return_map, sample.returns.start)
    sorts = np.where(sample.returns.valid, sample.sorting(sample.returns), -1)
    joined = sorts[first] == sorts[second]
    crossed = np.flatnonzero((pieces[first] != pieces[second]).any(axis=1))
    crossed = crossed[:: -(-len(crossed) // MOST_EDGES) or 1]
    edge, points = _edges(return_map, sample, first[crossed], second[crossed], jump)
    joined[crossed[edge]] = False
    size = sample.grid.size
    graph = coo_array((np.ones(joined.sum()), (first[joined], second[joined])), shape=(size, size))
    number = connected_components(graph, directed=False)[1]
    number = np.where(sample.inside, np.unique(np.where(sample.inside, number, -1), return_inverse=True)[1], -1)
    if not sample.inside.all():  # the outside is the first of the numbers
        number = np.where(sample.inside, number - 1, -1)
    there = crossed[edge]
    return Sheets(number, points[edge], np.sort(np.column_stack([number[first[there]], number[second[there]]])))


def separators(sample: Sample, sheets: Sheets) -> Iterator[Cut]:
    """Curves that may separate the sheets of a cell: through the edges of two sheets or of one, along the ends of each."""
    pairs = [(sheets.pair == pair).all(axis=1) for pair in np.unique(sheets.pair, axis=0)]
    for edge in [*pairs, *((sheets.pair == k).any(axis=1) for k in range(sheets.number.max() + 1))]:
        points = sheets.points[edge]
        if len(points) < FEWEST:
            continue
        wide, others = np.ptp(sample.returns.start, axis=0), points.shape[1] - 1
        thin = np.ptp(points, axis=0) < 1e-3 * wide
        for dependent in range(points.shape[1]):
            if np.delete(thin, dependent).all():
                continue
            for order in range(1, SEPARATOR_ORDER + 1):
                if len(points) >= 2 * comb(others + order, order):
                    yield _through(points, dependent, comb(others + order, order), wide[dependent])
    for number in range(sheets.number.max() + 1):
        states = sample.returns.start[sheets.number == number]
        for i in range(states.shape[1]):
            step = np.ptp(sample.returns.start[:, i]) / (sample.grid.shape[i] - 1)
            for end in (states[:, i].min() - step / 2, states[:, i].max() + step / 2):
                yield bound(i, end, step)


def best_separator(sample: Sample, sheets: Sheets, least_area: float = 0.0) -> Cut | None:
    """The curve with the fewest states outside the largest sheet of their side, by lowest degree; None if none helps.

    A curve must leave at least `least_area` on both sides.
    """
    inside = sheets.number >= 0
    if not inside.any():
        return None
    states, number = sample.returns.start[inside], sheets.number[inside]
    count = number.max() + 1
    before = len(number) - np.bincount(number).max()
    smallest = max(SMALLEST, least_area / sample.area) * len(states)
    best, least = None, before - WORTH * len(number)
    for cut in separators(sample, sheets):
        above = cut.beyond(states)
        if not smallest <= above.sum() <= len(states) - smallest:
            continue
        table = np.bincount(number + count * above, minlength=2 * count).reshape(2, count)
        misplaced = len(number) - table.max(axis=1).sum() + WORTH * len(number) * cut.order
        if misplaced < least:
            best, least = cut, misplaced
    return best


def bound(i: int, value: float, width: float) -> Cut:
    """A plain bound of coordinate i, with as many digits as a cell of this width needs."""
    return Cut(i, (rounded(value, width),), above=False)


def _through(points: Floats, dependent: int, terms: int, width: float) -> Cut:
    """The curve with a number of terms through points, by least squares."""
    others = np.delete(points, dependent, axis=1)
    reach = np.maximum(1.0, np.abs(others).max(axis=0))
    monomials = np.array(powers(others.shape[1], terms))
    design = np.prod((others / reach)[:, None, :] ** monomials, axis=2)
    found = np.linalg.lstsq(design, points[:, dependent], rcond=None)[0]
    scales = np.prod(reach**monomials, axis=1)
    coefficients = [rounded(float(c / scale), width / 10 / scale) for c, scale in zip(found, scales, strict=True)]
    return Cut(dependent, tuple(coefficients), above=False)


def _neighbours(sample: Sample) -> tuple[Ints, Ints]:
    """The pairs of grid points in the cell that are next to each other."""
    places = np.arange(sample.grid.size).reshape(sample.grid.shape)
    along = [np.moveaxis(places, i, 0) for i in range(places.ndim)]
    first, second = np.concatenate([each[1:].ravel() for each in along]), np.concatenate([each[:-1].ravel() for each in along])
    both = sample.inside[first] & sample.inside[second]
    return first[both], second[both]


def _edges(return_map: ReturnMap, sample: Sample, first: Ints, second: Ints, jump: float) -> tuple[Bools, Floats]:
    """A mask of edges between K grid points and others, and their places: the first of the borders between them that is one."""
    start, end = sample.returns.start[first], sample.returns.start[second]
    sorting, label = sample.sorting, partial(sample.sorting.pieces, return_map)
    edge, points = np.zeros(len(start), bool), (start + end) / 2
    rows, low = np.arange(len(start)), start
    for _ in range(MOST_BORDERS):
        if not len(rows):
            break
        high = end[rows]
        low, high, beyond = bisect_change(label, low, high, label(low), label(high), halvings=BISECTIONS)
        a, b = return_map.first_return(low), return_map.first_return(high)
        found = (sorting(a) != sorting(b)) | (a.valid != b.valid) | (_jump(a, b) > jump)
        edge[rows], points[rows[found]] = found, high[found]
        more = ~found & (beyond != label(end[rows])).any(axis=1)
        rows, low = rows[more], high[more]
    return edge, points


def _jump(a: Returns, b: Returns) -> Floats:
    """The largest difference of the images in any coordinate, shape (N,)."""
    return np.abs(a.coordinates.difference(a.image, b.image)).max(axis=1)
