"""Derivatives of observables of first returns of a system with modes, through every event, along directions of its memory."""

import math

from nsmaps.exact.engine.jit import inlined, inner, long_entry
from nsmaps.exact.modes.flights.motion import advance, begin_piece, copy_features, slopes_at, within_turn
from nsmaps.exact.modes.flights.states import dot, shift, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON, begins, timely
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly, saltation
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import DOUBTED, MOST_DOUBTS, MOST_EVENTS, PAUSE, bounded, cleared, met
from nsmaps.exact.modes.march.starting import starting
from nsmaps.exact.observables.motions import row_of
from nsmaps.exact.observables.slopes import chained
from nsmaps.exact.observables.sums import evaluated


@inlined
def written(p, q, g, first, w):
    """Write states and their derivatives among the inputs, from a place on."""
    for i in range(p.own):
        q.y[first + i] = w.z[i]
        for j in range(len(g.phase)):
            g.d[first + i, j] = w.dz[i, j]


@inner
def at_event(p, q, g, k, phi, slopes, w):
    """Add the derivatives of an event; the states before it, and the phase's derivatives, are written."""
    written(p, q, g, p.own, w)
    evaluated(q, q.impact, phi)
    chained(q, g, 2 * p.own, k, False, 1.0, slopes)


@inner
def at_instant(p, q, g, mode, phi, s, x):
    """Write the states a time s after those of `x`, within its piece, and their derivatives; evaluate the formulas."""
    slopes_at(p, mode, s, x, q.y, g.d)
    for c in range(len(g.phase)):
        g.phase[c] = x.dphi[c] + x.moved.rate * s
    evaluated(q, q.flight, within_turn(phi + p.rate * s)[0])


@inner
def over_panel(p, q, g, mode, row, phi, h, slopes, x):
    """Add the derivatives of a part of a flight."""
    x.spent[0] += len(q.nodes)
    for j in range(len(q.nodes)):
        at_instant(p, q, g, mode, phi, h * q.nodes[j], x)
        chained(q, g, p.own, row, True, h * q.weights[j], slopes)


@inner
def over_flight(p, q, g, mode, row, phi, s, slopes, x):
    """Add the derivatives of a flight of fixed time s, whose states at its start `x` has; formulas of its end are written."""
    done, unit = 0.0, begin_piece(p, mode, s, x)
    while s - done > unit > 0.0:
        over_panel(p, q, g, mode, row, phi, unit, slopes, x)
        phi, _ = advance(p, mode, 1.0, unit, phi, x)
        done += unit
        unit = begin_piece(p, mode, s - done, x)
    over_panel(p, q, g, mode, row, phi, s - done, slopes, x)
    at_instant(p, q, g, mode, phi, s - done, x)


@inner
def at_end(p, q, mode, row, which, slopes, w):
    """Add the derivatives by the time of a flight, whose formulas at its end are written; none of one that takes no time."""
    if w.lapse[0] == 0.0:
        return
    shift(p, w)
    velocity(p, mode, w.z, w.field, w)
    rate, _ = dot(p.functions[which], w.field)
    for j in range(w.dz.shape[1]):
        gap = 0.0
        for i in range(len(w.z)):
            gap += p.functions[which, i] * w.dz[i, j]
            if w.moved.here:
                gap += w.moved.functions[which, i] * w.z[i]
        for c in range(q.over.shape[1]):
            if q.over[row, c]:
                slopes[q.at.shape[1] + c, j] -= q.out[c, 0] * gap / rate * p.steps[mode]


@inner
def motion_slopes(p, q, g, k, mode, phi, image, tangent, slopes, w, x):
    """From a state after a transition k, in a mode, to the section; whether there are derivatives."""
    code, power, time, doubts, row = 0, 1, 0.0, 0, row_of(p, q, k, mode, mode)
    for _ in range(MOST_EVENTS if begins(p, mode, w) == GOES_ON else 0):
        copy_features(p, w, x)
        under_way, from_phase = mode, phi
        which, flight, phi, _, vague = fly(p, mode, phi, math.inf, w)
        w.held[0], time = w.held[0] + flight, time + flight
        if which == NO_FUNCTION or not bounded(w):
            return False
        if q.flight != 0:
            over_flight(p, q, g, under_way, row, from_phase, flight, slopes, x)
            at_end(p, q, under_way, row, which, slopes, w)
        saltation(p, mode, which, w)
        written(p, q, g, 0, w)
        for c in range(len(g.phase)):
            g.phase[c] = w.dphi[c]
        outcome, mode, code, power, unsure, k = met(p, mode, which, phi, code, power, image, tangent, w)
        doubts, w.spent[0] = doubts + (1 if unsure or vague else 0), w.spent[0] + (DOUBTED if unsure else 0)
        if q.impact != 0 and k >= 0 and (outcome == GOES_ON or p.after):
            at_event(p, q, g, k, phi, slopes, w)
        row = row_of(p, q, k, mode, row) if k >= 0 else row
        outcome = timely(p, outcome, mode, which, time, image, tangent, w)
        if outcome != GOES_ON or doubts > MOST_DOUBTS:
            return outcome != GOES_ON and not math.isnan(image[0])
    return False


@long_entry
def mode_slopes(p, q, g, begin, states, slopes, image, tangent, w, x):
    """The derivatives of the totals of first returns (N, m) along the directions of the memory, slopes (N, C, D), from one on.

    The number of those that are known after about `PAUSE` pieces of flights.
    """
    w.spent[0], x.spent[0] = 0, 0
    for i in range(begin, len(states)):
        if w.spent[0] + x.spent[0] > PAUSE:
            return i
        slopes[i] = 0.0
        k, phi = starting(p, states[i], w)
        cleared(p, k, image, tangent, w)
        known = k >= 0
        if known:
            written(p, q, g, 0, w)
            for c in range(len(g.phase)):
                g.phase[c] = w.dphi[c]
            mode = entered(p, k, not p.after, phi, w)
            if q.impact != 0 and not p.after:
                at_event(p, q, g, k, phi, slopes[i], w)
            known = motion_slopes(p, q, g, k, mode, phi, image, tangent, slopes[i], w, x)
        if not known:
            slopes[i] = math.nan
    return len(states)
