"""Many first returns in parallel: the flights of `march.py` in loops that a compiler turns into vector instructions.

A block of returns is a table with a column each, advanced from impact to impact: launch, march, close in, land; columns that are
open are moved to the front. The results are those of `first_return`, bit for bit: its arithmetic is that of `march.py`, which no
compiler may fuse or reorder. Rest, chatter, doubt and flights whose bounds depend on the time are left to it, from their start.
"""

import numpy as np

from nsmaps.exact.engine.block import (
    ACCELERATION,
    AIMED,
    BEHIND,
    BLOCK,
    BY_PHASE,
    BY_PHASE_1,
    BY_SPEED,
    BY_SPEED_1,
    D00,
    D01,
    D1,
    D2,
    D3,
    D10,
    D11,
    FLIGHT,
    HIGH,
    JERK,
    LEAST,
    LESS,
    LOW,
    MARCHED,
    ODD,
    OPEN,
    PHI,
    POP,
    RATE,
    RETURN,
    SNAP,
    STEADY,
    STEP,
    TERMS,
    TIME,
    TO_UP,
    TURNS,
    WHICH,
    S,
    V,
    W,
    X,
    begin_block,
    fill,
    fly_to,
    give_up,
    harmonic,
    leave_wall,
    motion_of,
    read_gap,
    size_of,
    slopes,
    tangents,
    to_front,
    write_gap,
)
from nsmaps.exact.engine.flight.flow import horizon, phase_rate, walls_of
from nsmaps.exact.engine.flight.layout import HARMONICS, WIDE
from nsmaps.exact.engine.jit import allocating, entry, inner
from nsmaps.exact.engine.march import (
    INWARD,
    ROUNDING,
    ahead,
    careful_step,
    converged,
    doubtful,
    leave,
    look,
    rooms,
    see,
    taylor_root,
)
from nsmaps.exact.engine.returns import (
    INVALID,
    NO_SPEED,
    RETURNED,
    accumulation,
    first_return,
    put,
    saltation,
    spell,
    summed,
    turned,
)

FEW = 16  # fewer returns than this are not computed in a block
MOST_FLIGHTS = 16  # of a return in a block; more are rare
MOST_ROUNDS = 50  # of a flight in a block; more are rare


@inner
def launch(p, t, n, up, chatter):
    """From an impact of speed V at phase PHI to the flight after it."""
    z, room_up, room_down = rooms(p, up)
    has_up, has_down, _ = walls_of(p)
    two, into = has_up and has_down, 1.0 if up else -1.0
    leave_wall(p, t, n, up, into)
    begin_block(p, t, n, z)
    for k in range(n):
        v, u, w = t[V + k], -into * t[W + k], t[W + k]
        _, _, a, j, q, r = motion_of(t, k)
        gap = ahead(up, 0.0, 0.0, (0.0, w, a, j, q, r))
        press = -gap[2]
        odd = t[ODD + k] > 0.0 or not u >= NO_SPEED
        bounds = t[JERK + k], t[SNAP + k]
        odd = odd or (press > 0.0 and summed(p, up, v, chatter, press) and u < v and accumulation(u, v, press, bounds)[1])
        surely, h = leave(two, gap, room_up + room_down, t[JERK + k], t[SNAP + k])
        write_gap(t, k, gap)
        t[S + k], t[X + k], t[TO_UP + k] = 0.0, h, 1.0 if up else 0.0
        t[ODD + k], t[OPEN + k] = 1.0 if odd else 0.0, 0.0 if surely or odd else 1.0


@inner
def march(p, t, n, up):
    """One step of flights that are not yet certain to reach a wall."""
    _, room_up, room_down = rooms(p, up)
    has_up, has_down, _ = walls_of(p)
    two, horizon_time = has_up and has_down, horizon(p)
    for k in range(n):
        s = t[S + k] + t[X + k] * INWARD
        t[ODD + k] = 0.0 if t[X + k] > ROUNDING * t[S + k] and s < horizon_time else 1.0
        t[S + k] = s
    fly_to(p, t, n)
    for k in range(n):
        size = size_of(t, k, t[S + k])
        to_up, gap, error, behind = see(has_up, has_down, motion_of(t, k), up, room_up, room_down, size)
        surely, x = look(two, gap[0] + error, behind, gap, t[JERK + k], t[SNAP + k])
        write_gap(t, k, gap)
        t[X + k], t[TO_UP + k], t[LEAST + k], t[BEHIND + k] = x, 1.0 if to_up else 0.0, gap[0] - error, behind
        t[OPEN + k] = 0.0 if surely or t[ODD + k] > 0.0 else 1.0


@inner
def measure(p, t, n):
    """The next step of flights that are not yet certain to reach a wall."""
    has_up, has_down, _ = walls_of(p)
    two = has_up and has_down
    for k in range(n):
        t[X + k] = careful_step(two, max(t[LEAST + k], 0.0), t[BEHIND + k], read_gap(t, k), t[JERK + k], t[SNAP + k])


@inner
def aim(t, n):
    """The times between which a wall is certainly reached, and the first approximation of that time."""
    for k in range(n):
        s, x = t[S + k], t[X + k]
        step, rate = taylor_root(read_gap(t, k), x)
        t[LOW + k], t[HIGH + k], t[STEP + k], t[RATE + k] = s, s + 1.5 * x, step, rate
        t[OPEN + k] = 0.0 if converged(step, rate, s, t[POP + k]) or t[ODD + k] > 0.0 else 1.0


@inner
def near(p, t, n, up):
    """A step towards the time at which a wall is reached, as in `close_in`."""
    _, room_up, room_down = rooms(p, up)
    for k in range(n):
        s, step, low, high = t[S + k], t[STEP + k], t[LOW + k], t[HIGH + k]
        t[S + k] = s + (step if low < s + step and s + step < high else (low + high) * 0.5 - s)
    fly_to(p, t, n)
    for k in range(n):
        s, low, high = t[S + k], t[LOW + k], t[HIGH + k]
        gap = ahead(t[TO_UP + k] > 0.0, room_up, room_down, motion_of(t, k))
        low, high = s if gap[0] > 0.0 else low, high if gap[0] > 0.0 else s
        newton = -gap[0] / gap[1]
        x = newton if abs(newton) < 0.5 * abs(t[X + k]) else (low + high) * 0.5 - s
        step, rate = taylor_root(gap, x)
        write_gap(t, k, gap)
        t[X + k], t[STEP + k], t[LOW + k], t[HIGH + k], t[RATE + k] = x, step, low, high, rate
        t[OPEN + k] = 0.0 if converged(step, rate, s, t[POP + k]) or t[ODD + k] > 0.0 else 1.0


@inner
def carry(p, t, n, up):
    """Carry the derivatives to the impact at S + STEP."""
    rate = phase_rate(p)
    tangents(p, t, n)
    slopes(p, t, n, up)
    for k in range(n):
        d = t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k]
        moves = t[BY_PHASE + k], t[BY_SPEED + k], t[BY_PHASE_1 + k], t[BY_SPEED_1 + k]
        d = saltation(up, t[TO_UP + k] > 0.0, t[D3 + k], t[D1 + k], t[D2 + k], moves, rate, d)
        t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k] = d


@inner
def land(p, t, n, up):
    """The impact at S + STEP; columns that are not back on the base wall remain open."""
    _, room_up, room_down = rooms(p, up)
    base_up, max_time = walls_of(p)[2], horizon(p)
    for k in range(n):
        s, rate, to_up = t[S + k] + t[STEP + k], t[RATE + k], t[TO_UP + k] > 0.0
        bound = abs(t[STEADY + k]) + t[ACCELERATION + k]
        room = 0.0 if to_up == up else room_up + room_down
        odd = (
            t[ODD + k] > 0.0
            or s > max_time
            or doubtful(rate, size_of(t, k, s), bound, room, s * max(abs(t[W + k]), abs(rate)), 0.0)
        )
        phi, whole = turned(p, t[PHI + k], s)
        t[PHI + k], t[V + k], t[TIME + k], t[TURNS + k] = phi, max(-rate, 0.0), t[TIME + k] + s, t[TURNS + k] + whole
        t[ODD + k], t[OPEN + k] = 1.0 if odd else 0.0, 0.0 if to_up == base_up or odd else 1.0


@inner
def fly(p, t, n, up, chatter, begun, want):
    """From impacts on a wall to the next impacts; returns the number of returns that continue, which stand in front.

    Derivatives of returns that have not `begun` are the identity in every column, and are not moved during the flight.
    """
    first = RETURN if not want else D00 if begun else LESS
    launch(p, t, n, up, chatter)
    m = to_front(p, t, n, first, MARCHED, TERMS)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        march(p, t, m, up)
        m = to_front(p, t, m, first, AIMED, TERMS)
        measure(p, t, m)
    give_up(t, m)
    aim(t, n)
    m = to_front(p, t, n, first, MARCHED, AIMED)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        near(p, t, m, up)
        m = to_front(p, t, m, first, MARCHED, AIMED)
    give_up(t, m)
    if want:
        carry(p, t, n, up)
    land(p, t, n, up)
    return to_front(p, t, n, D00 if want else RETURN, FLIGHT, 0)


@allocating
def side_by_side(p, start, i, chatter, states, turns, codes, outcome, time, tangents):
    """Returns number i of all orbits, which start from the states (M, 2), block by block: while a return continues, its impacts
    are on the other wall.
    """
    want = len(tangents) > 0
    has_up, has_down, base_up = walls_of(p)
    rows = harmonic(p, int(p.table[HARMONICS]) + 1)
    t = np.empty(rows)
    d = (0.0, 0.0, 0.0, 0.0)
    base = 5 if has_up and has_down else 4  # number of codes, as in `first_return`
    for first in range(0, len(start), BLOCK):
        n = min(BLOCK, len(start) - first)
        fill(p, t, n, first, start, want)
        code, power = spell(0, 1, base, 1, 1)
        for flights in range(1, MOST_FLIGHTS + 1):
            begun = flights > 1
            left = fly(p, t, n, base_up != begun, chatter, begun, want)
            if flights == MOST_FLIGHTS:
                give_up(t, left)
                left = 0
            word, _ = spell(code, power, base, 1, 1)
            for k in range(left, n):
                orbit = int(t[WHICH + k])
                if t[ODD + k] > 0.0:
                    result = first_return(p, start[orbit, 0], start[orbit, 1], chatter, want)
                else:
                    if want:
                        d = t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k]
                    result = RETURNED, t[V + k], t[PHI + k], int(t[TURNS + k]), t[TIME + k], word, d
                put(i, orbit, result, states, turns, codes, outcome, time, tangents)
            n = left
            code, power = spell(code, power, base, 2, 1)
            if n == 0:
                break


@entry
def orbits(p, chatter, start, states, turns, codes, outcome, time, tangents):
    """The first n returns of each of M states, start (M, 2), written into states (n, M, 2) and the other arrays.

    The outcome of an orbit that ended is repeated to the last return. Derivatives are written if `tangents`, shape (n, M, 2, 2),
    has any rows. First returns are orbits with n = 1: there is one compiled function for both.
    """
    n, m = codes.shape
    wide, slopes = p.table[WIDE] > 0.0 and m >= FEW, len(tangents) > 0
    for i in range(n if wide else 0):
        before = states[i - 1] if i > 0 else start
        side_by_side(p, before, i, chatter, states, turns, codes, outcome, time, tangents)
    for k in range(m):
        v, phi = start[k, 0], start[k, 1]
        for i in range(n):
            if not wide:
                result = first_return(p, v, phi, chatter, slopes)
                put(i, k, result, states, turns, codes, outcome, time, tangents)
                v, phi = result[1], result[2]
            if i > 0 and outcome[i, k] == INVALID:
                outcome[i, k] = outcome[i - 1, k]
