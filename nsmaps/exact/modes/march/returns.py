"""First returns of a system with modes: from event to event until the section is met again."""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import (
    ACCUMULATES,
    BLOCKED,
    ENDLESS,
    INVALID,
    LOST,
    REPELLING,
    RESTS,
    RETURNED,
    SIMULTANEOUS,
    STUCK,
    UNDECIDED,
    append_symbol,
)
from nsmaps.exact.modes.flights.motion import within_turn
from nsmaps.exact.modes.flights.states import dot, features, shift, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON, begins, rates, timely
from nsmaps.exact.modes.march.flight import NO_FUNCTION, WHY, fly, saltation
from nsmaps.exact.modes.march.resting import entered, in_a_row, marked, shortened
from nsmaps.exact.modes.march.section import picked
from nsmaps.exact.modes.march.starting import starting
from nsmaps.exact.modes.march.together import due, order_matters

MOST_EVENTS = 100_000  # of one return
MOST_DOUBTS = 200  # doubtful events of one return
PAUSE = 500_000  # pieces of flights, within about a second, after which Ctrl-C is heard
DOUBTED = 1_000  # pieces of flights that take as long as one doubtful event


@inner
def lengthened(base, digit, code, power):
    """A word with the letter of an event behind it, if it has one, and the place of the next letter."""
    return append_symbol(code, power, base, digit, 1 if digit else 0)


@inner
def noted(p, which, mode, k, code, power, w):
    """The itinerary with the minima of a flight and the letter of the event behind it; margins are written."""
    velocity(p, mode, w.z, w.field, w)
    w.near[1] = min(w.near[1], abs(dot(p.functions[which], w.field)[0]) / (p.steps[mode] * w.units[which]))
    for f in range(p.watched[mode], p.watched[mode + 1]):
        for _ in range(w.minima[f]):
            code, power = lengthened(p.base + 2, p.base + 1, code, power)
        w.near[2] += w.minima[f]
        w.minima[f] = 0
    return lengthened(p.base + 2, p.digit[k], code, power)


@inner
def cleared(p, k, image, tangent, w):
    """Nothing is known yet: (code of the first letter, place of the next)."""
    for c in range(len(image)):
        image[c] = math.nan
        for j in range(w.dz.shape[1]):
            tangent[c, j] = math.nan
    margins = not math.isnan(w.near[0])
    w.held[1], w.row[0] = 0.0, 0
    w.lapse[1], w.lapse[2], w.lapse[3], w.both[0] = 0.0, math.inf, 0.0, NO_FUNCTION
    w.doubt[0], w.doubt[WHY] = -1.0, 0.0
    w.scales[:] = 0.0
    w.idle[0], w.idle[1], w.idle[2], w.idle[3] = 0, NO_FUNCTION, NO_FUNCTION, 0
    if margins:
        w.near[0], w.near[1], w.near[2] = math.inf, math.inf, 0.0
        w.minima[:] = 0
    if k < 0:
        return 0, 1
    code, power = lengthened(p.base + 2 if margins else p.base, p.digit[k], 0, 1)
    in_a_row(p.digit[k], code, power, w)
    return code, power


@inner
def arrived(p, phi, image, tangent, w):
    """Write the image and its derivatives."""
    for c in range(len(p.places)):
        image[c] = phi if p.places[c] < 0 else w.z[p.places[c]]
        for j in range(w.dz.shape[1]):
            tangent[c, j] = w.dphi[j] if p.places[c] < 0 else w.dz[p.places[c], j]


@inner
def bounded(w):
    """Whether a state has not grown beyond the range of floats."""
    total = 0.0
    for j in range(len(w.z)):
        total += abs(w.z[j])
    return total < math.inf


@inner
def met(p, mode, which, phi, code, power, image, tangent, w):
    """Take the state through an event, as `happens`, or through two."""
    if w.both[0] == NO_FUNCTION:
        return happens(p, mode, which, phi, code, power, image, tangent, w)
    return both_met(p, mode, which, phi, code, power, image, tangent, w)


@inner
def both_met(p, mode, which, phi, code, power, image, tangent, w):
    """Take the state through two events that are met at once, if their order does not matter; as `happens`."""
    one, two = w.both[0], w.both[1]
    if order_matters(p, one, two, phi, w):
        return SIMULTANEOUS, mode, code, power, True, which
    outcome, mode, code, power, doubtful, k = one_met(p, mode, which, phi, code, power, image, tangent, w)
    second = due(p, two if which == one else one, mode, w.z, True, w) if outcome == GOES_ON else -1
    if second >= 0:
        outcome, mode, code, power, unsure, k = one_met(p, mode, second, phi, code, power, image, tangent, w)
        doubtful = doubtful or unsure
        first = due(p, which, mode, w.z, False, w) if outcome == GOES_ON else -1
        if first >= 0:
            w.on[first] = max(w.on[first], 1)
    return outcome, mode, code, power, doubtful, k


@inner
def one_met(p, mode, which, phi, code, power, image, tangent, w):
    """As `happens`, compiled once."""
    return happens(p, mode, which, phi, code, power, image, tangent, w)


@inner
def happens(p, mode, which, phi, code, power, image, tangent, w):
    """Take the state through an event.

    (outcome, or GOES_ON; mode that follows; word; place of its next letter; whether doubtful; transition).
    """
    k, doubtful = picked(p, which, w.z, w)
    w.doubt[0] = which if (doubtful or k < 0) and w.doubt[0] < 0.0 else w.doubt[0]
    if k < 0:
        return UNDECIDED, mode, code, power, True, k
    if w.dz.shape[1] > 0:
        saltation(p, mode, which, w)
    held = False
    if p.target[k] < 0 or p.is_section[k] or not p.resting[p.target[k]]:
        code, power, held = marked(p, code, power, w)
    if math.isnan(w.near[0]):
        code, power = lengthened(p.base, p.digit[k], code, power)
    else:
        code, power = noted(p, which, mode, k, code, power, w)
    in_a_row(p.digit[k], code, power, w)
    if p.target[k] < 0:
        return LOST, mode, code, power, doubtful, k
    returned, outcome = p.is_section[k] and (held or not p.releases[k]), STUCK if p.releases[k] else RETURNED
    if returned and not p.after:
        arrived(p, phi, image, tangent, w)
        return outcome, mode, code, power, doubtful, k
    mode = entered(p, k, True, phi, w)
    code, power = shortened(code, power, w)
    if returned and w.lapse[1] == 0.0:
        arrived(p, phi, image, tangent, w)
        return outcome, mode, code, power, doubtful, k
    return begins(p, mode, w), mode, code, power, doubtful, k


@inner
def settled(outcome, code, time, turns, doubtful):
    """A return that has ended, in the form of `first_return`."""
    if outcome in (RETURNED, STUCK, LOST):
        return UNDECIDED if doubtful else outcome, code, time, turns if outcome != LOST else 0
    return outcome, code, time if outcome in (SIMULTANEOUS, REPELLING, ACCUMULATES, BLOCKED) else math.nan, 0


@inner
def onward(p, mode, phi, code, power, image, tangent, w):
    """From a state in a mode to the section: (outcome, code of its word, time, whole turns of the phase)."""
    time, turns, doubts = 0.0, 0, 0
    outcome = begins(p, mode, w)
    if outcome != GOES_ON:
        return settled(outcome, code, time, turns, False)
    for _ in range(MOST_EVENTS):
        which, flight, phi, more, unsure = fly(p, mode, phi, math.inf, w)
        since, time, turns, doubts = time, time + flight, turns + more, doubts + (1 if unsure else 0)
        w.held[0] += flight
        if which == NO_FUNCTION or not bounded(w):
            ended = RESTS if p.resting[mode] and flight >= p.horizon else UNDECIDED if doubts > 0 and bounded(w) else LOST
            return ended, marked(p, code, power, w)[0], since + w.lapse[3] if ended == RESTS else math.nan, 0
        outcome, mode, code, power, unsure, _ = met(p, mode, which, phi, code, power, image, tangent, w)
        doubts, w.spent[0] = doubts + (1 if unsure else 0), w.spent[0] + (DOUBTED if unsure else 0)
        w.doubt[1] = time if doubts == 1 and unsure else w.doubt[1]
        outcome = timely(p, outcome, mode, which, time, image, tangent, w)
        if outcome != GOES_ON:
            return settled(outcome, code, time, turns, doubts > 0)
        if doubts > MOST_DOUBTS:
            return UNDECIDED, code, math.nan, 0
    return ENDLESS, code, math.nan, 0


@inner
def first_return(p, row, image, tangent, w):
    """The first return of a row of coordinates: (outcome, code of its word, time, whole turns of the phase)."""
    k, phi = starting(p, row, w)
    code, power = cleared(p, k, image, tangent, w)
    if k < 0:
        return INVALID, 0, math.nan, 0
    if p.bounces[k] < 0 and p.impacts[k] < 0:  # no event that may follow itself
        w.lapse[2] = p.function[k]
        rates(p, p.mode[k], w.start[0], w)
    mode = entered(p, k, not p.after, phi, w)
    if w.lapse[2] < math.inf:
        rates(p, mode, w.start[1], w)
    return onward(p, mode, phi, code, power, image, tangent, w)


@inner
def first_arrival(p, mode, state, phase, image, tangent, w):
    """The first arrival at the section of a state in a mode, -1 for none, as `first_return`; directions are states and phase."""
    code, power = cleared(p, -1, image, tangent, w)
    if mode < 0:
        return INVALID, 0, math.nan, 0
    n, turns = len(state), math.floor(phase / TWO_PI)
    phi, _ = within_turn(phase - turns * TWO_PI)
    for i in range(n):
        w.z[i] = state[i]
    features(p, phi, w)
    for c in range(w.dz.shape[1]):
        for i in range(n + 1):
            w.dz[i, c] = 1.0 if i == c and c < n else 0.0
        w.dphi[c] = 1.0 if c == n else 0.0
    shift(p, w)
    w.held[0], w.on[:] = 0.0, 0
    outcome, code, time, more = onward(p, mode, phi, code, power, image, tangent, w)
    return outcome, code, time, more + turns


@inner
def put(p, found, r, k, ended, w):
    """Write how return number r of a motion ended, in a record that has its image."""
    outcome, found.codes[r, k], found.time[r, k], whole = ended
    found.outcome[r, k] = found.outcome[r - 1, k] if r > 0 and math.isnan(found.states[r, k, 0]) else outcome
    for c in range(len(p.places)):
        before = math.floor(found.states[r, k, c] / TWO_PI) if outcome != INVALID else 0
        found.turns[r, k, c] = whole + before if p.places[c] < 0 else 0
    for c in range(3):
        found.near[r, k, c] = w.near[c]


@inner
def alone(p, found, r, k, w):
    """Return number r of a motion by itself, written to a record."""
    put(p, found, r, k, first_return(p, found.states[r, k], found.states[r + 1, k], found.tangents[r, k], w), w)


@long_entry
def arrivals(p, modes, states, phases, found, begin, w):
    """The first arrivals at the section of states in modes, from one on, written to a `Record` of one return.

    The number of those that are known after about `PAUSE` pieces of flights.
    """
    w.spent[0] = 0
    for r in range(begin, len(modes)):
        if w.spent[0] > PAUSE:
            return r
        found.outcome[0, r], found.codes[0, r], found.time[0, r], turns = first_arrival(
            p, modes[r], states[r], phases[r], found.states[1, r], found.tangents[0, r], w
        )
        for c in range(len(p.places)):
            found.turns[0, r, c] = turns if p.places[c] < 0 else 0
    return len(modes)
