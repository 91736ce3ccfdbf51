"""Why first returns of a system with modes ended, in sentences."""

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.modes.blocks.lanes import block_of, motions
from nsmaps.exact.modes.blocks.wide import returns
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.tables.memory import Memory, memory, record
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.outcome import Outcome


def reasons_of(definition: Definition, table: Tables, start: Floats) -> tuple[str, ...]:
    """As `HybridSystem.reasons`, of rows of the section's coordinates."""
    sentences = []
    for row in start:
        found, w = record(row[None], 1, 0), memory(table, 0)
        returns(table, found, w, motions(table, False), block_of(table))
        outcome = Outcome(found.outcome[0, 0])
        why = {Outcome.simultaneous: meeting_of, Outcome.repelling: surface_of}.get(outcome)
        sentences.append(why(definition, table, float(found.time[0, 0]), w) if why else outcome.advice)
    return tuple(sentences)


def meeting_of(definition: Definition, table: Tables, time: float, w: Memory) -> str:
    """Which guards are met at once, in which mode, when and where."""
    first, second = (_guards(definition, table, f) for f in w.both.tolist())
    mode = definition.modes[definition.transitions[table.chosen[table.choices[w.both[0]]]].mode]
    return (
        f"The guards {first} and {second} are met at once in the mode {mode!r}, {time:.10g} after the start, "
        f"at {_states(definition, w)}; the states that follow depend on which event is first."
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
