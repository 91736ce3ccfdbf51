"""The motion of a system with modes through its events, sampled: tracks, impacts, extents of flights."""

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import StateError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.returns import CHATTER
from nsmaps.exact.events import Events, ModeTrack, check_samples
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.march.events import Passage
from nsmaps.exact.modes.march.words import INSTANT
from nsmaps.exact.modes.paths.arriving import features_of, velocities
from nsmaps.exact.modes.paths.path import FILLED, EventRows, begin_track, begin_track_in, continue_track, event_rows, sample
from nsmaps.exact.modes.tables.memory import FIRST, Memory, memory
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import CHATTER as CHATTERED
from nsmaps.exact.words import REST as RESTED

EVENTS = 32  #: that are computed at a time
SPEED = 1  #: place of the velocity among the states of an impact system
MOST_EVENTS = 64  #: of a return, beyond which its motion is not looked at
LAST = -1  #: instant of a flight, just before the event at its end
SAMPLES = 9  #: instants of a flight
SLOW = 1e-9  #: share of the largest rate of a function between events, below which its rate at them is rounding


class Event(NamedTuple):
    """One event of a motion, with a name."""

    transition: int
    mode: int  #: that follows, -1 where the motion ends
    time: float
    phase: float
    before: Floats  #: shape (n,), states just before
    after: Floats  #: shape (n,)
    contact: int  #: how contact begins at it: `CHATTER` or `REST` of the march, 0 without


Flight = tuple[Event, Event, Floats, Floats]  #: events at both ends, times since the first (K,), states (K, n)


def events_of(definition: Definition, table: Tables, start: Floats, chatter: float = SUMMED_SPEED) -> Iterator[Event]:
    """The events of the motion from a row of the section's coordinates, the start first, until none follows.

    Raises:
        StateError: the row is not a start.
    """
    rows, w = event_rows(EVENTS, len(definition.states)), memory(table, 0, chatter=chatter)
    passage = begin_track(table, start, rows, w)
    if passage.transition < 0:
        raise StateError(f"the state {start} is not a start; expected: a finite state just before or after the section's event")
    yield from _following(definition, table, passage, rows, w)


def events_from(definition: Definition, table: Tables, state: Floats, mode: int) -> Iterator[Event]:
    """The events of the motion from a state, with the phase where there is forcing, in a mode, until none follows."""
    n, w = len(definition.states), memory(table, 0)
    phi = float(state[n]) % (2 * np.pi) if table.rate > 0 else 0.0
    w.z[:n] = state[:n]
    yield from _following(definition, table, begin_track_in(table, mode, phi, w), event_rows(EVENTS, n), w)


def _following(definition: Definition, table: Tables, passage: Passage, rows: EventRows, w: Memory) -> Iterator[Event]:
    """The events of a motion that has begun, those that are written first, until none follows."""
    while True:
        passage = continue_track(table, passage, rows, w)
        written = int(rows.numbers[FILLED])
        for k in range(written):
            if definition.transitions[rows.transition[k]].name:
                numbers = int(rows.transition[k]), int(rows.mode[k]), float(rows.time[k]), float(rows.phase[k])
                yield Event(*numbers, rows.before[k].copy(), rows.after[k].copy(), int(rows.contact[k]))
        if written == 0:
            return
        rows.before[FIRST], rows.numbers[FILLED] = rows.before[written % len(rows.before)], 0


def mode_track(definition: Definition, table: Tables, start: Floats, n: int, samples: int, chatter: float) -> ModeTrack:
    """The motion from a row of the section's coordinates through at most n events. Raises as `events_of` and `check_samples`."""
    check_samples(n, samples)
    events = list(islice(events_of(definition, table, start, chatter), n))
    transitions, following, time, phase, before, after, _ = map(np.array, zip(*events, strict=True))
    ones = [definition.transitions[k] for k in transitions]
    times = np.linspace(time[:-1], time[1:], samples, axis=1)
    states, w = np.empty((*times.shape, len(definition.states))), memory(table, 0)
    for k, event in enumerate(events[:-1]):
        sample(table, event.mode, event.phase, event.after, times[k] - time[k], states[k], w)
    names, letters = (np.array([getattr(one, name) for one in ones], str) for name in ("name", "letter"))
    modes = np.array([definition.modes[mode] for mode in following[:-1]], str)
    return ModeTrack(definition.states, Events(names, letters, time, phase, before, after), modes, times, states)


def shortest_rest(definition: Definition, table: Tables, start: Floats) -> float:
    """The shortest lasting contact that begins and is released within a first return, in units of time; NaN without.

    Raises as `events_of`.
    """
    section = {definition.transitions[one.transition].name for one in definition.starts}
    instant = INSTANT * (2 * np.pi / table.rate if table.rate > 0 else table.steps[FIRST])
    shortest = since = np.nan
    for number, event in enumerate(events_of(definition, table, start)):
        one, duration = definition.transitions[event.transition], event.time - since
        ends = number > 0 and one.name in section
        if one.releases:
            shortest = np.fmin(shortest, duration if duration > instant else np.nan)
            ends = ends and duration > instant
        if ends or event.mode < 0:
            break
        if not table.resting[event.mode]:
            since = np.nan
        elif not table.resting[one.mode]:
            since = event.time
    return float(shortest)


def extents_of(definition: Definition, table: Tables, starts: Floats) -> Floats:
    """The largest extent of each coordinate on a flight of the first returns of starts (N, m), shape (m,).

    Zero of a coordinate that changes by resets only, and of the phase. Raises as `events_of`.
    """
    moved = np.zeros(len(definition.states) + 1)  # the last one is the phase, whose place is -1
    for _, _, _, states in first_flights(definition, table, starts):
        moved[:-1] = np.maximum(moved[:-1], np.ptp(states, axis=0))
    return np.asarray(moved[np.asarray(table.places)])


def fastest_of(definition: Definition, table: Tables, starts: Floats, between: bool) -> Floats:
    """The largest rate of each function, shape (S,), just before the events of first returns, or `between` them too.

    That between events is also taken where those at events are rounding. Raises as `events_of`.
    """
    at_events, ever = np.zeros(len(table.functions)), np.zeros(len(table.functions))
    for begin, _, times, states in first_flights(definition, table, starts):
        phases = begin.phase + table.rate * times
        rates = np.abs(velocities(table, begin.mode, features_of(table, states, phases), phases) @ table.functions.T)
        rates /= table.steps[begin.mode]
        at_events, ever = np.maximum(at_events, rates[LAST]), np.maximum(ever, rates.max(axis=0))
    return ever if between else np.where(at_events > SLOW * ever, at_events, ever)


def first_flights(definition: Definition, table: Tables, starts: Floats) -> Iterator[Flight]:
    """The flights of the first returns of starts (N, m). Raises as `events_of`."""
    section, w = {definition.transitions[one.transition].name for one in definition.starts}, memory(table, 0)
    for start in starts:
        last: Event | None = None
        for event in islice(events_of(definition, table, start), MOST_EVENTS):
            if last is not None:
                times, states = np.linspace(0.0, event.time - last.time, SAMPLES), np.empty((SAMPLES, len(event.after)))
                sample(table, last.mode, last.phase, last.after, times, states, w)
                yield last, event, times, states
                if definition.transitions[event.transition].name in section:
                    break
            last = event


def impacts_of(definition: Definition, table: Tables, start: Floats, n: int, chatter: float) -> Impacts:
    """The first n impacts and releases of the motion from one state, shape (2,). StateError if it is not a start."""
    events = list(islice(events_of(definition, table, start, chatter), n))
    transitions, _, time, phase, before, _, _ = map(np.array, zip(*events, strict=True))
    ones = [definition.transitions[k] for k in transitions]
    wall, speed = np.array([definition.letters.index(one.name) for one in ones], np.int8), np.abs(before[:, SPEED])
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
