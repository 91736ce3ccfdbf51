"""Many first returns side by side: the flights of `flight.py` in loops that a compiler turns into vector instructions.

A block of returns is a table, one column each, that is taken from impact to impact: launch, march, close in, land. Between the
loops what is still open is brought to the front, so that each runs over what needs it. All decisions and all arithmetic are those
of `flight.py`, and no compiler may fuse or reorder them: the results are those of `first_return`, bit for bit. What is out of the
ordinary (rest, chatter, doubt, no wall met) is left to that, from its start.

Like `flight.py`, this file is not imported but copied behind the flow that is generated for a system.
"""

import math

import numpy as np

from nsmaps.exact.compiled import njit
from nsmaps.exact.flight import (
    INWARD,
    OUTWARD,
    ROUNDING,
    ahead,
    angle,
    careful_step,
    close_in,
    doubtful,
    leave,
    look,
    rooms,
    see,
    settled,
    taylor_root,
)
from nsmaps.exact.flow import BASE_UP, HAS_DOWN, HAS_UP, WIDE, bounds_at, coefficients_at, horizon, phase_rate, rebound, start
from nsmaps.exact.returns import (
    INVALID,
    NO_SPEED,
    RETURNED,
    accumulation,
    advance_tangent,
    first_return,
    is_state,
    one_by_one,
    put,
    spell,
    turned,
)

# === engine ===

BLOCK = 512  # returns side by side: few enough to stay in the processor's cache
PITCH = BLOCK + 8  # from row to row: no power of two, which would crowd one part of the cache
FEW = 16  # returns that are not worth a block
MOST_FLIGHTS = 16  # of a return in a block, more are rare
MOST_ROUNDS = 50  # of a flight in a block, more are rare
WHICH, TIME, TURNS, V, PHI, LESS, SINE, W = range(0, 8 * PITCH, PITCH)  # the return and its last impact
ODD, OPEN, TO_UP, S, X, ERROR, BEHIND, STEP, LOW, HIGH, RATE = range(8 * PITCH, 19 * PITCH, PITCH)  # the flight so far
Y, U, B, J, K, Q, ROWS, D01, D10, D11, ALL_ROWS = range(19 * PITCH, 30 * PITCH, PITCH)  # the gap ahead, the derivative
D00 = ROWS  # rows from here on are there only where derivatives are wanted


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def flight_at(p, z, t, k):
    """The flight of a column: its coefficients and bounds, raised against rounding."""
    at = t[PHI + k], t[LESS + k], t[SINE + k]
    limits = bounds_at(p, at, z, t[W + k])
    return coefficients_at(p, at, z, t[W + k]), limits[0] * OUTWARD, limits[1] * OUTWARD, limits[3] * OUTWARD


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def write_gap(t, k, gap):
    """Keep a gap and its rates."""
    t[Y + k], t[U + k], t[B + k], t[J + k], t[K + k], t[Q + k] = gap


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def read_gap(t, k):
    """What `write_gap` kept."""
    return t[Y + k], t[U + k], t[B + k], t[J + k], t[K + k], t[Q + k]


@njit(cache=True, nogil=True, error_model="numpy")
def launch(p, t, n, up, chatter):
    """From an impact of speed V at phase PHI on to the flight behind it."""
    z, room_up, room_down = rooms(p, up)
    into = 1.0 if up else -1.0
    for k in range(n):
        v = t[V + k]
        u, _ = rebound(p, up, v)
        at = angle(t[PHI + k])
        w = -into * u
        c = coefficients_at(p, at, z, w)
        limits = bounds_at(p, at, z, w)
        gap = ahead(up, 0.0, 0.0, (0.0, w, *start(c)))
        press = -gap[2]
        odd = t[ODD + k] > 0.0 or not u >= NO_SPEED
        odd = odd or (press > 0.0 and v * phase_rate(p) <= chatter * press and u < v and accumulation(u, v, press, limits)[1])
        surely, h = leave(gap, room_up + room_down, limits[0] * OUTWARD, limits[1] * OUTWARD)
        write_gap(t, k, gap)
        t[LESS + k], t[SINE + k], t[W + k] = at[1], at[2], w
        t[S + k], t[X + k], t[ERROR + k], t[TO_UP + k] = 0.0, h, 0.0, 1.0 if up else 0.0
        t[ODD + k], t[OPEN + k] = 1.0 if odd else 0.0, 0.0 if surely or odd else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def march(p, t, n, up):
    """One step of flights that are not sure yet to meet a wall."""
    z, room_up, room_down = rooms(p, up)
    longest = horizon(p)
    for k in range(n):
        c, jerk, snap, _ = flight_at(p, z, t, k)
        s = t[S + k] + t[X + k] * INWARD
        odd = not (t[X + k] > ROUNDING * t[S + k] and s < longest)
        to_up, gap, error, behind = see(c, room_up, room_down, s)
        surely, x = look(gap[0] + error, behind, gap, jerk, snap)
        write_gap(t, k, gap)
        t[S + k], t[X + k], t[TO_UP + k], t[ERROR + k], t[BEHIND + k] = s, x, 1.0 if to_up else 0.0, error, behind
        t[ODD + k], t[OPEN + k] = 1.0 if odd else 0.0, 0.0 if surely or odd else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def measure(p, t, n, up):
    """The next step of flights that are not sure yet to meet a wall."""
    z, _, _ = rooms(p, up)
    for k in range(n):
        _, jerk, snap, _ = flight_at(p, z, t, k)
        t[X + k] = careful_step(max(t[Y + k] - t[ERROR + k], 0.0), t[BEHIND + k], read_gap(t, k), jerk, snap)


@njit(cache=True, nogil=True, error_model="numpy")
def aim(p, t, n, up):
    """Between which times a wall will surely be met, and the first guess when."""
    z, _, _ = rooms(p, up)
    for k in range(n):
        _, _, _, pop = flight_at(p, z, t, k)
        s, x = t[S + k], t[X + k]
        step, rate = taylor_root(read_gap(t, k), x)
        t[LOW + k], t[HIGH + k], t[STEP + k], t[RATE + k] = s, s + 1.5 * x, step, rate
        t[OPEN + k] = 0.0 if settled(step, rate, s, pop) or t[ODD + k] > 0.0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def near(p, t, n, up):
    """A step closer to where a wall is met."""
    z, room_up, room_down = rooms(p, up)
    for k in range(n):
        c, _, _, pop = flight_at(p, z, t, k)
        at = t[S + k], t[X + k], t[STEP + k], read_gap(t, k), t[ERROR + k], t[LOW + k], t[HIGH + k]
        rate, at = close_in(c, t[TO_UP + k] > 0.0, room_up, room_down, *at)
        s, x, step, gap, error, low, high = at
        write_gap(t, k, gap)
        t[S + k], t[X + k], t[STEP + k], t[LOW + k], t[HIGH + k], t[RATE + k] = s, x, step, low, high, rate
        t[ERROR + k] = error
        t[OPEN + k] = 0.0 if settled(step, rate, s, pop) or t[ODD + k] > 0.0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def carry(p, t, n, up):
    """The derivatives, to the impact at S."""
    for k in range(n):
        at = t[PHI + k], t[LESS + k], t[SINE + k]
        d = t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k]
        _, slope = rebound(p, up, t[V + k])
        d = advance_tangent(p, up, at, t[W + k], slope, t[TO_UP + k] > 0.0, t[S + k] + t[STEP + k], d)
        t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k] = d


@njit(cache=True, nogil=True, error_model="numpy")
def land(p, t, n, up):
    """The impact at S: open are those that are not back on the base wall."""
    z, room_up, room_down = rooms(p, up)
    for k in range(n):
        _, jerk, _, _ = flight_at(p, z, t, k)
        s, rate, to_up = t[S + k] + t[STEP + k], t[RATE + k], t[TO_UP + k] > 0.0
        room = room_up if to_up else room_down
        odd = t[ODD + k] > 0.0 or doubtful(s, t[STEP + k], rate, read_gap(t, k), t[ERROR + k], t[W + k], room, jerk)
        phi, whole = turned(p, t[PHI + k], s)
        t[PHI + k], t[V + k], t[TIME + k], t[TURNS + k] = phi, max(-rate, 0.0), t[TIME + k] + s, t[TURNS + k] + whole
        t[ODD + k], t[OPEN + k] = 1.0 if odd else 0.0, 0.0 if to_up == BASE_UP or odd else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def to_front(t, n, rows):
    """Bring what is open to the front; returns how many these are."""
    k, m = 0, n
    while True:
        while k < m and t[OPEN + k] > 0.0:
            k += 1
        while k < m and not t[OPEN + m - 1] > 0.0:
            m -= 1
        if k >= m:
            return m
        m -= 1
        for row in range(0, rows, PITCH):
            t[row + k], t[row + m] = t[row + m], t[row + k]
        k += 1


@njit(cache=True, nogil=True, error_model="numpy")
def give_up(t, n):
    """Leave columns to `first_return`."""
    for k in range(n):
        t[ODD + k] = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def fly(p, t, n, up, chatter, rows):
    """From impacts on a wall to the next impacts; returns how many go on, which stand in front."""
    launch(p, t, n, up, chatter)
    m = to_front(t, n, rows)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        march(p, t, m, up)
        m = to_front(t, m, rows)
        measure(p, t, m, up)
    give_up(t, m)
    aim(p, t, n, up)
    m = to_front(t, n, rows)
    for _ in range(MOST_ROUNDS):
        if m == 0:
            break
        near(p, t, m, up)
        m = to_front(t, m, rows)
    give_up(t, m)
    if rows > D00:
        carry(p, t, n, up)
    land(p, t, n, up)
    return to_front(t, n, rows)


@njit(cache=True, nogil=True, error_model="numpy")
def fill(p, t, n, first, start, rows):
    """Begin the table with n states from the first on."""
    for k in range(n):
        v, phi = start[first + k, 0], start[first + k, 1]
        t[WHICH + k], t[TIME + k], t[V + k] = first + k, 0.0, v
        t[PHI + k], t[TURNS + k] = turned(p, phi, 0.0)
        t[ODD + k] = 0.0 if is_state(v, phi) else 1.0
        if rows > D00:
            t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k] = 1.0, 0.0, 0.0, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def side_by_side(p, start, chatter, image, turns, codes, outcome, time, tangents):
    """First returns of a batch, block by block: as long as a return goes on, its impacts are on the other wall."""
    want = len(tangents) > 0
    rows = ALL_ROWS if want else ROWS
    t = np.zeros(ALL_ROWS)
    d = (0.0, 0.0, 0.0, 0.0)
    base = 1 + (HAS_UP and HAS_DOWN) + 3  # of codes, as in `first_return`
    for first in range(0, len(start), BLOCK):
        n = min(BLOCK, len(start) - first)
        fill(p, t, n, first, start, rows)
        code, power = spell(0, 1, base, 1, 1)
        for flights in range(1, MOST_FLIGHTS + 1):
            left = fly(p, t, n, (flights == 1) == BASE_UP, chatter if flights == 1 else math.inf, rows)
            if flights == MOST_FLIGHTS:
                give_up(t, left)
                left = 0
            word, _ = spell(code, power, base, 1, 1)
            for k in range(left, n):
                i = int(t[WHICH + k])
                if t[ODD + k] > 0.0:
                    result = first_return(p, start[i, 0], start[i, 1], chatter, want)
                else:
                    if want:
                        d = t[D00 + k], t[D01 + k], t[D10 + k], t[D11 + k]
                    result = RETURNED, t[V + k], t[PHI + k], int(t[TURNS + k]), t[TIME + k], word, d
                put(i, result, image, turns, codes, outcome, time, tangents)
            n = left
            code, power = spell(code, power, base, 2, 1)
            if n == 0:
                break


@njit(cache=True, nogil=True, error_model="numpy")
def first_returns(p, start, chatter, image, turns, codes, outcome, time, tangents):
    """First returns of a batch, written into the arrays given; derivatives where `tangents` has a row a state."""
    if WIDE and len(start) >= FEW:
        side_by_side(p, start, chatter, image, turns, codes, outcome, time, tangents)
    else:
        one_by_one(p, start, chatter, image, turns, codes, outcome, time, tangents)


@njit(cache=True, nogil=True, error_model="numpy")
def orbits(p, chatter, states, turns, codes, outcome, time):
    """Orbits of M states, written behind them into states (n + 1, M, 2); how one ended is repeated to the last."""
    n, m = codes.shape
    none = np.empty((0, 2, 2))
    wide = WIDE and m >= FEW
    for i in range(n if wide else 0):
        first_returns(p, states[i], chatter, states[i + 1], turns[i], codes[i], outcome[i], time[i], none)
    for k in range(m):
        v, phi = states[0, k]
        for i in range(n):
            if not wide:
                outcome[i, k], v, phi, turns[i, k, 1], time[i, k], codes[i, k], _ = first_return(p, v, phi, chatter, False)
                turns[i, k, 0], states[i + 1, k, 0], states[i + 1, k, 1] = 0, v, phi
            if i > 0 and outcome[i, k] == INVALID:
                outcome[i, k] = outcome[i - 1, k]
