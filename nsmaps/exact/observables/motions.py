"""Observables of a system with modes, summed from event to event: `first_return` of the march with formulas on the way."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.jit import inlined, inner, long_entry
from nsmaps.exact.engine.returns import ENDLESS, INVALID, LOST, RESTS, UNDECIDED
from nsmaps.exact.modes.flights.motion import advance, begin_piece, copy_features, state_at, within_turn
from nsmaps.exact.modes.march.beginning import GOES_ON, begins, timely
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly
from nsmaps.exact.modes.march.resting import CHATTER, entered
from nsmaps.exact.modes.march.returns import DOUBTED, MOST_DOUBTS, MOST_EVENTS, PAUSE, bounded, cleared, met, settled
from nsmaps.exact.modes.march.starting import starting
from nsmaps.exact.observables import sums
from nsmaps.exact.observables.sums import BESIDE, LEAST, MOST_CHATTER, at_impact, at_rest, highest, joined, sampled

LASTING, SHARE = 3, 4  # places in `Memory.lapse`: the time in which impacts accumulate, the share of speed that each leaves
SINCE, HOW = 0, 1  # places in `Memory.held`: time since contact has begun, and how


@inlined
def before(p, q, w):
    """Write the states just before an event among the inputs."""
    for i in range(p.own):
        q.y[i] = w.z[i]


@inner
def event(p, q, k, phi, w):
    """Join the values of an event, whose states before it are written, and of those that follow if they accumulate."""
    changed = 0.0
    for i in range(p.own):
        q.y[p.own + i] = w.z[i]
        changed += abs(q.y[i] - w.z[i])
    if q.departed and changed == 0.0:  # a release, with which a return ends and the next begins
        return
    if w.held[HOW] == CHATTER and w.held[SINCE] == 0.0:
        chattered(p, q, k, phi, w)
    else:
        at_impact(q, k, phi)


@inner
def chattered(p, q, k, phi, w):
    """Join the values of impacts that accumulate, of which the states before the first, and in contact, are written.

    Where these states differ by d, those of the impact m differ from contact by r^m d before it, and by -r^(m + 1) d after it. A
    formula that is not zero at speed zero has no finite sum.
    """
    n, left = p.own, 1.0
    for i in range(n):
        w.one[i] = q.y[i] - w.z[i]
    for _ in range(MOST_CHATTER):
        if not left > LEAST:
            break
        for i in range(n):
            q.y[i], q.y[n + i] = w.z[i] + left * w.one[i], w.z[i] - left * w.lapse[SHARE] * w.one[i]
        at_impact(q, k, within_turn(phi + p.rate * w.lapse[LASTING] * (1.0 - left))[0])
        left *= w.lapse[SHARE]
    else:
        q.total[: q.at.shape[1]] = math.nan
    for i in range(n):
        q.y[i], q.y[n + i] = w.z[i], w.z[i]
    at_rest(q, k, phi)


class Piece(NamedTuple):
    """A piece of a flight."""

    p: Any  #: Tables
    mode: int
    phase: float  #: at the states of `x`
    x: Any  #: memory with the states at its start


@inner
def instant(q, s, piece):
    """Write the states a time s after the start of a piece; returns the phase."""
    state_at(piece.p, piece.mode, s, piece.x, q.y)
    phi, _ = within_turn(piece.phase + piece.p.rate * s)
    return phi


@inner
def over_panel(p, q, mode, row, phi, h, x):
    """Join the values of a part of a flight, of time h from the states of `x`."""
    first, piece = q.at.shape[1], Piece(p, mode, phi, x)
    q.peak[:] = -math.inf
    x.spent[0] += len(q.nodes)
    sampled(q, row, instant(q, 0.0, piece), 0.0, 0.0)
    for j in range(len(q.nodes)):
        s = h * q.nodes[j]
        sampled(q, row, instant(q, s, piece), s, h * q.weights[j])
    sampled(q, row, instant(q, h, piece), h, 0.0)
    for c in range(q.over.shape[1]):
        if q.over[row, c] and q.largest[first + c]:
            low, high = max(q.when[c] - BESIDE * h, 0.0), min(q.when[c] + BESIDE * h, h)
            joined(q, first + c, highest(q, c, low, high, instant, piece))


@inner
def over_flight(p, q, mode, row, phi, s, x):
    """Join the values of a flight of time s, whose states at its start `x` has; panels are its pieces."""
    done, unit = 0.0, begin_piece(p, mode, s, x)
    while s - done > unit > 0.0:
        over_panel(p, q, mode, row, phi, unit, x)
        phi, _ = advance(p, mode, 1.0, unit, phi, x)
        done += unit
        unit = begin_piece(p, mode, s - done, x)
    over_panel(p, q, mode, row, phi, s - done, x)


@inlined
def row_of(p, q, k, mode, row):
    """The row of a table by which a flight in a mode counts, that begins at a transition k."""
    if not q.departed:
        return mode
    return p.digit[k] - 1 if p.digit[k] > 0 else row


@inner
def observed_motion(p, q, k, mode, phi, image, tangent, counts, w, x):
    """From a state after a transition k, in a mode, to the section: (outcome, time); values join the totals if it `counts`."""
    row = row_of(p, q, k, mode, mode)
    time, doubts, code, power = 0.0, 0, 0, 1
    outcome = begins(p, mode, w)
    if outcome != GOES_ON:
        return outcome, math.nan
    for _ in range(MOST_EVENTS):
        under_way, from_phase = mode, phi
        copy_features(p, w, x)
        which, flight, phi, _, unsure = fly(p, mode, phi, math.inf, w)
        time, doubts = time + flight, doubts + (1 if unsure else 0)
        w.held[0] += flight
        if which == NO_FUNCTION or not bounded(w):
            rests = p.resting[mode] and flight >= p.horizon
            return (RESTS if rests else UNDECIDED if doubts > 0 and bounded(w) else LOST), math.nan
        if counts and q.flight != 0:
            over_flight(p, q, under_way, row, from_phase, flight, x)
        before(p, q, w)
        outcome, mode, code, power, unsure, k = met(p, mode, which, phi, code, power, image, tangent, w)
        doubts, w.spent[0] = doubts + (1 if unsure else 0), w.spent[0] + (DOUBTED if unsure else 0)
        if counts and q.impact != 0 and k >= 0 and (outcome == GOES_ON or p.after):
            event(p, q, k, phi, w)
        row = row_of(p, q, k, mode, row) if k >= 0 else row
        outcome = timely(p, outcome, mode, which, time, image, tangent, w)
        if outcome != GOES_ON:
            return settled(outcome, code, time, 0, doubts > 0)[0], time
        if doubts > MOST_DOUBTS:
            return UNDECIDED, math.nan
    return ENDLESS, math.nan


@inner
def observed_return(p, q, row, image, tangent, counts, w, x):
    """The first return of a row of coordinates: (outcome, time); of sections before the reset the event at the start counts."""
    k, phi = starting(p, row, w)
    cleared(p, k, image, tangent, w)
    if k < 0:
        return INVALID, math.nan
    before(p, q, w)
    mode = entered(p, k, not p.after, phi, w)
    if counts and q.impact != 0 and not p.after:
        event(p, q, k, phi, w)
    return observed_motion(p, q, k, mode, phi, image, tangent, counts, w, x)


@long_entry
def observed_modes(p, q, discard, length, at, states, outcome, time, totals, image, tangent, w, x):
    """As `observed` of an impact system, for states (M, m) of a system with modes, in about `PAUSE` pieces of flights."""
    w.spent[0], x.spent[0] = 0, 0
    while at[0] < len(states):
        k = at[0]
        for i in range(at[1], discard + len(time) * length):
            b = (i - discard) // length if i >= discard else -1
            if b >= 0 and (i - discard) % length == 0:
                sums.begin_totals(q)
                time[b, k] = 0.0
            if i == 0 or not math.isnan(states[k, 0]):
                outcome[k], s = observed_return(p, q, states[k], image, tangent, b >= 0, w, x)
                for c in range(len(image)):
                    states[k, c] = image[c]
                if b >= 0:
                    time[b, k] += s
            if b >= 0 and (i - discard) % length == length - 1:
                sums.write_totals(q, math.isnan(states[k, 0]), b, k, time, totals)
            at[1] = i + 1
            if w.spent[0] + x.spent[0] > PAUSE:
                return False
        at[0], at[1] = k + 1, 0
    return True
