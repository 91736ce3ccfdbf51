"""The loop of systems with modes, from event to event, which calls observers; first returns, and arrivals at the section."""

import math
from typing import NamedTuple

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inlined, inner, long_entry
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
)
from nsmaps.exact.modes.flights.motion import within_turn
from nsmaps.exact.modes.flights.states import features, shift
from nsmaps.exact.modes.march.beginning import GOES_ON, begin_mode, outcome_in_time, write_rates
from nsmaps.exact.modes.march.events import Motion, Passage, take_events
from nsmaps.exact.modes.march.flight import fly
from nsmaps.exact.modes.march.resting import enter_mode
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.march.words import REST, append_contact, first_event_of_word, first_letter, reset_return
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATION_TIME,
    AFTER,
    BEFORE,
    CONTACT_MARK,
    CONTACT_TIME,
    DOUBT_TIME,
    FIRST,
    NO_FUNCTION,
    PIECES,
    START_FUNCTION,
)

MOST_EVENTS = 100_000  # of one return
MOST_DOUBTS = 200  # doubtful flights and events of one return
PAUSE = 500_000  # pieces of flights, within about a second, after which Ctrl-C is heard
DOUBTED = 1_000  # pieces of flights that take as long as one doubtful event


class Limits(NamedTuple):
    """At which a motion stops before the section."""

    time: float  #: since the return began
    events: int  #: number of events


class Return(NamedTuple):
    """How a return ended; its image is in memory."""

    outcome: int  #: a value of Outcome
    code: int  #: of its word
    time: float  #: on the way, or to where it ended; NaN where that is not known
    turns: int  #: whole turns of the phase on the way


@inner
def enter_return(p, k, phase, w):
    """Begin a return with a transition: a `Motion`, whose mode is still to begin.

    Its state just before it, or of sections `after` their events just after it, is in memory.
    """
    reset_return(w)
    code, power = first_letter(p, k, w)
    once = p.bounces[k] < 0 and p.impacts[k] < 0  # the event may not follow itself
    if once:
        w.integers[START_FUNCTION] = p.function[k]
        write_rates(p, p.mode[k], w.start_rates[BEFORE], w)
    mode = enter_mode(p, k, not p.after, phase, w)
    if once:
        write_rates(p, mode, w.start_rates[AFTER], w)
    return Motion(mode, phase, code, power, 0.0, 0, 0)


@inner
def begin_return(p, k, phase, w):
    """As `enter_return`; the `Passage` through the transition."""
    motion = enter_return(p, k, phase, w)
    return Passage(begin_mode(p, motion.mode, w), motion, k)


@inner
def begin_next_return(p, passage, w):
    """Begin the return after one that has ended on the section, from its state in memory: the `Passage` through the event."""
    motion, k = passage.motion, passage.transition
    rests = p.after and w.integers[CONTACT_MARK] > 0
    reset_return(w)
    code, power = first_letter(p, first_event_of_word(p, k), w)
    mode = motion.mode if p.after else enter_mode(p, k, True, motion.phase, w)
    if rests:
        w.integers[CONTACT_MARK] = REST
    return Passage(begin_mode(p, mode, w), Motion(mode, motion.phase, code, power, 0.0, 0, 0), k)


@inner
def is_finite(w):
    """Whether a state has not grown beyond the range of floats."""
    total = 0.0
    for j in range(len(w.z)):
        total += abs(w.z[j])
    return total < math.inf


@inlined
def after_flight(motion, flight):
    """A motion at the end of a flight."""
    time, turns = motion.time + flight.time, motion.turns + flight.turns
    doubts = motion.doubts + (1 if flight.doubtful else 0)
    return Motion(motion.mode, flight.phase, motion.code, motion.power, time, turns, doubts)


@inner
def end_without_event(p, motion, flight, w):
    """How a return ended with a flight on which no event takes place: a `Passage`."""
    code, power, _ = append_contact(p, motion.code, motion.power, w)
    if p.resting[motion.mode] and flight.time >= p.horizon:
        time = motion.time + w.reals[ACCUMULATION_TIME]
        return Passage(RESTS, Motion(motion.mode, flight.phase, code, power, time, 0, motion.doubts), -1)
    known = not (is_finite(w) and motion.doubts + (1 if flight.doubtful else 0) > 0)
    return Passage(LOST if known else UNDECIDED, Motion(motion.mode, flight.phase, code, power, math.nan, 0, 0), -1)


@inlined
def observe_nothing(p, motion, last, context, w):
    """The observer that sees nothing."""


@inner
def follow_motion(p, motion, limits, on_flight, on_event, context, w):
    """From event to event to the section, or to limits: a `Passage`.

    The mode of the motion has begun. After each flight to an event, before it, or to the limit of time, the loop calls
    `on_flight(p, motion, flight, context, w)`, with the motion at the start of the flight; after the event
    `on_event(p, motion, passage, context, w)`, with the motion before it. Between two events at once there is a flight of no
    time. Both may write to arrays of the context; numba compiles the loop once for each pair of them. At a limit the outcome is
    GOES_ON: the loop can be called again with the motion of the passage.
    """
    transition = -1
    for _ in range(limits.events):
        flight = fly(p, motion.mode, motion.phase, limits.time - motion.time, w)
        w.reals[CONTACT_TIME] += flight.time
        if flight.function == NO_FUNCTION and limits.time < math.inf and flight.time < p.horizon and is_finite(w):
            on_flight(p, motion, flight, context, w)
            return Passage(GOES_ON, after_flight(motion, flight), transition)
        if flight.function == NO_FUNCTION or not is_finite(w):
            return end_without_event(p, motion, flight, w)
        on_flight(p, motion, flight, context, w)
        before = after_flight(motion, flight)
        passage = take_events(p, before, flight.function, on_flight, on_event, context, w)
        motion, transition = passage.motion, passage.transition
        w.integers[PIECES] += DOUBTED if motion.doubts > before.doubts else 0
        if motion.doubts == 1 and before.doubts == 0:
            w.reals[DOUBT_TIME] = motion.time
        outcome = outcome_in_time(p, passage.outcome, motion.mode, flight.function, motion.time, w)
        if outcome != GOES_ON:
            return Passage(outcome, motion, transition)
        if motion.doubts > MOST_DOUBTS:
            return Passage(UNDECIDED, motion, transition)
    return Passage(GOES_ON, motion, transition)


@inner
def end_of_return(passage):
    """A return that has ended."""
    outcome, motion = passage.outcome, passage.motion
    if outcome in (RETURNED, STUCK, LOST):
        turns = motion.turns if outcome != LOST else 0
        return Return(UNDECIDED if motion.doubts > 0 else outcome, motion.code, motion.time, turns)
    timed = outcome in (RESTS, SIMULTANEOUS, REPELLING, ACCUMULATES, BLOCKED)
    return Return(ENDLESS if outcome == GOES_ON else outcome, motion.code, motion.time if timed else math.nan, 0)


@inner
def follow_return(p, passage, w):
    """The return that has begun with a passage."""
    if passage.outcome == GOES_ON:
        passage = follow_motion(p, passage.motion, Limits(math.inf, MOST_EVENTS), observe_nothing, observe_nothing, (), w)
    return end_of_return(passage)


@inner
def first_return(p, row, w):
    """The first return of a row of coordinates."""
    k, phase = find_start(p, row, w)
    if k < 0:
        reset_return(w)
        return Return(INVALID, 0, math.nan, 0)
    return follow_return(p, begin_return(p, k, phase, w), w)


@inner
def begin_in_mode(p, mode, phase, w):
    """Begin a motion in a mode at own states in memory: a `Passage`."""
    reset_return(w)
    features(p, phase, w)
    shift(p, w)
    w.reals[CONTACT_TIME], w.on[:] = 0.0, 0
    return Passage(begin_mode(p, mode, w), Motion(mode, phase, 0, 1, 0.0, 0, 0), -1)


@inner
def first_arrival(p, mode, state, phase, w):
    """The first arrival at the section of a state in a mode, -1 for none; directions are states and phase."""
    if mode < 0:
        reset_return(w)
        return Return(INVALID, 0, math.nan, 0)
    n, turns = len(state), math.floor(phase / TWO_PI)
    initial, _ = within_turn(phase - turns * TWO_PI)
    for i in range(n):
        w.z[i] = state[i]
    for c in range(w.dz.shape[1]):
        for i in range(n + 1):
            w.dz[i, c] = 1.0 if i == c and c < n else 0.0
        w.dphi[c] = 1.0 if c == n else 0.0
    found = follow_return(p, begin_in_mode(p, mode, initial, w), w)
    return Return(found.outcome, found.code, found.time, found.turns + turns)


@inner
def write_return(p, found, r, k, ended):
    """Write how return number r of a motion ended, in a record that has its image."""
    found.outcome[r, k], found.codes[r, k], found.time[r, k] = ended.outcome, ended.code, ended.time
    before = r - 1
    if r > 0 and math.isnan(found.states[r, k, FIRST]):
        found.outcome[r, k] = found.outcome[before, k]
    for c in range(len(p.places)):
        whole = math.floor(found.states[r, k, c] / TWO_PI) if ended.outcome != INVALID else 0
        found.turns[r, k, c] = ended.turns + whole if p.places[c] < 0 else 0


@inner
def write_image(found, r, k, w):
    """Write the image in memory of return number r of a motion, its derivatives and margins to a record."""
    after = r + 1
    for c in range(len(w.image)):
        found.states[after, k, c] = w.image[c]
        for j in range(w.tangent.shape[1]):
            found.tangents[r, k, c, j] = w.tangent[c, j]
    for c in range(len(w.margins)):
        found.margins[r, k, c] = w.margins[c]


@long_entry
def arrivals(p, modes, states, phases, found, begin, w):
    """The first arrivals at the section of states (M, n) in modes (M,), from one on, written to a `Record` of one return.

    The number of those that are known after about `PAUSE` pieces of flights.
    """
    first = 0
    w.integers[PIECES] = 0
    for k in range(begin, len(modes)):
        if w.integers[PIECES] > PAUSE:
            return k
        ended = first_arrival(p, modes[k], states[k], phases[k], w)
        write_image(found, first, k, w)
        write_return(p, found, first, k, ended)
    return len(modes)
