"""The search for a closed set: cells around an attractor whose next impacts are all in cells of the set."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nsmaps.arrays import Bools
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import ProofError
from nsmaps.exact.engine.jit import entry
from nsmaps.proof.arrivals import OPEN, Cells, Flow, Integers
from nsmaps.proof.cells import bring_up, divided
from nsmaps.proof.flights import follow

if TYPE_CHECKING:
    from nsmaps.coordinates import StateLike
    from nsmaps.exact.systems.system import ImpactSystem

LARGEST = 2_000_000  #: cells of a set, at most


class Around(NamedTuple):
    """The closed set to be found, around the attractor of an orbit."""

    depth: int  #: how often its cells are divided
    transient: int = 2000  #: first impacts of the orbit, until it is on the attractor
    n_samples: int = 1_000_000  #: number of impacts after them, whose cells the closed set is compared with


def closed_around(
    system: "ImpactSystem", start: "StateLike", flow: Flow, cells: Cells, around: Around, unit: float
) -> tuple[Cells, str]:
    """The base grids with a closed set around an orbit's attractor, and how its area compares with that of the orbit's cells.

    Args:
        unit: of speeds in flow and cells.

    Raises:
        ProofError: the orbit ends before, or no closed set is found.
    """
    seen = system.impacts(start, around.transient + around.n_samples)
    walls, phases, speeds = (x[around.transient :] for x in (seen.wall.astype(np.int64), seen.phase, seen.speed / unit))
    if len(walls) < around.n_samples or not speeds.max() < cells.top:
        raise ProofError(
            f"the orbit has {len(seen.wall)} impacts, with speeds up to {seen.speed.max():.6g}; expected: "
            f"{around.transient + around.n_samples}, on the attractor below {unit * cells.top:g}"
        )
    cells = closed_set(flow, cells, around.depth, (int(walls[0]), float(phases[0]), float(speeds[0])), unit)
    side, zero = cells.side << around.depth, _zero(cells)
    column, row = (phases % TWO_PI * (side / TWO_PI)).astype(np.int64), (speeds * (side / cells.top)).astype(np.int64)
    met = np.bincount(np.unique((walls * side + column) * side + row) // side**2, minlength=len(system.letters))
    area = np.bincount(cells.place[zero, 0], (cells.place[zero, 2] / cells.n * side) ** 2, len(system.letters))
    parts = (f"{n:.0f} and {m} on wall {letter}" for n, m, letter in zip(area, met, system.letters, strict=True))
    return cells, (
        f"cells of {side} x {side} in the closed set, and those of {around.n_samples} impacts after {around.transient} "
        f"(sampled): {', '.join(parts)}"
    )


def closed_set(flow: Flow, cells: Cells, depth: int, seed: tuple[int, float, float], unit: float = 1.0) -> Cells:
    """Base grids with the cells of a closed set around a state divided `depth` times, and given the order zero.

    The set is found among cells of the base grids first, then among their parts. Cells that no image meets are left out.

    Args:
        cells: base grids, without orders.
        seed: wall, phase and speed of an impact on the attractor.
        unit: of speeds, for errors.

    Raises:
        ProofError: orbits from cells of the set meet too many others, or speeds above all cells.
    """
    for level in range(depth + 1):
        if not _images(flow, cells, np.array([_leaf(cells, seed)]), True, LARGEST):
            raise ProofError(
                f"orbits from the cell, one of {cells.side << level}^2, at phase {seed[1]:.6g} and speed {unit * seed[2]:.6g} on "
                f"wall {seed[0]} meet more than {LARGEST} others, or speeds above {unit * cells.top:g}"
            )
        found = np.flatnonzero(_zero(cells))
        if level < depth:
            cells, _ = divided(cells, found)
            cells.order[:] = OPEN
    while True:
        cells.order[:] = OPEN
        _images(flow, cells, found, False, LARGEST)
        met = np.flatnonzero(_zero(cells))
        if len(met) == len(found):
            bring_up(cells, found)
            return cells
        found = met


def _zero(cells: Cells) -> Bools:
    """Which nodes are cells of order zero."""
    return (cells.child < 0) & (cells.order == 0)


def _leaf(cells: Cells, seed: tuple[int, float, float]) -> int:
    """The cell of a state."""
    wall, phase, speed = seed
    column, row, side = phase % TWO_PI / TWO_PI, speed / cells.top, cells.side
    node = (wall * side + int(column * side)) * side + int(row * side)
    while cells.child[node] >= 0:
        side *= 2
        node = cells.child[node] + 2 * (int(column * side) % 2) + int(row * side) % 2
    return int(node)


@entry
def _images(flow: Flow, cells: Cells, leaves: Integers, onward: bool, largest: int) -> bool:
    """Give the order zero to all cells that images of some cells meet; `onward`: to these cells and all that follow them.

    False if they are too many, or flights leave all cells.
    """
    stack, state = np.empty(largest + leaves.size, np.int64), np.empty(4)
    count = total = leaves.size
    stack[:count] = leaves
    if onward:
        cells.order[leaves] = 0
    while count:
        count -= 1
        state[0], leaf = -1.0, stack[count]
        blocker, _ = follow(flow, cells, leaf, state)
        while blocker >= 0:
            cells.order[blocker] = 0
            if onward:
                stack[count] = blocker
                count, total = count + 1, total + 1
                if total > largest:
                    return False
            blocker, _ = follow(flow, cells, leaf, state)
        if blocker == -2:
            return False
    return True
