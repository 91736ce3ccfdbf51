"""How far the states of a system with modes move, and how fast the functions of its guards, between events too."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.arriving import features_of, velocities
from nsmaps.exact.modes.paths.path import sample
from nsmaps.exact.modes.paths.tracks import Event, events_of
from nsmaps.exact.modes.tables.memory import memory
from nsmaps.exact.modes.tables.tables import Tables

MOST_EVENTS = 64  #: of a return, beyond which its motion is not looked at
LAST = -1  #: instant of a flight, just before the event at its end
SAMPLES = 9  #: instants of a flight
SLOW = 1e-9  #: share of the largest rate of a function between events, below which its rate at them is rounding

Flight = tuple[Event, Event, Floats, Floats]  #: events at both ends, times since the first (K,), states (K, n)


def extents_of(definition: Definition, table: Tables, starts: Floats) -> Floats:
    """The largest extent of each coordinate on a flight of the first returns of starts (N, m), shape (m,).

    Zero of a coordinate that changes by resets only, and of the phase. Raises as `events_of`.
    """
    moved = np.zeros(len(definition.states) + 1)  # the last one is the phase, whose place is -1
    for _, _, _, states in flights_of(definition, table, starts):
        moved[:-1] = np.maximum(moved[:-1], np.ptp(states, axis=0))
    return np.asarray(moved[np.asarray(table.places)])


def fastest_of(definition: Definition, table: Tables, starts: Floats, between: bool) -> Floats:
    """The largest rate of each function, shape (S,), just before the events of first returns, or `between` them too.

    That between events is also taken where those at events are rounding. Raises as `events_of`.
    """
    at_events, ever = np.zeros(len(table.functions)), np.zeros(len(table.functions))
    for begin, _, times, states in flights_of(definition, table, starts):
        phases = begin.phase + table.rate * times
        rates = np.abs(velocities(table, begin.mode, features_of(table, states, phases), phases) @ table.functions.T)
        rates /= table.steps[begin.mode]
        at_events, ever = np.maximum(at_events, rates[LAST]), np.maximum(ever, rates.max(axis=0))
    return ever if between else np.where(at_events > SLOW * ever, at_events, ever)


def flights_of(definition: Definition, table: Tables, starts: Floats) -> Iterator[Flight]:
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
