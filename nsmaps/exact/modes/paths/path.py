"""The events of a motion of a system with modes, and its states between events: compiled.

Units are those of the system, phases are in radians.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import INVALID, RETURNED, STUCK
from nsmaps.exact.modes.flights.motion import advance, begin_piece, state_at
from nsmaps.exact.modes.flights.states import features
from nsmaps.exact.modes.march.beginning import GOES_ON
from nsmaps.exact.modes.march.events import Motion, Passage
from nsmaps.exact.modes.march.returns import Limits, begin_in_mode, begin_next_return, begin_return, follow_motion
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.tables.memory import CONTACT_MARK

LEFT = -1  # the mode of a motion that has ended
SPARE = 1  # rows more than events: of two events at once both are written
FILLED, ORIGIN = 0, 0  # places in `EventRows.numbers` and `.times`


class EventRows(NamedTuple):
    """Events of a motion, K at most."""

    numbers: Any  #: shape (1,), rows that are written
    times: Any  #: shape (1,), the time at which the return under way began
    transition: Any  #: shape (K + SPARE,)
    mode: Any  #: the same, that follows, LEFT where the motion ends
    contact: Any  #: the same, how contact begins at it: `CHATTER` or `REST` of the march, 0 without
    time: Any  #: the same, since the start
    phase: Any  #: the same
    before: Any  #: shape (K + SPARE, n), states just before
    after: Any  #: the same, just after


def event_rows(events: int, n: int) -> EventRows:
    """Room for so many events of a motion with n states."""
    count = events + SPARE
    transition, mode, contact = np.zeros((3, count), np.int64)
    time, phase = np.zeros((2, count))
    before, after = np.zeros((2, count, n))
    return EventRows(np.zeros(1, np.int64), np.zeros(1), transition, mode, contact, time, phase, before, after)


@inner
def write_before(p, motion, flight, rows, w):
    """The observer of flights: write the states at the end, just before an event."""
    row = rows.before[rows.numbers[FILLED]]
    for i in range(len(row)):
        row[i] = w.z[i]


@inner
def write_row(p, passage, time, rows, w):
    """Write an event, before which the states are written, at a time since the return began."""
    k, motion = rows.numbers[FILLED], passage.motion
    mode = motion.mode if passage.outcome == GOES_ON else LEFT
    rows.transition[k], rows.mode[k] = passage.transition, mode
    rows.time[k], rows.phase[k] = rows.times[ORIGIN] + time, motion.phase
    rows.contact[k] = w.integers[CONTACT_MARK] if mode != LEFT and p.resting[mode] else 0
    for i in range(rows.after.shape[1]):
        rows.after[k, i] = w.z[i]
    rows.numbers[FILLED] = k + 1


@inner
def write_event(p, motion, passage, rows, w):
    """The observer of events: write one that takes place and does not end a return."""
    if passage.transition >= 0 and passage.outcome not in (RETURNED, STUCK):
        write_row(p, passage, motion.time, rows, w)


@long_entry
def begin_track(p, start, rows, w):
    """Begin a motion at coordinates of the section, and write the event there: a `Passage`, INVALID of no start."""
    k, phase = find_start(p, start, w)
    if k < 0:
        return Passage(INVALID, Motion(LEFT, 0.0, 0, 0, 0.0, 0, 0), k)
    for i in range(rows.before.shape[1]):
        rows.before[FILLED, i] = w.z[i]
    passage = begin_return(p, k, phase, w)
    write_row(p, passage, 0.0, rows, w)
    return passage


@long_entry
def begin_track_in(p, mode, phase, w):
    """Begin a motion in a mode at own states in memory: a `Passage`."""
    return begin_in_mode(p, mode, phase, w)


@long_entry
def continue_track(p, passage, rows, w):
    """Write the events that follow on a motion while there is room: the `Passage` through the last."""
    while passage.outcome in (GOES_ON, RETURNED, STUCK) and rows.numbers[FILLED] < len(rows.time) - SPARE:
        if passage.outcome == GOES_ON:
            left = len(rows.time) - SPARE - rows.numbers[FILLED]
            limits = Limits(math.inf, max(left // 2, 1))
            passage = follow_motion(p, passage.motion, limits, write_before, write_event, rows, w)
        else:
            rows.times[ORIGIN] += passage.motion.time
            passage = begin_next_return(p, passage, w)
            write_row(p, passage, 0.0, rows, w)
    return passage


@long_entry
def sample(p, mode, phi, z, times, states, w):
    """Write the states (K, n) of a flight from the states z, shape (n,), at times (K,) since its start, which grow."""
    done = 0.0
    for i in range(len(z)):
        w.z[i] = z[i]
    features(p, phi, w)
    unit = begin_piece(p, mode, math.inf, w)
    for k in range(len(times)):
        while times[k] - done > unit > 0.0:
            phi, _ = advance(p, mode, 1.0, unit, phi, w)
            done += unit
            unit = begin_piece(p, mode, math.inf, w)
        state_at(p, mode, times[k] - done, w, states[k])
