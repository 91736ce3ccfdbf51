"""A motion through an event, or through two that are met at once: its word, its image on the section, the mode that follows."""

from typing import NamedTuple

from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import LOST, RETURNED, SIMULTANEOUS, STUCK, UNDECIDED
from nsmaps.exact.modes.flights.states import dot, velocity
from nsmaps.exact.modes.march.beginning import GOES_ON, begin_mode
from nsmaps.exact.modes.march.flight import Flight, saltation
from nsmaps.exact.modes.march.resting import enter_mode
from nsmaps.exact.modes.march.section import transition_at
from nsmaps.exact.modes.march.together import function_due, order_matters
from nsmaps.exact.modes.march.words import append_contact, append_letter, base_of, note_letter, with_margins, word_before_contact
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATING,
    DOUBTED_FUNCTION,
    END,
    FIRST_AT_ONCE,
    MINIMA,
    NO_FUNCTION,
    SECOND_AT_ONCE,
    SLOWEST,
)


class Motion(NamedTuple):
    """A motion under way, of which memory has the features and their derivatives."""

    mode: int
    phase: float  #: of the forcing, within a turn
    code: int  #: of the word of the return so far
    power: int  #: place value of its next letter; 0: the word is longer than a code holds
    time: float  #: since the return began
    turns: int  #: whole turns of the phase since then
    doubts: int  #: flights and events since then that are doubtful


class Passage(NamedTuple):
    """What an event makes of a motion."""

    outcome: int  #: GOES_ON, or a value of Outcome with which the return ends
    motion: Motion
    transition: int  #: -1 for none


@inlined
def motion_in(motion, mode, code, power):
    """A motion that enters a mode, with a word."""
    return Motion(mode, motion.phase, code, power, motion.time, motion.turns, motion.doubts)


@inlined
def doubtful_motion(motion):
    """A motion with one doubt more."""
    return Motion(motion.mode, motion.phase, motion.code, motion.power, motion.time, motion.turns, motion.doubts + 1)


@inner
def append_event(p, motion, function, letter, w):
    """The word with the minima of the last flight and the letter of the event of a function behind it; margins are written."""
    code, power = motion.code, motion.power
    velocity(p, motion.mode, w.z, w.field, w)
    rate = abs(dot(p.functions[function], w.field).value) / (p.steps[motion.mode] * w.units[function])
    w.margins[SLOWEST] = min(w.margins[SLOWEST], rate)
    for f in range(p.watched[motion.mode], p.watched[motion.mode + END]):
        for _ in range(w.minima[f]):
            code, power = append_letter(base_of(p, w), p.base + 1, code, power)
        w.margins[MINIMA] += w.minima[f]
        w.minima[f] = 0
    return append_letter(base_of(p, w), letter, code, power)


@inner
def write_image(p, phase, w):
    """Write the coordinates of the state in memory, and their derivatives, as the image of the return."""
    for c in range(len(p.places)):
        w.image[c] = phase if p.places[c] < 0 else w.z[p.places[c]]
        for j in range(w.dz.shape[1]):
            w.tangent[c, j] = w.dphi[j] if p.places[c] < 0 else w.dz[p.places[c], j]


@inner
def take_events(p, motion, function, on_flight, on_event, context, w):
    """Take a motion through the event of a function, or through two that are met at once: a `Passage`.

    Observers, as of `follow_motion`, see each of them.
    """
    if w.integers[FIRST_AT_ONCE] != NO_FUNCTION:
        return take_two_events(p, motion, function, on_flight, on_event, context, w)
    passage = take_event(p, motion, function, w)
    on_event(p, motion, passage, context, w)
    return passage


@inner
def take_two_events(p, motion, function, on_flight, on_event, context, w):
    """Take a motion through two events that are met at once, if their order does not matter: a `Passage`."""
    one, two = w.integers[FIRST_AT_ONCE], w.integers[SECOND_AT_ONCE]
    if order_matters(p, one, two, motion.phase, w):
        return Passage(SIMULTANEOUS, doubtful_motion(motion), -1)
    passage = take_event(p, motion, function, w)
    on_event(p, motion, passage, context, w)
    motion, second = passage.motion, NO_FUNCTION
    if passage.outcome == GOES_ON:
        second = function_due(p, two if function == one else one, motion.mode, w.z, True, w)
    if second == NO_FUNCTION:
        return passage
    on_flight(p, motion, Flight(second, 0.0, motion.phase, 0, False), context, w)
    passage = take_event(p, motion, second, w)
    on_event(p, motion, passage, context, w)
    first = function_due(p, function, passage.motion.mode, w.z, False, w) if passage.outcome == GOES_ON else NO_FUNCTION
    if first != NO_FUNCTION:
        w.on[first] = max(w.on[first], 1)
    return passage


@inner
def take_event(p, motion, function, w):
    """Take a motion through the event of a function: a `Passage`."""
    k, doubtful = transition_at(p, function, w.z, w)
    if doubtful or k < 0:
        motion = doubtful_motion(motion)
        w.integers[DOUBTED_FUNCTION] = function if w.integers[DOUBTED_FUNCTION] < 0 else w.integers[DOUBTED_FUNCTION]
    if k < 0:
        return Passage(UNDECIDED, motion, k)
    if w.dz.shape[1] > 0:
        saltation(p, motion.mode, function, w)
    code, power, lasted = motion.code, motion.power, False
    if p.target[k] < 0 or p.is_section[k] or not p.resting[p.target[k]]:
        code, power, lasted = append_contact(p, code, power, w)
        motion = motion_in(motion, motion.mode, code, power)
    if with_margins(w):
        code, power = append_event(p, motion, function, p.digit[k], w)
    else:
        code, power = append_letter(p.base, p.digit[k], code, power)
    note_letter(p.digit[k], code, power, w)
    motion = motion_in(motion, motion.mode, code, power)
    if p.target[k] < 0:
        return Passage(LOST, motion, k)
    returned, outcome = p.is_section[k] and (lasted or not p.releases[k]), STUCK if p.releases[k] else RETURNED
    if returned and not p.after:
        write_image(p, motion.phase, w)
        return Passage(outcome, motion, k)
    mode = enter_mode(p, k, True, motion.phase, w)
    code, power = word_before_contact(code, power, w)
    motion = motion_in(motion, mode, code, power)
    if returned and w.integers[ACCUMULATING] == 0:
        write_image(p, motion.phase, w)
        return Passage(outcome, motion, k)
    return Passage(begin_mode(p, mode, w), motion, k)
