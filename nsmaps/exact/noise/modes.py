"""Orbits of systems with modes under Ornstein-Uhlenbeck noise, from grid point to grid point of its exact discretisation.

Over a step the noise is the cubic with its values at both ends and its first two integrals: their law is Gaussian and is drawn
exactly (D. T. Gillespie, Phys. Rev. E 54, 1996). The cubic and its derivatives are states of the table, the last own ones, so
that flights and events, of affine and of nonlinear modes, are as those without noise. Of flights on which only the noise acts,
places and speeds at the ends are exact.
"""

from typing import Any, NamedTuple

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import ENDLESS, INVALID, LOST, REPELLING, RESTS, RETURNED, STUCK, UNDECIDED
from nsmaps.exact.modes.flights.motion import begin_piece, copy_features
from nsmaps.exact.modes.flights.pieces import combine, sizes_of
from nsmaps.exact.modes.flights.states import derive, dot, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON, begin_mode
from nsmaps.exact.modes.march.events import Motion
from nsmaps.exact.modes.march.returns import (
    MOST_EVENTS,
    PAUSE,
    Limits,
    Return,
    begin_next_return,
    enter_return,
    follow_motion,
    write_image,
    write_return,
)
from nsmaps.exact.modes.march.section import is_repelled
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.tables.memory import NO_FUNCTION, PIECES
from nsmaps.exact.modes.tables.taylor import ROUNDING, TERMS, combine_rows, weighted_size
from nsmaps.exact.noise.flight import noise_over, quintic
from nsmaps.exact.observables.motions import join_event, join_flight, join_start, write_before
from nsmaps.exact.observables.sums import begin_totals

UNDER_WAY = -1  # the fate of a motion under way; others are values of Outcome
# The record of a motion: its phase, the noise, time since the return began, when the last event took place, and its speed; and
# whole numbers, of which DRAWN is the number of the next step among those drawn
PHASE, ETA, SINCE, EVENT_TIME, SPEED, NUMBERS = range(6)
MODE, LAST, CODE, POWER, WHOLE, MADE, HITS, EVENTS, DOUBT, STEPS, DRAWN, FATE, COUNTS = range(13)
VALUE, FIRST, SECOND, THIRD = range(4)  # the noise and its derivatives, the last own states
DERIVATIVES = 4
CUBED, FOURTH, FIFTH = 6.0, 24.0, 120.0  # factorials of 3, 4, 5: derivatives of powers
START, ONE = 0, 0  # the row of the start, and the one motion of a record


class MotionRecord(NamedTuple):
    """A motion under way."""

    run: Any  #: shape (NUMBERS,)
    count: Any  #: shape (COUNTS,)


class Realisation(NamedTuple):
    """Arrays for n returns of one motion."""

    found: Any  #: a `Record` of one motion
    eta: Any  #: shape (n + 1,), the noise at each state
    hits: Any  #: shape (k, 3), of the first events that have a letter: its number, the speed, the phase


class Grid(NamedTuple):
    """The grid in time."""

    step: float
    law: Any  #: shape (2, 3, 3), of a part of a step: see `nsmaps.dynamics.noise.orbits.exact_step`


@inner
def write_noise(p, h, first, q, w):
    """Write the noise over a step, the second derivative of a quintic, and its derivatives in units of the step."""
    _, c, d, e = q
    n = p.own - DERIVATIVES
    w.z[n + VALUE], w.z[n + FIRST] = first, CUBED * c * h
    w.z[n + SECOND], w.z[n + THIRD] = FOURTH * d * h * h, FIFTH * e * h * h * h
    derive(p, w.z, w)


@inner
def series_of(p, f, w):
    """Write the series of a function from the state in memory on: the sum of the sizes of its terms."""
    if len(p.nonlinear) > 0:
        combine(p, f, w)
        size, _ = sizes_of(p, f, w)
        return size
    combine_rows(p.series[f], w.z, w.a)
    return weighted_size(p.sizes[f], w.z)


@inner
def recount_zeros(p, mode, h, w):
    """Count anew how many of the first terms of each function are zero, but for rounding, some time after an event."""
    after, some = mode + 1, False
    for f in range(p.watched[mode], p.watched[after]):
        some = some or 0 < w.on[f] < TERMS
    if not some or begin_piece(p, mode, h, w) <= 0.0:
        return
    for f in range(p.watched[mode], p.watched[after]):
        if 0 < w.on[f] < TERMS:
            size, k = ROUNDING * series_of(p, f, w), 0
            while k < w.on[f] and abs(w.a[k]) <= size:
                k += 1
            w.on[f] = k


@inner
def end_return(p, outcome, motion, out, w):
    """Write a return that has just ended, whose image is in memory."""
    run, count = motion
    i = count[MADE]
    after = i + 1
    write_image(out.found, i, ONE, w)
    ended = Return(UNDECIDED if count[DOUBT] > 0 else outcome, count[CODE], run[SINCE], count[WHOLE])
    write_return(p, out.found, i, ONE, ended)
    out.eta[after] = w.z[p.own - DERIVATIVES]
    count[MADE] = after


@inner
def write_motion(motion, now):
    """Write a motion of the loop of first returns to the record."""
    run, count = motion
    count[MODE], run[PHASE], count[CODE], count[POWER] = now.mode, now.phase, now.code, now.power
    run[SINCE], count[WHOLE], count[DOUBT] = now.time, now.turns, now.doubts


@inner
def observe_flight(p, now, flight, context, w):
    """The observer of flights, to an event or to the end of a step: totals, and the speed at which the event's function falls."""
    (run, _), _, o = context
    join_flight(p, now, flight, o, w)
    if flight.function != NO_FUNCTION:
        velocity(p, now.mode, w.z, w.field, w)
        run[SPEED] = -dot(p.functions[flight.function], w.field).value / p.steps[now.mode]


@inner
def observe_event(p, now, passage, context, w):
    """The observer of events: totals, and the list of impacts: the letter, the speed and the phase of events with a letter."""
    (run, count), out, o = context
    k = passage.transition
    join_event(p, now, passage, o, w)
    count[EVENTS] += 1
    run[EVENT_TIME] = now.time
    if k >= 0 and p.digit[k] > 0 and count[HITS] < len(out.hits):
        out.hits[count[HITS]] = p.digit[k] - 1.0, run[SPEED], now.phase
        count[HITS] += 1


@inner
def continue_from(p, passage, motion, o, w):
    """Begin the return after one that has ended."""
    run, count = motion
    write_before(p, o.q, w)
    passage = begin_next_return(p, passage, w)
    if not p.after:
        join_start(p, passage.motion, passage.transition, o, w)
    write_motion(motion, passage.motion)
    run[EVENT_TIME], count[EVENTS] = 0.0, 0
    count[FATE] = UNDER_WAY if passage.outcome == GOES_ON else passage.outcome


@inner
def advance(p, h, motion, out, o, w):
    """Advance through one step: every event in it, up to the last return for which there is room."""
    run, count = motion
    left = h
    while count[FATE] == UNDER_WAY and count[MADE] < len(out.found.codes):
        if is_repelled(p, count[MODE], w):
            count[FATE] = REPELLING
            break
        copy_features(p, w, o.x)
        since = run[SINCE]
        now = Motion(count[MODE], run[PHASE], count[CODE], count[POWER], since, count[WHOLE], count[DOUBT])
        limits = Limits(since + left, MOST_EVENTS + 1 - count[EVENTS])
        passage = follow_motion(p, now, limits, observe_flight, observe_event, (motion, out, o), w)
        write_motion(motion, passage.motion)
        left -= run[SINCE] - since
        if passage.outcome in (RETURNED, STUCK):
            end_return(p, passage.outcome, motion, out, w)
            if count[MADE] < len(out.found.codes):
                continue_from(p, passage, motion, o, w)
        elif passage.outcome != GOES_ON:
            count[FATE] = passage.outcome
        elif count[EVENTS] > MOST_EVENTS:
            count[FATE] = ENDLESS
        elif run[SINCE] - run[EVENT_TIME] > p.horizon:
            count[FATE] = RESTS if p.resting[count[MODE]] else LOST
        else:
            break


@long_entry
def prepare(p, first, motion, out, w):
    """Prepare a motion for its first step, with the noise at its start."""
    run, count = motion
    row = out.found.states[START, ONE]
    count[LAST], run[PHASE] = find_start(p, row, w)
    run[ETA], out.eta[START], count[FATE] = first, first, INVALID if count[LAST] < 0 else UNDER_WAY


@long_entry
def noisy_motion(p, grid, normals, motion, out, o, w):
    """Advance through as many steps as there are normals, shape (S, K, 3) of K parts of a step, or as there is room for returns.

    Step `DRAWN` is the first; it pauses after about `PAUSE` pieces of flights.
    """
    run, count = motion
    w.integers[PIECES], o.x.integers[PIECES] = 0, 0
    while count[DRAWN] < len(normals) and w.integers[PIECES] + o.x.integers[PIECES] <= PAUSE:
        if count[FATE] != UNDER_WAY or count[MADE] == len(out.found.codes):
            count[DRAWN] = len(normals)
            break
        a, b, last = noise_over(normals[count[DRAWN]], grid.law, run[ETA])
        write_noise(p, grid.step, run[ETA], quintic(grid.step, run[ETA], a, b, last), w)
        if count[STEPS] == 0:
            begin_totals(o.q)
            write_before(p, o.q, w)
            now = enter_return(p, count[LAST], run[PHASE], w)
            join_start(p, now, count[LAST], o, w)
            write_motion(motion, now)
            if run[ETA] == 0.0:  # coordinates give a state of the system without noise
                outcome = begin_mode(p, now.mode, w)
                count[FATE] = UNDER_WAY if outcome == GOES_ON else outcome
        if count[STEPS] > 0 or run[ETA] != 0.0:
            recount_zeros(p, count[MODE], grid.step, w)
        advance(p, grid.step, motion, out, o, w)
        run[ETA] = last
        count[STEPS], count[DRAWN] = count[STEPS] + 1, count[DRAWN] + 1
