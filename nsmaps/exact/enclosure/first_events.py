"""All possible first events of a set of states on a flight, for each kind of sets.

The set is followed in time. While no state of it can meet a guard (a wall of an impact system), the steps are those of
`engine.steps`, for the least values of functions and derivatives over all states. Where all states certainly meet one guard,
once, and no other before it, the set lands as a whole. Where only some states may meet a guard, as next to a grazing state, or
several guards, the states that may do so are enclosed in short steps of time, and the set continues as if the guards were absent,
until no state of it can still be on its way.

A kind of sets is given by three functions, for which numba compiles the loop once:

- `survey(p, flight, s, narrow, w)`: bounds at time s, once more narrower ones where there are any: see `follow_flight`;
- `land(p, flight, near, number, w)`: write the event of all states at the place `number`; True if it is proved;
- `take_step(p, flight, near, number, w)`: (a step of time, the number of events with those written within it).
"""

import math

from nsmaps.exact.enclosure.subdivide import GONE, LANDED, SPENT, SetFlight
from nsmaps.exact.engine.constants import FOUR, NO_SPEED
from nsmaps.exact.engine.jit import inlined, inner

MOST_STEPS = 2_000  #: of one flight of a set
SHORT = 0.125  #: steps are abandoned when shorter than this share of the time in which a set passes a guard
RESERVE = 1.05  #: factor of an estimate that is to be proved a bound
LEAST = 1e-15  #: of the time flown: no step is shorter


@inlined
def passing_time(y, u, b):
    """An estimate of the time that a set takes to pass a guard whose function lies within +-y, with these rates."""
    return FOUR * y / (abs(u) + math.sqrt(u * u + FOUR * y * abs(b)) + NO_SPEED)


@inlined
def step_within(clear, passing, s, limit):
    """(A step of time within which no state meets a guard, or a short one; whether it is short and events are to be recorded).

    From the time for which the guards are clear and that in which the set passes the nearest one.
    """
    h, short = min(clear, limit), SHORT * passing
    if h > short:
        return h, False
    return min(max(2.0 * short, LEAST * s), limit), True


@inner
def follow_flight(p, flight, number, w, survey, land, take_step):
    """Write all possible first events of a set behind the first ones, so many: the `SetFlight`.

    A flight has the time `last` to which it is followed. What `survey` returns has these fields: `surely`, whether all states
    meet the nearest guard, once and first; `over`, whether all states have met a guard; `wide`, whether narrower bounds exist.
    """
    s = 0.0
    for _ in range(MOST_STEPS):
        for narrow in range(2):
            near = survey(p, flight, s, narrow > 0, w)
            if near.surely and land(p, flight, near, number, w):
                return SetFlight(LANDED, number + 1, False)
            if not near.wide:
                break
        if near.over:
            return SetFlight(LANDED, number, False)
        h, number = take_step(p, flight, near, number, w)
        if not h > 0.0:
            return SetFlight(SPENT, number, True)
        s += h
        if not s < flight.last:
            return SetFlight(GONE, number, True)
        if number + 2 > len(w.hits):
            return SetFlight(SPENT, number, True)
    return SetFlight(SPENT, number, True)
