"""Why first returns and arrivals of a system with modes ended, in sentences."""

from collections import deque
from collections.abc import Iterable, Sequence
from itertools import islice

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.modes.blocks.batch_scheduler import returns
from nsmaps.exact.modes.blocks.workspace import workspace
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.march.flight import CLOUDED, FAINT, STEEP, STIFF
from nsmaps.exact.modes.paths.arriving import arrivals_of, arrived_alone, modes_given
from nsmaps.exact.modes.paths.refused import in_no_mode, in_words, not_a_start
from nsmaps.exact.modes.paths.tracks import Event, events_from, events_of
from nsmaps.exact.modes.tables.memory import (
    DOUBT_REASON,
    DOUBT_TIME,
    DOUBTED_FUNCTION,
    END,
    FIRST_AT_ONCE,
    NO_FUNCTION,
    RATE_ABOVE,
    SECOND_AT_ONCE,
    SURFACE,
    Memory,
    memory,
    record,
)
from nsmaps.exact.modes.tables.tables import Tables, mode_of
from nsmaps.exact.outcome import Outcome

FOLLOWED = 5_000  #: events of a motion that are looked at
ENDS = Outcome.escaped, Outcome.rests, Outcome.endless
LAST = 3  #: last events that are named of one that does not end


def reasons_of(definition: Definition, table: Tables, start: Floats, chatter: float = SUMMED_SPEED) -> tuple[str, ...]:
    """As `HybridSystem.reasons`, of rows of the section's coordinates."""
    sentences = []
    for row in start:
        found, w = record(row[None], 1, 0), memory(table, 0, chatter=chatter)
        returns(table, found, np.zeros(2, np.int64), w, workspace(table, 0, False, w.moved))
        outcome, time = Outcome(found.outcome.item()), found.time.item()
        if outcome == Outcome.invalid:
            sentences.append(not_a_start(definition, table, row))
        elif outcome in ENDS:
            sentences.append(end_of(definition, table, outcome, "", events_of(definition, table, row, chatter)))
        else:
            sentences.append(_sentence(definition, table, outcome, time, w))
    return tuple(sentences)


def arrival_reasons_of(
    definition: Definition, table: Tables, states: ArrayLike, modes: str | Sequence[str] | None
) -> tuple[str, ...]:
    """As `HybridSystem.arrival_reasons`."""
    arrivals = arrivals_of(definition, table, states, modes, False)
    sentences = []
    for row, mode in zip(arrivals.start, modes_given(modes, len(arrivals)), strict=True):
        outcome, time, number, w = arrived_alone(definition, table, row, mode)
        if outcome == Outcome.invalid:
            sentences.append(in_no_mode(definition, table, row, mode))
        elif outcome in ENDS:
            events = events_from(definition, table, row, number)
            sentences.append(end_of(definition, table, outcome, definition.modes[number], events))
        else:
            sentences.append(_sentence(definition, table, outcome, time, w))
    return tuple(sentences)


def _sentence(definition: Definition, table: Tables, outcome: Outcome, time: float, w: Memory) -> str:
    """Why a motion ended, by what its memory holds; what is advised of the outcome where that is nothing."""
    why = WHY.get(outcome)
    return why(definition, table, time, w) if why else outcome.advice


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


def meeting_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which guards are met at once, in which mode, when and where."""
    first, second = (_guards(definition, table, f) for f in _functions(w))
    return (
        f"The guards {first} and {second} are met at once in the mode {_mode(definition, table, w)!r}, "
        f"{time:.10g} after the start, at {in_words(definition.states, w.z)}; the image depends on which event is first."
    )


def surface_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """From which surface both modes lead away, when and where."""
    values = table.surfaces @ w.z
    away = np.where((values[:, RATE_ABOVE:] > 0).all(axis=1), abs(values[:, SURFACE]), np.inf)
    surface = definition.surfaces[int(np.argmin(away))]
    return (
        f"Both modes beside the sliding {surface.name!r}, {' and '.join(map(repr, surface.modes))}, lead away from its surface, "
        f"{time:.10g} after the start, at {in_words(definition.states, w.z)}: the motion may leave it at any time, on either "
        "side."
    )


def accumulation_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which events follow one another ever faster, when and where."""
    return (
        f"Events of {_both(definition, table, w)} in the mode {_mode(definition, table, w)!r} accumulate, {time:.10g} "
        f"after the start, at {in_words(definition.states, w.z)}, and nothing says what follows. Of impacts that lose "
        "speed, declare `rests=` in the guard."
    )


def block_of_motion(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which guard is negative where its mode begins, or which events follow one another at once, when and where."""
    one, other = _functions(w)
    where = f"{time:.10g} after the start, at {in_words(definition.states, w.z)}"
    if other == NO_FUNCTION:
        return (
            f"The guard {_guards(definition, table, one)} is negative where the mode {_mode(definition, table, w)!r} begins, "
            f"{where}. A guard is positive for as long as its mode lasts, unless it is declared with `crossing=True`: then its "
            "event takes place whenever its function falls through zero."
        )
    modes = " and ".join(repr(definition.modes[mode_of(table, f)]) for f in (other, one))
    return (
        f"The events of {_both(definition, table, w)} follow one another at once without end, {where}: no time passes in the "
        f"modes {modes}. Where both lead to one surface, declare a `SlidingSurface` between them."
    )


def doubt_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which guard it cannot be decided of, in which mode, and when."""
    function, why = int(w.integers[DOUBTED_FUNCTION]), int(w.integers[DOUBT_REASON])
    if why:
        return DOUBTS[why]
    if function < 0:
        return Outcome.undecided.advice
    return (
        f"{Outcome.undecided.advice} The guard is {_guards(definition, table, function)} in the mode "
        f"{definition.modes[mode_of(table, function)]!r}, {w.reals[DOUBT_TIME]:.10g} after the start."
    )


def _functions(w: Memory) -> tuple[int, int]:
    """The functions that are zero at once, or those of the last two events; NO_FUNCTION for none."""
    return int(w.integers[FIRST_AT_ONCE]), int(w.integers[SECOND_AT_ONCE])


def _both(definition: Definition, table: Tables, w: Memory) -> str:
    """The guards of one or two functions."""
    return " and ".join(_guards(definition, table, f) for f in reversed(_functions(w)) if f != NO_FUNCTION)


def _mode(definition: Definition, table: Tables, w: Memory) -> str:
    """The mode of the first of two functions."""
    return definition.modes[mode_of(table, int(w.integers[FIRST_AT_ONCE]))]


def _guards(definition: Definition, table: Tables, function: int) -> str:
    """The guards of a function, by name."""
    ones = table.chosen[table.choices[function] : table.choices[function + END]]
    names = dict.fromkeys(definition.transitions[k].name or "(a section behind, or a kink)" for k in np.asarray(ones).tolist())
    return " or ".join(map(repr, names))


DOUBTS = {
    FAINT: "Rounding errors of the states change the speed of an impact by more than 3e-5 of it: a graze within rounding. Impact "
    "speeds far below those of the flight are better known of flights in closed form (`displacement`).",
    CLOUDED: "A flight amplifies rounding errors until its states are not known to 1e-10 of their size: it is chaotic before its "
    "event, and the image is one of many.",
    STEEP: "At a state that a flight comes to, a rate is so steep that no Taylor series agrees with it, or has no value, as the "
    "root of a negative number or exp beyond the range of floats, or as u**(3/2) where a motion comes to u = 0. Make the steep "
    "part wider, to 1e-12 of the range of its argument or more, as in u*(u**2 + eps**2)**(1/4) for u**(3/2), or restrict the "
    "starts.",
    STIFF: "A flight takes more than 100,000 steps: the rates are stiff there, as where smoothed friction holds a body. Make the "
    "steep part wider, or let the body stick by `rests` or `SlidingSurface`.",
}  #: why a Taylor flight is in doubt

WHY = {
    Outcome.simultaneous: meeting_of,
    Outcome.repelling: surface_of,
    Outcome.accumulates: accumulation_of,
    Outcome.blocked: block_of_motion,
    Outcome.undecided: doubt_of,
}
