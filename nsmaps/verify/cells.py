"""The cells of a certificate: orbits that start in one are later in a cell of a lower order, and in the end in the trap.

The cells are one array of codes, breadth first: those of the base grid of every wall, phase by phase with the speed running
fastest, then the parts of each cell that is divided, in the order of these cells. A square can be split into four squares:
those of the earlier half of its phases, the lower speeds first, then those of the later half. Or it is cut into two strips, the
lower one first, between lines of one slope, the outer of which leave no part of it out; a strip can be cut again in the same
way. Slopes are only data: what is verified of strips holds for any.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import frexp, inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.arrivals import LEFT, Frame, Tree, compiled
from nsmaps.verify.formula import System, in_units, tables_of
from nsmaps.verify.images import covered, frame_of

SPLIT, CUT = 65534, 65533  #: codes of cells that are divided; codes below are orders, zero that of the trap
SHARES = 8  #: a slope is in eighths of the height of a square by its width
TOP = 20  #: bits of the speed at the upper edge
BITS = 30  #: of n, of SHARES and of the halvings of strips together: lines are exact
FINEST = 8  #: phases of the tables in the narrowest cell, at least
CHUNK = 20_000
MOST = 2**26  #: times in the tables
PART = 2**22  #: nodes whose areas are computed at a time
NONE = np.zeros(0, np.int8)


class Grid(NamedTuple):
    """What a certificate states of its cells beside the codes."""

    side: int  #: cells of the base grid along each direction, a power of two
    depth: int  #: times that a cell of the base grid may be split
    top: float  #: speed at the upper edge
    periods: int  #: of the forcing, the longest flight that is followed
    closed: bool  #: the cells of order zero are a forward invariant set by themselves


class Shares(NamedTuple):
    """Of the phases x speeds up to the upper edge on each wall, shape (walls,)."""

    proved: NDArray[np.float64]  #: of all cells with an order
    zero: NDArray[np.float64]  #: of those of order zero
    whole: bool  #: no cell is left open


class CertificateError(ValueError):
    """A certificate does not prove what it states."""


def tree_of(grid: Grid, walls: int, codes: NDArray[np.uint16], slopes: NDArray[np.int8] = NONE) -> Tree:
    """The cells from their codes, and the slopes of the squares that are cut, in their order."""
    _check_grid(grid, walls, len(codes))
    side, n = grid.side, grid.side * FINEST << grid.depth
    unit, start, used, cells = grid.top / (SHARES * n), 0, 0, _base(grid, walls, n)
    levels, children = [], []
    while len(cells.wall):
        count, square = len(cells.wall), cells.slope == 0
        code = codes[start : start + count]
        if len(code) < count:
            raise CertificateError(f"{len(codes)} codes do not describe cells: a level has {count} from place {start}")
        split, cut = code == SPLIT, code == CUT
        if (split & ~(square & (cells.width > FINEST))).any() or (cut & (cells.row == 0)).any():
            raise CertificateError("a strip or one of the narrowest squares is split, or one of the lowest row is cut")
        start += count
        number = np.where(split, 4, np.where(cut, 2, 0))
        levels.append(cells)
        children.append(np.where(number > 0, start + np.cumsum(number) - number, -1))
        new = slopes[used : used + int((cut & square).sum())].astype(np.int64)
        used += int((cut & square).sum())
        slope = cells.slope.copy()
        if len(new) < (cut & square).sum() or (new == 0).any():
            raise CertificateError("a square is cut without a slope, or along one of zero")
        slope[cut & square] = new * unit
        cells = _divided(cells, slope, number, grid.top / n)
        if len(levels) + n.bit_length() > BITS:
            raise CertificateError(f"cells are divided more than {len(levels)} times, finer than numbers here")
    if start != len(codes) or used != len(slopes):
        raise CertificateError(f"{len(codes)} codes and {len(slopes)} slopes for {start} cells, {used} of them cut")
    child = np.concatenate(children)
    columns = [list(column) for column in zip(*levels, strict=True)]
    levels.clear()
    places = _Level(*(np.concatenate(columns.pop(0)) for _ in range(len(columns))))  # each is freed when it is copied
    return Tree(side, n, grid.top, child, _highest(child, codes, places.slope), *places)


def _check_grid(grid: Grid, walls: int, codes: int) -> None:
    """Whether numbers of a grid are of the right kind and size, and within what can be verified."""
    side, depth, top, periods, closed = grid
    whole = all(type(x) is int for x in (side, depth, periods)) and type(closed) is bool and type(top) in (int, float)
    fine = whole and 0 < top < inf and frexp(top)[0] * 2**TOP % 1 == 0
    if not fine or side < 32 or side & side - 1 or not 0 <= depth <= 20 or periods < 1:
        raise CertificateError(
            f"{grid}: expected a side that is a power of two >= 32, a depth <= 20, a speed above 0 of {TOP} bits, and a "
            "number of periods from 1 on"
        )
    if walls * side**2 > codes or side * FINEST * (periods + 1) << depth > MOST:
        raise CertificateError(
            f"{grid}: expected as many codes as cells, and flights of up to {MOST} parts; there are {codes} codes"
        )


class _Level(NamedTuple):
    """Cells of one level, as in `Tree`."""

    wall: NDArray[np.int64]
    first: NDArray[np.int64]
    width: NDArray[np.int64]
    row: NDArray[np.int64]
    slope: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def _base(grid: Grid, walls: int, n: int) -> _Level:
    """The squares of the base grids."""
    side, index = grid.side, np.arange(walls * grid.side**2)
    row, height, width = index % side, grid.top / side, n // side
    first = index // side % side * width
    low = row * np.float64(height)
    return _Level(index // side**2, first, np.full(len(index), width), row, np.zeros(len(index)), low, low + height)


def _divided(cells: _Level, slope: NDArray[np.float64], number: NDArray[np.int64], unit: float) -> _Level:
    """The parts of cells, `number` of each, along lines of these slopes if these are two."""
    part, square = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number), np.repeat(number, number) == 4
    wall, first, width, row = (np.repeat(x, number) for x in cells[:4])
    slope, low, high, old = (np.repeat(x, number) for x in (slope, cells.low, cells.high, cells.slope))
    rise = np.where(old == 0, 0.5 * np.abs(slope) * width, 0.0)
    width = np.where(square, width // 2, width)
    row = np.where(square, 2 * row + part % 2, row)
    middle, tall = 0.5 * (low + high), width * unit
    low, high = np.where(part == 0, low - rise, middle), np.where(part == 0, middle, high + rise)
    low, high = np.where(square, row * tall, low), np.where(square, (row + 1) * tall, high)
    return _Level(wall, first + np.where(square, part // 2 * width, 0), width, row, slope, low, high)


def check_cells(
    system: System,
    grid: Grid,
    codes: NDArray[np.uint16],
    trapped: Callable[[int, NDArray[np.int64], int, NDArray[np.float64]], NDArray[np.bool_]],
    progress: Callable[[int, int], Any] = lambda done, total: None,
    workers: int = 2,
    slopes: NDArray[np.int8] = NONE,
) -> Shares:
    """The shares of each wall that are proved, or `CertificateError`.

    Args:
        trapped: which boxes of a wall, phases (M, 2) in parts of 2 pi/n with this n and speeds (M, 2), are inside the trap, whose
            orbits are shown to converge elsewhere; unused for `closed` grids.
        slopes: of the squares that are cut.
    """
    _check_grid(grid, len(system.walls), len(codes))
    system, unit = in_units(system, grid.top)
    grid = grid._replace(top=grid.top / unit)
    tree = tree_of(grid, len(system.walls), codes, slopes)
    base, steepest = tree.n // tree.side, float(np.abs(tree.slope).max())
    if base * steepest > min(1.0, grid.top):
        raise CertificateError(f"a slope of {steepest * tree.n:g} a period is too large for the bounds of rounding")
    fastest = grid.top + base * steepest
    tables = tables_of(system, tree.n, base, grid.periods, fastest)
    if tables.step * tree.n > 16:
        raise CertificateError("the period is known too little for the bounds of rounding")
    given, leaves = tree._replace(top=unit * tree.top), np.flatnonzero((tree.child < 0) & (tree.order < LEFT))
    if not grid.closed:
        _check_trap(given, leaves[tree.order[leaves] == 0], trapped)
        leaves = leaves[tree.order[leaves] > 0]
    failed = _failed(frame_of(tables), tree, leaves, progress, workers)
    if failed >= 0:
        raise CertificateError(f"not proved: that orbits from {place_of(given, failed)} are later in cells of a lower order")
    left = (tree.child < 0) & (tree.order == LEFT)
    proved, zero = (_share(tree, last, len(system.walls)) for last in (CUT - 1, 0))
    return Shares(proved, zero, not left.any())


def _failed(frame: Frame, tree: Tree, leaves: NDArray[np.int64], progress: Callable[[int, int], Any], workers: int) -> int:
    """One of some cells that is not proved, or -1."""
    limits = np.maximum(tree.order[leaves], 1)
    parts = [slice(i, i + CHUNK) for i in range(0, len(leaves), CHUNK)]
    with ThreadPoolExecutor(workers) as pool:
        for done, failed in enumerate(pool.map(lambda part: _first_failure(frame, tree, leaves[part], limits[part]), parts)):
            if failed >= 0:
                pool.shutdown(cancel_futures=True)
                return failed
            progress(min(CHUNK * (done + 1), len(leaves)), len(leaves))
    return -1


def _share(tree: Tree, last: int, walls: int) -> NDArray[np.float64]:
    """The share of the cells of orders up to `last` of each wall."""
    total = np.zeros(walls)
    for start in range(0, len(tree.child), PART):
        part = slice(start, start + PART)
        some = (tree.child[part] < 0) & (tree.order[part] <= last)
        total += np.bincount(tree.wall[part], _areas(tree, part) * some, walls)
    return total


def _areas(tree: Tree, part: slice) -> NDArray[np.float64]:
    """The share of the phases and speeds of a wall that each cell of a part is, up to rounding."""
    width, slope = tree.width[part], tree.slope[part]
    tall, rise = tree.top * width / tree.n, 0.5 * np.abs(slope) * width
    floor, square = tree.row[part] * tall, slope == 0

    def below(line: NDArray[np.float64]) -> NDArray[np.float64]:
        """The mean over the phases of the height of a square below a line, times twice its rise."""
        ends = [np.maximum(line + side * rise - floor, 0) for side in (-1, 1)]
        inside, above = ([f(end, tall) for end in ends] for f in (np.minimum, np.maximum))
        return np.asarray(0.5 * (inside[1] ** 2 - inside[0] ** 2) + tall * (above[1] - above[0]))

    heights = np.where(square, tall, (below(tree.high[part]) - below(tree.low[part])) / np.where(square, 1.0, 2 * rise))
    return np.asarray(heights * width / (tree.top * tree.n))


def place_of(tree: Tree, node: int) -> str:
    """A cell in words."""
    turn, high = 2 * np.pi / tree.n, tree.top * tree.width[node] / tree.n
    first, row, end = tree.first[node], tree.row[node], tree.first[node] + tree.width[node]
    speeds = f"{row * high:.6g}..{(row + 1) * high:.6g}"
    return f"the cell {node} of wall {tree.wall[node]}: phases {first * turn:.6f}..{end * turn:.6f}, speeds {speeds}"


def _check_trap(tree: Tree, leaves: NDArray[np.int64], trapped: Callable[..., NDArray[np.bool_]]) -> None:
    for wall in np.unique(tree.wall[leaves]):
        cells = leaves[tree.wall[leaves] == wall]
        first, width, row = tree.first[cells], tree.width[cells], tree.row[cells]
        height = tree.top * width / tree.n
        inside = trapped(int(wall), np.stack([first, first + width], 1), tree.n, np.stack([row * height, (row + 1) * height], 1))
        if not inside.all():
            raise CertificateError(f"not in the trap: {place_of(tree, cells[~inside][0])}")


@compiled
def _first_failure(frame: Frame, tree: Tree, leaves: NDArray[np.int64], limits: NDArray[np.int64]) -> int:
    """The first of some cells that is not proved, or -1."""
    for i in range(leaves.size):
        if not (covered(frame, tree, leaves[i], limits[i], False) or covered(frame, tree, leaves[i], limits[i], True)):
            return int(leaves[i])
    return -1


def _highest(child: NDArray[np.int64], codes: NDArray[np.uint16], slope: NDArray[np.float64]) -> NDArray[np.int64]:
    """The orders of cells, and the largest order among the cells of each node; children come after their parents."""
    order = codes.astype(np.int64)
    return _largest_below(child, order, slope)


@compiled
def _largest_below(child: NDArray[np.int64], order: NDArray[np.int64], slope: NDArray[np.float64]) -> NDArray[np.int64]:
    for i in range(child.size - 1, -1, -1):
        if child[i] >= 0:
            order[i] = order[child[i]]
            for part in range(child[i] + 1, child[i] + (4 if slope[child[i]] == 0 else 2)):
                order[i] = max(order[i], order[part])
    return order
