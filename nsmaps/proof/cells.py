"""The search for cells whose orbits all reach a trap: certified from the trap outwards, and what is left is divided.

A cell is certified if all its next impacts are in certified cells; its order is one more than the largest of theirs. Any other
waits for the first open cell that it meets, and is resumed from there when that one is certified.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.errors import ProofError
from nsmaps.proof.flights import OPEN, SPLIT, Cells, Doubles, Flow, Integers, compiled, follow

FINEST = 8  #: phases of the tables in the narrowest cell


@dataclass(frozen=True)
class Found:
    """Codes of cells as in `nsmaps.verify.cells`, and the share that is certified of the cells of each wall."""

    codes: NDArray[np.uint16]
    shares: Doubles


def search(
    flow: Flow,
    walls: int,
    side: int,
    depth: int,
    top: float,
    trapped: Callable[[Integers, Integers, Doubles], NDArray[np.bool_]],
    progress: Callable[[int, Doubles], bool] = lambda level, shares: True,
) -> Found:
    """Certify the cells of `walls` base grids of side x side, dividing what is left `depth` times or until `progress` is false.

    Args:
        flow: tables at side * FINEST * 2^depth phases.
        top: speed at the upper edge.
        trapped: which boxes, of walls (M,), first and last phases (M, 2) and speeds (M, 2), are within the trap.
        progress: called after each division with its number and the share certified of each wall.
    """
    cells = _base(walls, side, side * FINEST << depth, top)
    n = cells.n
    new = np.arange(len(cells.child))
    for level in range(depth + 1):
        _trap(cells, new, trapped)
        queue = new[cells.order[new] == OPEN]
        certify(flow, cells, queue[np.argsort(-cells.place[queue, 1], kind="stable")])
        leaf = cells.child < 0
        certified = leaf & (cells.order < OPEN)
        shares = np.bincount(cells.place[certified, 0], (cells.place[certified, 2] / n) ** 2, walls).astype(np.float64)
        if not progress(level, shares) or level == depth:
            break
        cells, new = _divided(cells, np.flatnonzero(leaf & ~certified))
    return Found(np.where(cells.child >= 0, SPLIT, cells.order).astype(np.uint16), shares)


def closed_set(flow: Flow, walls: int, side: int, depth: int, top: float, seeds: Integers, largest: int) -> NDArray[np.bool_]:
    """The cells of the base grids that orbits from some of them meet, a forward invariant set.

    Args:
        seeds: places of cells, (wall side + column) side + row; columns count phases, rows speeds.
        largest: number of cells of the set, at most.

    Raises:
        ProofError: orbits meet more cells, or leave them.
    """
    cells = _base(walls, side, side * FINEST << depth, top)
    if not _close(flow, cells, np.unique(seeds), largest):
        raise ProofError(f"orbits from {len(seeds)} cells meet more than {largest} others, or speeds above {top}")
    return cells.order == 0


def _base(walls: int, side: int, n: int, top: float) -> Cells:
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
    _raise(cells, new[inside])


def _divided(cells: Cells, leaves: Integers) -> tuple[Cells, Integers]:
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
def _close(flow: Flow, cells: Cells, seeds: Integers, largest: int) -> bool:
    """Give the order zero to cells until their orbits stay in them; false if they are too many, or orbits leave all cells."""
    stack, state = np.empty(largest + seeds.size, np.int64), np.empty(4)
    count = total = seeds.size
    stack[:count] = seeds
    for seed in seeds:
        cells.order[seed] = 0
    while count:
        count -= 1
        state[0], leaf = -1.0, stack[count]
        blocker, _ = follow(flow, cells, leaf, state)
        while blocker >= 0:
            cells.order[blocker], stack[count] = 0, blocker
            count, total = count + 1, total + 1
            if total > largest:
                return False
            blocker, _ = follow(flow, cells, leaf, state)
        if blocker == -2:
            return False
    return True


@compiled
def _parent(cells: Cells, node: int) -> int:
    """The parent of a node, with its order brought up to date; -1 for a cell of the base grid."""
    parent = cells.parent[node]
    if parent >= 0:
        cells.order[parent] = cells.order[cells.child[parent] : cells.child[parent] + 4].max()
    return int(parent)


@compiled
def _raise(cells: Cells, nodes: Integers) -> None:
    """Bring the orders of all ancestors up to date."""
    for node in nodes:
        ancestor = _parent(cells, node)
        while ancestor >= 0 and cells.order[ancestor] < OPEN:
            ancestor = _parent(cells, ancestor)
