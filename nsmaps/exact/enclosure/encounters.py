"""All possible first impacts of a Taylor set of states on its way from a wall: see `first_events`."""

from typing import NamedTuple

from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.enclosure.arithmetic.balls import ZERO, badd, between, bplus, bsub, exact, high, low, size
from nsmaps.exact.enclosure.first_events import follow_flight, passing_time, step_within
from nsmaps.exact.enclosure.flight.flow import at_time, ball_motion, ball_places, ball_rate
from nsmaps.exact.enclosure.landing import Gap, Impact, bend_within, gap_to, land_set
from nsmaps.exact.enclosure.subdivide import CODE, SPENT, SetFlight
from nsmaps.exact.enclosure.taylor_set import box_of, box_set, launch_set, narrow_motion, put_set
from nsmaps.exact.engine.constants import FAR, FOURTH, INWARD, LATEST, NO_SPEED, SIXTH
from nsmaps.exact.engine.flight.flow import Flow, evaluate, horizon, walls_of
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.march import wall_gap
from nsmaps.exact.engine.observers import BASE
from nsmaps.exact.engine.returns import PHASE, SPEED
from nsmaps.exact.engine.steps import closes, first_step, is_converged, safe_step, stays_clear, taylor_root

CHATTERED = (1.0 + 1e-6) * SUMMED_SPEED  #: of the speed gained in a radian: slower impacts on the base wall are summed
SURELY_OPEN = 1e-13  #: of the terms of a gap: a lower bound above it is beyond their rounding
MOST_AIMS = 3  #: of Newton's method for the time at which the centre lands


class WallSurvey(NamedTuple):
    """The gaps of a set at a time."""

    time: float
    surely: bool  #: whether all states certainly reach the wall ahead, once and before the other
    over: bool  #: whether the set is beyond a wall
    wide: bool  #: whether narrower gaps are known
    reach: float  #: if they surely reach the wall, they do so within `LATEST` times this time
    upper: bool  #: whether the wall ahead is the upper one
    up: Gap  #: to the upper wall
    down: Gap  #: to the lower wall


@inner
def clear_time(gap, launch):
    """A time for which the gap certainly stays open, for all states."""
    y = low(gap.y)
    return safe_step(y, low(gap.u), low(gap.b), low(gap.j), launch.jerk, launch.snap) * INWARD if y > 0.0 else 0.0


@inner
def cubic_root(gap, h, x):
    """An estimate of when the gap of the centre closes, near h, within +-x; only the tightness of the result depends on it."""
    y, u, b, j = gap.y.centre, gap.u.centre, gap.b.centre, gap.j.centre
    start = h
    for _ in range(MOST_AIMS):
        h -= (y + h * (u + h * (0.5 * b + h * j * SIXTH))) / (u + h * (b + 0.5 * h * j))
    return h if abs(h) <= x else start


@inner
def record_passage(p, launch, near, upper, h, w, n):
    """Write the possible impacts on a wall within a time h in row n of the hits; returns the number of rows afterwards."""
    y, u, b, _ = near.up if upper else near.down
    jerk = launch.jerk
    all_h = between(0.0, h)
    rate = bplus(u, bend_within(b, jerk, all_h), all_h)
    least = low(y) + min(low(u) * h, 0.0) + 0.5 * h * h * min(low(b) - h * jerk, 0.0)
    if least > SURELY_OPEN * (abs(low(y)) + h * size(u)) or low(rate) >= 0.0:
        return n
    _, phi = box_of(w.parts[launch.part])
    phi = bplus(phi, ball_rate(p), badd(exact(near.time), all_h))
    put_set(w.hits[n], upper, box_set(between(max(-high(rate), 0.0), max(-low(rate), 0.0)), phi), False)
    return n + 1


@inlined
def rooms_of(p, up):
    """The distances of the upper and the lower wall from the one that a flight leaves."""
    room = bsub(*ball_places(p))
    return (ZERO, room) if up else (room, ZERO)


@inner
def landing_time(p, launch, near, gap):
    """An estimate of when the centre reaches the wall ahead; only the tightness of the result depends on it."""
    flow, x, room = Flow(p.table, p.table[p.flight :]), near.reach, bsub(*ball_places(p)).centre
    jerk, snap = launch.jerk, launch.snap
    pop, root = snap * (snap / jerk) ** 2 if jerk > 0.0 else 0.0, near.time + cubic_root(gap, x, LATEST * x)
    far = 0.0 if near.upper == launch.up else room
    for _ in range(MOST_AIMS):
        there = wall_gap(near.upper, far, evaluate(flow, root))
        step, rate = taylor_root(there, -there.size / there.rate)
        if not abs(step) <= FOURTH * x:
            break
        root += step
        if is_converged(step, rate, root, pop):
            break
    return root


@inlined
def keep_spread(launch, w, by):
    """Keep the spread by each coordinate of the first flight of a cell."""
    if launch.first:
        w.box.spread[SPEED], w.box.spread[PHASE] = by


@inner
def land_on_wall(p, launch, near, number, w):
    """Write the impacts of a Taylor set that certainly reaches the wall ahead: True if no rate is near zero."""
    gap = near.up if near.upper else near.down
    room_up, room_down = rooms_of(p, launch.up)
    room, root = room_up if near.upper else room_down, landing_time(p, launch, near, gap)
    impact = Impact(near.upper, room, near.time, near.time + LATEST * near.reach, root)
    steep, by = land_set(p, launch, impact, w.parts[launch.part], w.hits[number])
    keep_spread(launch, w, by)
    return steep


@inner
def stays_open(gap, jerk, s, h):
    """True if a gap that does not shrink at first certainly stays open for a time h after s."""
    y, u = low(gap.y) * INWARD, low(gap.u) * INWARD
    return (y > 0.0 or s == 0.0) and stays_clear(y, u, low(gap.b), jerk, h)


@inner
def survey_walls(p, launch, s, narrow, w):
    """The `WallSurvey` of a set at the time s."""
    has_up, has_down, _ = walls_of(p)
    motion = launch.start
    if narrow:
        motion, by = narrow_motion(p, launch, s)
        keep_spread(launch, w, by)
    elif s > 0.0:
        at_time(p, exact(s))
        motion = ball_motion(p, p.whole, launch.w, 3)
    room_up, room_down = rooms_of(p, launch.up)
    up, down = gap_to(True, room_up, motion), gap_to(False, room_down, motion)
    upper = has_up and (not has_down or up.u.centre < 0.0)
    gap, behind = (up, down) if upper else (down, up)
    surely, x = closes(high(gap.y), high(gap.u), high(gap.b), high(gap.j), launch.jerk, launch.snap)
    surely = surely and low(gap.y) > 0.0
    surely = surely and (not (has_up and has_down) or stays_open(behind, launch.jerk, s, LATEST * x))
    over = (has_up and high(up.y) < 0.0) or (has_down and high(down.y) < 0.0)
    return WallSurvey(s, surely, over, s > 0.0 and not narrow, x, upper, up, down)


@inlined
def first_clear_time(launch):
    """A time for which the gap to the wall that a flight leaves certainly stays open, for all states."""
    gap = gap_to(launch.up, ZERO, launch.start)
    return first_step(max(low(gap.u), 0.0), low(gap.b), low(gap.j), launch.jerk, launch.snap) * INWARD


@inner
def take_step(p, launch, near, number, w):
    """(A step of time for which the walls stay clear, or a short one; the number of impacts with those within it)."""
    has_up, has_down, _ = walls_of(p)
    first, leaves_up = near.time == 0.0, launch.up
    h_up = FAR if not has_up else first_clear_time(launch) if first and leaves_up else clear_time(near.up, launch)
    h_down = FAR if not has_down else first_clear_time(launch) if first and not leaves_up else clear_time(near.down, launch)
    gap = near.up if h_up < h_down else near.down
    passing = passing_time(gap.y.radius, gap.u.centre, gap.b.centre)
    h, short = step_within(min(h_up, h_down), passing, near.time, FAR)
    if short and has_up and not h_up > h:
        number = record_passage(p, launch, near, True, h, w, number)
    if short and has_down and not h_down > h:
        number = record_passage(p, launch, near, False, h, w, number)
    return h, number


@inlined
def may_stay(p, launch, row):
    """True if some state of a set may stay on the wall that it just hit, or come to rest on it by chatter."""
    _, _, base_up = walls_of(p)
    gap, (v, _) = gap_to(launch.up, ZERO, launch.start), box_of(row)
    slow = launch.up == base_up and low(v) * low(ball_rate(p)) <= CHATTERED * -low(gap.b)
    return low(gap.b) <= 0.0 and (max(low(gap.u), 0.0) <= NO_SPEED or slow)


@inner
def first_impacts(p, part, w):
    """Write all possible first impacts of a set that waits, and its spread by each coordinate."""
    row, first = w.parts[part], w.box.words[part, CODE] == BASE
    launch = launch_set(p, part, first, row, horizon(p))
    keep_spread(launch, w, launch.r)
    if may_stay(p, launch, row):
        return SetFlight(SPENT, 0, True)
    return follow_flight(p, launch, 0, w, survey_walls, land_on_wall, take_step)
