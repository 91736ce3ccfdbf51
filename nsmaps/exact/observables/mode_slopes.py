"""Derivatives of observables of first returns of a system with modes, through every event, along directions of its memory."""

import math

from nsmaps.exact.engine.jit import inlined, inner, long_entry
from nsmaps.exact.modes.march.beginning import GOES_ON, begins, timely
from nsmaps.exact.modes.march.flight import NO_FUNCTION, carried, dot, fly, saltation, shift_waves, velocity, within_turn
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import DOUBTED, MOST_DOUBTS, MOST_EVENTS, PAUSE, bounded, cleared, met
from nsmaps.exact.modes.march.section import starting
from nsmaps.exact.modes.tables.taylor import features, moved_on, propagated
from nsmaps.exact.observables.slopes import chained
from nsmaps.exact.observables.sums import evaluated


@inlined
def taken(q, g, first, w):
    """Write states and their derivatives among the inputs, from a place on."""
    for i in range(len(w.new)):
        q.y[first + i] = w.z[i]
        for j in range(len(g.phase)):
            g.d[first + i, j] = w.dz[i, j]


@inner
def at_event(q, g, k, phi, slopes, w):
    """Add the derivatives of an event; the states before it, and the phase's derivatives, are written."""
    taken(q, g, len(w.new), w)
    evaluated(q, q.impact, phi)
    chained(q, g, 2 * len(w.new), k, 0, q.at, 1.0, slopes)


@inner
def at_instant(p, q, g, mode, phi, s, x):
    """Write the states a time s after those of `x`, a longest step at most, and their derivatives; evaluate the formulas."""
    n, width, directions = len(x.new), len(x.z), len(g.phase)
    shift_waves(x.z, x.dz, x.dphi, n)
    propagated(p, mode, s / p.steps[mode], x)
    if x.moved.here:
        for i in range(n):
            g.back[i, 0] = x.dz[i, 0]
        carried(p, mode, s / p.steps[mode], x)
        for i in range(n):
            g.d[i, 0], x.dz[i, 0] = x.dz[i, 0], g.back[i, 0]
    for i in range(n):
        total = x.z[i]
        for j in range(width):
            total += x.flow[i * width + j] * x.z[j]
        q.y[i] = total
        for c in range(0 if x.moved.here else directions):
            slope = x.dz[i, c]
            for j in range(width):
                slope += x.flow[i * width + j] * x.dz[j, c]
            g.d[i, c] = slope
    for c in range(directions):
        g.phase[c] = x.dphi[c] + x.moved.rate * s
    evaluated(q, q.flight, within_turn(phi + p.rate * s)[0])


@inner
def over_panel(p, q, g, mode, phi, h, slopes, x):
    """Add the derivatives of a part of a flight."""
    x.spent[0] += len(q.nodes)
    for j in range(len(q.nodes)):
        at_instant(p, q, g, mode, phi, h * q.nodes[j], x)
        chained(q, g, len(x.new), mode, q.at.shape[1], q.over, h * q.weights[j], slopes)


@inner
def over_flight(p, q, g, mode, phi, s, slopes, x):
    """Add the derivatives of a flight of fixed time s, whose states at its start `x` has; formulas of its end are written."""
    step, n, done = p.steps[mode], len(x.new), 0.0
    while s - done > step:
        over_panel(p, q, g, mode, phi, step, slopes, x)
        shift_waves(x.z, x.dz, x.dphi, n)
        propagated(p, mode, 1.0, x)
        if x.moved.here:
            carried(p, mode, 1.0, x)
        moved_on(x)
        for c in range(len(g.phase)):
            x.dphi[c] += x.moved.rate * step
        done += step
        phi, _ = within_turn(phi + p.rate * step)
        features(phi, x.z, n)
    over_panel(p, q, g, mode, phi, s - done, slopes, x)
    at_instant(p, q, g, mode, phi, s - done, x)


@inner
def at_end(p, q, mode, which, slopes, w):
    """Add the derivatives by the time of a flight, whose formulas at its end are written; none of one that takes no time."""
    if w.lapse[0] == 0.0:
        return
    shift_waves(w.z, w.dz, w.dphi, len(w.new))
    velocity(p, mode, w.z, w.field)
    rate, _ = dot(p.functions[which], w.field)
    for j in range(w.dz.shape[1]):
        gap = 0.0
        for i in range(len(w.z)):
            gap += p.functions[which, i] * w.dz[i, j]
            if w.moved.here:
                gap += w.moved.functions[which, i] * w.z[i]
        for c in range(q.over.shape[1]):
            if q.over[mode, c]:
                slopes[q.at.shape[1] + c, j] -= q.out[c, 0] * gap / rate * p.steps[mode]


@inlined
def copied(w, x):
    """Let a memory have the states of another, and their derivatives."""
    for j in range(len(w.z)):
        x.z[j] = w.z[j]
        for c in range(w.dz.shape[1]):
            x.dz[j, c] = w.dz[j, c]
    for c in range(w.dz.shape[1]):
        x.dphi[c] = w.dphi[c]


@inner
def motion_slopes(p, q, g, mode, phi, image, tangent, slopes, w, x):
    """From a state in a mode to the section; whether there are derivatives."""
    code, power, time, doubts = 0, 1, 0.0, 0
    for _ in range(MOST_EVENTS if begins(p, mode, w) == GOES_ON else 0):
        copied(w, x)
        flown, from_phase = mode, phi
        which, flight, phi, _, vague = fly(p, mode, phi, math.inf, w)
        w.held[0], time = w.held[0] + flight, time + flight
        if which == NO_FUNCTION or not bounded(w):
            return False
        if q.flight != 0:
            over_flight(p, q, g, flown, from_phase, flight, slopes, x)
            at_end(p, q, flown, which, slopes, w)
        saltation(p, mode, which, w)
        taken(q, g, 0, w)
        for c in range(len(g.phase)):
            g.phase[c] = w.dphi[c]
        outcome, mode, code, power, unsure, k = met(p, mode, which, phi, code, power, image, tangent, w)
        doubts, w.spent[0] = doubts + (1 if unsure or vague else 0), w.spent[0] + (DOUBTED if unsure else 0)
        if q.impact != 0 and k >= 0 and (outcome == GOES_ON or p.after):
            at_event(q, g, k, phi, slopes, w)
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
            taken(q, g, 0, w)
            for c in range(len(g.phase)):
                g.phase[c] = w.dphi[c]
            mode = entered(p, k, not p.after, phi, w)
            if q.impact != 0 and not p.after:
                at_event(q, g, k, phi, slopes[i], w)
            known = motion_slopes(p, q, g, mode, phi, image, tangent, slopes[i], w, x)
        if not known:
            slopes[i] = math.nan
    return len(states)
