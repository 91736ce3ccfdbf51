"""The search for cells whose orbits all reach a trap: certified from the trap outwards, and what is left is divided.

Squares are divided into four. Those that are left are cut into strips along the stable sets of saddles, which are halved.

A cell is certified if all its next impacts are in certified cells; its order is one more than the largest of theirs. Any other
waits for the first open cell that it meets, and is resumed from there when that one is certified.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.exact.engine.jit import entry, inner
from nsmaps.proof.arrivals import CUT, OPEN, SPLIT, Cells, Doubles, Flow, Integers, parts
from nsmaps.proof.flights import follow
from nsmaps.proof.slopes import SHARES, slopes_of

FINEST = 8  #: phases of the tables in the narrowest cell


def search(
    flow: Flow,
    cells: Cells,
    depth: int,
    trapped: Callable[[Integers, Integers, Doubles], NDArray[np.bool_]],
    progress: Callable[[int, Doubles], bool] = lambda level, shares: True,
    cuts: int = 0,
) -> Cells:
    """Certify cells, dividing what is left of the base grids until `progress` is false.

    Args:
        flow: tables at side * FINEST * 2^depth phases, or more.
        cells: base grids, or those with a closed set of cells of order zero.
        depth: times that squares are divided into four.
        trapped: which boxes, of walls (M,), first and last phases (M, 2) and speeds (M, 2), are within the trap.
        progress: called after each division with its number and the share certified of the cells of each wall.
        cuts: times that what is left then is cut into two strips; squares of the lowest row are not.
    """
    new = np.flatnonzero(cells.child < 0)
    for level in range(depth + cuts + 1):
        _trap(cells, new, trapped)
        if level != depth + 1 or cuts == 1:  # strips of the first cut are about as high as their square
            queue = np.flatnonzero((cells.child < 0) & (cells.order == OPEN))
            certify(flow, cells, queue[np.argsort(-cells.place[queue, 1], kind="stable")])
        left = (cells.child < 0) & (cells.order == OPEN)
        without = np.bincount(cells.place[left, 0], areas(cells, left), flow.walls.shape[1]).astype(np.float64)
        if not progress(level, 1 - without) or level == depth + cuts:
            break
        if level < depth:
            cells, new = divided(cells, np.flatnonzero(left & (cells.place[:, 2] == cells.n // cells.side >> level)))
        elif level == depth:
            squares = np.flatnonzero(left & (cells.place[:, 3] > 0))
            cells, new = halved(cells, squares, slopes_of(flow, cells, squares))
        else:
            cells, new = halved(cells, np.flatnonzero(left & (cells.lines[:, 0] != 0)))
    return cells


def codes_of(cells: Cells) -> tuple[NDArray[np.uint16], NDArray[np.int8]]:
    """The codes of cells and the slopes of those that are cut, as in `nsmaps.verify.cells`, breadth first."""
    level, codes, slopes = np.flatnonzero(cells.parent < 0), [], []
    while len(level):
        child, number = cells.child[level], parts_of(cells, level)
        codes.append(np.where(number == 0, cells.order[level], np.where(number == 4, SPLIT, CUT)))
        slopes.append(cells.lines[child[(number == 2) & (cells.lines[level, 0] == 0)], 0])
        part = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
        level = np.repeat(child, number) + part
    eighths = np.rint(np.concatenate(slopes) * (SHARES * cells.n / cells.top))
    return np.concatenate(codes).astype(np.uint16), eighths.astype(np.int8)


def parts_of(cells: Cells, nodes: Integers) -> Integers:
    """The number of parts of nodes."""
    child = cells.child[nodes]
    return np.where(child < 0, 0, np.where(cells.lines[child, 0] == 0, 4, 2))


def areas(cells: Cells, which: NDArray[np.bool_]) -> Doubles:
    """The share of the phases and speeds of a wall that each of some cells is."""
    _, _, width, row = cells.place[which].T
    slope, low, high = cells.lines[which].T
    tall, rise = cells.top * width / cells.n, 0.5 * np.abs(slope) * width

    def below(line: Doubles) -> Doubles:
        """The part of a square below a line, as a share of its width times twice its rise."""
        lower, upper = (np.clip(x - row * tall, 0, None) for x in (line - rise, line + rise))
        return 0.5 * (np.minimum(upper, tall) ** 2 - np.minimum(lower, tall) ** 2) + tall * (
            np.maximum(upper, tall) - np.maximum(lower, tall)
        )

    strips = (below(high) - below(low)) / np.where(slope == 0, 1.0, 2 * rise)
    return np.asarray(np.where(slope == 0, tall, strips) * width / (cells.top * cells.n))


def base_grids(walls: int, side: int, n: int, top: float) -> Cells:
    """The base grids, without orders."""
    count = walls * side * side
    index = np.arange(count)
    place = np.stack([index // side**2, index // side % side * (n // side), np.full(count, n // side), index % side], 1)
    child, parent, order = (np.full(count, value, np.int32) for value in (-1, -1, OPEN))
    return Cells(side, n, top, child, parent, order, place.astype(np.int32), _square(place, top / n))


def _square(place: Integers, unit: float) -> Doubles:
    """The lines of squares: their edges, as of slope zero."""
    tall = place[:, 2] * unit
    return np.stack([np.zeros(len(place)), place[:, 3] * tall, (place[:, 3] + 1) * tall], 1)


def _trap(cells: Cells, new: Integers, trapped: Callable[..., NDArray[np.bool_]]) -> None:
    """Give the order zero to the new squares that are within the trap."""
    new = new[cells.lines[new, 0] == 0]
    wall, first, width, _ = cells.place[new].T
    inside = trapped(wall, np.stack([first, first + width], 1), cells.lines[new, 1:])
    cells.order[new[inside]] = 0
    bring_up(cells, new[inside])


def divided(cells: Cells, leaves: Integers) -> tuple[Cells, Integers]:
    """The cells with some squares divided into four, and the places of the new ones."""
    place, part = np.repeat(cells.place[leaves], 4, 0), np.tile(np.arange(4), len(leaves))
    place[:, 2] //= 2
    place[:, 1] += part // 2 * place[:, 2]
    place[:, 3] = 2 * place[:, 3] + part % 2
    return _more(cells, leaves, place, _square(place, cells.top / cells.n))


def halved(cells: Cells, leaves: Integers, slopes: Integers | None = None) -> tuple[Cells, Integers]:
    """The cells with some divided into two strips: squares along lines of new slopes, or strips, along their own."""
    place, lines, part = np.repeat(cells.place[leaves], 2, 0), np.repeat(cells.lines[leaves], 2, 0), np.tile([0, 1], len(leaves))
    if slopes is not None:
        lines[:, 0] = np.repeat(slopes, 2) * (cells.top / (SHARES * cells.n))
        rise = 0.5 * np.abs(lines[:, 0]) * place[:, 2]
        lines[:, 1:] += np.stack([-rise, rise], 1)
    middle = 0.5 * (lines[:, 1] + lines[:, 2])
    lines[part == 0, 2], lines[part == 1, 1] = middle[part == 0], middle[part == 1]
    return _more(cells, leaves, place, lines)


def _more(cells: Cells, leaves: Integers, place: Integers, lines: Doubles) -> tuple[Cells, Integers]:
    """The cells with the parts of some of them, and the places of the parts."""
    more = len(place)
    each = more // max(len(leaves), 1)
    cells.child[leaves] = len(cells.child) + each * np.arange(len(leaves))
    added: list[Any] = [np.full(more, -1), np.repeat(leaves, each), np.full(more, OPEN), place, lines]
    columns = (np.concatenate(pair, dtype=pair[0].dtype) for pair in zip(cells[3:], added, strict=True))
    return Cells(cells.side, cells.n, cells.top, *columns), len(cells.child) + np.arange(more)


@entry
def certify(flow: Flow, cells: Cells, queue: Integers) -> None:
    """Certify what can be of the cells in a queue, the last first; `order` is changed in place."""
    total = cells.child.size
    waiting = np.full(total, -1)  # the first that waits for a node
    following = np.full(total, -1)  # the next that waits with it
    number = np.full(total, -1)
    states = np.full((queue.size, 4), -1.0)
    stack = np.empty(queue.size + 1, np.int64)
    count = queue.size
    for i in range(count):
        number[queue[i]], stack[i] = i, queue[i]
    while count:
        count -= 1
        leaf = stack[count]
        blocker, highest = follow(flow, cells, leaf, states[number[leaf]])
        if blocker >= 0:
            following[leaf], waiting[blocker] = waiting[blocker], leaf
        elif blocker == -1 and highest + 1 < CUT:
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


@inner
def _parent(cells: Cells, node: int) -> int:
    """The parent of a node, with its order brought up to date; -1 for a cell of the base grid."""
    parent = cells.parent[node]
    if parent >= 0:
        child, order = cells.child[parent], 0
        for part in range(child, child + parts(cells, parent)):
            order = max(order, cells.order[part])
        cells.order[parent] = order
    return int(parent)


@entry
def bring_up(cells: Cells, nodes: Integers) -> None:
    """Bring the orders of all ancestors up to date."""
    for node in nodes:
        ancestor = _parent(cells, node)
        while ancestor >= 0 and cells.order[ancestor] < OPEN:
            ancestor = _parent(cells, ancestor)
