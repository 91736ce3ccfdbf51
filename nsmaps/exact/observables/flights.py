"""Observables of an impact system, summed from impact to impact by an observer of the engine's loop."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.accumulation import accumulation_time
from nsmaps.exact.engine.constants import MOST_IMPACTS
from nsmaps.exact.engine.flight.flow import evaluate, on_top, rebound, start, wall_place
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import CHATTER, ESCAPED, FOREVER, IMPACT, PHASE, SPEED, Impact, follow, phase_at
from nsmaps.exact.observables.sums import LEAST, MOST_CHATTER, at_impact, at_rest, follow_batches, join_panels

PAUSE = 10_000  # returns, within about a second, after which Ctrl-C is heard
V, V_AFTER, PLACE = range(3)  # the inputs of formulas of impacts
AT_PLACE, AT_VELOCITY = range(2)  # and of those of flights


class Flown(NamedTuple):
    """A flight whose coefficients are written, or a rest."""

    p: Any  #: a Flow
    place: float  #: of the wall
    phase: float  #: at the start
    time: float
    flies: bool  #: False: a rest


class Batches(NamedTuple):
    """Which returns count, and where their totals go: B batches of M states; C formulas."""

    discard: int  #: returns before the first batch
    length: int  #: returns of a batch
    states: Any  #: shape (M, 2), replaced by the last ones; NaN after an orbit has ended
    outcome: Any  #: shape (M,), of the last return, or of that which ended an orbit
    time: Any  #: shape (B, M), NaN from the end of an orbit on
    totals: Any  #: shape (B, M, C), the same


@inlined
def row_of(p, up):
    """The row of a wall in the tables of a plan: the base wall's is the first."""
    return 0 if up == on_top(p) else 1


@inlined
def join_impact(p, q, up, z, phi, v):
    """Join the values of an impact of speed v; returns the speed after it."""
    u, _ = rebound(p, up, v)
    q.y[V], q.y[V_AFTER], q.y[PLACE] = v, u, z
    at_impact(q, row_of(p, up), phi)
    return u


@inner
def join_chatter(p, q, up, z, impact, u):
    """Join the values of the impacts after one that was left at speed u, to where they accumulate.

    A formula that is not zero at speed zero has no finite sum.
    """
    a, _, _, _ = start(p)
    v, x = u, accumulation_time(u, u / impact.speed, abs(a))
    for _ in range(MOST_CHATTER):
        if not v > LEAST * u:
            break
        after, _ = rebound(p, up, v)
        v = join_impact(p, q, up, z, phase_at(p, impact.phase, x * (1.0 - after / u)), v)
    else:
        q.total[: q.at.shape[1]] = math.nan
    q.y[V], q.y[V_AFTER], q.y[PLACE] = 0.0, 0.0, z
    at_rest(q, row_of(p, up), impact.phase)


@inner
def instant(q, s, flown):
    """Write the inputs at a time s of a flight or a rest; returns the phase."""
    d, v = 0.0, 0.0
    if flown.flies:
        d, v, _, _, _, _ = evaluate(flown.p, s)
    q.y[AT_PLACE], q.y[AT_VELOCITY] = flown.place + d, v
    return phase_at(flown.p, flown.phase, s)


@inner
def join_event(p, impact, event, q, counts):
    """The observer of totals: join the values of an impact, and of the flight or the rest after it, if these count."""
    up, phi, z = impact.up, impact.phase, wall_place(p, impact.up)
    if counts and q.impact != 0 and impact.speed > 0.0:
        u = join_impact(p, q, up, z, phi, impact.speed)
        if event.ended in (CHATTER, FOREVER):
            join_chatter(p, q, up, z, impact, u)
    if counts and q.flight != 0 and event.ended not in (FOREVER, ESCAPED):
        join_panels(q, row_of(p, up), event.time, instant, Flown(p, z, phi, event.time, event.ended == IMPACT))
    return counts


@inner
def image_of(context, state, counts):
    """Replace a state by its image: (outcome, time, one return); values join the totals if the return `counts`."""
    p, q, chatter = context
    impact = Impact(on_top(p), state[PHASE], state[SPEED])
    found, _ = follow(p, impact, chatter, MOST_IMPACTS, join_event, q, counts)
    state[SPEED], state[PHASE] = found.speed, found.phase
    return found.outcome, found.time, 1


@entry
def observe_flights(p, q, chatter, at, batches):
    """Follow M states through the returns of all batches: whether all totals are known, see `follow_batches`."""
    return follow_batches(q, at, batches, PAUSE, image_of, (p, q, chatter))
