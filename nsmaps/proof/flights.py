"""Flights of cells in floats: the cells in which their next impacts can be, and the first of these that is not certified yet.

Nothing is proved here: `nsmaps.verify` bounds the same images with all rounding. Here bounds are widened by `PAD`.
"""

from math import sqrt
from typing import Any

import numpy as np

from nsmaps.exact.engine.jit import inner
from nsmaps.proof.arrivals import NONE, UNKNOWN, WIDE, Arrival, Cells, Doubles, Flow, blocking, extent, speeds


@inner
def follow(flow: Flow, cells: Cells, leaf: int, state: Doubles) -> tuple[int, int]:
    """The first cell that blocks `leaf`, -1 for none and -2 where it can never be certified, and the largest order met so far.

    `state` is where the last call stopped, and is brought up to date: time, slowest and fastest departure, largest order.
    """
    _, first, width, _ = cells.place[leaf]
    if state[0] < 0:
        slope, low, high = cells.lines[leaf]
        slowest, fastest = extent(cells, leaf)
        if slowest > fastest:
            return -1, 0
        slowest, fastest = max(flow.r * slowest - flow.pad, 0.0), flow.r * fastest + flow.pad
        state[1], state[2], state[3] = flow.r * low - flow.pad, flow.r * high + flow.pad, 0
        if slope == 0:
            state[1] = slowest
        blocker, start, highest = first_times(flow, cells, leaf, slowest, fastest)
        if blocker != -1:
            return blocker, 0
        state[3] = highest
        if start < 0:
            return -1, highest
        state[0] = start
    shortest, block, start, highest = max(width // 4, 2), width, int(state[0]), int(state[3])
    start -= start % shortest
    end = first + flow.flights.shape[0] - flow.before - cells.n // cells.side
    while start + block <= end:
        while start % block:
            block //= 2
        blocker, below, above, met = impacts(flow, cells, leaf, state[1], state[2], start, block)
        if blocker == -1:
            highest, state[1], state[2] = max(highest, met), below, above
            if below > above:
                return -1, highest
            start += block
            block *= 2 if 2 * block <= cells.n // 32 else 1
        elif block <= shortest:
            state[0], state[3] = start, highest
            return blocker, highest
        else:
            block //= 2
    return -2, highest


@inner
def first_times(flow: Flow, cells: Cells, leaf: int, low: float, high: float) -> tuple[int, int, int]:
    """A blocking cell (-1: none), the time from which blocks follow (-1: all flights have ended), and the largest order met."""
    wall, first, width = WIDE(cells.place[leaf, 0]), WIDE(cells.place[leaf, 1]), WIDE(cells.place[leaf, 2])
    at, side, step, n = flow.walls[0, wall], flow.walls[1, wall], flow.step, cells.n
    room = abs(flow.walls[0, 1] - flow.walls[0, 0]) - 2 * flow.gap if flow.walls.shape[1] > 1 else np.inf
    away = -side * (flow.phases[(first + width // 2) % n, 2] - flow.k * at + flow.b * side * 0.5 * (low + high))
    spread, jerk, r0 = 0.5 * flow.b * (high - low) + flow.pad, flow.bounds[4], 0.5 * width * step
    s, start, highest, rests = max(width // 4, 1), -1, 0, cells.place[leaf, 3] == 0
    if rests:
        edge = -side * (flow.phases[(first + width) % n, 2] - flow.k * at)
        start_edge = -side * (flow.phases[first % n, 2] - flow.k * at)
        if edge <= flow.pad and start_edge <= flow.bounds[5] * width * step + flow.pad:
            blocker, highest = blocking(flow, cells, NONE, wall, first + width, first + width + 1, 0.0, 0.0, UNKNOWN)
            if blocker != -1:
                return blocker, 0, 0
    while s < n // 4:
        t = s * step
        change = spread + jerk * (r0 + t)
        if not low + 0.5 * t * (away - change) > flow.pad and not (low > 0 and away > change):
            break
        if t * (high + 0.5 * t * max(away + change, 0.0)) + flow.pad >= room:
            break
        start, s = first + s, 2 * s
    if start >= 0 or not rests:
        return -1, max(start, first), highest
    s = max(width // 4, 1)
    while s < 16 * width and high + 0.5 * s * step * (away + spread + jerk * (r0 + s * step)) > -flow.pad:
        s *= 2
    closed = s < 16 * width
    s = s if closed else 2 * width
    t, change = s * step, spread + jerk * (r0 + s * step)
    if t * (high + 0.5 * t * max(away + change, 0.0)) + flow.pad >= room:
        return -2, 0, 0
    fastest, weakest = high + 2 * t * change, -away - change - flow.pad
    if weakest > 0:
        fastest = min(fastest, high * sqrt((change - away) / weakest))
    blocker, met = blocking(flow, cells, leaf, wall, first, first + width + s, 0.0, fastest + flow.pad, UNKNOWN)
    return blocker, -1 if closed else first + s, max(met, highest)


@inner
def expansion(
    flow: Flow, wall: int, c0: int, c1: int, kappa: float, tilt: float, radii: tuple[float, float, float]
) -> tuple[Any, Any]:
    """At the centre of a block: z, z' and their derivatives by departure time, speed and arrival time; and the remainders.

    Departures are those of speeds within radii[1] of kappa + tilt (t0 - c0).
    """
    n, m, (r0, rk, r1) = len(flow.phases), c1 - c0 + flow.before, radii
    a, da, fall = flow.flights[m]
    c, w0, side = da + flow.b * a, -flow.walls[1, wall] * kappa, flow.walls[1, wall]
    x, y = flow.walls[0, wall] - flow.phases[c0 % n, 0], w0 - flow.phases[c0 % n, 1]
    z = flow.phases[c1 % n, 0] + fall + x * c + y * a
    v = flow.phases[c1 % n, 1] + flow.g * a - x * flow.k * a + y * da
    start = flow.phases[c0 % n, 2] - flow.k * flow.walls[0, wall] - flow.b * w0
    push = flow.phases[c1 % n, 2] - flow.k * z - flow.b * v
    z0, v0 = -(w0 * c + start * a), w0 * flow.k * a - start * da
    top, dda, v00, v01, jerk, rate = flow.bounds
    rk += abs(tilt) * r0
    late = abs(v0) + v00 * r0 + v01 * r1 + dda * rk
    still = 0.5 * (late + rate * (abs(a) + top * (r0 + r1))) * r0 * r0 + top * r0 * rk + flow.pad + flow.gap * (1 + abs(c))
    off = still + late * r0 * r1 + top * r1 * rk + 0.5 * (abs(push) + jerk * r1 + v01 * r0 + dda * rk) * r1 * r1
    off_v = 0.5 * v00 * r0 * r0 + v01 * r0 * r1 + dda * (r0 + r1) * rk + 0.5 * jerk * r1 * r1 + flow.pad
    return (z, v, z0 - tilt * side * a, -side * a, v0 - tilt * side * da, -side * da, push), (still, off, off_v)


@inner
def impacts(
    flow: Flow, cells: Cells, leaf: int, low: float, high: float, start: int, block: int
) -> tuple[int, float, float, int]:
    """A blocking cell, the departure speeds still in flight (none: reversed), and the largest order, of one block of times."""
    wall, first, width, _ = cells.place[leaf]
    middle, tilt = 0.5 * (low + high), flow.r * cells.lines[leaf, 0] / flow.step
    radii = 0.5 * width * flow.step, 0.5 * (high - low) + flow.pad, 0.5 * block * flow.step
    (z, v, z0, zk, v0, vk, push), (still, off, off_v) = expansion(
        flow, wall, first + width // 2, start + block // 2, middle, tilt, radii
    )
    reach = abs(z0) * radii[0] + abs(zk) * radii[1] + abs(v) * radii[2] + off
    below, above, highest = low, high, 0
    for other in range(flow.walls.shape[1]):
        side = flow.walls[1, other]
        f, lift = side * (z - flow.walls[0, other]), side * zk
        if f > reach:
            return -1, 1.0, 0.0, highest
        if f < -reach:
            continue
        df, du = (side * z0, lift, side * v), (side * v0, side * vk, side * push)
        arrival = Arrival(True, f, side * v, df, du, radii, off, off_v, start + block // 2)
        slow, fast = speeds(arrival, 0.0)
        if fast >= 0 and slow <= fast:
            if 2 * block > 4 * cells.n // cells.side or fast - slow > 0.25 * cells.top:
                return -2, low, high, 0
            own = leaf if other == wall and start < first + width else NONE
            blocker, met = blocking(flow, cells, own, other, start, start + block, max(slow, 0.0), fast, arrival)
            if blocker != -1:
                return blocker, low, high, 0
            highest = max(highest, met)
        beyond = f - abs(z0) * radii[0] - still
        if lift < 0 and beyond > lift * radii[1]:
            below = max(below, middle - beyond / lift)
        elif lift > 0 and beyond > -lift * radii[1]:
            above = min(above, middle - beyond / lift)
    return -1, below, above, highest
