"""The cells of a search, and those in which arrivals can be, in floats."""

from math import floor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.exact.engine.jit import allocating, inner

Doubles = NDArray[np.float64]
Integers = NDArray[np.signedinteger]  #: of 32 bits in cells, of which there are up to 10^8
OPEN, SPLIT, CUT = 65535, 65534, 65533
WIDE: Any = np.int64  #: the one type of numbers of cells and phases in calls: for others all would be compiled once more
NONE = WIDE(-1)  #: no cell
PAD = 16.0  #: times the bound of rounding of the verification


class Flow(NamedTuple):
    """Tables at n phases of p, p' and force; at times from -before on of a, a' and q; walls and bounds of derivatives."""

    phases: Doubles
    flights: Doubles
    before: int
    b: float
    k: float
    g: float
    r: float
    walls: Doubles  #: (2, number of walls): places and sides
    step: float
    pad: float
    gap: float
    bounds: Doubles  #: largest |a'|, |a''|, |z'_00|, |z'_01|, |jerk|, |rate of the force|


class Cells(NamedTuple):
    """Squares and the strips into which some are cut; `order` has room for the cells of one more division."""

    side: int
    n: int
    top: float
    child: Integers
    parent: Integers
    order: Integers
    place: Integers  #: (M, 4): wall, first phase, width, row of the square
    lines: Doubles  #: (M, 3): slope by the phase of the lines that bound a strip, their speeds in the middle; slope 0: a square


class Arrival(NamedTuple):
    """Arrivals of a block: place and speed at its centre, derivatives of both, radii, remainders and the time of the centre."""

    known: bool
    f: float
    u: float
    df: tuple[float, float, float]
    du: tuple[float, float, float]
    radii: tuple[float, float, float]
    off: float
    off_v: float
    time: int


UNKNOWN = Arrival(False, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0, 0)


@inner
def parts(cells: Cells, node: int) -> int:
    """The number of parts of a divided cell."""
    return 4 if cells.lines[cells.child[node], 0] == 0 else 2


@inner
def extent(cells: Cells, leaf: int) -> tuple[float, float]:
    """The slowest and fastest speed of a cell; reversed if it is empty."""
    _, _, width, row = cells.place[leaf]
    slope, low, high = cells.lines[leaf]
    tall, rise = cells.top * width / cells.n, 0.5 * abs(slope) * width
    return max(row * tall, low - rise), min((row + 1) * tall, high + rise)


@inner
def speeds(at: Arrival, slope: float) -> tuple[float, float]:
    """Bounds of u - slope (t1 - c1) on the line f = 0, by multiples of f that remove one of the three derivatives, or none."""
    low, high = -np.inf, np.inf
    du = at.du[0], at.du[1], at.du[2] - slope
    for i in range(4):
        m = du[i % 3] / at.df[i % 3] if i < 3 and at.df[i % 3] != 0 else 0.0
        spread = at.off_v + abs(m) * at.off
        for j in range(3):
            spread += abs(du[j] - m * at.df[j]) * at.radii[j]
        low, high = max(low, at.u - m * at.f - spread), min(high, at.u - m * at.f + spread)
    return low, high


@allocating
def blocking(
    flow: Flow, cells: Cells, skipped: int, wall: int, first: int, end: int, low: float, high: float, at: Arrival
) -> tuple[int, int]:
    """The first open cell that arrivals in a box can be in, other than `skipped` or `NONE`, and the largest order.

    It is -1 if there is none, and -2 above all cells.
    """
    base, height, highest = cells.n // cells.side, cells.top / cells.side, 0
    if high >= cells.top:
        return -2, 0
    stack, slow, fast = np.empty(256, np.int64), low, high
    for column in range(first // base, (end - 1) // base + 1):
        turn = column // cells.side * cells.n
        for row in range(max(floor(low / height) - 1, 0), min(floor(high / height) + 1, cells.side - 1) + 1):
            stack[0], count, known = (wall * cells.side + column % cells.side) * cells.side + row, 1, (-1, 0.0)
            while count:
                count -= 1
                node = stack[count]
                _, left, width, line = cells.place[node]
                left, tall, slope = left + turn, cells.top * width / cells.n, cells.lines[node, 0]
                if left >= end or left + width <= first or line * tall > high or (line + 1) * tall < low:
                    continue
                if slope != 0:
                    middle = left + width // 2
                    if known != (middle, slope):
                        slow, fast = leaning(flow, slope, middle, first, end, low, high, at)
                        known = (middle, slope)
                    if cells.lines[node, 1] > fast or cells.lines[node, 2] < slow:
                        continue
                if cells.order[node] < OPEN:
                    highest = max(highest, cells.order[node])
                elif cells.child[node] >= 0:
                    for i in range(parts(cells, node)):
                        stack[count] = cells.child[node] + i
                        count += 1
                elif node != skipped:
                    return node, 0
    return -1, highest


@inner
def leaning(
    flow: Flow, slope: float, anchor: int, first: int, end: int, low: float, high: float, at: Arrival
) -> tuple[float, float]:
    """Bounds of the speeds less slope times the phase from the anchor, of the arrivals in a box."""
    a, b = slope * (first - anchor), slope * (end - anchor)
    slow, fast = low - max(a, b), high - min(a, b)
    if at.known:
        smallest, largest = speeds(at, slope / flow.step)
        shift = slope * (at.time - anchor)
        slow, fast = max(slow, smallest - shift - flow.pad), min(fast, largest - shift + flow.pad)
    return slow, fast
