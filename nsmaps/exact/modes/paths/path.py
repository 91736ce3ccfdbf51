"""The motion of a system with modes to its next event, and its states between events: compiled."""

import math

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.modes.flights.motion import advance, begin_piece, state_at
from nsmaps.exact.modes.flights.states import features
from nsmaps.exact.modes.march.beginning import GOES_ON, begins
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import bounded
from nsmaps.exact.modes.march.section import picked
from nsmaps.exact.modes.march.starting import starting

NONE, LEFT = -1, -1  # no transition; the mode of a motion that has ended


@inner
def followed_by(p, k, with_reset, phi, w):
    """As `entered`; no mode where the motion does not continue."""
    mode = entered(p, k, with_reset, phi, w)
    return mode if begins(p, mode, w) == GOES_ON else LEFT


@long_entry
def begin(p, row, before, w):
    """The event at which coordinates of the section start, -1 for none, the mode that follows, and the phase; states in `w.z`."""
    k, phi = starting(p, row, w)
    if k < 0:
        return NONE, LEFT, 0.0
    for i in range(len(before)):
        before[i] = w.z[i]
    return k, followed_by(p, k, not p.after, phi, w), phi


@long_entry
def begin_in(p, mode, phi, w):
    """Prepare a motion that begins in a mode at states in `w.z` and a phase: the mode, `LEFT` where it cannot continue."""
    features(p, phi, w)
    return mode if begins(p, mode, w) == GOES_ON else LEFT


@long_entry
def follow(p, mode, phi, before, w):
    """To the next event: (its transition, -1 for none; the mode that follows; time of the flight; phase; whether doubtful)."""
    which, flight, phi, _, doubtful = fly(p, mode, phi, math.inf, w)
    doubtful = doubtful or w.both[0] != NO_FUNCTION
    for i in range(len(before)):
        before[i] = w.z[i]
    if which == NO_FUNCTION or not bounded(w):
        return NONE, LEFT, flight, phi, doubtful
    k, unsure = picked(p, which, w.z, w)
    if k < 0 or p.target[k] < 0:
        return k, LEFT, flight, phi, doubtful or unsure
    return k, followed_by(p, k, True, phi, w), flight, phi, doubtful or unsure


@long_entry
def sample(p, mode, phi, z, times, states, w):
    """Write the states of a flight from the states z at times since its start, which grow."""
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
