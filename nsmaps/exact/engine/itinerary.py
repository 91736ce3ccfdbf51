"""The itinerary of a return: the turning points of its flights, and their least distance from a wall that they do not meet."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.constants import MOST_IMPACTS, MOST_STEPS, ROUNDING
from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.derivatives import tangent_at
from nsmaps.exact.engine.flight.flow import angle, evaluate, on_top, start, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.observers import BASE, OTHER, advance_tangent, base_of, mark_of
from nsmaps.exact.engine.returns import (
    ESCAPED,
    FOREVER,
    IMPACT,
    INVALID,
    LOST,
    PHASE,
    REST,
    RETURNED,
    SPEED,
    UNDECIDED,
    Impact,
    append_symbol,
    follow,
    next_impact,
    phase_at,
)
from nsmaps.exact.engine.steps import closes, first_step, safe_step

TURNS = 2  # letters of itineraries besides those of words: turning points, high and low


@inner
def next_turn(p, s, h, end):
    """The first zero of the velocity after s + h and before `end`, or infinity: the march for the derivative of the gap."""
    for _ in range(MOST_STEPS):
        s += h
        if s >= end:
            return math.inf
        _, v, a, j, k, _ = evaluate(p, s)
        sign = 1.0 if v > 0.0 else -1.0
        _, snap, crackle, _, reach, _, _ = limits(p, s)
        surely, h = closes(sign * v, sign * a, sign * j, sign * k, snap, crackle)
        h = h if surely else safe_step(sign * v, sign * a, sign * j, sign * k, snap, crackle)
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


class Itinerary(NamedTuple):
    """The turning points of the flights of a motion, and the one with the least gap to the wall ahead."""

    code: int  #: see `nsmaps.exact.words`
    place_value: int  #: as in `Word`
    turning_points: int
    slowest: float  #: least impact speed, infinite without an impact
    gap: float  #: least gap to the wall ahead at a turning point, infinite without one
    gap_time: float  #: of this turning point, since the impact before it
    gap_up: bool  #: True if it is before the upper wall
    gap_flight: int  #: the number of its flight
    flights: int


@inner
def with_turning_points(p, impact, event, found):
    """An itinerary with the turning points of the flight after an impact, which `p` holds."""
    top, bottom = wall_places(p)
    z = top if impact.up else bottom
    has_up, has_down, _ = walls_of(p)
    w, base = event.velocity, base_of(p) + TURNS
    a, j, k, _ = start(p)
    h = after_turn(p, 0.0, a, j, k) if w == 0.0 else 0.0
    s = 0.0
    before = w if w != 0.0 else (a if a != 0.0 else j)
    for _ in range(MOST_STEPS):
        s = next_turn(p, s, h, event.time)
        if s == math.inf:
            break
        d, _, a, j, k, _ = evaluate(p, s)
        up = before > 0.0
        gap, at, gap_up, flight = found.gap, found.gap_time, found.gap_up, found.gap_flight
        room = (top - z) - d if up else (z - bottom) + d
        if room < gap and ((has_up and up) or (has_down and before < 0.0)):
            gap, at, gap_up, flight = room, s, up, found.flights
        code, place_value = append_symbol(found.code, found.place_value, base, base - 2 if up else base - 1, 1)
        found = Itinerary(code, place_value, found.turning_points + 1, found.slowest, gap, at, gap_up, flight, found.flights)
        before = -before
        h = after_turn(p, s, a, j, k)
    return found


@inner
def extend_itinerary(p, impact, event, context, found):
    """The observer of itineraries."""
    letter, slowest = BASE if event.up == on_top(p) else OTHER, found.slowest
    if event.ended in (FOREVER, ESCAPED):
        return found
    if event.ended == IMPACT:
        found, slowest = with_turning_points(p, impact, event, found), min(slowest, event.speed)
    else:
        letter = mark_of(base_of(p), event.ended)
    code, place_value = append_symbol(found.code, found.place_value, base_of(p) + TURNS, letter, 1)
    gap = found.gap, found.gap_time, found.gap_up, found.gap_flight
    return Itinerary(code, place_value, found.turning_points, slowest, *gap, found.flights + 1)


@inner
def itinerary_of(p, v, phi, chatter):
    """The itinerary of one first return: (outcome, Itinerary); a graze within rounding is not distinguished."""
    code, place_value = append_symbol(0, 1, base_of(p) + TURNS, BASE, 1)
    none = Itinerary(code, place_value, 0, math.inf, math.inf, 0.0, False, 0, 0)
    found, seen = follow(p, Impact(on_top(p), phi, v), chatter, MOST_IMPACTS, extend_itinerary, (), none)
    if found.outcome == INVALID:
        seen = Itinerary(0, 0, 0, math.nan, math.nan, 0.0, False, 0, 0)
    if found.outcome == UNDECIDED:
        return LOST if math.isnan(found.phase) else RETURNED, seen
    return found.outcome, seen


class ItineraryRows(NamedTuple):
    """The itineraries of N first returns, each of shape (N,); fields as in `Itinerary`."""

    outcome: Any
    code: Any
    turning_points: Any
    gap: Any
    slowest: Any


@entry
def itinerary(p, v, phi, chatter):
    """As `itinerary_of`, for Python."""
    return itinerary_of(p, v, phi, chatter)


@entry
def all_itineraries(p, states, chatter, rows):
    """The itineraries of a batch (N, 2), written into the given arrays."""
    for i in range(len(states)):
        rows.outcome[i], found = itinerary_of(p, states[i, SPEED], states[i, PHASE], chatter)
        rows.code[i], rows.turning_points[i] = found.code, found.turning_points
        rows.gap[i], rows.slowest[i] = found.gap, found.slowest


class Prelude(NamedTuple):
    """Impacts before a touch, all on the other wall."""

    impact: Impact  #: the last one
    derivative: tuple[float, float, float, float]  #: of its (speed, phase) by the start, row by row
    slowest: float  #: the least speed of these impacts, NaN if others occur


@inner
def extend_prelude(p, impact, event, context, seen):
    """The observer of the impacts before a touch."""
    if event.ended != IMPACT or event.up == on_top(p) or math.isnan(seen.slowest):
        return Prelude(impact, seen.derivative, math.nan)
    d = advance_tangent(p, impact, event, seen.derivative)
    following = Impact(event.up, phase_at(p, impact.phase, event.time), event.speed)
    return Prelude(following, d, min(seen.slowest, event.speed))


class WallTouch(NamedTuple):
    """A flight at some time, as if there were no wall then; gap and its rate vanish together on a grazing curve."""

    slowest: float  #: least speed of the impacts before, NaN if others occur
    share: float  #: of the time of the flight's own first impact
    gap: float  #: to the upper or the lower wall
    rate: float  #: of the gap
    acceleration: float  #: of the gap
    by_state: tuple[float, float, float, float]  #: derivatives of gap and rate by speed and phase of the start, row by row


@entry
def touch(p, v, phi, s, hits, upper):
    """A flight at time s after an impact on the base wall and `hits` on the other wall, beside the upper or the lower wall."""
    nothing = (math.nan, math.nan, math.nan, math.nan)
    start_at = Impact(on_top(p), phase_at(p, phi, 0.0), v)
    _, seen = follow(p, start_at, 0.0, hits, extend_prelude, (), Prelude(start_at, (1.0, 0.0, 0.0, 1.0), math.inf))
    if math.isnan(seen.slowest):
        return WallTouch(math.nan, 0.0, math.nan, math.nan, math.nan, nothing)
    impact = seen.impact
    top, bottom = wall_places(p)
    z, into = top if impact.up else bottom, 1.0 if impact.up else -1.0
    event = next_impact(p, impact, 0.0)
    share = 0.0 if event.ended in (REST, FOREVER) else event.time / s if event.ended == IMPACT else math.inf
    place, rate, a, _, _, _ = evaluate(p, s)
    z_phi, z_w, v_phi, v_w = tangent_at(p, angle(impact.phase), s)
    side = -1.0 if upper else 1.0
    gap = (top - z) - place if upper else (z - bottom) + place
    d_vv, d_vp, d_pv, d_pp = seen.derivative
    w_v, w_phi = -into * event.slope * d_vv, -into * event.slope * d_vp
    by = (z_w * w_v + z_phi * d_pv, z_w * w_phi + z_phi * d_pp, v_w * w_v + v_phi * d_pv, v_w * w_phi + v_phi * d_pp)
    by_gap_v, by_gap_phi, by_rate_v, by_rate_phi = by
    by_state = (side * by_gap_v, side * by_gap_phi, side * by_rate_v, side * by_rate_phi)
    return WallTouch(seen.slowest, share, gap, side * rate, side * a, by_state)
