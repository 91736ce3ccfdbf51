"""Why first returns and arrivals of a system with modes ended, in sentences."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.exact.modes.blocks.lanes import block_of, motions
from nsmaps.exact.modes.blocks.wide import returns
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.arriving import arrivals_of, arrived_alone
from nsmaps.exact.modes.paths.ends import ENDS, end_of
from nsmaps.exact.modes.paths.refused import in_no_mode, not_a_start
from nsmaps.exact.modes.paths.tracks import events_from, events_of
from nsmaps.exact.modes.tables.memory import Memory, memory, record
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.outcome import Outcome


def reasons_of(definition: Definition, table: Tables, start: Floats) -> tuple[str, ...]:
    """As `HybridSystem.reasons`, of rows of the section's coordinates."""
    sentences = []
    for row in start:
        found, w = record(row[None], 1, 0), memory(table, 0)
        returns(table, found, w, motions(table, False), block_of(table))
        outcome, time = Outcome(found.outcome[0, 0]), float(found.time[0, 0])
        if outcome == Outcome.invalid:
            sentences.append(not_a_start(definition, table, row))
        elif outcome in ENDS:
            sentences.append(end_of(definition, table, outcome, "", events_of(definition, table, row)))
        else:
            sentences.append(_sentence(definition, table, outcome, time, w))
    return tuple(sentences)


def arrival_reasons_of(
    definition: Definition, table: Tables, states: ArrayLike, modes: str | Sequence[str] | None
) -> tuple[str, ...]:
    """As `HybridSystem.arrival_reasons`."""
    arrivals = arrivals_of(definition, table, states, modes, False)
    given = ("",) * len(arrivals) if modes is None else (modes,) * len(arrivals) if isinstance(modes, str) else tuple(modes)
    sentences = []
    for row, mode in zip(arrivals.start, given, strict=True):
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
    why = {Outcome.simultaneous: meeting_of, Outcome.repelling: surface_of}.get(outcome)
    return why(definition, table, time, w) if why else outcome.advice


def meeting_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which guards are met at once, in which mode, when and where."""
    first, second = (_guards(definition, table, f) for f in w.both.tolist())
    mode = definition.modes[definition.transitions[table.chosen[table.choices[w.both[0]]]].mode]
    return (
        f"The guards {first} and {second} are met at once in the mode {mode!r}, {time:.10g} after the start, "
        f"at {_states(definition, w)}; the image depends on which event is first."
    )


def surface_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """From which surface both modes lead away, when and where."""
    values = table.surfaces @ w.z
    away = np.where((values[:, 1:] > 0).all(axis=1), abs(values[:, 0]), np.inf)
    surface = definition.surfaces[int(np.argmin(away))]
    return (
        f"Both modes beside the sliding {surface.name!r}, {' and '.join(map(repr, surface.modes))}, lead away from its surface, "
        f"{time:.10g} after the start, at {_states(definition, w)}: the motion may leave it at any time, on either side."
    )


def _states(definition: Definition, w: Memory) -> str:
    """The states at which a motion stopped."""
    values = w.z[: len(definition.states)].tolist()
    return ", ".join(f"{name} = {value:.10g}" for name, value in zip(definition.states, values, strict=True))


def _guards(definition: Definition, table: Tables, function: int) -> str:
    """The guards of a function, by name."""
    ones = table.chosen[table.choices[function] : table.choices[function + 1]]
    names = dict.fromkeys(definition.transitions[k].name or "(a section behind)" for k in np.asarray(ones).tolist())
    return " or ".join(map(repr, names))
