"""Cells as a tree, and whether arrivals that are known by bounds can be in a cell whose order is too high.

Bounds include rounding as argued in `images`.
"""

from collections.abc import Callable
from math import floor
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nsmaps.verify.formula import WIDER

LEFT = 65535  #: order of a cell that is not certified
NONE: Any = np.int64(-1)  #: no cell, of the type of cells: for another all would be compiled once more
TINY = 1e-9  #: derivatives by which nothing is divided

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """A function compiled by numba, which calls others compiled so and lets other threads run."""
    return cast(F, njit(cache=True, nogil=True)(function))


class Tree(NamedTuple):
    """Cells: a base grid of `side` x `side` per wall, the four squares or two strips of those that are divided, each a node."""

    side: int
    n: int  #: phases of the tables; all first phases and widths are in these units
    top: float  #: speed at the upper edge, an integer times a power of two with less than 20 binary digits
    child: NDArray[np.int64]  #: the first of its parts, or -1
    order: NDArray[np.int64]  #: the order of a cell, of a node with children the largest among them
    wall: NDArray[np.int64]
    first: NDArray[np.int64]  #: the first phase of a node
    width: NDArray[np.int64]
    row: NDArray[np.int64]  #: its speeds are row to row + 1 times top width/n; of a strip, those of its square
    slope: NDArray[np.float64]  #: of the lines that bound a strip, speed by phase in parts of 2 pi/n; zero for a square
    low: NDArray[np.float64]  #: the speed of the lower line in the middle of the phases
    high: NDArray[np.float64]  #: of the upper line


class Frame(NamedTuple):
    """Tables of a system as in `formula.Tables`, with the bound of rounding."""

    phases: NDArray[np.float64]
    flights: NDArray[np.float64]
    before: int
    numbers: NDArray[np.float64]
    places: NDArray[np.float64]
    sides: NDArray[np.float64]
    step: float
    gap: float  #: radius of the places of the walls that is not in `slack`
    unit: float  #: errors of rounding are below unit (size^2 (1 + |a| + |a'|) (size + kappa) + 1 + |q|)
    size: float
    slack: float  #: that bound at a = 0, a' = 1, q = 0 with the fastest departure
    bounds: NDArray[np.float64]


class Arrival(NamedTuple):
    """What is known of the arrivals of a block: place f and speed u at its centre, their derivatives, radii and remainders."""

    known: bool
    f: float
    u: float
    slopes: tuple[tuple[float, float, float], tuple[float, float, float]]
    radii: tuple[float, float, float]
    off: float
    off_v: float
    time: int  #: of the centre


UNKNOWN = Arrival(False, 0.0, 0.0, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0), 0.0, 0.0, 0)


@compiled
def parts(tree: Tree, node: int) -> int:
    """The number of parts of a divided cell."""
    return 4 if tree.slope[tree.child[node]] == 0 else 2


@compiled
def extent(tree: Tree, leaf: int) -> tuple[float, float]:
    """The slowest and fastest speed of a cell, exact; reversed if it is empty."""
    tall, rise = tree.top * tree.width[leaf] / tree.n, 0.5 * abs(tree.slope[leaf]) * tree.width[leaf]
    return max(tree.row[leaf] * tall, tree.low[leaf] - rise), min((tree.row[leaf] + 1) * tall, tree.high[leaf] + rise)


@compiled
def speeds(at: Arrival, slope: float) -> tuple[float, float]:
    """Bounds of u - slope (t1 - c1) where f = 0: with m = 0, or so that one of the three derivatives of it less m f is zero."""
    low, high = -np.inf, np.inf
    df, du = at.slopes[0], (at.slopes[1][0], at.slopes[1][1], at.slopes[1][2] - slope)
    for i in range(4):
        m = 0.0 if i == 3 or abs(df[i]) < TINY else du[i] / df[i]
        spread = at.off_v + abs(m) * at.off
        for j in range(3):
            spread += abs(du[j] - m * df[j]) * at.radii[j]
        low, high = max(low, at.u - m * at.f - spread * WIDER), min(high, at.u - m * at.f + spread * WIDER)
    return low, high


@compiled
def below_limit(
    frame: Frame, tree: Tree, skipped: int, wall: int, first: int, end: int, low: float, high: float, at: Arrival, limit: int
) -> bool:
    """True if all cells in which arrivals in a box can be have orders below `limit`; `skipped` (or `NONE`) is passed over."""
    base, height = tree.n // tree.side, tree.top / tree.side
    if high >= tree.top:
        return False
    stack, slow, fast = np.empty(256, np.int64), low, high
    bottom, upper = max(floor(low / height) - 1, 0), min(floor(high / height) + 1, tree.side - 1)
    for column in range(first // base, (end - 1) // base + 1):
        turn = column // tree.side * tree.n
        for row in range(bottom, upper + 1):
            stack[0], count, known = (wall * tree.side + column % tree.side) * tree.side + row, 1, (-1, 0.0)
            while count:
                count -= 1
                node = stack[count]
                left, width, slope = turn + tree.first[node], tree.width[node], tree.slope[node]
                tall = tree.top * width / tree.n
                outside = (
                    left >= end or left + width <= first or tree.row[node] * tall > high or (tree.row[node] + 1) * tall < low
                )
                if outside or tree.order[node] < limit:
                    continue
                if slope != 0:
                    middle = left + width // 2
                    if known != (middle, slope):
                        slow, fast = _along(frame, slope, middle, first, end, low, high, at)
                        known = (middle, slope)
                    if tree.low[node] > fast or tree.high[node] < slow:
                        continue
                if tree.child[node] < 0:
                    if node != skipped:
                        return False
                    continue
                for i in range(parts(tree, node)):
                    stack[count] = tree.child[node] + i
                    count += 1
    return True


@compiled
def _along(
    frame: Frame, slope: float, middle: int, first: int, end: int, low: float, high: float, at: Arrival
) -> tuple[float, float]:
    """Bounds of the speed less slope times the phase from `middle`, of the arrivals in a box."""
    a, b = slope * (first - middle), slope * (end - middle)
    slow, fast = low - max(a, b) - frame.slack, high - min(a, b) + frame.slack
    if at.known:
        smallest, largest = speeds(at, slope / frame.step)
        shift = slope * (at.time - middle)
        slow, fast = max(slow, smallest - shift - frame.slack), min(fast, largest - shift + frame.slack)
    return slow, fast
