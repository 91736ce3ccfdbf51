"""How a motion without a return ended, in sentences."""

from collections import deque
from collections.abc import Iterable
from itertools import islice

from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.tracks import Event
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.outcome import Outcome

FOLLOWED = 5_000  #: events of a motion that are looked at
ENDS = Outcome.escaped, Outcome.rests, Outcome.endless
LAST = 3  #: last events that are named of one that does not end


def end_of(definition: Definition, table: Tables, outcome: Outcome, mode: str, events: Iterable[Event]) -> str:
    """How a motion that begins in a mode ended with `escaped`, `rests` or `endless`, by its events."""
    named = [(definition.transitions[event.transition], event) for event in deque(islice(events, FOLLOWED), LAST)]
    if outcome == Outcome.endless:
        times = ", ".join(f"{one.name!r} after {event.time:.10g}" for one, event in named)
        return f"{outcome.advice} Of its first {FOLLOWED:,} events the last are {times}."
    after = "From the start on,"
    for one, event in named[-1:]:
        if event.mode < 0 and one.target < 0:
            return f"The guard {one.name!r} ends the motion, {event.time:.10g} after the start."
        mode = definition.modes[event.mode]
        after = f"{event.time:.10g} after the start, after the event {one.name!r},"
    if outcome == Outcome.rests:
        return f"{after} the motion stays in contact, in the mode {mode!r}: the pressure never falls to zero."
    return (
        f"{after} no guard of the mode {mode!r} is met: within the horizon of {table.horizon:.6g}, or before the states "
        "are larger than any float."
    )
