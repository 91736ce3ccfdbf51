"""The motion of a system with modes to its next event, and its states between events: compiled."""

import math

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.modes.march.beginning import GOES_ON, begins
from nsmaps.exact.modes.march.flight import NO_FUNCTION, fly, within_turn
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import bounded
from nsmaps.exact.modes.march.section import picked, starting
from nsmaps.exact.modes.tables.taylor import features, moved_on, propagated

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
def begin_in(p, mode, w):
    """Prepare a motion that begins in a mode, its features in `w.z`: the mode, `LEFT` where it cannot continue."""
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
    k, unsure = picked(p, which, w.z)
    if k < 0 or p.target[k] < 0:
        return k, LEFT, flight, phi, doubtful or unsure
    return k, followed_by(p, k, True, phi, w), flight, phi, doubtful or unsure


@long_entry
def sample(p, mode, phi, z, times, states, w):
    """Write the states of a flight from the states z at times since its start, which grow."""
    n, width, done, step = len(z), len(w.z), 0.0, p.steps[mode]
    for i in range(n):
        w.z[i] = z[i]
    features(phi, w.z, n)
    for k in range(len(times)):
        while times[k] - done > step:
            propagated(p, mode, 1.0, w)
            moved_on(w)
            done += step
            phi, _ = within_turn(phi + p.rate * step)
            features(phi, w.z, n)
        propagated(p, mode, (times[k] - done) / step, w)
        for i in range(n):
            states[k, i] = w.z[i]
            for j in range(width):
                states[k, i] += w.flow[i * width + j] * w.z[j]
