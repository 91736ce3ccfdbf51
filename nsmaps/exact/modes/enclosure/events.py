"""All possible first events of a set of states in a mode.

The set is followed in time. While no state of it can meet a guard, the steps are those of `engine.march`, for the least values of
functions and derivatives over all states. Where all states certainly meet one guard, once, and no other before it, the set lands
as a whole. Where only some states may meet a guard, or several guards, the states that may do so are enclosed in short steps of
time, and the set continues as if the guards were absent, until no state of it can still be on its way.
"""

import math

from nsmaps.exact.enclosure.subdivide import GONE, LANDED, SPENT
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.steps import closes
from nsmaps.exact.modes.enclosure.flow import clear_time, flow_to, measure
from nsmaps.exact.modes.enclosure.forms import apply_row, features, same, shave
from nsmaps.exact.modes.enclosure.landing import FALLING, LOOSE, STARTED, landed, passed
from nsmaps.exact.modes.enclosure.tables import CELLS

MOST_LEAPS = 2_000  # steps of one flight of a set
SHORT = 0.125  # steps are abandoned when shorter than this share of the time in which a set passes


@inlined
def is_on(p, known, behind, function):
    """Whether a function is zero at the start of a flight for all states: with the transition behind it, or a start's number."""
    return p.started[behind, function] if known & STARTED else p.on[behind, function]


@inlined
def does_rise(p, known, transition, function):
    """Whether a function that is zero at the start surely does not fall there."""
    return known & FALLING != 0 and p.rises[transition, function]


@inlined
def passing(function, begins, w):
    """An estimate of the time that a set takes to pass a guard."""
    y = 0.5 * (w.high[function, 0] - w.low[function, 0])
    u = 0.5 * (w.high[function, 1] + w.low[function, 1])
    b = 0.5 * (w.high[function, 2] + w.low[function, 2])
    if begins:
        top = max(w.high[function, 1], 0.0) if not w.clear[function] > 0.0 else 0.0
        return 2.0 * top / (abs(b) + math.sqrt(w.jerk[function] * top) + 1e-300)
    return 4.0 * y / (abs(u) + math.sqrt(u * u + 4.0 * y * abs(b)) + 1e-300)


@inlined
def copied(a_set, to):
    """Copy a set."""
    for i in range(len(a_set)):
        same(a_set[i], to[i])


@inlined
def noted(w, number, function, known):
    """Take note of an event in the place `number`, whose set is written; returns the next place."""
    w.met[number, 0], w.met[number, 1] = function, known
    return number + 1


@inlined
def depends(p, function, w):
    """Write how much a function depends on the symbols, the first of which are those of the coordinates."""
    apply_row(p.functions[function, 0], w.z, w.rows[0])
    for c in range(len(w.box.spread)):
        w.box.spread[c] = abs(w.rows[0, 1 + c])


@inner
def at_once(p, mode, part, w):
    """Write the events that take place at the start: (whether all states have one, their number)."""
    a_set, known, behind, number, whole = w.parts[part], w.kind[part, 2], w.kind[part, 1], 0, False
    transition = p.starts[behind] if known & STARTED else behind
    for f in range(p.watched[mode], p.watched[mode + 1]):
        measure(p, f, 1.0, w)
        on = is_on(p, known, behind, f)
        k = 1 if on else 0
        w.proper[f] = (on and does_rise(p, known, transition, f)) or w.low[f, k] > 0.0
        if not w.proper[f]:
            for c in range(len(w.late)):
                w.late[c] = -w.rows[k, c] if c + 1 < len(w.late) else w.rows[k, c]
            copied(a_set, w.hits[number])
            if shave(w.hits[number], w.late, 0.0):
                all_at_once = w.high[f, k] < 0.0
                number = noted(w, number, f, known & LOOSE if all_at_once and number == 0 else LOOSE)
                whole = whole or all_at_once
    if whole and number > 1:
        for k in range(number):
            w.met[k, 1] = LOOSE
    return whole, number


@inner
def surveyed(p, mode, part, s, w):
    """Measure all functions of a mode at the time s: (the function met first, if any; how long all stay clear; how long the
    others do; whether some function is negative for all states).
    """
    known, behind = w.kind[part, 2], w.kind[part, 1]
    transition = p.starts[behind] if known & STARTED else behind
    first, least, second, over = -1, math.inf, math.inf, False
    for f in range(p.watched[mode], p.watched[mode + 1]):
        measure(p, f, 1.0, w)
        begins = s == 0.0 and is_on(p, known, behind, f)
        clear = clear_time(f, begins, begins and does_rise(p, known, transition, f), w)
        w.clear[f] = clear
        over = over or (w.high[f, 0] < 0.0 and not begins)
        if clear < least:
            first, least, second = f, clear, least
        else:
            second = min(second, clear)
    return first, least, second, over


@inner
def recorded(p, mode, part, s, h, number, w):
    """Write the possible events between s and s + h; returns their number with those before."""
    for f in range(p.watched[mode], p.watched[mode + 1]):
        near, room = w.clear[f] <= h, number + 1 < len(w.hits)
        if near and room and passed(p, mode, f, s, h, w.proper[f], w.parts[part], w, w.hits[number]):
            number = noted(w, number, f, (FALLING if w.proper[f] else 0) | LOOSE)
    return number


@inner
def first_events(p, mode, part, w):
    """Write all possible first events of a part into `hits` and `met`: (how its flight ended, their number)."""
    n = p.resets.shape[1]
    features(w.parts[part], w.start, n)
    flow_to(p, mode, 0.0, w)
    done, number = at_once(p, mode, part, w)
    if done:
        return LANDED, number
    s, known = 0.0, w.kind[part, 2]
    for _ in range(MOST_LEAPS):
        first, clear, second, over = surveyed(p, mode, part, s, w)
        if over:
            return LANDED, number
        h = min(clear, 1.0)
        if first >= 0 and clear < 1.0:
            f, begins = first, s == 0.0 and is_on(p, known, w.kind[part, 1], first)
            surely, x = closes(w.high[f, 0], w.high[f, 1], w.high[f, 2], w.high[f, 3], w.jerk[f], w.snap[f])
            if surely and not begins and w.low[f, 0] > 0.0 and 1.25 * x < min(second, 1.0):
                depends(p, f, w)
                if landed(p, mode, f, s + x, s, s + 1.25 * x, w.parts[part], w, w.hits[number]):
                    return LANDED, noted(w, number, f, FALLING | (LOOSE if number > 0 else known & LOOSE))
                flow_to(p, mode, s, w)
                first, clear, second, over = surveyed(p, mode, part, s, w)
            short = SHORT * passing(f, begins, w)
            if not h > short:
                h = min(max(2.0 * short, 1e-15 * s), 1.0)
                if h == 0.0:
                    return SPENT, number
                depends(p, f, w)
                number = recorded(p, mode, part, s, h, number, w)
        s += h
        if not s < p.last[mode] or not s < CELLS * CELLS - 1 or number + 2 > len(w.hits):
            return GONE if not s < p.last[mode] else SPENT, number
        flow_to(p, mode, s, w)
    return SPENT, number
