"""The first impact of a flight, with a certificate: no step of the march can carry the ball through a wall."""

import math
from typing import NamedTuple

from nsmaps.exact.engine.constants import AMBIGUOUS, BRACKET, DEPTH, FAR, INWARD, MOST_STEPS, OUTWARD, ROUNDING
from nsmaps.exact.engine.flight.bounds import limits, rounding_growth
from nsmaps.exact.engine.flight.flow import evaluate, horizon, start, wall_places, walls_of
from nsmaps.exact.engine.flight.layout import LOCAL
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.steps import (
    Gap,
    careful_step,
    departure,
    first_step,
    is_converged,
    safe_step,
    surely_reached,
    taylor_root,
)


class Bracket(NamedTuple):
    """Where a single root of a gap lies."""

    s: float  #: time
    x: float  #: from there to the root, to first order
    step: float  #: from there to the root of the gap's Taylor polynomial
    rate: float  #: of the polynomial there
    low: float  #: time before the root
    high: float  #: time after it


class FirstImpact(NamedTuple):
    """The end of a flight."""

    found: bool
    up: bool  #: on the upper wall
    time: float  #: of the flight
    speed: float
    undecided: bool  #: a wall is passed or met within rounding of a graze


@inlined
def wall_gap(to_up, room, motion):
    """The gap to a wall and its derivatives, from those of the displacement; `room` is its distance from the start."""
    d, v, a, j, k, q = motion
    return Gap(room - d, -v, -a, -j, -k, -q) if to_up else Gap(room + d, v, a, j, k, q)


@inlined
def close_in(p, to_up, room, at):
    """Move to the root of the last Taylor polynomial, and compute the root of the next.

    Steps that leave the bracket, or do not shrink, bisect it.
    """
    low, high = at.low, at.high
    s = at.s + (at.step if low < at.s + at.step and at.s + at.step < high else (low + high) * 0.5 - at.s)
    gap = wall_gap(to_up, room, evaluate(p, s))
    low, high = s if gap.size > 0.0 else low, high if gap.size > 0.0 else s
    newton = -gap.size / gap.rate
    x = newton if abs(newton) < 0.5 * abs(at.x) else (low + high) * 0.5 - s
    step, rate = taylor_root(gap, x)
    return Bracket(s, x, step, rate, low, high)


@inlined
def refine(p, to_up, room, s, x, gap, pop):
    """The single crossing of a gap with these rates between s and s + BRACKET x, to rounding: (its time, the gap's rate)."""
    step, rate = taylor_root(gap, x)
    at = Bracket(s, x, step, rate, s, s + BRACKET * x)
    for _ in range(200):
        if is_converged(at.step, at.rate, at.s, pop):
            break
        at = close_in(p, to_up, room, at)
    return at.s + at.step, at.rate


@inlined
def gap_ahead(has_up, has_down, motion, up, room_up, room_down, size):
    """A motion relative to the walls: (towards the upper wall, gap ahead and its rates, bound on its error, least gap behind).

    Rounding errors are bounded relative to the sizes of the displacement's terms in the gap to the wall just left, and relative
    to the distance of the walls besides in that to the other.
    """
    d, v, _, _, _, _ = motion
    to_up = has_up and (v > 0.0 or not has_down)
    near = ROUNDING * size
    far = near + ROUNDING * (room_up + room_down)
    behind = (room_down + d if to_up else room_up - d) - (far if to_up == up else near)
    return to_up, wall_gap(to_up, room_up if to_up else room_down, motion), near if to_up == up else far, max(behind, 0.0)


@inlined
def is_ambiguous(rate, size, bound, room, way, grown_error):
    """True if an impact is within the rounding of the gap: an arc rate^2/(2 bound) deep or more, or the way flown to it.

    `size` is that of the displacement's terms, `room` the distance to the wall, zero for that just left, `way` the distance flown
    at the speed of the start, and `grown_error` the size to which rounding errors at the start have grown.
    """
    error = ROUNDING * (size + room)
    return rate * rate <= DEPTH * (error + grown_error) * bound or error > AMBIGUOUS * max(room, way)


@inlined
def wall_distances(p, up):
    """The place of a wall, and the distances from there to the upper and to the lower wall."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    return z, top - z, z - bottom


@inlined
def first_gap(p, up, w):
    """The gap to the wall just left with velocity w, and its rates."""
    gap = wall_gap(up, 0.0, (0.0, w, *start(p)))
    if gap.rate == 0.0 and gap.acceleration < 0.0:
        return Gap(0.0, 0.0, 0.0, gap.jerk, gap.snap, gap.crackle)  # released: the acceleration is zero up to rounding
    return gap


@inlined
def departure_within(two, gap, room, bounds):
    """As `departure`, whose return is only certain within the reach of the bounds."""
    jerk, snap = bounds.jerk * OUTWARD, bounds.snap * OUTWARD
    surely, h = departure(two, gap, room, jerk, snap)
    if surely and BRACKET * h > bounds.reach:
        surely, h = False, first_step(gap.rate, gap.acceleration, gap.jerk, jerk, snap)
        h = min(h, safe_step(room, -gap.rate, -gap.acceleration, -gap.jerk, jerk, snap)) if two else h
    return surely, h


@inner
def first_impact(p, up, w):
    """The first impact after leaving a wall with velocity w.

    A march: no step can carry the gap to either wall through zero, and steps converge to a root at third order. It ends where the
    wall is certainly reached, once and without a turning point: then the root is refined to rounding. Rounding is accounted for:
    bounds are enlarged, steps shortened, and the gap is reduced by a bound on its error, which is relative for the wall just
    left. Bounds hold for a reach, which is infinite except for flights that may grow; no step exceeds it. The growth of rounding
    errors of the start counts too; where it hides which wall is met, the flight is undecided, and is followed as computed in
    floats.
    """
    z, room_up, room_down = wall_distances(p, up)
    has_up, has_down, _ = walls_of(p)
    two = has_up and has_down
    to_up, s, undecided, error, max_time, growing = up, 0.0, False, 0.0, horizon(p), p.table[LOCAL] > 0.0
    bounds, gap = limits(p, 0.0), first_gap(p, up, w)
    surely, h = departure_within(two, gap, room_up + room_down, bounds)
    for _ in range(MOST_STEPS):
        if surely or (h <= ROUNDING * s and gap.size <= 0.0):
            rate = gap.rate
            if surely:
                s, rate = refine(p, to_up, room_up if to_up else room_down, s, h, gap, bounds.pop * OUTWARD)
            if s > max_time:
                break
            bounds = limits(p, s)
            room, way = 0.0 if to_up == up else room_up + room_down, s * max(abs(w), abs(rate))
            grown_error = rounding_growth(p, z, s, ROUNDING) if growing else 0.0
            undecided = undecided or is_ambiguous(rate, bounds.size, bounds.acceleration, room, way, grown_error)
            return FirstImpact(True, to_up, s, max(-rate, 0.0), undecided)
        if h <= ROUNDING * s:
            undecided = True  # a graze within rounding: pass it, to where the wall recedes again
            h = 4 * ROUNDING * s
            if gap.acceleration > 0.0:
                h += 2.0 * (abs(gap.rate) + math.sqrt(2.0 * gap.acceleration * error)) / gap.acceleration
        s += min(h, bounds.reach) * INWARD
        if not s < max_time:
            break
        bounds = limits(p, s)
        if not bounds.size < FAR:
            break  # it has grown beyond the range of floats
        jerk, snap = bounds.jerk * OUTWARD, bounds.snap * OUTWARD
        to_up, gap, error, behind = gap_ahead(has_up, has_down, evaluate(p, s), up, room_up, room_down, bounds.size)
        if growing:
            grown_error = rounding_growth(p, z, s, ROUNDING)
            growing = grown_error < gap.size and (grown_error < behind or not two)
            undecided, error, behind = undecided or not growing, error + growing * grown_error, behind - growing * grown_error
        surely, h = surely_reached(two, gap.size + error, behind, gap, jerk, snap)
        if not surely or BRACKET * h > bounds.reach:
            surely, h = False, careful_step(two, max(gap.size - error, 0.0), behind, gap, jerk, snap)
    return FirstImpact(False, up, s, 0.0, undecided)
