"""Observables of a system with modes, summed from event to event by observers of the loop of first returns."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.jit import inlined, inner, long_entry
from nsmaps.exact.engine.returns import INVALID
from nsmaps.exact.modes.flights.motion import advance, begin_piece, copy_features, state_at, within_turn
from nsmaps.exact.modes.march.beginning import GOES_ON
from nsmaps.exact.modes.march.returns import (
    MOST_EVENTS,
    PAUSE,
    Limits,
    Return,
    begin_return,
    end_of_return,
    follow_motion,
)
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.march.words import CHATTER, reset_return
from nsmaps.exact.modes.tables.memory import ACCUMULATION_TIME, CONTACT_MARK, CONTACT_TIME, PIECES, SPEED_RATIO
from nsmaps.exact.observables.sums import LEAST, MOST_CHATTER, NODES, at_impact, at_rest, follow_batches, join_panels

ROW, COUNTS = range(2)  # places in `Observation.numbers`
COUNTED = 1  # the number there of returns that count


class Observation(NamedTuple):
    """What the observers of totals work in."""

    q: Any  #: Quantities
    x: Any  #: Memory with the features at the start of the flight under way
    numbers: Any  #: shape (2,), the row of a table by which this flight counts; whether the return counts


class Piece(NamedTuple):
    """A piece of a flight."""

    p: Any  #: Tables
    mode: int
    phase: float  #: at the states of `x`
    x: Any  #: memory with the states at its start


@inner
def over_pieces(p, motion, time, visit, context, x):
    """Call `visit(piece, length, context)` for each piece of a flight of this time: the last piece, and its length.

    The motion is that at its start, and `x` has the features there.
    """
    left, phase = time, motion.phase
    unit = begin_piece(p, motion.mode, left, x)
    while left > unit > 0.0:
        visit(Piece(p, motion.mode, phase, x), unit, context)
        phase, _ = advance(p, motion.mode, 1.0, unit, phase, x)
        left -= unit
        unit = begin_piece(p, motion.mode, left, x)
    piece = Piece(p, motion.mode, phase, x)
    visit(piece, left, context)
    return piece, left


@inlined
def row_of(p, q, k, mode, row):
    """The row of a table by which a flight in a mode counts, that begins at a transition k; `row` where no letter says."""
    if not q.departed:
        return mode
    return p.digit[k] - 1 if p.digit[k] > 0 else row


@inlined
def phase_after(p, phase, time):
    """A phase a time later, within a turn."""
    later, _ = within_turn(phase + p.rate * time)
    return later


@inlined
def write_before(p, q, w):
    """Write the states just before an event among the inputs."""
    for i in range(p.own):
        q.y[i] = w.z[i]


@inner
def join_impact(p, q, k, phase, w):
    """Join the values of an event, whose states before it are written, and of those that follow if they accumulate."""
    changed = 0.0
    for i in range(p.own):
        q.y[p.own + i] = w.z[i]
        changed += abs(q.y[i] - w.z[i])
    if q.departed and changed == 0.0:  # a release, with which a return ends and the next begins
        return
    if w.integers[CONTACT_MARK] == CHATTER and w.reals[CONTACT_TIME] == 0.0:
        join_chatter(p, q, k, phase, w)
    else:
        at_impact(q, k, phase)


@inner
def join_chatter(p, q, k, phase, w):
    """Join the values of impacts that accumulate, of which the states before the first, and in contact, are written.

    Where these states differ by d, those of the impact m differ from contact by r^m d before it, and by -r^(m + 1) d after it. A
    formula that is not zero at speed zero has no finite sum.
    """
    n, left, ratio = p.own, 1.0, w.reals[SPEED_RATIO]
    for i in range(n):
        w.one[i] = q.y[i] - w.z[i]
    for _ in range(MOST_CHATTER):
        if not left > LEAST:
            break
        for i in range(n):
            q.y[i], q.y[n + i] = w.z[i] + left * w.one[i], w.z[i] - left * ratio * w.one[i]
        at_impact(q, k, phase_after(p, phase, w.reals[ACCUMULATION_TIME] * (1.0 - left)))
        left *= ratio
    else:
        q.total[: q.at.shape[1]] = math.nan
    for i in range(n):
        q.y[i], q.y[n + i] = w.z[i], w.z[i]
    at_rest(q, k, phase)


@inner
def instant(q, s, piece):
    """Write the states a time s after the start of a piece; returns the phase."""
    state_at(piece.p, piece.mode, s, piece.x, q.y)
    return phase_after(piece.p, piece.phase, s)


@inner
def join_piece(piece, length, seen):
    """Join the values of a piece of a flight."""
    piece.x.integers[PIECES] += len(NODES)
    join_panels(seen.q, seen.numbers[ROW], length, instant, piece)


@inner
def join_flight(p, motion, flight, seen, w):
    """The observer of flights: join the values of one, and write the states at its end."""
    if seen.numbers[COUNTS] == COUNTED and seen.q.flight != 0 and flight.time > 0.0:
        over_pieces(p, motion, flight.time, join_piece, seen, seen.x)
    write_before(p, seen.q, w)


@inner
def join_event(p, motion, passage, seen, w):
    """The observer of events: join the values of one, but of that which ends a return before its reset."""
    k, q = passage.transition, seen.q
    if k >= 0:
        if seen.numbers[COUNTS] == COUNTED and q.impact != 0 and (passage.outcome == GOES_ON or p.after):
            join_impact(p, q, k, motion.phase, w)
        seen.numbers[ROW] = row_of(p, q, k, passage.motion.mode, seen.numbers[ROW])
    copy_features(p, w, seen.x)


@inner
def join_start(p, motion, k, seen, w):
    """Join the values of the event k at the start of a return, if the section is before its reset."""
    if seen.numbers[COUNTS] == COUNTED and seen.q.impact != 0 and not p.after:
        join_impact(p, seen.q, k, motion.phase, w)
    seen.numbers[ROW] = row_of(p, seen.q, k, motion.mode, motion.mode)
    copy_features(p, w, seen.x)


@inner
def observed_return(p, row, seen, w):
    """The first return of a row of coordinates; of sections before the reset the event at the start counts."""
    k, phase = find_start(p, row, w)
    if k < 0:
        reset_return(w)
        return Return(INVALID, 0, math.nan, 0)
    write_before(p, seen.q, w)
    passage = begin_return(p, k, phase, w)
    join_start(p, passage.motion, k, seen, w)
    if passage.outcome == GOES_ON:
        passage = follow_motion(p, passage.motion, Limits(math.inf, MOST_EVENTS), join_flight, join_event, seen, w)
    return end_of_return(passage)


@inner
def image_of(context, state, counts):
    """Replace coordinates by their image: (outcome, time, pieces of flights); values join the totals if the return `counts`."""
    p, seen, w = context
    seen.numbers[COUNTS] = COUNTED if counts else 0
    found = observed_return(p, state, seen, w)
    for c in range(len(state)):
        state[c] = w.image[c]
    pieces = w.integers[PIECES] + seen.x.integers[PIECES]
    w.integers[PIECES], seen.x.integers[PIECES] = 0, 0
    return found.outcome, found.time, pieces


@long_entry
def observed_modes(p, seen, at, batches, w):
    """Follow M states through the returns of all batches: whether all totals are known, see `follow_batches`."""
    return follow_batches(seen.q, at, batches, PAUSE, image_of, (p, seen, w))
