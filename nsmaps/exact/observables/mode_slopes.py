"""Derivatives of observables of first returns of a system with modes, through every event, along directions of its memory."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.jit import inlined, inner, long_entry
from nsmaps.exact.modes.flights.motion import copy_features, slopes_at
from nsmaps.exact.modes.flights.states import dot, shift, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON
from nsmaps.exact.modes.march.flight import saltation, time_slope
from nsmaps.exact.modes.march.returns import MOST_EVENTS, PAUSE, Limits, begin_return, follow_motion
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.tables.memory import FLIGHT_TIME, PIECES
from nsmaps.exact.observables.motions import ROW, instant, over_pieces, phase_after, row_of, write_before
from nsmaps.exact.observables.slopes import add_slopes
from nsmaps.exact.observables.sums import NODES, VALUE, evaluate_formulas, over_panel

FIRST = 0  # coordinate of an image, NaN without a return


class SlopeObservation(NamedTuple):
    """What the observers of derivatives work in."""

    q: Any  #: Quantities
    g: Any  #: Directions
    slopes: Any  #: shape (C, D), of the totals
    x: Any  #: Memory with the features and their derivatives at the start of the flight under way
    numbers: Any  #: shape (2,), the row of a table by which this flight counts


@inlined
def write_slopes(p, g, first, w):
    """Write the derivatives of states and of the phase among those of the inputs, from a place on."""
    for j in range(len(g.phase)):
        g.phase[j] = w.dphi[j]
        for i in range(p.own):
            g.d[first + i, j] = w.dz[i, j]


@inner
def add_impact(p, k, phase, seen, w):
    """Add the derivatives of an event, before which states and derivatives are written."""
    q, g = seen.q, seen.g
    for i in range(p.own):
        q.y[p.own + i] = w.z[i]
        for j in range(len(g.phase)):
            g.d[p.own + i, j] = w.dz[i, j]
    evaluate_formulas(q, q.impact, phase)
    add_slopes(q, g, 2 * p.own, k, False, 1.0, seen.slopes)


@inner
def evaluate_instant(piece, s, seen):
    """Write the states a time s after the start of a piece, and their derivatives; evaluate the formulas."""
    p, x, q, g = piece.p, piece.x, seen.q, seen.g
    slopes_at(p, piece.mode, s, x, q.y, g.d)
    for c in range(len(g.phase)):
        g.phase[c] = x.dphi[c] + x.moved.rate * s
    evaluate_formulas(q, q.flight, phase_after(p, piece.phase, s))


@inner
def add_node(s, weight, context):
    """Add the derivatives at a time of a piece."""
    piece, seen = context
    evaluate_instant(piece, s, seen)
    add_slopes(seen.q, seen.g, piece.p.own, seen.numbers[ROW], True, weight, seen.slopes)


@inner
def add_piece(piece, length, seen):
    """Add the derivatives of a piece of a flight of fixed time."""
    piece.x.integers[PIECES] += len(NODES)
    over_panel(seen.q, seen.numbers[ROW], (0.0, length), instant, piece, add_node, (piece, seen))


@inner
def add_time(p, mode, function, seen, w):
    """Add the derivatives by the time of a flight, if it takes any, to an event whose formulas at its end are written."""
    if w.reals[FLIGHT_TIME] == 0.0:
        return
    shift(p, w)
    velocity(p, mode, w.z, w.field, w)
    rate = dot(p.functions[function], w.field).value
    q, row, first = seen.q, seen.numbers[ROW], seen.q.at.shape[1]
    for j in range(w.dz.shape[1]):
        time = time_slope(p, function, rate, j, w) * p.steps[mode]
        for c in range(q.over.shape[1]):
            if q.over[row, c]:
                seen.slopes[first + c, j] += q.out[c, VALUE] * time


@inner
def add_flight(p, motion, flight, seen, w):
    """The observer of flights: add the derivatives of one, and write states and derivatives at its end."""
    if seen.q.flight != 0 and (flight.time > 0.0 or len(p.nonlinear) == 0):
        last, length = over_pieces(p, motion, flight.time, add_piece, seen, seen.x)
        evaluate_instant(last, length, seen)
        add_time(p, motion.mode, flight.function, seen, w)
    saltation(p, motion.mode, flight.function, w)
    write_before(p, seen.q, w)
    write_slopes(p, seen.g, 0, w)


@inner
def add_event(p, motion, passage, seen, w):
    """The observer of events: add the derivatives of one, but of that which ends a return before its reset."""
    k, q = passage.transition, seen.q
    if k >= 0:
        if q.impact != 0 and (passage.outcome == GOES_ON or p.after):
            add_impact(p, k, motion.phase, seen, w)
        seen.numbers[ROW] = row_of(p, q, k, passage.motion.mode, seen.numbers[ROW])
    copy_features(p, w, seen.x)


@inner
def slopes_of_return(p, row, seen, w):
    """Write the derivatives of the totals of the first return of a row of coordinates; NaN without a return."""
    q, known = seen.q, False
    seen.slopes[:] = 0.0
    k, phase = find_start(p, row, w)
    if k >= 0:
        write_before(p, q, w)
        write_slopes(p, seen.g, 0, w)
        passage = begin_return(p, k, phase, w)
        if q.impact != 0 and not p.after:
            add_impact(p, k, phase, seen, w)
        seen.numbers[ROW] = row_of(p, q, k, passage.motion.mode, passage.motion.mode)
        copy_features(p, w, seen.x)
        if passage.outcome == GOES_ON:
            passage = follow_motion(p, passage.motion, Limits(math.inf, MOST_EVENTS), add_flight, add_event, seen, w)
        known = not math.isnan(w.image[FIRST])
    if not known:
        seen.slopes[:] = math.nan


@long_entry
def mode_slopes(p, seen, begin, states, slopes, w):
    """The derivatives of the totals of first returns (N, m) along the directions of the memory, slopes (N, C, D), from one on.

    The number of those that are known after about `PAUSE` pieces of flights.
    """
    x = seen.x
    w.integers[PIECES], x.integers[PIECES] = 0, 0
    for i in range(begin, len(states)):
        if w.integers[PIECES] + x.integers[PIECES] > PAUSE:
            return i
        slopes_of_return(p, states[i], SlopeObservation(seen.q, seen.g, slopes[i], x, seen.numbers), w)
    return len(states)
