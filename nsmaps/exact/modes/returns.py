"""First returns of a system with modes: from event to event until the section is met again."""

import math

from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.modes.flight import NO_FUNCTION, dot, fly, saltation, velocity
from nsmaps.exact.modes.section import enter, picked, starting

MOST_EVENTS = 100_000  # of one return
HIGHEST_CODE = 2**62
RETURNED, ESCAPED, UNDECIDED, INVALID = 0, 3, 4, 6  # of `nsmaps.exact.outcome.Outcome`


@inlined
def lengthened(base, digit, code, power):
    """A word with a letter behind it, and the place of the next letter; below zero where it holds no more."""
    if digit == 0 or code < 0:
        return code, power
    if power > HIGHEST_CODE // base:
        return -code, power
    return code + digit * power, power * base


@inlined
def noted(p, which, mode, k, code, power, w):
    """The itinerary with the minima of a flight and the letter of the event behind it; margins are written."""
    velocity(p, mode, w.z, w.field)
    w.near[1] = min(w.near[1], abs(dot(p.functions[which], w.field)[0]) / p.steps[mode])
    for f in range(p.watched[mode], p.watched[mode + 1]):
        for _ in range(w.minima[f]):
            code, power = lengthened(p.base + 2, p.base + 1, code, power)
        w.near[2] += w.minima[f]
        w.minima[f] = 0
    return lengthened(p.base + 2, p.digit[k], code, power)


@inlined
def cleared(p, k, image, tangent, w):
    """Nothing is known yet: (whether margins are asked for, code of the first letter, place of the next)."""
    for c in range(len(image)):
        image[c] = math.nan
        for j in range(w.dz.shape[1]):
            tangent[c, j] = math.nan
    margins = not math.isnan(w.near[0])
    if margins:
        w.near[0], w.near[1], w.near[2] = math.inf, math.inf, 0.0
        w.minima[:] = 0
    if k < 0:
        return margins, 0, 1
    code, power = lengthened(p.base + 2 if margins else p.base, p.digit[k], 0, 1)
    return margins, code, power


@inlined
def arrived(p, phi, image, tangent, w):
    """Write the image and its derivatives."""
    for c in range(len(p.places)):
        image[c] = phi if p.places[c] < 0 else w.z[p.places[c]]
        for j in range(w.dz.shape[1]):
            tangent[c, j] = w.dphi[j] if p.places[c] < 0 else w.dz[p.places[c], j]


@inner
def first_return(p, row, image, tangent, w):
    """The first return of a row of coordinates: (outcome, code of its word, time, whole turns of the phase)."""
    k, phi = starting(p, row, w)
    margins, code, power = cleared(p, k, image, tangent, w)
    if k < 0:
        return INVALID, 0, math.nan, 0
    mode, time, turns, doubtful = enter(p, k, not p.after, w), 0.0, 0, False
    for _ in range(MOST_EVENTS):
        which, flight, phi, more, unsure = fly(p, mode, phi, w)
        time, turns, doubtful = time + flight, turns + more, doubtful or unsure
        if which == NO_FUNCTION:
            return ESCAPED, code, math.nan, 0
        k, unsure = picked(p, which, w.z)
        doubtful = doubtful or unsure
        if k < 0:
            return UNDECIDED, code, math.nan, 0
        if w.dz.shape[1] > 0:
            saltation(p, mode, which, w)
        if margins:
            code, power = noted(p, which, mode, k, code, power, w)
        else:
            code, power = lengthened(p.base, p.digit[k], code, power)
        if p.target[k] < 0:
            return ESCAPED, code, time, 0
        if p.is_section[k] and not p.after:
            arrived(p, phi, image, tangent, w)
            return UNDECIDED if doubtful else RETURNED, code, time, turns
        mode = enter(p, k, True, w)
        if p.is_section[k]:
            arrived(p, phi, image, tangent, w)
            return UNDECIDED if doubtful else RETURNED, code, time, turns
    return UNDECIDED, code, math.nan, 0


@entry
def first_returns(p, starts, image, turns, codes, outcome, time, tangents, w):
    """First returns of a batch, written row by row; derivatives where there is room for them."""
    for r in range(len(starts)):
        slopes = tangents[r if w.dz.shape[1] > 0 else 0]
        outcome[r], codes[r], time[r], whole = first_return(p, starts[r], image[r], slopes, w)
        for c in range(len(p.places)):
            turns[r, c] = whole if p.places[c] < 0 else 0


@entry
def orbits(p, states, turns, codes, outcome, time, tangents, w):
    """The first n returns of M states, shapes (n + 1, M, ...) and (n, M, ...), whose first row is given."""
    for k in range(len(codes)):
        for r in range(states.shape[1]):
            slopes = tangents[k if w.dz.shape[1] > 0 else 0, r if w.dz.shape[1] > 0 else 0]
            ended = k > 0 and math.isnan(states[k, r, 0])
            outcome[k, r], codes[k, r], time[k, r], whole = first_return(p, states[k, r], states[k + 1, r], slopes, w)
            if ended:
                outcome[k, r] = outcome[k - 1, r]
            for c in range(len(p.places)):
                turns[k, r, c] = whole if p.places[c] < 0 else 0


@entry
def sensitivities(p, starts, moves, w):
    """The derivatives of the images of a batch along the direction of the parameters that the memory holds."""
    for r in range(len(starts)):
        first_return(p, starts[r], w.image, w.column, w)
        for c in range(len(p.places)):
            moves[r, c] = w.column[c, 0]


@entry
def all_itineraries(p, starts, outcome, codes, turns, clearance, slowest, w):
    """Itineraries and margins of the first returns of a batch."""
    for r in range(len(starts)):
        outcome[r], codes[r], _, _ = first_return(p, starts[r], w.image, w.column, w)
        clearance[r], slowest[r], turns[r] = w.near[0], w.near[1], int(w.near[2])
