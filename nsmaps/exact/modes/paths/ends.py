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
    last = deque(islice(events, FOLLOWED), LAST)
    names = [definition.transitions[event.transition].name for event in last]
    after = f"{last[-1].time:.10g} after the start, after the event {names[-1]!r}," if last else "From the start on,"
    if outcome == Outcome.endless:
        times = ", ".join(f"{name!r} after {event.time:.10g}" for name, event in zip(names, last, strict=True))
        return f"{outcome.advice} Of its first {FOLLOWED:,} events the last are {times}."
    if last and last[-1].mode < 0 and definition.transitions[last[-1].transition].target < 0:
        return f"The guard {names[-1]!r} ends the motion, {last[-1].time:.10g} after the start."
    if last:
        mode = definition.modes[last[-1].mode]
        after = f"{last[-1].time:.10g} after the start, after the event {names[-1]!r},"
    if outcome == Outcome.rests:
        return f"{after} the motion stays in contact, in the mode {mode!r}: the pressure never falls to zero."
    return (
        f"{after} no guard of the mode {mode!r} is met: within the horizon of {table.horizon:.6g}, or before the states "
        "are larger than any float."
    )
