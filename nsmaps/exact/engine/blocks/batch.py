"""Many first returns in parallel: the flights of `march.py` in loops that a compiler turns into vector instructions.

A block of returns is a table with a column each, advanced from impact to impact: launch, march, close in, land; columns that are
open are moved to the front. The results are those of `first_return`, bit for bit: its arithmetic is that of `march.py`, which no
compiler may fuse or reorder. Rest, chatter, doubt and flights whose bounds depend on the time are left to it, from their start.
"""

import numpy as np

from nsmaps.exact.engine.blocks.block import (
    begin_block,
    harmonic,
    leave_to_scalar,
    motion_of,
    read_gap,
    size_of,
    to_front,
    write_gap,
    write_motion,
    write_rebounds,
    write_starts,
)
from nsmaps.exact.engine.blocks.derivatives import slopes, tangents
from nsmaps.exact.engine.blocks.rows import AT, BLOCK, FLIGHT, MARCH, RETURN, SEARCH, TERMS
from nsmaps.exact.engine.constants import BRACKET, INWARD, NO_SPEED, ROUNDING
from nsmaps.exact.engine.flight.flow import horizon, on_top, phase_rate, walls_of
from nsmaps.exact.engine.flight.layout import HARMONICS, WIDE
from nsmaps.exact.engine.jit import allocating, entry, inner
from nsmaps.exact.engine.march import gap_ahead, is_ambiguous, wall_distances, wall_gap
from nsmaps.exact.engine.observers import BASE, OTHER, FirstReturn, base_of, first_return, saltation, write_return
from nsmaps.exact.engine.returns import INVALID, PHASE, RETURNED, SPEED, accumulation, append_symbol, may_be_summed, phase_after
from nsmaps.exact.engine.steps import careful_step, departure, is_converged, surely_reached, taylor_root

FEW = 16  # fewer returns than this are not computed in a block
MOST_FLIGHTS = 16  # of a return in a block; more are rare
MOST_ROUNDS = 50  # of a flight in a block; more are rare


@inner
def launch(p, t, n, up, chatter):
    """From an impact to the flight after it."""
    z, room_up, room_down = wall_distances(p, up)
    has_up, has_down, _ = walls_of(p)
    two, into = has_up and has_down, 1.0 if up else -1.0
    write_rebounds(p, t, n, up, into)
    begin_block(p, t, n, z)
    for k in range(n):
        v, u, w = t[AT.speed + k], -into * t[AT.velocity + k], t[AT.velocity + k]
        _, _, a, j, q, r = motion_of(t, k)
        gap = wall_gap(up, 0.0, (0.0, w, a, j, q, r))
        press = -gap.acceleration
        odd = t[AT.needs_scalar + k] > 0.0 or not u >= NO_SPEED
        jerk, snap = t[AT.jerk + k], t[AT.snap + k]
        _, summable = accumulation(u, v, press, jerk, snap)
        odd = odd or (press > 0.0 and may_be_summed(p, up, v, chatter, press) and u < v and summable)
        surely, h = departure(two, gap, room_up + room_down, jerk, snap)
        write_gap(t, k, gap)
        t[AT.now + k], t[AT.ahead + k], t[AT.to_up + k] = 0.0, h, 1.0 if up else 0.0
        t[AT.needs_scalar + k], t[AT.open + k] = 1.0 if odd else 0.0, 0.0 if surely or odd else 1.0


@inner
def march(p, t, n, up):
    """One step of flights that are not yet certain to reach a wall."""
    _, room_up, room_down = wall_distances(p, up)
    has_up, has_down, _ = walls_of(p)
    two, horizon_time = has_up and has_down, horizon(p)
    for k in range(n):
        s = t[AT.now + k] + t[AT.ahead + k] * INWARD
        t[AT.needs_scalar + k] = 0.0 if t[AT.ahead + k] > ROUNDING * t[AT.now + k] and s < horizon_time else 1.0
        t[AT.now + k] = s
    write_motion(p, t, n)
    for k in range(n):
        size = size_of(t, k, t[AT.now + k])
        to_up, gap, error, behind = gap_ahead(has_up, has_down, motion_of(t, k), up, room_up, room_down, size)
        surely, x = surely_reached(two, gap.size + error, behind, gap, t[AT.jerk + k], t[AT.snap + k])
        write_gap(t, k, gap)
        t[AT.ahead + k], t[AT.to_up + k], t[AT.least + k], t[AT.behind + k] = x, 1.0 if to_up else 0.0, gap.size - error, behind
        t[AT.open + k] = 0.0 if surely or t[AT.needs_scalar + k] > 0.0 else 1.0


@inner
def measure(p, t, n):
    """The next step of flights that are not yet certain to reach a wall."""
    has_up, has_down, _ = walls_of(p)
    two = has_up and has_down
    for k in range(n):
        least = max(t[AT.least + k], 0.0)
        t[AT.ahead + k] = careful_step(two, least, t[AT.behind + k], read_gap(t, k), t[AT.jerk + k], t[AT.snap + k])


@inner
def bracket(t, n):
    """The times between which a wall is certainly reached, and the first approximation of that time."""
    for k in range(n):
        s, x = t[AT.now + k], t[AT.ahead + k]
        step, rate = taylor_root(read_gap(t, k), x)
        t[AT.low + k], t[AT.high + k], t[AT.step + k], t[AT.rate + k] = s, s + BRACKET * x, step, rate
        t[AT.open + k] = 0.0 if is_converged(step, rate, s, t[AT.pop + k]) or t[AT.needs_scalar + k] > 0.0 else 1.0


@inner
def newton_step(p, t, n, up):
    """A step towards the time at which a wall is reached, as in `close_in`."""
    _, room_up, room_down = wall_distances(p, up)
    for k in range(n):
        s, step, low, high = t[AT.now + k], t[AT.step + k], t[AT.low + k], t[AT.high + k]
        t[AT.now + k] = s + (step if low < s + step and s + step < high else (low + high) * 0.5 - s)
    write_motion(p, t, n)
    for k in range(n):
        s, low, high = t[AT.now + k], t[AT.low + k], t[AT.high + k]
        to_up = t[AT.to_up + k] > 0.0
        gap = wall_gap(to_up, room_up if to_up else room_down, motion_of(t, k))
        low, high = s if gap.size > 0.0 else low, high if gap.size > 0.0 else s
        newton = -gap.size / gap.rate
        x = newton if abs(newton) < 0.5 * abs(t[AT.ahead + k]) else (low + high) * 0.5 - s
        step, rate = taylor_root(gap, x)
        write_gap(t, k, gap)
        t[AT.ahead + k], t[AT.step + k], t[AT.low + k], t[AT.high + k], t[AT.rate + k] = x, step, low, high, rate
        t[AT.open + k] = 0.0 if is_converged(step, rate, s, t[AT.pop + k]) or t[AT.needs_scalar + k] > 0.0 else 1.0


@inner
def carry_derivatives(p, t, n, up):
    """Carry the derivatives to the impact at `now + step`."""
    rate, into = phase_rate(p), 1.0 if up else -1.0
    tangents(p, t, n)
    slopes(p, t, n, up)
    for k in range(n):
        d = t[AT.d_vv + k], t[AT.d_vp + k], t[AT.d_pv + k], t[AT.d_pp + k]
        moves = t[AT.by_phase + k], t[AT.by_speed + k], t[AT.by_phase_1 + k], t[AT.by_speed_1 + k]
        to_wall = 1.0 if t[AT.to_up + k] > 0.0 else -1.0
        d = saltation(to_wall, t[AT.motion_1 + k], t[AT.motion_2 + k], -into * t[AT.motion_3 + k], moves, rate, d)
        t[AT.d_vv + k], t[AT.d_vp + k], t[AT.d_pv + k], t[AT.d_pp + k] = d


@inner
def meet_walls(p, t, n, up):
    """The impact at `now + step`; columns that are not back on the base wall remain open."""
    _, room_up, room_down = wall_distances(p, up)
    base_up, max_time = on_top(p), horizon(p)
    for k in range(n):
        s, rate, to_up = t[AT.now + k] + t[AT.step + k], t[AT.rate + k], t[AT.to_up + k] > 0.0
        bound = abs(t[AT.steady + k]) + t[AT.acceleration + k]
        room = 0.0 if to_up == up else room_up + room_down
        odd = (
            t[AT.needs_scalar + k] > 0.0
            or s > max_time
            or is_ambiguous(rate, size_of(t, k, s), bound, room, s * max(abs(t[AT.velocity + k]), abs(rate)), 0.0)
        )
        phi, whole = phase_after(p, t[AT.phase + k], s)
        t[AT.phase + k], t[AT.speed + k] = phi, max(-rate, 0.0)
        t[AT.time + k] += s
        t[AT.turns + k] += whole
        t[AT.needs_scalar + k], t[AT.open + k] = 1.0 if odd else 0.0, 0.0 if to_up == base_up or odd else 1.0


@inner
def next_impacts(p, t, n, up, chatter, begun, with_derivative):
    """From impacts on a wall to the next impacts; returns the number of returns that continue, which stand in front.

    Derivatives of returns that have not `begun` are the identity in every column, and are not moved during the flight.
    """
    first = RETURN if not with_derivative else AT.d_vv if begun else AT.less
    launch(p, t, n, up, chatter)
    m = to_front(p, t, n, first, MARCH, TERMS)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        march(p, t, m, up)
        m = to_front(p, t, m, first, SEARCH, TERMS)
        measure(p, t, m)
    leave_to_scalar(t, m)
    bracket(t, n)
    m = to_front(p, t, n, first, MARCH, SEARCH)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        newton_step(p, t, m, up)
        m = to_front(p, t, m, first, MARCH, SEARCH)
    leave_to_scalar(t, m)
    if with_derivative:
        carry_derivatives(p, t, n, up)
    meet_walls(p, t, n, up)
    return to_front(p, t, n, AT.d_vv if with_derivative else RETURN, FLIGHT, 0)


@allocating
def returns_in_blocks(p, start, i, chatter, written):
    """Returns number i of all orbits from the states (M, 2), block by block: within a return impacts are on the other wall."""
    with_derivative, base, base_up = len(written.tangents) > 0, base_of(p), on_top(p)
    rows = harmonic(p, int(p.table[HARMONICS]) + 1)
    t = np.empty(rows)
    d = (0.0, 0.0, 0.0, 0.0)
    for first in range(0, len(start), BLOCK):
        n = min(BLOCK, len(start) - first)
        write_starts(p, t, n, first, start, with_derivative)
        code, power = append_symbol(0, 1, base, BASE, 1)
        for flights in range(1, MOST_FLIGHTS + 1):
            begun = flights > 1
            left = next_impacts(p, t, n, base_up != begun, chatter, begun, with_derivative)
            if flights == MOST_FLIGHTS:
                leave_to_scalar(t, left)
                left = 0
            word, _ = append_symbol(code, power, base, BASE, 1)
            for k in range(left, n):
                orbit = int(t[AT.orbit + k])
                if t[AT.needs_scalar + k] > 0.0:
                    found = first_return(p, start[orbit, SPEED], start[orbit, PHASE], chatter, with_derivative)
                else:
                    if with_derivative:
                        d = t[AT.d_vv + k], t[AT.d_vp + k], t[AT.d_pv + k], t[AT.d_pp + k]
                    found = FirstReturn(RETURNED, t[AT.speed + k], t[AT.phase + k], int(t[AT.turns + k]), t[AT.time + k], word, d)
                write_return(written, i, orbit, found)
            n = left
            code, power = append_symbol(code, power, base, OTHER, 1)
            if n == 0:
                break


@entry
def orbits(p, chatter, start, rows):
    """The first n returns of each of M states, start (M, 2), written into rows.

    The outcome of an orbit that ended is repeated to the last return. First returns are orbits with n = 1: there is one compiled
    function for both.
    """
    n, m = rows.codes.shape
    wide, slopes = p.table[WIDE] > 0.0 and m >= FEW, len(rows.tangents) > 0
    for i in range(n if wide else 0):
        before = i - 1
        returns_in_blocks(p, rows.states[before] if i > 0 else start, i, chatter, rows)
    for k in range(m):
        v, phi = start[k, SPEED], start[k, PHASE]
        for i in range(n):
            if not wide:
                found = first_return(p, v, phi, chatter, slopes)
                write_return(rows, i, k, found)
                v, phi = found.speed, found.phase
            before = i - 1
            if i > 0 and rows.outcome[i, k] == INVALID:
                rows.outcome[i, k] = rows.outcome[before, k]
