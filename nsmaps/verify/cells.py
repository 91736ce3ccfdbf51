"""The cells of a certificate: orbits that start in one are later in a cell of a lower order, and in the end in the trap.

The cells are one array of codes, breadth first: those of the base grid of every wall, phase by phase with the speed running
fastest, then the four parts of each cell that is split, in the order of the split cells: those of the earlier half of its
phases, the lower speeds first, then those of the later half.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.formula import System, tables_of
from nsmaps.verify.images import LEFT, Frame, Tree, compiled, covered, frame_of

SPLIT = 65534  #: code of a cell that is split; codes below are orders, zero that of the trap
FINEST = 8  #: phases of the tables in the narrowest cell, at least
CHUNK = 20_000


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


class Refused(ValueError):
    """A certificate does not prove what it states."""


def tree_of(grid: Grid, walls: int, codes: NDArray[np.uint16]) -> Tree:
    """The cells from their codes."""
    side, n = grid.side, grid.side * FINEST << grid.depth
    if side < 32 or side & side - 1 or not 0 <= grid.depth <= 20 or not grid.top > 0 or grid.top * 2**10 % 1:
        raise Refused(f"{grid}: expected a side that is a power of two >= 32, a depth <= 20, a speed that is a multiple of 2^-10")
    start, count, index = 0, walls * side * side, np.arange(walls * side * side)
    wall, first, row = index // side**2, index // side % side * (n // side), index % side
    levels, children, width = [], [], n // side
    while count:
        code = codes[start : start + count]
        if len(code) < count or width < FINEST:
            raise Refused(f"{len(codes)} codes do not describe cells: a level has {count} from place {start}")
        split = code == SPLIT
        child = np.full(count, -1)
        child[split] = start + count + 4 * np.arange(split.sum())
        levels.append((wall, first, np.full(count, width), row))
        children.append(child)
        start, count, width = start + count, 4 * int(split.sum()), width // 2
        part = np.tile(np.arange(4), count // 4)
        wall, first = np.repeat(wall[split], 4), np.repeat(first[split], 4) + part // 2 * width
        row = 2 * np.repeat(row[split], 4) + part % 2
    if start != len(codes):
        raise Refused(f"{len(codes)} codes for {start} cells")
    places = [np.concatenate(x) for x in zip(*levels, strict=True)]
    child = np.concatenate(children)
    return Tree(side, n, grid.top, child, _highest(child, codes), *places)


def check_cells(
    system: System,
    grid: Grid,
    codes: NDArray[np.uint16],
    trapped: Callable[[int, NDArray[np.int64], int, NDArray[np.float64]], NDArray[np.bool_]],
    progress: Callable[[int, int], Any] = lambda done, total: None,
    workers: int = 2,
) -> Shares:
    """The shares of each wall that are proved, or `Refused`.

    Args:
        trapped: which boxes of a wall, phases (M, 2) in parts of 2 pi/n with this n and speeds (M, 2), are inside the trap, whose
            orbits are shown to converge elsewhere; unused for `closed` grids.
    """
    tree = tree_of(grid, len(system.walls), codes)
    tables = tables_of(system, tree.n, tree.n // tree.side, grid.periods, grid.top)
    if tables.step * tree.n > 16 or grid.top > grid.side:
        raise Refused(
            "cells are too large for the bounds of rounding: expected a period < 16 and a speed below the cells of a side"
        )
    leaves = np.flatnonzero((tree.child < 0) & (tree.order < LEFT))
    if not grid.closed:
        _check_trap(tree, leaves[tree.order[leaves] == 0], trapped)
        leaves = leaves[tree.order[leaves] > 0]
    frame, limits = frame_of(tables, grid.top), np.maximum(tree.order[leaves], 1)
    parts = [slice(i, i + CHUNK) for i in range(0, len(leaves), CHUNK)]
    with ThreadPoolExecutor(workers) as pool:
        for done, failed in enumerate(pool.map(lambda part: _first_failure(frame, tree, leaves[part], limits[part]), parts)):
            if failed >= 0:
                pool.shutdown(cancel_futures=True)
                raise Refused(f"not proved: that orbits from {place_of(tree, failed)} are later in cells of a lower order")
            progress(min(CHUNK * (done + 1), len(leaves)), len(leaves))
    return Shares(*(_share(tree, last, len(system.walls)) for last in (SPLIT - 1, 0)))


def _share(tree: Tree, last: int, walls: int) -> NDArray[np.float64]:
    """The share of the cells of orders up to `last` of each wall."""
    some = (tree.child < 0) & (tree.order <= last)
    return np.bincount(tree.wall[some], (tree.width[some] / tree.n) ** 2, walls).astype(np.float64)


def place_of(tree: Tree, node: int) -> str:
    """A cell in words."""
    turn, high = 2 * np.pi / tree.n, tree.top * tree.width[node] / tree.n
    first, row, end = tree.first[node], tree.row[node], tree.first[node] + tree.width[node]
    speeds = f"{row * high:.6f}..{(row + 1) * high:.6f}"
    return f"the cell {node} of wall {tree.wall[node]}: phases {first * turn:.6f}..{end * turn:.6f}, speeds {speeds}"


def _check_trap(tree: Tree, leaves: NDArray[np.int64], trapped: Callable[..., NDArray[np.bool_]]) -> None:
    for wall in np.unique(tree.wall[leaves]):
        cells = leaves[tree.wall[leaves] == wall]
        first, width, row = tree.first[cells], tree.width[cells], tree.row[cells]
        height = tree.top * width / tree.n
        inside = trapped(int(wall), np.stack([first, first + width], 1), tree.n, np.stack([row * height, (row + 1) * height], 1))
        if not inside.all():
            raise Refused(f"not in the trap: {place_of(tree, cells[~inside][0])}")


@compiled
def _first_failure(frame: Frame, tree: Tree, leaves: NDArray[np.int64], limits: NDArray[np.int64]) -> int:
    """The first of some cells that is not proved, or -1."""
    for i in range(leaves.size):
        if not (covered(frame, tree, leaves[i], limits[i], False) or covered(frame, tree, leaves[i], limits[i], True)):
            return int(leaves[i])
    return -1


def _highest(child: NDArray[np.int64], codes: NDArray[np.uint16]) -> NDArray[np.int64]:
    """The orders of cells, and the largest order among the cells of each node; children come after their parents."""
    order = codes.astype(np.int64)
    return _largest_below(child, order)


@compiled
def _largest_below(child: NDArray[np.int64], order: NDArray[np.int64]) -> NDArray[np.int64]:
    for i in range(child.size - 1, -1, -1):
        if child[i] >= 0:
            order[i] = max(order[child[i]], order[child[i] + 1], order[child[i] + 2], order[child[i] + 3])
    return order
