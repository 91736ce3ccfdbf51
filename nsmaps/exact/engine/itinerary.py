"""The itinerary of a return: the turning points of its flights, and their least distance from a wall that they do not meet."""

import math

from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.flow import angle, begin, evaluate, rebound, start, tangent_at, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.march import MOST_STEPS, ROUNDING, approach, first_step
from nsmaps.exact.engine.returns import (
    CHATTER,
    ESCAPED,
    FOREVER,
    IMPACT,
    INVALID,
    LOST,
    MOST_IMPACTS,
    REST,
    RESTS,
    RETURNED,
    STUCK,
    advance_tangent,
    is_state,
    next_impact,
    onward,
    spell,
)


@inner
def next_turn(p, s, h, end):
    """The first zero of the velocity after s + h and before `end`, or infinity: the march of the flight for the derivative of the
    gap.
    """
    for _ in range(MOST_STEPS):
        s += h
        if s >= end:
            return math.inf
        _, v, a, j, k, _ = evaluate(p, s)
        sign = 1.0 if v > 0.0 else -1.0
        _, snap, crackle, _, reach, _, _ = limits(p, s)
        surely, h = approach(sign * v, sign * a, sign * j, sign * k, snap, crackle)
        if h > reach:
            surely, h = False, reach
        if surely or h <= ROUNDING * s:
            for _ in range(8):
                s += h
                _, v, a, _, _, _ = evaluate(p, s)
                h = -v / a if a != 0.0 else 0.0
                if abs(h) <= ROUNDING * s:
                    break
            return s if s < end else math.inf
    return math.inf


@inner
def after_turn(p, s, rate, j, k):
    """A step from a zero of the velocity, where the acceleration is `rate`, within which there is no other zero."""
    _, snap, crackle, _, reach, _, _ = limits(p, s)
    sign = 1.0 if rate > 0.0 or (rate == 0.0 and j > 0.0) else -1.0
    if rate == 0.0:
        return min(first_step(sign * j, sign * k, 0.0, crackle, math.inf), reach) if crackle > 0.0 else reach
    return min(first_step(sign * rate, sign * j, sign * k, snap, crackle), reach)


@inner
def turns_of_flight(p, up, phi, v, end, code, power, base):
    """The turning points of a flight of time `end`: (code of the itinerary with them, its power, their number, nearest).

    The nearest is the turning point with the least gap to the wall ahead: (the gap, its time, True if before the upper wall).
    """
    top, bottom = wall_places(p)
    z = top if up else bottom
    u, _ = rebound(p, up, v)
    w = -u if up else u
    has_up, has_down, _ = walls_of(p)
    begin(p, angle(phi), z, w)
    a, j, k, _ = start(p)
    h = after_turn(p, 0.0, a, j, k) if w == 0.0 else 0.0
    count, nearest, s = 0, (math.inf, 0.0, False), 0.0
    before = w if w != 0.0 else (a if a != 0.0 else j)
    for _ in range(MOST_STEPS):
        s = next_turn(p, s, h, end)
        if s == math.inf:
            break
        d, _, a, j, k, _ = evaluate(p, s)
        gap = (top - z) - d if before > 0.0 else (z - bottom) + d
        if gap < nearest[0] and ((has_up and before > 0.0) or (has_down and before < 0.0)):
            nearest = (gap, s, before > 0.0)
        count += 1
        code, power = spell(code, power, base, base - 2 if before > 0.0 else base - 1, 1)
        before = -before
        h = after_turn(p, s, a, j, k)
    return code, power, count, nearest


@entry
def itinerary(p, v, phi, chatter):
    """The itinerary of one first return: (outcome, code of the itinerary, turning points, least impact speed, nearest, flight).

    The nearest turning point of all flights is as in `turns_of_flight`, with the number of its flight.
    """
    nearest, flight_of = (math.inf, 0.0, False), 0
    if not is_state(v, phi):
        return INVALID, 0, 0, math.nan, (math.nan, 0.0, False), 0
    phi, _ = onward(p, phi, 0.0)
    has_up, has_down, base_up = walls_of(p)
    walls = 2 if has_up and has_down else 1
    base = walls + 5  # of the itinerary's code: walls, chatter, rest, two turning points, none
    up, turns, slowest = base_up, 0, math.inf
    code, power = spell(0, 1, base, 1, 1)
    for flown in range(MOST_IMPACTS):
        on_base = up == base_up
        ended, now_up, s, now_v, _, _, _ = next_impact(p, up, phi, v, chatter)
        if ended in (FOREVER, ESCAPED):
            return RESTS if ended == FOREVER else LOST, code, turns, slowest, nearest, flight_of
        if ended == IMPACT:
            code, power, more, least = turns_of_flight(p, up, phi, v, s, code, power, base)
            turns, slowest = turns + more, min(slowest, now_v)
            if least[0] < nearest[0]:
                nearest, flight_of = least, flown
            code, power = spell(code, power, base, 1 if now_up == base_up else 2, 1)
        else:
            code, power = spell(code, power, base, walls + (1 if ended == CHATTER else 2), 1)
        phi, _ = onward(p, phi, s)
        v, up = now_v, now_up
        if up == base_up and (ended == IMPACT or on_base):
            return RETURNED if ended == IMPACT else STUCK, code, turns, slowest, nearest, flight_of
    return LOST, code, turns, slowest, nearest, flight_of


@entry
def all_itineraries(p, states, chatter, outcome, codes, turns, clearance, slowest):
    """The itineraries of a batch, written into the given arrays."""
    for i in range(len(states)):
        outcome[i], codes[i], turns[i], slowest[i], nearest, _ = itinerary(p, states[i, 0], states[i, 1], chatter)
        clearance[i] = nearest[0]


@entry
def touch(p, v, phi, s, hits, upper):
    """A flight at time s after `hits` impacts on the other wall, as if there were no wall at s, before the upper or the lower
    wall.

    Returns (least speed of these impacts or NaN if others occur, s as a share of the time of the flight's own first impact, gap,
    rate, acceleration, derivatives of gap and rate by v and phi). Gap and rate vanish together on a grazing curve.
    """
    nothing = (math.nan, math.nan, math.nan, math.nan)
    base_up = walls_of(p)[2]
    up, d, slowest = base_up, (1.0, 0.0, 0.0, 1.0), math.inf
    phi, _ = onward(p, phi, 0.0)
    for _ in range(hits):
        ended, now_up, t, now_v, _, slope, _ = next_impact(p, up, phi, v, 0.0)
        if ended != IMPACT or now_up == base_up:
            return math.nan, 0.0, math.nan, math.nan, math.nan, nothing
        d = advance_tangent(p, up, angle(phi), slope, now_up, t, d)
        phi, _ = onward(p, phi, t)
        v, up, slowest = now_v, now_up, min(slowest, now_v)
    top, bottom = wall_places(p)
    z, into = top if up else bottom, 1.0 if up else -1.0
    ended, _, t, _, _, slope, _ = next_impact(p, up, phi, v, 0.0)
    share = 0.0 if ended in (REST, FOREVER) else t / s if ended == IMPACT else math.inf
    place, rate, a, _, _, _ = evaluate(p, s)
    z_phi, z_w, v_phi, v_w = tangent_at(p, angle(phi), s)
    side = -1.0 if upper else 1.0
    gap = (top - z) - place if upper else (z - bottom) + place
    w_v, w_phi = -into * slope * d[0], -into * slope * d[1]
    by = (z_w * w_v + z_phi * d[2], z_w * w_phi + z_phi * d[3], v_w * w_v + v_phi * d[2], v_w * w_phi + v_phi * d[3])
    return slowest, share, gap, side * rate, side * a, (side * by[0], side * by[1], side * by[2], side * by[3])
