"""From step to step and from impact to impact: several lanes, each of which follows a return of its own."""

import math

from nsmaps.exact.engine.constants import MOST_IMPACTS, TWO_PI
from nsmaps.exact.engine.flight.flow import horizon, phase_rate, walls_of
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import ESCAPED, FOREVER, IMPACT, LOST, RESTS, RETURNED, STUCK, UNDECIDED, onward, spell
from nsmaps.exact.ode.flight import clouded, evaluate, faint, first_impact, propagated, step_size
from nsmaps.exact.ode.impact import carried, held_back, place_at, take_off, through_impact
from nsmaps.exact.ode.layout import (
    BEFORE,
    CLOUDED,
    CODE,
    ELAPSED,
    FLOWN,
    FRESH,
    GRAZES,
    IMPACTS,
    LETTER,
    PHI,
    POWER,
    ROW,
    RUN,
    SLOWEST,
    SPEED,
    STEEP,
    STEP_PHI,
    STEPS,
    STIFF,
    SURE,
    TURNS,
    UNSURE,
    UP,
    WAYS,
)
from nsmaps.exact.ode.memory import at_addresses
from nsmaps.exact.ode.record import IDLE, begin_orbit, finish, letter_at, mark_at, record
from nsmaps.exact.ode.steps.resolution import resolved
from nsmaps.exact.ode.turns import letters, turns_of_step

MOST_STEPS = 100_000  # of one flight
MOST_HALVINGS = 60  # of one step


@inlined
def passed(w, k, s):
    """Let a time s pass from the last impact of lane k to the next, or to its release."""
    lane, count = w.lanes[k], w.counts[k]
    lane[ELAPSED] += s
    lane[PHI], whole = onward(w.p, lane[PHI], s)
    count[TURNS] += whole
    count[IMPACTS] += 1
    count[STEPS] = 0


@inner
def at_wall(w, k, mark):
    """After an impact or a release of lane k: the return ends on the base wall, and otherwise the next flight begins."""
    count = w.counts[k]
    on_base = (count[UP] == 1) == walls_of(w.p)[2]
    if len(w.hits):
        if record(w, k, mark):
            take_off(w, k)
        else:
            w.counts[k, ROW] = IDLE
    elif on_base:
        ends_on(w, k, mark)
    elif count[IMPACTS] >= MOST_IMPACTS:
        finish(w, k, LOST, False)
    else:
        take_off(w, k)


@inlined
def ends_on(w, k, mark):
    """End the return of lane k on the base wall."""
    count = w.counts[k]
    if not w.turning:
        count[CODE], count[POWER] = spell(count[CODE], count[POWER], letters(w.p)[0] + 3, count[LETTER], count[RUN])
    finish(w, k, STUCK if mark != IMPACT else UNDECIDED if count[UNSURE] != SURE else RETURNED, True)


@inner
def paused(w, k, ended, s):
    """Lane k rests or chatters for a time s, until its release, or permanently."""
    lane = w.lanes[k]
    if ended == FOREVER:
        if len(w.hits):
            w.hits[w.counts[k, IMPACTS], 4], w.counts[k, ROW] = FOREVER, IDLE
        else:
            finish(w, k, RESTS, False)
        return
    mark_at(w, k, ended)
    for j in range(2 * WAYS):
        lane[BEFORE + j] = math.nan if j % WAYS == 2 else 0.0  # the release does not depend on the state
    lane[SPEED] = 0.0
    passed(w, k, s)
    at_wall(w, k, ended)


@inner
def landed(w, k, now_up, x, doubtful):
    """Lane k meets a wall a time x after the beginning of the step."""
    lane, count = w.lanes[k], w.counts[k]
    a = evaluate(w, k, x)
    propagated(w, k, x)
    speed = max(w.ends[1] if now_up else -w.ends[1], 0.0)
    if doubtful or faint(w, k, a, speed):
        count[UNSURE] = GRAZES
    if clouded(w, k, now_up, x, speed):
        count[UNSURE] = CLOUDED
    piece(w, k, x)
    carried(w, k, x)
    lane[FLOWN] += x
    through_impact(w, k, now_up, a)
    s = lane[FLOWN]
    lane[SPEED], lane[SLOWEST] = speed, min(lane[SLOWEST], speed)
    count[UP] = 1 if now_up else 0
    letter_at(w, k, count[UP])
    passed(w, k, s)
    at_wall(w, k, IMPACT)


@inlined
def flown_on(w, k, h):
    """Lane k meets no wall within a step h: its next step begins there."""
    lane, count = w.lanes[k], w.counts[k]
    evaluate(w, k, h)
    propagated(w, k, h)
    carried(w, k, h)
    piece(w, k, h)
    lane[FLOWN] += h
    lane[STEP_PHI], _ = onward(w.p, lane[PHI], lane[FLOWN])
    w.state[0, k], w.state[1, k] = w.ends[0], w.ends[1]
    count[FRESH] = 0
    count[STEPS] += 1
    place_at(w, k)


@inner
def escaped(w, k):
    """Lane k has no next impact, or none that is known."""
    if len(w.hits):
        w.hits[w.counts[k, IMPACTS], 4], w.counts[k, ROW] = ESCAPED, IDLE
    else:
        finish(w, k, UNDECIDED if w.counts[k, UNSURE] != SURE else LOST, False)


@inlined
def piece(w, k, s):
    """Write a step of time s of lane k, if impacts are recorded."""
    if len(w.hits):
        lane, count = w.lanes[k], w.counts[k]
        w.piece[0, 0], w.piece[0, 1], w.piece[0, 2], w.piece[0, 3] = 1.0, count[IMPACTS], lane[FLOWN], s
        for m in range(w.tc.shape[1]):
            w.piece[1, m], w.piece[2, m] = w.tc[0, m, k], w.tc[1, m, k]


@inner
def ends_aloft(w, k, h):
    """Whether the flight of lane k cannot be continued by a step h, which is then noted."""
    lane, count, tc = w.lanes[k], w.counts[k], w.tc
    if math.isfinite(tc[0, 0, k]) and not (math.isfinite(tc[1, 1, k]) and math.isfinite(tc[1, 2, k])):
        count[UNSURE] = STEEP
        return True
    if count[STEPS] > MOST_STEPS:
        count[UNSURE] = STIFF
        return True
    finite = math.isfinite(tc[0, 0, k]) and math.isfinite(tc[1, tc.shape[1] - 1, k])
    return not (finite and h > 0.0) or lane[FLOWN] >= horizon(w.p)


@inner
def first_in_step(w, k, h):
    """The first impact of lane k within a step h, as `first_impact`, and the length of a step that is the flight, or zero."""
    found, now_up, x, doubtful = first_impact(w, k, h)
    for _ in range(MOST_HALVINGS):
        if resolved(w, k, x):
            return found, now_up, x, doubtful
        found, now_up, x, doubtful = first_impact(w, k, 0.5 * x)
    return False, now_up, 0.0, doubtful


@inner
def one_step(w, k):
    """A step of lane k: what happens first within the reach of its Taylor series."""
    lane, count = w.lanes[k], w.counts[k]
    if count[FRESH] == 1:
        ended, s = held_back(w, k)
        if ended != IMPACT:
            paused(w, k, ended, s)
            return
    h = step_size(w.tc, k, TWO_PI / phase_rate(w.p))
    if ends_aloft(w, k, h):
        escaped(w, k)
        return
    found, now_up, x, doubtful = first_in_step(w, k, h)
    if x == 0.0:
        count[UNSURE] = STEEP
    if x == 0.0 or (found and lane[FLOWN] + x > horizon(w.p)):
        escaped(w, k)
        return
    if w.turning:
        turns_of_step(w, k, x)
    if found:
        landed(w, k, now_up, x, doubtful)
        return
    if doubtful:
        count[UNSURE] = GRAZES
    flown_on(w, k, x)


@entry
def started(w):
    """Let all lanes begin with the first states; returns the number of lanes with a return under way."""
    for k in range(len(w.lanes)):
        begin_orbit(w, k)
        if w.counts[k, ROW] >= 0 and len(w.hits):
            record(w, k, 0)
    return number_busy(w)


@inlined
def number_busy(w):
    """The number of lanes with a return under way."""
    busy = 0
    for k in range(len(w.lanes)):
        busy += 1 if w.counts[k, ROW] >= 0 else 0
    return busy


@entry
def advanced(found, chatter, turning, equation):
    """A step of all lanes of the memory at these addresses, whose Taylor coefficients have been computed.

    Returns the number of lanes still under way.
    """
    w = at_addresses(found, chatter, turning, equation)
    for k in range(len(w.lanes)):
        if w.counts[k, ROW] >= 0:
            one_step(w, k)
    return number_busy(w)
