"""Orbits of systems with modes under Ornstein-Uhlenbeck noise, from grid point to grid point of its exact discretisation.

Over a step the noise is the cubic with its values at both ends and its first two integrals: their law is Gaussian and is drawn
exactly (D. T. Gillespie, Phys. Rev. E 54, 1996). The cubic and its derivatives are states of the table, the last own ones, so
that flights and events, of affine and of nonlinear modes, are as those without noise. Of flights on which only the noise acts,
places and speeds at the ends are exact.
"""

import math
from typing import Any, NamedTuple

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import ENDLESS, INVALID, LOST, REPELLING, RESTS, RETURNED, STUCK, UNDECIDED
from nsmaps.exact.modes.flights.motion import begin_piece, copy_features
from nsmaps.exact.modes.flights.pieces import combine
from nsmaps.exact.modes.flights.states import derive, dot, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON, begins
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import DOUBTED, MOST_DOUBTS, MOST_EVENTS, PAUSE, bounded, cleared, met
from nsmaps.exact.modes.march.section import repelled
from nsmaps.exact.modes.march.starting import starting
from nsmaps.exact.modes.tables.taylor import ROUNDING, TERMS, sized, weighed
from nsmaps.exact.noise.flight import noise_over, quintic
from nsmaps.exact.observables.motions import SINCE as CONTACT_TIME
from nsmaps.exact.observables.motions import before, event, over_flight, row_of
from nsmaps.exact.observables.sums import begin_totals

UNDER_WAY = -1  # the fate of a motion under way; others are values of Outcome
# The record of a motion: its phase, the noise, time since the last return and the last event; and whole numbers, of which ROW is
# that of a table by which the flight under way counts for observables, and DRAWN the number of the next step among those drawn
PHASE, ETA, SINCE, ALOFT, NUMBERS = range(5)
MODE, LAST, ROW, CODE, POWER, WHOLE, MADE, HITS, EVENTS, DOUBT, STEPS, DRAWN, FATE, COUNTS = range(14)
VALUE, FIRST, SECOND, THIRD = range(4)  # the noise and its derivatives, the last own states
DERIVATIVES = 4
CUBED, FOURTH, FIFTH = 6.0, 24.0, 120.0  # factorials of 3, 4, 5: derivatives of powers
SPENT = 0  # the place of the number in `Memory.spent`
START, ONE = 0, 0  # the row of the start, and the one motion of a record


class Motion(NamedTuple):
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


class Observation(NamedTuple):
    """What is added up along a motion."""

    q: Any  #: Quantities, of no formulas where nothing is
    x: Any  #: memory for states along flights


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
        size, _ = combine(p, f, w)
        return size
    weighed(p.series[f], w.z, w.a)
    return sized(p.sizes[f], w.z)


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
def first_event(p, k):
    """The event with which a word begins after event k: the impact, where that is a release."""
    for j in range(len(p.contacts)):
        if p.releases[k] and p.contacts[j] >= 0 and p.target[j] == p.mode[k]:
            for i in range(len(p.impacts)):
                if p.impacts[i] == p.contacts[j]:
                    return i
    return k


@inner
def begin_return(p, k, motion, out, w):
    """Begin the record of a return at an event, with a word of its letter."""
    run, count = motion
    number = count[MADE]
    after = number + 1
    image, tangent = out.found.states[after, ONE], out.found.tangents[number, ONE]
    count[CODE], count[POWER] = cleared(p, first_event(p, k), image, tangent, w)
    run[SINCE], run[ALOFT], count[EVENTS], count[DOUBT] = 0.0, 0.0, 0, 0


@inner
def leave_section(p, k, motion, o, w):
    """Take a motion, whose start or image is taken before the reset, through that of event k; the event counts here."""
    run, count = motion
    before(p, o.q, w)
    count[MODE] = entered(p, k, not p.after, run[PHASE], w)
    if o.q.impact != 0 and not p.after:
        event(p, o.q, k, run[PHASE], w)


@inner
def begin_flight(p, motion, w):
    """Let a motion continue in its mode, or end it there."""
    _, count = motion
    outcome = begins(p, count[MODE], w)
    count[FATE] = UNDER_WAY if outcome == GOES_ON else outcome


@inner
def write_return(p, outcome, motion, out, w):
    """Write a return that has just ended, whose image is written."""
    run, count = motion
    i = count[MADE]
    after = i + 1
    for c in range(len(p.places)):
        out.found.turns[i, ONE, c] = count[WHOLE] if p.places[c] < 0 else 0
    out.found.codes[i, ONE], out.found.time[i, ONE] = count[CODE], run[SINCE]
    out.found.outcome[i, ONE] = UNDECIDED if count[DOUBT] > 0 else outcome
    out.eta[after] = w.z[p.own - DERIVATIVES]
    count[WHOLE], count[MADE] = 0, after


@inner
def list_impact(p, k, speed, motion, hits):
    """Write an event with a letter to the list of impacts: the letter, the speed and the phase."""
    run, count = motion
    if k >= 0 and p.digit[k] > 0 and count[HITS] < len(hits):
        hits[count[HITS]] = p.digit[k] - 1.0, speed, run[PHASE]
        count[HITS] += 1


@inner
def take_event(p, which, motion, out, o, w):
    """Take the motion through an event, and to the next return if it ends one."""
    run, count = motion
    velocity(p, count[MODE], w.z, w.field, w)
    rate, _ = dot(p.functions[which], w.field)
    speed, number = -rate / p.steps[count[MODE]], count[MADE]
    after = number + 1
    image, tangent = out.found.states[after, ONE], out.found.tangents[number, ONE]
    before(p, o.q, w)
    outcome, count[MODE], count[CODE], count[POWER], unsure, k = met(
        p, count[MODE], which, run[PHASE], count[CODE], count[POWER], image, tangent, w
    )
    count[EVENTS] += 1
    count[DOUBT], w.spent[SPENT] = count[DOUBT] + (1 if unsure else 0), w.spent[SPENT] + (DOUBTED if unsure else 0)
    run[ALOFT] = 0.0
    list_impact(p, k, speed, motion, out.hits)
    if o.q.impact != 0 and k >= 0 and (outcome == GOES_ON or p.after):
        event(p, o.q, k, run[PHASE], w)
    count[ROW] = row_of(p, o.q, k, count[MODE], count[ROW]) if k >= 0 else count[ROW]
    if outcome in (RETURNED, STUCK):
        write_return(p, outcome, motion, out, w)
        if count[MADE] < len(out.found.codes):
            begin_return(p, k, motion, out, w)
            if not p.after:
                leave_section(p, k, motion, o, w)
                count[ROW] = row_of(p, o.q, k, count[MODE], count[ROW])
            begin_flight(p, motion, w)
    elif outcome != GOES_ON:
        count[FATE] = outcome
    elif count[DOUBT] > MOST_DOUBTS:
        count[FATE] = UNDECIDED
    elif count[EVENTS] > MOST_EVENTS:
        count[FATE] = ENDLESS


@inner
def advance(p, h, motion, out, o, w):
    """Advance through one step: every event in it, up to the last return for which there is room."""
    run, count = motion
    left = h
    while count[FATE] == UNDER_WAY and count[MADE] < len(out.found.codes):
        if repelled(p, count[MODE], w):
            count[FATE] = REPELLING
            break
        phase = run[PHASE]
        if o.q.flight != 0:
            copy_features(p, w, o.x)
        which, flight, run[PHASE], more, unsure = fly(p, count[MODE], phase, left, w)
        if o.q.flight != 0 and flight > 0.0:
            over_flight(p, o.q, count[MODE], count[ROW], phase, flight, o.x)
        left, run[SINCE], run[ALOFT] = left - flight, run[SINCE] + flight, run[ALOFT] + flight
        w.held[CONTACT_TIME] += flight
        count[WHOLE] += more
        count[DOUBT] += 1 if unsure else 0
        if not bounded(w) or run[ALOFT] > p.horizon:
            count[FATE] = RESTS if p.resting[count[MODE]] else LOST
        elif which == NO_FUNCTION:
            break
        else:
            take_event(p, which, motion, out, o, w)


@long_entry
def prepare(p, first, motion, out, w):
    """Prepare a motion for its first step, with the noise at its start."""
    run, count = motion
    row = out.found.states[START, ONE]
    count[LAST], run[PHASE] = starting(p, row, w)
    run[ETA], out.eta[START], count[FATE] = first, first, INVALID if count[LAST] < 0 else UNDER_WAY
    for c in range(len(p.places)):
        if p.places[c] < 0 and count[LAST] >= 0:
            count[WHOLE] = math.floor(row[c] / TWO_PI)


@long_entry
def noisy_motion(p, grid, normals, motion, out, o, w):
    """Advance through as many steps as there are normals, shape (S, parts, 3), or as there is room for returns.

    Step `DRAWN` is the first; it pauses after about `PAUSE` pieces of flights.
    """
    run, count = motion
    w.spent[SPENT], o.x.spent[SPENT] = 0, 0
    while count[DRAWN] < len(normals) and w.spent[SPENT] + o.x.spent[SPENT] <= PAUSE:
        if count[FATE] != UNDER_WAY or count[MADE] == len(out.found.codes):
            count[DRAWN] = len(normals)
            break
        a, b, last = noise_over(normals[count[DRAWN]], grid.law, run[ETA])
        write_noise(p, grid.step, run[ETA], quintic(grid.step, run[ETA], a, b, last), w)
        if count[STEPS] == 0:
            begin_totals(o.q)
            begin_return(p, count[LAST], motion, out, w)
            leave_section(p, count[LAST], motion, o, w)
            count[ROW] = row_of(p, o.q, count[LAST], count[MODE], count[MODE])
            if run[ETA] == 0.0:  # coordinates give a state of the system without noise
                begin_flight(p, motion, w)
        if count[STEPS] > 0 or run[ETA] != 0.0:
            recount_zeros(p, count[MODE], grid.step, w)
        advance(p, grid.step, motion, out, o, w)
        run[ETA] = last
        count[STEPS], count[DRAWN] = count[STEPS] + 1, count[DRAWN] + 1
