"""The impacts of one motion of an impact system, by its definition with modes, and its flights between them."""

from itertools import islice

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.returns import CHATTER
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.tracks import events_of, mode_track
from nsmaps.exact.modes.tables.memory import FIRST
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import CHATTER as CHATTERED
from nsmaps.exact.words import REST as RESTED

SPEED = 1  #: place of the velocity among the states of an impact system


def impacts_of(definition: Definition, table: Tables, start: Floats, n: int, chatter: float) -> Impacts:
    """The first n impacts and releases of the motion from one state, shape (2,). StateError if it is not a start."""
    events = list(islice(events_of(definition, table, start, chatter), n))
    ones = [definition.transitions[event.transition] for event in events]
    wall = np.array([definition.letters.index(one.name) for one in ones], np.int8)
    time, phase = (np.array([getattr(event, name) for event in events]) for name in ("time", "phase"))
    speed = np.abs([event.before[SPEED] for event in events])
    begun = [CHATTERED if event.contact == CHATTER else RESTED for event in events]  # how the contact at it begins
    marks = ["", *(mark if one.releases else "" for mark, one in zip(begun, ones[1:], strict=False))]
    *_, last = events
    if len(events) < n and last.contact:
        marks[-1:] = [RESTED]  # until all times
    return Impacts(definition.letters, wall, time, phase, speed, np.array(marks))


def flights_of(definition: Definition, table: Tables, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
    """Times, displacements and velocities in the M - 1 flights between impacts, each of shape (M - 1, samples)."""
    if len(impacts.time) < 2:
        return (np.empty((0, samples)),) * 3
    base, *_ = definition.transitions
    by_place, *_ = base.function.coefficients
    start = np.array([impacts.speed[FIRST], impacts.phase[FIRST]])
    track = mode_track(definition, table, start, len(impacts.time), samples, SUMMED_SPEED)
    places, speeds = np.moveaxis(track.states, -1, 0)
    return track.time, places, -float(by_place) * speeds
