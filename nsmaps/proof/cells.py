"""The search for cells whose orbits all reach a trap: certified from the trap outwards, and what is left is divided.

A cell is certified if all its next impacts are in certified cells; its order is one more than the largest of theirs. Any other
waits for the first open cell that it meets, and is resumed from there when that one is certified.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.proof.flights import OPEN, SPLIT, Cells, Doubles, Flow, Integers, compiled, follow

FINEST = 8  #: phases of the tables in the narrowest cell


def search(
    flow: Flow,
    cells: Cells,
    depth: int,
    trapped: Callable[[Integers, Integers, Doubles], NDArray[np.bool_]],
    progress: Callable[[int, Doubles], bool] = lambda level, shares: True,
) -> Cells:
    """Certify cells, dividing those of the base grids that are left `depth` times or until `progress` is false.

    Args:
        flow: tables at side * FINEST * 2^depth phases, or more.
        cells: base grids, or those with a closed set of cells of order zero.
        trapped: which boxes, of walls (M,), first and last phases (M, 2) and speeds (M, 2), are within the trap.
        progress: called after each division with its number and the share certified of the cells of each wall.
    """
    new = np.flatnonzero(cells.child < 0)
    for level in range(depth + 1):
        _trap(cells, new, trapped)
        queue = np.flatnonzero((cells.child < 0) & (cells.order == OPEN))
        certify(flow, cells, queue[np.argsort(-cells.place[queue, 1], kind="stable")])
        leaf = cells.child < 0
        certified = leaf & (cells.order < OPEN)
        areas = (cells.place[certified, 2] / cells.n) ** 2
        shares = np.bincount(cells.place[certified, 0], areas, flow.walls.shape[1]).astype(np.float64)
        if not progress(level, shares) or level == depth:
            break
        wide = cells.place[:, 2] == cells.n // cells.side >> level
        cells, new = divided(cells, np.flatnonzero(leaf & ~certified & wide))
    return cells


def codes_of(cells: Cells) -> NDArray[np.uint16]:
    """The codes of cells as in `nsmaps.verify.cells`, breadth first."""
    level, parts = np.flatnonzero(cells.parent < 0), []
    while len(level):
        split = cells.child[level] >= 0
        parts.append(np.where(split, SPLIT, cells.order[level]))
        level = (cells.child[level[split], None] + np.arange(4)).ravel()
    return np.concatenate(parts).astype(np.uint16)


def base_grids(walls: int, side: int, n: int, top: float) -> Cells:
    """The base grids, without orders."""
    count = walls * side * side
    index = np.arange(count)
    place = np.stack([index // side**2, index // side % side * (n // side), np.full(count, n // side), index % side], 1)
    return Cells(side, n, top, np.full(count, -1), np.full(count, -1), np.full(count, OPEN), place)


def _trap(cells: Cells, new: Integers, trapped: Callable[..., NDArray[np.bool_]]) -> None:
    """Give the order zero to the new cells that are within the trap."""
    wall, first, width, row = cells.place[new].T
    tall = cells.top * width / cells.n
    inside = trapped(wall, np.stack([first, first + width], 1), np.stack([row * tall, (row + 1) * tall], 1))
    cells.order[new[inside]] = 0
    bring_up(cells, new[inside])


def divided(cells: Cells, leaves: Integers) -> tuple[Cells, Integers]:
    """The cells with some of them split, and the places of the new ones."""
    cells.child[leaves] = len(cells.child) + 4 * np.arange(len(leaves))
    place, part = np.repeat(cells.place[leaves], 4, 0), np.tile(np.arange(4), len(leaves))
    place[:, 2] //= 2
    place[:, 1] += part // 2 * place[:, 2]
    place[:, 3] = 2 * place[:, 3] + part % 2
    more = len(place)
    parts: list[Any] = [np.full(more, -1), np.repeat(leaves, 4), np.full(more, OPEN), place]
    columns = (np.concatenate(pair) for pair in zip((cells.child, cells.parent, cells.order, cells.place), parts, strict=True))
    return Cells(cells.side, cells.n, cells.top, *columns), len(cells.child) + np.arange(more)


@compiled
def certify(flow: Flow, cells: Cells, queue: Integers) -> None:
    """Certify what can be of the cells in a queue, the last first; `order` is changed in place."""
    total = cells.child.size
    waiting = np.full(total, -1)  # the first that waits for a node
    following = np.full(total, -1)  # the next that waits with it
    number = np.full(total, -1)
    number[queue] = np.arange(queue.size)
    states = np.full((queue.size, 4), -1.0)
    stack = np.empty(queue.size + 1, np.int64)
    count = queue.size
    stack[:count] = queue
    while count:
        count -= 1
        leaf = stack[count]
        blocker, highest = follow(flow, cells, leaf, states[number[leaf]])
        if blocker >= 0:
            following[leaf], waiting[blocker] = waiting[blocker], leaf
        elif blocker == -1 and highest + 1 < SPLIT:
            cells.order[leaf] = highest + 1
            node = leaf
            while node >= 0 and cells.order[node] < OPEN:
                if waiting[node] >= 0:
                    waiter, waiting[node] = waiting[node], -1
                    while waiter >= 0:
                        stack[count] = waiter
                        count += 1
                        waiter = following[waiter]
                node = _parent(cells, node)


@compiled
def _parent(cells: Cells, node: int) -> int:
    """The parent of a node, with its order brought up to date; -1 for a cell of the base grid."""
    parent = cells.parent[node]
    if parent >= 0:
        cells.order[parent] = cells.order[cells.child[parent] : cells.child[parent] + 4].max()
    return int(parent)


@compiled
def bring_up(cells: Cells, nodes: Integers) -> None:
    """Bring the orders of all ancestors up to date."""
    for node in nodes:
        ancestor = _parent(cells, node)
        while ancestor >= 0 and cells.order[ancestor] < OPEN:
            ancestor = _parent(cells, ancestor)
