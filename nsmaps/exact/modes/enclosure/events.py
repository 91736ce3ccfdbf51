"""All possible first events of a set of states in a mode: see `enclosure.first_events`."""

import math
from typing import NamedTuple

from nsmaps.exact.enclosure.first_events import follow_flight, passing_time, step_within
from nsmaps.exact.enclosure.subdivide import LANDED, SPENT, SetFlight
from nsmaps.exact.engine.constants import LATEST, NO_SPEED
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.steps import closes
from nsmaps.exact.modes.enclosure.flow import clear_time, flow_to, measure, span
from nsmaps.exact.modes.enclosure.forms import SYMBOLS, apply_row, copy_set, put_features, shave
from nsmaps.exact.modes.enclosure.landing import enclose_passage, land_set
from nsmaps.exact.modes.enclosure.memory import BEHIND, EVENT_FUNCTION, EVENT_KNOWN, KNOWN, MODE
from nsmaps.exact.modes.enclosure.tables import BEND, CELLS, JERK, RATE, VALUE

STARTED, FALLING, LOOSE = 1, 2, 4  #: of a set: at the section; the function of its event fell; a box, or a part of a set
LONGEST = 1.0  #: step, in cells


class ModeFlight(NamedTuple):
    """The flight of a set in a mode."""

    part: int  #: place of the set in flight
    mode: int
    known: int  #: of the set: see `STARTED`
    behind: int  #: the transition behind the set, or the number of its start
    transition: int  #: that of the start too
    last: float  #: longest flight that is followed, in cells


class GuardSurvey(NamedTuple):
    """The guards of a mode at a time."""

    time: float  #: since the start of the flight, in cells
    surely: bool  #: whether all states certainly meet one guard, once and no other before it
    over: bool  #: whether some function is negative for all states
    wide: bool  #: whether the set is surveyed anew where it does not land
    function: int  #: that may be met first, -1 for none
    begins: bool  #: whether it is zero now, at the start
    clear: float  #: how long all are certainly positive
    reach: float  #: if all states surely meet it, they do so within `LATEST` times this time


@inlined
def is_on(p, flight, function):
    """Whether a function is zero at the start of a flight for all states."""
    return p.started[flight.behind, function] if flight.known & STARTED else p.on[flight.behind, function]


@inlined
def does_rise(p, flight, function):
    """Whether a function that is zero at the start surely does not fall there."""
    return flight.known & FALLING != 0 and p.rises[flight.transition, function]


@inlined
def time_to_pass(near, w):
    """An estimate of the time that a set takes to pass the nearest guard."""
    f = near.function
    u = 0.5 * (w.high[f, RATE] + w.low[f, RATE])
    b = 0.5 * (w.high[f, BEND] + w.low[f, BEND])
    if near.begins:
        top = max(w.high[f, RATE], 0.0) if not w.clear[f] > 0.0 else 0.0
        return 2.0 * top / (abs(b) + math.sqrt(w.jerk[f] * top) + NO_SPEED)
    return passing_time(0.5 * (w.high[f, VALUE] - w.low[f, VALUE]), u, b)


@inlined
def put_event(w, number, function, known):
    """Write the function of an event whose set is written, and what is known of it."""
    w.events[number, EVENT_FUNCTION], w.events[number, EVENT_KNOWN] = function, known


@inlined
def put_spread(form, w):
    """Write how much a form depends on each coordinate: the first symbols are theirs."""
    for c in range(len(w.box.spread)):
        w.box.spread[c] = abs(form[SYMBOLS + c])


@inlined
def spread_by_guard(p, function, w):
    """Write how much a function depends on the coordinates."""
    value = w.rows[VALUE]
    apply_row(p.functions[function, VALUE], w.z, value)
    put_spread(value, w)


@inner
def events_at_once(p, flight, w):
    """Write the events that take place at the start: (whether all states have one, their number)."""
    known, number, whole, delay = flight.known, 0, False, w.delay
    for f in span(p.table.watched, flight.mode):
        measure(p, f, LONGEST, w)
        on = is_on(p, flight, f)
        k = RATE if on else VALUE
        w.proper[f] = (on and does_rise(p, flight, f)) or w.low[f, k] > 0.0
        if not w.proper[f]:
            for c in range(len(delay)):
                delay[c] = -w.rows[k, c] if c + 1 < len(delay) else w.rows[k, c]
            copy_set(w.parts[flight.part], w.hits[number])
            if shave(w.hits[number], delay, 0.0):
                all_at_once = w.high[f, k] < 0.0
                put_event(w, number, f, known & LOOSE if all_at_once and number == 0 else LOOSE)
                number += 1
                whole = whole or all_at_once
    if whole and number > 1:
        for k in range(number):
            w.events[k, EVENT_KNOWN] = LOOSE
    return whole, number


@inner
def survey_guards(p, flight, s, narrow, w):
    """The `GuardSurvey` of a mode at the time s, with all functions measured."""
    if s > 0.0 or narrow:
        flow_to(p, flight.mode, s, w)
    f, least, second, over = -1, math.inf, math.inf, False
    for k in span(p.table.watched, flight.mode):
        measure(p, k, LONGEST, w)
        begins = s == 0.0 and is_on(p, flight, k)
        clear = clear_time(k, begins, begins and does_rise(p, flight, k), w)
        w.clear[k] = clear
        over = over or (w.high[k, VALUE] < 0.0 and not begins)
        if clear < least:
            f, least, second = k, clear, least
        else:
            second = min(second, clear)
    surely, begins, x = False, False, 0.0
    if f >= 0 and least < LONGEST:
        begins = s == 0.0 and is_on(p, flight, f)
        surely, x = closes(w.high[f, VALUE], w.high[f, RATE], w.high[f, BEND], w.high[f, JERK], w.jerk[f], w.snap[f])
        surely = surely and not (begins or over or narrow) and w.low[f, VALUE] > 0.0 and LATEST * x < min(second, LONGEST)
    return GuardSurvey(s, surely, over, surely, f, begins, least, x)


@inner
def land_on_guard(p, flight, near, number, w):
    """Write the set at the guard that all states meet; returns whether that is proved."""
    spread_by_guard(p, near.function, w)
    if not land_set(p, flight, near, w, w.hits[number]):
        return False
    put_event(w, number, near.function, FALLING | (LOOSE if number > 0 else flight.known & LOOSE))
    return True


@inner
def record_events(p, flight, near, h, number, w):
    """Write the possible events within a time h; returns their number with those before."""
    for f in span(p.table.watched, flight.mode):
        possible = w.clear[f] <= h and number + 1 < len(w.hits)
        if possible and enclose_passage(p, flight, near, f, h, w, w.hits[number]):
            put_event(w, number, f, (FALLING if w.proper[f] else 0) | LOOSE)
            number += 1
    return number


@inner
def take_step(p, flight, near, number, w):
    """(A step of time for which the guards stay clear, or a short one; the number of events with those within it)."""
    passing = time_to_pass(near, w) if near.function >= 0 and near.clear < LONGEST else 0.0
    h, short = step_within(near.clear, passing, near.time, LONGEST)
    if short and h > 0.0:
        spread_by_guard(p, near.function, w)
        number = record_events(p, flight, near, h, number, w)
    later = near.time + h
    return (0.0 if later < flight.last and not later < CELLS * CELLS - 1 else h), number


@inner
def first_events(p, part, w):
    """Write all possible first events of a set into `hits` and `events`: the `SetFlight`."""
    mode, known, behind = w.kind[part, MODE], w.kind[part, KNOWN], w.kind[part, BEHIND]
    flight = ModeFlight(part, mode, known, behind, p.table.starts[behind] if known & STARTED else behind, p.last[mode])
    put_features(w.parts[part], w.start, p.table.resets.shape[1])
    flow_to(p, flight.mode, 0.0, w)
    done, number = events_at_once(p, flight, w)
    if done:
        return SetFlight(LANDED, number, False)
    found = follow_flight(p, flight, number, w, survey_guards, land_on_guard, take_step)
    lost = found.ended == LANDED and found.events == 0 and flight.known & STARTED != 0
    return SetFlight(SPENT if lost else found.ended, found.events, lost or found.missing)
