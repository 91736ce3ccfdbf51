"""Orbits of systems with modes under Ornstein-Uhlenbeck noise, from grid point to grid point of its exact discretisation.

Over a step the noise is the cubic with its values at both ends and its first two integrals: their law is Gaussian and is drawn
exactly. The cubic and its derivatives are states of the table, the last ones, so that flights and events are as those without
noise. Of flights on which only the noise acts, places and speeds at the ends are exact.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import ENDLESS, INVALID, LOST, REPELLING, RESTS, RETURNED, STUCK, UNDECIDED
from nsmaps.exact.modes.flights.states import dot, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import DOUBTED, MOST_DOUBTS, MOST_EVENTS, PAUSE, bounded, cleared, met
from nsmaps.exact.modes.march.section import repelled
from nsmaps.exact.modes.march.starting import starting
from nsmaps.exact.modes.tables.taylor import ROUNDING, sized, weighed
from nsmaps.exact.noise.flight import noise_over, quintic

UNDER_WAY = -1  # the fate of a motion under way; others are values of Outcome
# The record of a motion: its phase, the noise, time since the last return and the last event; and whole numbers
PHASE, ETA, SINCE, ALOFT, NUMBERS = range(5)
MODE, LAST, CODE, POWER, WHOLE, MADE, HITS, EVENTS, DOUBT, STEPS, FATE, COUNTS = range(12)


@inner
def loaded(z, n, h, first, q):
    """Write the noise over a step, the second derivative of a quintic, and its derivatives in units of the step."""
    _, c, d, e = q
    z[n - 4], z[n - 3], z[n - 2], z[n - 1] = first, 6.0 * c * h, 24.0 * d * h * h, 120.0 * e * h * h * h


@inner
def left_behind(p, mode, w):
    """Count anew how many of the first terms of each function are zero, but for rounding, some time after an event."""
    for f in range(p.watched[mode], p.watched[mode + 1]):
        if w.on[f] > 0:
            weighed(p.series[f], w.z, w.a)
            size, k = ROUNDING * sized(p.sizes[f], w.z), 0
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
def begun(p, k, run, count, found, w):
    """Begin the record of a return at an event, with a word of its letter."""
    image, tangent = found.states[count[MADE] + 1, 0], found.tangents[count[MADE], 0]
    count[CODE], count[POWER] = cleared(p, first_event(p, k), image, tangent, w)
    run[SINCE], run[ALOFT], count[EVENTS], count[DOUBT] = 0.0, 0.0, 0, 0


@inner
def returned(p, outcome, run, count, found, eta, w):
    """Write a return that has just ended, whose image is written."""
    i, n = count[MADE], p.first.shape[1] - 1
    for c in range(len(p.places)):
        found.turns[i, 0, c] = count[WHOLE] if p.places[c] < 0 else 0
    found.codes[i, 0], found.time[i, 0] = count[CODE], run[SINCE]
    found.outcome[i, 0], eta[i + 1] = UNDECIDED if count[DOUBT] > 0 else outcome, w.z[n - 4]
    count[WHOLE], count[MADE] = 0, i + 1


@inner
def noted(p, k, speed, run, count, hits):
    """Record an event with a letter in the list of impacts: the letter, the speed and the phase."""
    if k >= 0 and p.digit[k] > 0 and count[HITS] < len(hits):
        hits[count[HITS]] = p.digit[k] - 1.0, speed, run[PHASE]
        count[HITS] += 1


@inner
def met_one(p, which, run, count, found, eta, hits, w):
    """Take the motion through an event, and to the next return if it ends one."""
    velocity(p, count[MODE], w.z, w.field, w)
    speed = -dot(p.functions[which], w.field)[0] / p.steps[count[MODE]]
    image, tangent = found.states[count[MADE] + 1, 0], found.tangents[count[MADE], 0]
    outcome, count[MODE], count[CODE], count[POWER], unsure, k = met(
        p, count[MODE], which, run[PHASE], count[CODE], count[POWER], image, tangent, w
    )
    count[EVENTS] += 1
    count[DOUBT], w.spent[0] = count[DOUBT] + (1 if unsure else 0), w.spent[0] + (DOUBTED if unsure else 0)
    run[ALOFT] = 0.0
    noted(p, k, speed, run, count, hits)
    if outcome in (RETURNED, STUCK):
        returned(p, outcome, run, count, found, eta, w)
        if count[MADE] < len(found.codes):
            begun(p, k, run, count, found, w)
            if not p.after:
                count[MODE] = entered(p, k, True, run[PHASE], w)
    elif outcome != GOES_ON:
        count[FATE] = outcome
    elif count[DOUBT] > MOST_DOUBTS:
        count[FATE] = UNDECIDED
    elif count[EVENTS] > MOST_EVENTS:
        count[FATE] = ENDLESS


@inner
def through(p, h, run, count, found, eta, hits, w):
    """Advance through one step: every event in it, up to the last return for which there is room."""
    left = h
    while count[FATE] == UNDER_WAY and count[MADE] < len(found.codes):
        if repelled(p, count[MODE], w):
            count[FATE] = REPELLING
            break
        which, flight, run[PHASE], more, unsure = fly(p, count[MODE], run[PHASE], left, w)
        left, run[SINCE], run[ALOFT] = left - flight, run[SINCE] + flight, run[ALOFT] + flight
        w.held[0] += flight
        count[WHOLE] += more
        count[DOUBT] += 1 if unsure else 0
        if not bounded(w) or run[ALOFT] > p.horizon:
            count[FATE] = RESTS if p.resting[count[MODE]] else LOST
        elif which == NO_FUNCTION:
            break
        else:
            met_one(p, which, run, count, found, eta, hits, w)


@long_entry
def ready(p, sigma, normal, run, count, found, eta, w):
    """Prepare a motion for its first step."""
    row = found.states[0, 0]
    count[LAST], run[PHASE] = starting(p, row, w)
    run[ETA], eta[0], count[FATE] = sigma * normal, sigma * normal, INVALID if count[LAST] < 0 else UNDER_WAY
    for c in range(len(p.places)):
        if p.places[c] < 0 and count[LAST] >= 0:
            count[WHOLE] = math.floor(row[c] / TWO_PI)


@long_entry
def noisy_motion(p, h, step, normals, at, run, count, found, eta, hits, w):
    """Advance through as many steps as there are normals, shape (steps, parts, 3), or as there is room for returns.

    Step `at` is the first; the number of those that are known after about `PAUSE` pieces of flights.
    """
    n, w.spent[0] = p.first.shape[1] - 1, 0
    for j in range(at, len(normals)):
        if w.spent[0] > PAUSE:
            return j
        if count[FATE] != UNDER_WAY or count[MADE] == len(found.codes):
            break
        a, b, last = noise_over(normals[j], step, run[ETA])
        loaded(w.z, n, h, run[ETA], quintic(h, run[ETA], a, b, last))
        if count[STEPS] == 0:
            begun(p, count[LAST], run, count, found, w)
            count[MODE] = entered(p, count[LAST], not p.after, run[PHASE], w)
        if count[STEPS] > 0 or run[ETA] != 0.0:  # coordinates give a state of the system without noise
            left_behind(p, count[MODE], w)
        through(p, h, run, count, found, eta, hits, w)
        run[ETA] = last
        count[STEPS] += 1
    return len(normals)


@long_entry
def finish(count, found, eta):
    """Fill the record of a motion that ended."""
    for i in range(count[MADE], len(found.codes)):
        found.states[i + 1, 0, :], eta[i + 1], found.time[i, 0] = math.nan, math.nan, math.nan
        found.turns[i, 0, :], found.codes[i, 0], found.outcome[i, 0] = 0, 0, count[FATE]
