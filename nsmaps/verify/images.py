"""Whether all orbits that start in a cell have their next impact in given cells, in doubles whose rounding is bounded.

A cell is a box of phases and impact speeds on a wall. A flight from the time t0 with the speed kappa is at z(t0, kappa, t1) at
the time t1. It is followed through blocks of arrival times. In a block f = side (z - wall) and the arrival speed u = side
dz/dt1 are a value at the centre, first derivatives there times the distances |t0 - c0| <= r0, |kappa - ck| <= rk, |t1 - c1| <=
r1, and a remainder by second derivatives. Impacts of the block have f = 0 and u >= 0, and there u = u - m f for every number m:
each m bounds the speeds. Speeds kappa that are beyond a wall at the centre of a block for all t0 have hit before, and are left
out later.

Three arguments complete this. An orbit with endless impacts in one cell during one passage of its phases has flights whose
times add up to less than a period: their times, and so the speeds, tend to zero. Then the cell is of the lowest row, and the
orbit rests on the wall. So the next impact may be in the cell itself, if a ball that rests there is released in it or comes to
rest in a cell of a lower order, which the lowest row is checked for. A ball released at v = 0 is one of the starts of its cell.
Where a flight touches a wall at speed zero, both the impact and the flight without it are followed.

Rounding. Let e = eps + 2^-53, and K = `size` > 1. A table entry y has an error below e max(1, |y|); entries for phases, numbers
and places are below K. With A = 1 + |a| + |a'| and Y = K + kappa: the differences x, y of `_centre` are below 2 Y with errors
below 8 K e; c, dc are below 2 K A with errors below 8 K A e. A product of a factor below p with an error d p and one below q
with an error d' q has an error below (d + d' + d d' + 2^-53) p q, so z and z' are below 8 K^2 A Y + |q| + K with errors below
2^8 (K^2 A Y + 1 + |q|) e; the derivatives have one more factor K. A sum u - m f adds less than 2^-50 (1 + |m|) of these sizes,
and radii are at most one. All errors are below (1 + |m|)/2 times the slack 2^12 K (K^2 A Y + 1 + |q|) e, and each bound has
slack (1 + |m|). Sums of numbers without sign have few roundings and are multiplied by `WIDER`. Numbers of cells are integers
times a power of two, and exact.
"""

from collections.abc import Callable
from math import floor, sqrt
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nsmaps.verify.formula import Tables

LEFT = 65535  #: order of a cell that is not certified
WIDER = 1 + 2.0**-40
TINY = 1e-9  #: derivatives by which nothing is divided
CLOSE = 4  #: cells of the base grid along the phase, of the longest block that is compared with cells

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """A function compiled by numba, which calls others compiled so and lets other threads run."""
    return cast(F, njit(cache=True, nogil=True)(function))


class Tree(NamedTuple):
    """Cells: a base grid of `side` x `side` per wall and the four parts of those that are split, each a node."""

    side: int
    n: int  #: phases of the tables; all first phases and widths are in these units
    top: float  #: speed at the upper edge, an integer times a power of two with less than 20 binary digits
    child: NDArray[np.int64]  #: the first of four children, or -1
    order: NDArray[np.int64]  #: the order of a cell, of a node with children the largest among them
    wall: NDArray[np.int64]
    first: NDArray[np.int64]  #: the first phase of a node
    width: NDArray[np.int64]
    row: NDArray[np.int64]  #: its speeds are row to row + 1 times top width/n


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


def frame_of(tables: Tables, speed: float) -> Frame:
    """The tables with their bound of rounding, for cells with speeds up to `speed`."""
    unit, size = 2.0**12 * tables.size * (tables.eps + 2.0**-53), tables.size
    slack = unit * (2 * size**2 * (size + speed) + 1) * WIDER
    phases, flights, before, numbers, places, sides, step = tables[:7]
    return Frame(phases, flights, before, numbers, places, sides, step, tables.gap, unit, size, slack, tables.bounds)


@compiled
def covered(frame: Frame, tree: Tree, leaf: int, limit: int, fine: bool) -> bool:
    """True if every orbit from the cell `leaf` is later in a cell of an order below `limit`; `fine`: by short blocks only."""
    width, n = tree.width[leaf], tree.n
    height = tree.top * width / n
    low = frame.numbers[3] * tree.row[leaf] * height - frame.slack
    high = frame.numbers[3] * (tree.row[leaf] + 1) * height + frame.slack
    if tree.row[leaf] == 0 and not _rests(frame, tree, leaf, limit):
        return False
    start = _early(frame, tree, leaf, max(low, 0.0), high, limit)
    if start < 0:
        return start == -1
    shortest = max(width // 4, 2)
    block = shortest if fine else width
    end = tree.first[leaf] + frame.flights.shape[0] - frame.before - n // tree.side
    start -= start % shortest
    while start + block <= end:
        while start % block:
            block //= 2
        ok, below, above = _block(frame, tree, leaf, max(low, 0.0), high, start, block, limit)
        if ok:
            low, high = below, above
            if low > high:
                return True
            start += block
            block *= 1 if fine or 2 * block > n // 32 else 2
        elif block <= shortest:
            return False
        else:
            block //= 2
    return False


@compiled
def _rests(frame: Frame, tree: Tree, leaf: int, limit: int) -> bool:
    """True if a ball at rest in the phases of a cell is released in them, or is next in a cell of an order below `limit`."""
    wall, end = tree.wall[leaf], tree.first[leaf] + tree.width[leaf]
    away = -frame.sides[wall] * (frame.phases[end % tree.n, 2] - frame.numbers[1] * frame.places[wall])
    if away > frame.slack:
        return True
    away = -frame.sides[wall] * (frame.phases[tree.first[leaf] % tree.n, 2] - frame.numbers[1] * frame.places[wall])
    rate = frame.bounds[5] * tree.width[leaf] * frame.step * WIDER
    return away > rate + frame.slack or _below(frame, tree, leaf, False, wall, end, end + 1, 0.0, 0.0, limit)


@compiled
def _early(frame: Frame, tree: Tree, leaf: int, low: float, high: float, limit: int) -> int:
    """The time from which blocks follow the flights of a cell; -1 if all of them have hit in allowed cells, -2 for a failure.

    Until a time s the acceleration from the wall is within `change` of that at the centre of the cell.
    """
    wall, first, width = tree.wall[leaf], tree.first[leaf], tree.width[leaf]
    side, middle, r0 = frame.sides[wall], 0.5 * (low + high), 0.5 * width * frame.step
    force = frame.phases[(first + width // 2) % tree.n, 2] - frame.numbers[1] * frame.places[wall]
    away = -side * (force + frame.numbers[0] * side * middle)
    spread = abs(frame.numbers[0]) * 0.5 * (high - low) + frame.slack
    gap = abs(frame.places[0] - frame.places[1]) - 2 * frame.gap - frame.slack if frame.places.size > 1 else np.inf
    start, s = -1, max(width // 4, 1)
    while s < tree.n // 4:
        t = s * frame.step
        change = (spread + frame.bounds[4] * (r0 + t)) * WIDER
        if not (low + 0.5 * t * (away - change) > frame.slack or (low > 0 and away > change)):
            break
        if t * (high + 0.5 * t * max(away + change, 0.0)) * WIDER + frame.slack >= gap:
            break
        start, s = first + s, 2 * s
    if start >= 0 or tree.row[leaf] > 0:
        return max(start, first)
    s = max(width // 4, 1)
    while s < 16 * width and high + 0.5 * s * frame.step * (away + _change(frame, spread, r0, s)) > -frame.slack:
        s *= 2
    if s < 16 * width and _hits_until(frame, tree, leaf, high, (away, spread, gap), s, limit):
        return -1
    return first + 2 * width if _hits_until(frame, tree, leaf, high, (away, spread, gap), 2 * width, limit) else -2


@compiled
def _hits_until(frame: Frame, tree: Tree, leaf: int, high: float, known: tuple[float, float, float], s: int, limit: int) -> bool:
    """True if all impacts within a time s of departures from the lowest row are on the same wall and in allowed cells.

    Their speed differs from that of departure by s times the variation of the acceleration, at most. If the acceleration to the
    wall is between two numbers a1, a2 > 0, the flight rises to a height below high^2/(2 a1), and falls to a speed below
    high sqrt(a2/a1).
    """
    away, spread, gap = known
    wall, first, width, t = tree.wall[leaf], tree.first[leaf], tree.width[leaf], s * frame.step
    change = _change(frame, spread, 0.5 * width * frame.step, s)
    if t * (high + 0.5 * t * max(away + change, 0.0)) * WIDER + frame.slack >= gap:
        return False
    fastest, weakest = high + 2 * t * change, -away - change - frame.slack
    if weakest > 0:
        fastest = min(fastest, high * sqrt((change - away) / weakest))
    fastest = fastest * WIDER + frame.slack
    return bool(_below(frame, tree, leaf, True, wall, first, first + width + s, 0.0, fastest, limit))


@compiled
def _change(frame: Frame, spread: float, r0: float, s: int) -> float:
    """How much the acceleration of a flight changes from the centre of a cell until the time s, at most."""
    return (spread + frame.bounds[4] * (r0 + s * frame.step)) * WIDER


@compiled
def _centre(frame: Frame, wall: int, i0: int, kappa: float, i1: int, m: int) -> tuple[float, ...]:
    """At the centre: z, z', their derivatives by t0, a, a', c and the acceleration on arrival."""
    b, k, g = frame.numbers[0], frame.numbers[1], frame.numbers[2]
    a, da, fall = frame.flights[m, 0], frame.flights[m, 1], frame.flights[m, 2]
    c, dc, w0 = da + b * a, -k * a, -frame.sides[wall] * kappa
    x, y = frame.places[wall] - frame.phases[i0, 0], w0 - frame.phases[i0, 1]
    z = frame.phases[i1, 0] + fall + x * c + y * a
    v = frame.phases[i1, 1] + g * a + x * dc + y * da
    start = frame.phases[i0, 2] - k * frame.places[wall] - b * w0
    return z, v, -(w0 * c + start * a), -(w0 * dc + start * da), a, da, c, frame.phases[i1, 2] - k * z - b * v


@compiled
def _block(
    frame: Frame, tree: Tree, leaf: int, low: float, high: float, start: int, block: int, limit: int
) -> tuple[bool, float, float]:
    """True if all impacts of a block of times are in allowed cells, and the speeds that have not hit surely by its centre."""
    wall, first, width = tree.wall[leaf], tree.first[leaf], tree.width[leaf]
    middle, c0, c1 = 0.5 * (low + high), first + width // 2, start + block // 2
    r0, r1 = 0.5 * width * frame.step * WIDER, 0.5 * block * frame.step * WIDER
    rk = (0.5 * (high - low) + frame.slack) * WIDER
    z, v, z0, v0, a, da, c, push = _centre(frame, wall, c0 % tree.n, middle, c1 % tree.n, c1 - c0 + frame.before)
    top, dda, v00, v01, jerk, rate = frame.bounds
    fall = frame.flights[c1 - c0 + frame.before, 2]
    slack = frame.unit * (frame.size**2 * (1 + abs(a) + abs(da)) * (frame.size + high) + 1 + abs(fall)) * WIDER + frame.slack
    late = abs(v0) + v00 * r0 + v01 * r1 + dda * rk
    bend = 0.5 * (late + rate * (abs(a) + top * (r0 + r1))) * r0 * r0 + top * r0 * rk + slack + frame.gap * (1 + abs(c))
    off = bend + late * r0 * r1 + top * r1 * rk + 0.5 * (abs(push) + jerk * r1 + v01 * r0 + dda * rk) * r1 * r1
    off_v = 0.5 * v00 * r0 * r0 + v01 * r0 * r1 + dda * (r0 + r1) * rk + 0.5 * jerk * r1 * r1 + slack
    reach = (abs(z0) * r0 + abs(a) * rk + abs(v) * r1 + off) * WIDER
    below, above = low, high
    for other in range(frame.places.size):
        side = frame.sides[other]
        f, lift = side * (z - frame.places[other]), -side * frame.sides[wall] * a
        if f > reach:
            return True, 1.0, 0.0
        if f < -reach:
            continue
        slopes = (side * z0, lift, side * v), (side * v0, -side * frame.sides[wall] * da, side * push)
        slow, fast = _speeds(f, side * v, slopes, (r0, rk, r1), off * WIDER, off_v * WIDER)
        if fast >= 0 and slow <= fast:
            if 2 * block > CLOSE * tree.n // tree.side or fast - slow > 0.25 * tree.top:
                return False, low, high
            same = other == wall and start < first + width
            if not _below(frame, tree, leaf, same, other, start, start + block, max(slow, 0.0), fast, limit):
                return False, low, high
        beyond = f - (abs(z0) * r0 + bend) * WIDER - slack
        if lift < 0 and beyond > lift * rk:
            below = max(below, middle - beyond / lift - frame.slack)
        elif lift > 0 and beyond > -lift * rk:
            above = min(above, middle - beyond / lift + frame.slack)
    return True, below, above


@compiled
def _speeds(f: float, u: float, slopes: Any, radii: tuple[float, float, float], off: float, off_v: float) -> tuple[float, float]:
    """Bounds of the arrival speed where f = 0: with m = 0, or so that one of the three derivatives of u - m f is zero."""
    low, high = -np.inf, np.inf
    df, du = slopes
    for i in range(4):
        m = 0.0 if i == 3 or abs(df[i]) < TINY else du[i] / df[i]
        spread = off_v + abs(m) * off
        for j in range(3):
            spread += abs(du[j] - m * df[j]) * radii[j]
        low, high = max(low, u - m * f - spread * WIDER), min(high, u - m * f + spread * WIDER)
    return low, high


@compiled
def _below(
    frame: Frame, tree: Tree, leaf: int, same: bool, wall: int, first: int, end: int, low: float, high: float, limit: int
) -> bool:
    """True if all cells that meet a box have orders below `limit`; the cell `leaf` itself is passed over if `same`."""
    base, height = tree.n // tree.side, tree.top / tree.side
    if high >= tree.top:
        return False
    stack = np.empty(64, np.int64)
    bottom, upper = max(floor(low / height) - 1, 0), min(floor(high / height) + 1, tree.side - 1)
    for column in range(first // base, (end - 1) // base + 1):
        turn = column // tree.side * tree.n
        for row in range(bottom, upper + 1):
            stack[0], count = (wall * tree.side + column % tree.side) * tree.side + row, 1
            while count:
                count -= 1
                node = stack[count]
                left, width = turn + tree.first[node], tree.width[node]
                tall = tree.top * width / tree.n
                outside = (
                    left >= end or left + width <= first or tree.row[node] * tall > high or (tree.row[node] + 1) * tall < low
                )
                if outside or tree.order[node] < limit:
                    continue
                if tree.child[node] < 0:
                    if not (same and node == leaf):
                        return False
                    continue
                for i in range(4):
                    stack[count] = tree.child[node] + i
                    count += 1
    return True
