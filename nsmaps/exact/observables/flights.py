"""Observables of an impact system, summed from impact to impact: `first_return` of the engine with formulas on the way."""

import math

from nsmaps.exact.engine.flight.flow import evaluate, rebound, start, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import (
    CHATTER,
    ESCAPED,
    FOREVER,
    IMPACT,
    INVALID,
    LOST,
    MOST_IMPACTS,
    RESTS,
    RETURNED,
    STUCK,
    UNDECIDED,
    is_state,
    next_impact,
    onward,
)
from nsmaps.exact.observables.sums import GOLDEN, NARROWINGS, at_impact, cleared, evaluated, joined, panels, sampled, written

LEAST = 1e-17  # of the first speed: slower impacts of chatter are not added
PAUSE = 10_000  # returns, within about a second, after which Ctrl-C is heard
MOST_CHATTER = 10_000_000  # impacts of chatter that are added: after more the totals are not known


@inlined
def hit(p, q, up, z, phi, v):
    """Join the values of an impact of speed v; returns the speed after it."""
    u, _ = rebound(p, up, v)
    q.y[0], q.y[1], q.y[2] = v, u, z
    at_impact(q, 0 if up == walls_of(p)[2] else 1, phi)
    return u


@inner
def chattered(p, q, up, z, phi, first, u):
    """Join the values of the impacts after one of speed `first` that was left at speed u, to where they accumulate.

    A formula that is not zero at speed zero has no finite sum.
    """
    v, x = u, 2.0 * u / (abs(start(p)[0]) * (1.0 - u / first))
    for _ in range(MOST_CHATTER):
        if not v > LEAST * u:
            break
        after, _ = rebound(p, up, v)
        v = hit(p, q, up, z, onward(p, phi, x * (1.0 - after / u))[0], v)
    else:
        q.total[: q.at.shape[1]] = math.nan
    row = 0 if up == walls_of(p)[2] else 1
    q.y[0], q.y[1], q.y[2] = 0.0, 0.0, z
    evaluated(q, q.impact, phi)
    for c in range(q.at.shape[1]):
        if q.at[row, c] and q.out[c, 0] != 0.0 and not q.largest[c]:
            q.total[c] += math.copysign(math.inf, q.out[c, 0])


@inner
def instant(p, q, z, phi, s, flies):
    """Write the inputs at a time s of a flight, or of a rest; returns the phase."""
    d, v = 0.0, 0.0
    if flies:
        d, v, _, _, _, _ = evaluate(p, s)
    q.y[0], q.y[1] = z + d, v
    return onward(p, phi, s)[0]


@inner
def over_flight(p, q, row, z, phi, s, flies):
    """Join the values of a flight of time s, whose coefficients are written, or of a rest as long."""
    count, h = panels(q, s)
    first = q.at.shape[1]
    q.peak[:] = -math.inf
    sampled(q, row, instant(p, q, z, phi, 0.0, flies), 0.0, 0.0)
    for i in range(count):
        for j in range(len(q.nodes)):
            x = h * (i + q.nodes[j])
            sampled(q, row, instant(p, q, z, phi, x, flies), x, h * q.weights[j])
    sampled(q, row, instant(p, q, z, phi, s, flies), s, 0.0)
    for c in range(q.over.shape[1]):
        if q.over[row, c] and q.largest[first + c]:
            joined(q, first + c, highest(p, q, c, z, phi, max(q.when[c] - 0.2 * h, 0.0), min(q.when[c] + 0.2 * h, s), flies))


@inner
def highest(p, q, c, z, phi, low, high, flies):
    """The largest value of a formula between two times of a flight, by golden sections, at least that of the samples."""
    largest = q.peak[c]
    for _ in range(NARROWINGS):
        one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        evaluated(q, q.flight, instant(p, q, z, phi, one, flies))
        at_one = q.out[c, 0]
        evaluated(q, q.flight, instant(p, q, z, phi, two, flies))
        at_two = q.out[c, 0]
        largest = max(largest, max(at_one, at_two))
        low, high = (one, high) if at_one < at_two else (low, two)
    return largest


@inner
def passed(p, q, up, phi, v, ended, s):
    """Join the values of an impact of speed v at phase phi, and of the flight or the rest of time s after it."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    row = 0 if up == walls_of(p)[2] else 1
    if q.impact != 0 and v > 0.0:
        u = hit(p, q, up, z, phi, v)
        if ended in (CHATTER, FOREVER):
            chattered(p, q, up, z, phi, v, u)
    if q.flight != 0 and ended not in (FOREVER, ESCAPED):
        over_flight(p, q, row, z, phi, s, ended == IMPACT)


@inner
def observed_return(p, q, v, phi, chatter, counts):
    """The first return to the base wall: (outcome, speed, phase, time); its values join the totals if it `counts`."""
    if not is_state(v, phi):
        return INVALID, math.nan, math.nan, math.nan
    phi, _ = onward(p, phi, 0.0)
    base_up = walls_of(p)[2]
    up, time, undecided = base_up, 0.0, False
    for _ in range(MOST_IMPACTS):
        on_base = up == base_up
        ended, now_up, s, now_v, unsure, _, _ = next_impact(p, up, phi, v, chatter)
        undecided |= unsure
        if counts:
            passed(p, q, up, phi, v, ended, s)
        if ended == FOREVER:
            return RESTS, math.nan, math.nan, time
        if ended == ESCAPED:
            return UNDECIDED if undecided else LOST, math.nan, math.nan, math.nan
        time += s
        phi, _ = onward(p, phi, s)
        v, up = now_v, now_up
        if up == base_up and (ended == IMPACT or on_base):
            return STUCK if ended != IMPACT else UNDECIDED if undecided else RETURNED, v, phi, time
    return LOST, math.nan, math.nan, math.nan


@entry
def observed(p, q, chatter, discard, length, at, states, outcome, time, totals):
    """Follow M states (M, 2) through `discard` returns and then B batches of `length`: times (B, M) and totals (B, M, K + F).

    The states are replaced by the last ones; an orbit that ends has NaN from then on, and the outcome that ended it. About
    `PAUSE` returns are computed, from `at` on, the number of a state and of a return: whether all are known.
    """
    last = PAUSE
    while at[0] < len(states):
        k = at[0]
        for i in range(at[1], discard + len(time) * length):
            b = (i - discard) // length if i >= discard else -1
            if b >= 0 and (i - discard) % length == 0:
                cleared(q)
                time[b, k] = 0.0
            if i == 0 or not math.isnan(states[k, 0]):
                outcome[k], states[k, 0], states[k, 1], s = observed_return(p, q, states[k, 0], states[k, 1], chatter, b >= 0)
                last -= 1
                if b >= 0:
                    time[b, k] += s
            if b >= 0 and (i - discard) % length == length - 1:
                written(q, math.isnan(states[k, 0]), b, k, time, totals)
            at[1] = i + 1
            if last == 0:
                return False
        at[0], at[1] = k + 1, 0
    return True
