"""All possible first impacts of a Taylor set of states on its way from a wall.

The set is followed in time. While no state of it can reach a wall, the steps are those of `march.py`, for the least gap and the
least derivatives over all states. Where all states certainly reach the wall ahead, once and without a turning point, the set
lands as a whole. Where only some states may reach it, as next to a grazing state, possible impacts are recorded in short steps of
time, and the set continues as if the wall were absent, until no state of it can still be in flight.
"""

import math

from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.enclosure.arithmetic.balls import NOTHING, badd, between, bplus, bsub, high, low, size
from nsmaps.exact.enclosure.flight.flow import at_time, ball_motion, ball_places, ball_rate
from nsmaps.exact.enclosure.landing import bent, gap_to, landed
from nsmaps.exact.enclosure.subdivide import GONE, LANDED, SPENT, SetFlight
from nsmaps.exact.enclosure.taylor_set import box_of, box_set, launched, put_set, radii, view
from nsmaps.exact.engine.constants import FAR, INWARD, NO_SPEED, SIXTH
from nsmaps.exact.engine.flight.flow import Flow, evaluate, horizon, walls_of
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.march import wall_gap
from nsmaps.exact.engine.steps import closes, first_step, is_converged, safe_step, stays_clear, taylor_root

MOST_LEAPS = 400  # steps of one flight of a Taylor set
CLOSER = 0.125  # steps are abandoned when shorter than this share of the time in which a set passes
CHATTERED = (1.0 + 1e-6) * SUMMED_SPEED  # of the speed gained in a radian: slower impacts on the base wall are summed


@inner
def clear_for(gap, jerk, snap):
    """A time for which the gap certainly stays open, for all states."""
    y = low(gap[0])
    return safe_step(y, low(gap[1]), low(gap[2]), low(gap[3]), jerk, snap) * INWARD if y > 0.0 else 0.0


@inner
def passing(gap):
    """An estimate of the time that a set takes to pass a wall."""
    y, u, b, _ = gap
    return 4.0 * y[1] / (abs(u[0]) + math.sqrt(u[0] * u[0] + 4.0 * y[1] * abs(b[0])) + NO_SPEED)


@inner
def cubic_root(gap, h, x):
    """An estimate of when the gap of the centre closes, near h, within +-x; only the tightness of the result depends on it."""
    y, u, b, j = gap[0][0], gap[1][0], gap[2][0], gap[3][0]
    start = h
    for _ in range(3):
        h -= (y + h * (u + h * (0.5 * b + h * j * SIXTH))) / (u + h * (b + 0.5 * h * j))
    return h if abs(h) <= x else start


@inner
def passed(p, gap, jerk, s, h, row, upper, table, n):
    """Record the possible impacts between s and s + h in row n of a table; returns the number of rows afterwards."""
    y, u, b, _ = gap
    all_h = between(0.0, h)
    rate = bplus(u, bent(b, jerk, all_h), all_h)
    least = low(y) + min(low(u) * h, 0.0) + 0.5 * h * h * min(low(b) - h * jerk, 0.0)
    if least > 1e-13 * (abs(low(y)) + h * size(u)) or low(rate) >= 0.0:
        return n
    omega = ball_rate(p)
    phi = bplus(box_of(row)[1], omega, badd((s, 0.0), all_h))
    put_set(table[n], upper, box_set(between(max(-high(rate), 0.0), max(-low(rate), 0.0)), phi), False)
    return n + 1


@inner
def aimed(p, upper, room, s, x, gap, pop):
    """An estimate of when the centre reaches a wall, near s + x; only the tightness of the result depends on it."""
    flow, root = Flow(p.table, p.table[p.flight :]), s + cubic_root(gap, x, 1.25 * x)
    for _ in range(3):
        there = wall_gap(upper, room[0], room[0], evaluate(flow, root))
        step, rate = taylor_root(there, -there[0] / there[1])
        if not abs(step) <= 0.25 * x:
            break
        root += step
        if is_converged(step, rate, root, pop):
            break
    return root


@inner
def touchdown(p, up, flight, row, upper, room, gap, s, x, jerk, snap, out):
    """Write the impacts of a Taylor set that certainly reaches a wall within 1.25 x: (True if no rate is near zero then, spread
    by x).
    """
    pop = snap * (snap / jerk) ** 2 if jerk > 0.0 else 0.0  # estimate
    root = aimed(p, upper, room, s, x, gap, pop)
    return landed(p, up, flight, row, upper, room, (s, s + 1.25 * x), root, jerk, out)


@inner
def keeps_off(gap, jerk, s, h):
    """True if a gap that does not shrink at first certainly stays open for a time h after s."""
    y, u = low(gap[0]) * INWARD, low(gap[1]) * INWARD
    return (y > 0.0 or s == 0.0) and stays_clear(y, u, low(gap[2]), jerk, h)


@inner
def steps(has_up, has_down, to_up, to_down, jerk, snap, away):
    """Times for which the gaps to the upper and to the lower wall certainly stay open, given a bound `away` on them, or a
    negative number.
    """
    h_up = (away[0] if away[0] >= 0.0 else clear_for(to_up, jerk, snap)) if has_up else FAR
    h_down = (away[1] if away[1] >= 0.0 else clear_for(to_down, jerk, snap)) if has_down else FAR
    return h_up, h_down


@inner
def onward(p, walls, gaps, clear, jerk, s, row, table, n):
    """A step of time for which the walls stay clear, or a short one whose possible impacts are recorded: (the step, rows of the
    table).
    """
    (has_up, has_down), (to_up, to_down), (h_up, h_down) = walls, gaps, clear
    h, pass_by = min(h_up, h_down), passing(to_up if h_up < h_down else to_down)
    if not h > CLOSER * pass_by:
        h = max(2.0 * CLOSER * pass_by, 1e-15 * s)
        if has_up and not h_up > h:
            n = passed(p, to_up, jerk, s, h, row, True, table, n)
        if has_down and not h_down > h:
            n = passed(p, to_down, jerk, s, h, row, False, table, n)
    return h, n


@inlined
def stays(p, up, base_up, own, row):
    """True if some state of a set may stay on the wall that it just hit, or come to rest on it by chatter."""
    slow = up == base_up and low(box_of(row)[0]) * low(ball_rate(p)) <= CHATTERED * -low(own[2])
    return low(own[2]) <= 0.0 and (max(low(own[1]), 0.0) <= NO_SPEED or slow)


@inner
def first_impacts(p, up, row, table):
    """Write all possible first impacts of the set in a row into a table: (the `SetFlight`, the spread by x)."""
    has_up, has_down, base_up = walls_of(p)
    flight, (a, j), jerk, snap = launched(p, up, row)
    room = bsub(*ball_places(p))
    room_up, room_down = NOTHING if up else room, room if up else NOTHING
    motion, s, n, by, narrow = (NOTHING, flight[0], a, j), 0.0, 0, radii(row), True
    own = gap_to(up, NOTHING, motion)
    if stays(p, up, base_up, own, row):
        return SetFlight(SPENT, 0, True), by
    first = first_step(max(low(own[1]), 0.0), low(own[2]), low(own[3]), jerk, snap) * INWARD
    away = (first, -1.0) if up else (-1.0, first)
    for _ in range(2 * MOST_LEAPS):
        to_up, to_down = gap_to(True, room_up, motion), gap_to(False, room_down, motion)
        upper = has_up and (not has_down or to_up[1][0] < 0.0)
        gap, behind, ahead_room = (to_up, to_down, room_up) if upper else (to_down, to_up, room_down)
        surely, x = closes(high(gap[0]), high(gap[1]), high(gap[2]), high(gap[3]), jerk, snap)
        if surely and low(gap[0]) > 0.0 and (not (has_up and has_down) or keeps_off(behind, jerk, s, 1.25 * x)):
            steep, by = touchdown(p, up, flight, row, upper, ahead_room, gap, s, x, jerk, snap, table[n])
            if steep:
                return SetFlight(LANDED, n + 1, False), by
        if not narrow:
            motion, by = view(p, flight, s)
            narrow = True
            continue
        if (has_up and high(to_up[0]) < 0.0) or (has_down and high(to_down[0]) < 0.0):
            return SetFlight(LANDED, n, False), by
        clear = steps(has_up, has_down, to_up, to_down, jerk, snap, away)
        h, n = onward(p, (has_up, has_down), (to_up, to_down), clear, jerk, s, row, table, n)
        s, away = s + h, (-1.0, -1.0)
        if not s < horizon(p) or n + 2 > len(table):
            return SetFlight(SPENT if s < horizon(p) else GONE, n, True), by
        at_time(p, (s, 0.0))
        motion, narrow = ball_motion(p, p.whole, flight[0], 3), False
    return SetFlight(SPENT, n, True), by
