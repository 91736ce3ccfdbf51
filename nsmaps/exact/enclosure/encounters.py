"""All that may be the first impacts of a swarm on its way from a wall.

A march in time: as long as no state of the swarm can meet a wall, steps are those of `march.py`, for the least gap and the
least rates of all states. Where all surely meet the wall ahead, once and without a turn, the swarm lands there as a whole.
Where only some may, as next to a graze, what may is put down in short steps of time, and the swarm flies on as if it had not
been there, until none of it can be on its way any more.
"""

import math

from nsmaps.exact.enclosure.balls import NOTHING, badd, between, bmul, bsub, high, low, size
from nsmaps.exact.enclosure.flow import at_time, ball_motion, ball_places, ball_rate
from nsmaps.exact.enclosure.taylor_set import bent, box_swarm, gap_to, landed, launched, put_swarm, view
from nsmaps.exact.engine.flow import horizon, walls_of
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.march import FAR, INWARD, SIXTH, closes, first_step, safe_step
from nsmaps.exact.engine.returns import NO_SPEED

MOST_LEAPS = 400  # steps of one flight of a swarm
CLOSER = 0.125  # steps are cut off where they get shorter than this share of the time in which a swarm passes
CHATTERED = 1.000001e-12  # impacts on the base wall up to this speed, of that gained in a radian, `first_return` sums up
LANDED, RESTED, GONE, SPENT = 0, 1, 2, 3  # how the flight of a swarm ended; all but the first: perhaps of some states only


@inner
def clear_for(gap, jerk, snap):
    """For how long the gap surely stays open, for all states."""
    y = low(gap[0])
    return safe_step(y, low(gap[1]), low(gap[2]), low(gap[3]), jerk, snap) * INWARD if y > 0.0 else 0.0


@inner
def passing(gap):
    """About how long a swarm takes to pass a wall."""
    y, u, b, _ = gap
    return 4.0 * y[1] / (abs(u[0]) + math.sqrt(u[0] * u[0] + 4.0 * y[1] * abs(b[0])) + NO_SPEED)


@inner
def cubic_root(gap, h, x):
    """About when the gap of the centre closes, near h, within +-x; only the tightness of what follows rests on it."""
    y, u, b, j = gap[0][0], gap[1][0], gap[2][0], gap[3][0]
    start = h
    for _ in range(3):
        h -= (y + h * (u + h * (0.5 * b + h * j * SIXTH))) / (u + h * (b + 0.5 * h * j))
    return h if abs(h) <= x else start


@inner
def passed(p, gap, jerk, s, h, swarm, upper, table, n):
    """Put the impacts that there may be between s and s + h into row n of a table; returns how many rows there are then."""
    y, u, b, _ = gap
    all_h = between(0.0, h)
    rate = badd(u, bmul(bent(b, jerk, all_h), all_h))
    least = low(y) + min(low(u) * h, 0.0) + 0.5 * h * h * min(low(b) - h * jerk, 0.0)
    if least > 1e-13 * (abs(low(y)) + h * size(u)) or low(rate) >= 0.0:
        return n
    omega = ball_rate(p)
    phi = badd(swarm[7], bmul(omega, badd((s, 0.0), all_h)))
    put_swarm(table, n, upper, box_swarm(between(max(-high(rate), 0.0), max(-low(rate), 0.0)), phi), False)
    return n + 1


@inner
def touchdown(p, up, flight, swarm, upper, room, gap, s, x, jerk, table, n):
    """Put the impacts of a swarm that surely meets a wall within 1.25 x into row n of a table, if no rate is near zero then."""
    root = s + cubic_root(gap, x, 1.25 * x)
    at_time(p, (root, 0.0))
    root += cubic_root(gap_to(upper, room, ball_motion(p, p.one, flight[1], 3)), 0.0, 0.25 * x)
    tau = bsub(between(s, s + 1.25 * x), (root, 0.0))
    steep, there = landed(p, up, flight, swarm, upper, room, root, tau, jerk)
    if steep:
        put_swarm(table, n, upper, there, True)
    return steep


@inner
def first_impacts(p, up, swarm, table):
    """All that may be the first impacts of a swarm, put into a table: (how its flight ended, rows, spread by x)."""
    has_up, has_down, base_up = walls_of(p)
    flight, jerk, snap = launched(p, up, swarm)
    room = bsub(*ball_places(p))
    room_up, room_down = NOTHING if up else room, room if up else NOTHING
    at_time(p, NOTHING)
    _, _, a, j = ball_motion(p, p.whole, flight[0], 3)
    motion = NOTHING, flight[0], a, j
    own = gap_to(up, NOTHING, motion)
    u = max(low(own[1]), 0.0)
    slow = up == base_up and low(swarm[6]) * low(ball_rate(p)) <= CHATTERED * -low(own[2])
    if low(own[2]) <= 0.0 and (u <= NO_SPEED or slow):
        return RESTED, 0, swarm[5]
    away = first_step(u, low(own[2]), low(own[3]), jerk, snap) * INWARD
    s, n, by = 0.0, 0, swarm[5]
    for _ in range(MOST_LEAPS):
        to_up, to_down = gap_to(True, room_up, motion), gap_to(False, room_down, motion)
        if (has_up and high(to_up[0]) < 0.0) or (has_down and high(to_down[0]) < 0.0):
            return LANDED, n, by
        h_up = (away if s == 0.0 and up else clear_for(to_up, jerk, snap)) if has_up else FAR
        h_down = (away if s == 0.0 and not up else clear_for(to_down, jerk, snap)) if has_down else FAR
        upper = has_up and (not has_down or to_up[1][0] < 0.0)
        gap = to_up if upper else to_down
        surely, x = closes(high(gap[0]), high(gap[1]), high(gap[2]), high(gap[3]), jerk, snap)
        if surely and (h_up if upper else h_down) > 0.0 and 1.25 * x <= (h_down if upper else h_up):
            room = room_up if upper else room_down
            if touchdown(p, up, flight, swarm, upper, room, gap, s, x, jerk, table, n):
                return LANDED, n + 1, by
        h = min(h_up, h_down)
        pass_by = passing(to_up if h_up < h_down else to_down)
        if not h > CLOSER * pass_by:
            h = max(2.0 * CLOSER * pass_by, 1e-15 * s)
            if has_up and not h_up > h:
                n = passed(p, to_up, jerk, s, h, swarm, True, table, n)
            if has_down and not h_down > h:
                n = passed(p, to_down, jerk, s, h, swarm, False, table, n)
        s += h
        if not s < horizon(p):
            return GONE, n, by
        if n + 2 > len(table):
            break
        motion, _, by = view(p, flight, s)
    return SPENT, n, by
