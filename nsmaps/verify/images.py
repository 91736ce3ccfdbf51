"""Whether all orbits that start in a cell have their next impact in given cells, in doubles whose rounding is bounded.

A cell is a box of phases and impact speeds on a wall. A flight from the time t0 with the speed kappa is at z(t0, kappa, t1) at
the time t1. It is followed through blocks of arrival times. In a block f = side (z - wall) and the arrival speed u = side
dz/dt1 are a value at the centre, first derivatives there times the distances |t0 - c0| <= r0, |kappa - ck| <= rk, |t1 - c1| <=
r1, and a remainder by second derivatives. Impacts of the block have f = 0 and u >= 0, and there u = u - m f for every number m:
each m bounds the speeds. Speeds kappa that are beyond a wall at the centre of a block for all t0 have hit before, and are left
out later. For a strip, whose speeds are between lines of one slope, kappa is less r slope times the phase from the middle:
derivatives by t0 are those along the lines, and the second derivatives are multiplied by the largest differences of t0 and of
the whole departure speed. Of arrivals in a strip the speed less its slope times the phase is bounded in the same way. Any slope
is right, as a change of variables; a part of a strip outside its square is an image too many.

Three arguments complete this. An orbit with endless impacts in one cell during one passage of its phases has flights whose
times add up to less than a period: their times, and so the speeds, tend to zero. Then the cell is of the lowest row, and the
orbit rests on the wall. So the next impact may be in the cell itself, if a ball that rests there is released in it or comes to
rest in a cell of a lower order, which the lowest row is checked for. A ball released at v = 0 is one of the starts of its cell.
Where a flight touches a wall at speed zero, both the impact and the flight without it are followed.

Rounding. Let e = eps + 2^-53, and K = `size` > 1. A table entry y has an error below e max(1, |y|); entries for phases, numbers
and places are below K. With A = 1 + |a| + |a'| and Y = K + |kappa|: the differences x, y of `_centre` are below 2 Y with errors
below 8 K e; c, dc are below 2 K A with errors below 8 K A e. A product of a factor below p with an error d p and one below q
with an error d' q has an error below (d + d' + d d' + 2^-53) p q, so z and z' are below 8 K^2 A Y + |q| + K with errors below
2^8 (K^2 A Y + 1 + |q|) e; the derivatives have one more factor K. A sum u - m f adds less than 2^-50 (1 + |m|) of these sizes,
and radii are at most one. All errors are below (1 + |m|)/2 times the slack 2^12 K (K^2 A Y + 1 + |q|) e, and each bound has
slack (1 + |m|). Where a cell is a strip, |slope| times a width of the base grid is at most one and `top`. So the derivative by
kappa times r |slope| r0 has no larger error than times a radius; the slope by time, the shift from the middle and their
differences add less than 2^-46 (1 + top), below slack; and speeds between the lines are below that for which the tables are
made. Sums of numbers without sign have few roundings and are multiplied by `WIDER`. Numbers of cells are integers times a power
of two, and exact, as are slopes by the phase and the lines of strips.
"""

from math import sqrt

import numpy as np

from nsmaps.verify.arrivals import NONE, UNKNOWN, Arrival, Frame, Tree, below_limit, compiled, extent, speeds
from nsmaps.verify.formula import WIDER, Tables

CLOSE = 4  #: cells of the base grid along the phase, of the longest block that is compared with cells


def frame_of(tables: Tables) -> Frame:
    """The tables with their bound of rounding."""
    phases, flights, before, numbers, places, sides, step = tables[:7]
    return Frame(
        phases, flights, before, numbers, places, sides, step, tables.gap, tables.unit, tables.size, tables.slack, tables.bounds
    )


@compiled
def covered(frame: Frame, tree: Tree, leaf: int, limit: int, fine: bool) -> bool:
    """True if every orbit from the cell `leaf` is later in a cell of an order below `limit`; `fine`: by short blocks only."""
    width, n, r = tree.width[leaf], tree.n, frame.numbers[3]
    slowest, fastest = extent(tree, leaf)
    if slowest > fastest:
        return True
    if tree.row[leaf] == 0 and not _rests(frame, tree, leaf, limit):
        return False
    start = _early(frame, tree, leaf, max(r * slowest - frame.slack, 0.0), r * fastest + frame.slack, limit)
    if start < 0:
        return start == -1
    low, high = r * tree.low[leaf] - frame.slack, r * tree.high[leaf] + frame.slack
    if tree.slope[leaf] == 0:
        low = max(low, 0.0)
    shortest = max(width // 4, 2)
    block = shortest if fine else width
    end = tree.first[leaf] + frame.flights.shape[0] - frame.before - n // tree.side
    start -= start % shortest
    while start + block <= end:
        while start % block:
            block //= 2
        ok, below, above = _block(frame, tree, leaf, low, high, start, block, limit)
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
    return away > rate + frame.slack or below_limit(frame, tree, NONE, wall, end, end + 1, 0.0, 0.0, UNKNOWN, limit)


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
    return bool(below_limit(frame, tree, leaf, wall, first, first + width + s, 0.0, fastest, UNKNOWN, limit))


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
    rk, tilt = (0.5 * (high - low) + frame.slack) * WIDER, frame.numbers[3] * tree.slope[leaf] / frame.step
    whole, fastest = (rk + abs(tilt) * r0) * WIDER, max(abs(low), abs(high))
    z, v, z0, v0, a, da, c, push = _centre(frame, wall, c0 % tree.n, middle, c1 % tree.n, c1 - c0 + frame.before)
    top, dda, v00, v01, jerk, rate = frame.bounds
    fall = frame.flights[c1 - c0 + frame.before, 2]
    slack = frame.unit * (frame.size**2 * (1 + abs(a) + abs(da)) * (frame.size + fastest) + 1 + abs(fall)) * WIDER + frame.slack
    late = abs(v0) + v00 * r0 + v01 * r1 + dda * whole
    bend = 0.5 * (late + rate * (abs(a) + top * (r0 + r1))) * r0 * r0 + top * r0 * whole + slack + frame.gap * (1 + abs(c))
    off = bend + late * r0 * r1 + top * r1 * whole + 0.5 * (abs(push) + jerk * r1 + v01 * r0 + dda * whole) * r1 * r1
    off_v = 0.5 * v00 * r0 * r0 + v01 * r0 * r1 + dda * (r0 + r1) * whole + 0.5 * jerk * r1 * r1 + slack
    z0, v0 = z0 - tilt * frame.sides[wall] * a, v0 - tilt * frame.sides[wall] * da
    below, above, reach = low, high, (abs(z0) * r0 + abs(a) * rk + abs(v) * r1 + off) * WIDER
    for other in range(frame.places.size):
        side = frame.sides[other]
        f, lift = side * (z - frame.places[other]), -side * frame.sides[wall] * a
        if f > reach:
            return True, 1.0, 0.0
        if f < -reach:
            continue
        slopes = (side * z0, lift, side * v), (side * v0, -side * frame.sides[wall] * da, side * push)
        at = Arrival(True, f, side * v, slopes, (r0, rk, r1), off * WIDER, off_v * WIDER, c1)
        slow, fast = speeds(at, 0.0)
        if fast >= 0 and slow <= fast:
            if 2 * block > CLOSE * tree.n // tree.side or fast - slow > 0.25 * tree.top:
                return False, low, high
            own = leaf if other == wall and start < first + width else NONE
            if not below_limit(frame, tree, own, other, start, start + block, max(slow, 0.0), fast, at, limit):
                return False, low, high
        beyond = f - (abs(z0) * r0 + bend) * WIDER - slack
        if lift < 0 and beyond > lift * rk:
            below = max(below, middle - beyond / lift - frame.slack)
        elif lift > 0 and beyond > -lift * rk:
            above = min(above, middle - beyond / lift + frame.slack)
    return True, below, above
