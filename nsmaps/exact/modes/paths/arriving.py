"""First arrivals at the section of states that are given anywhere in a mode."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import StateError, near_match
from nsmaps.exact.engine.returns import MOST_PHASE
from nsmaps.exact.events import Arrivals
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.march.returns import arrivals
from nsmaps.exact.modes.tables.memory import memory, record
from nsmaps.exact.modes.tables.tables import Tables

NOWHERE = -1


def arrivals_of(
    definition: Definition, table: Tables, states: ArrayLike, modes: str | Sequence[str] | None, derivative: bool
) -> Arrivals:
    """As `HybridSystem.arrivals`."""
    names = start_names(definition, forced=table.rate > 0)
    start = as_states(states, names)
    n, m = len(definition.states), len(definition.coordinates)
    given = ("",) * len(start) if modes is None else (modes,) * len(start) if isinstance(modes, str) else tuple(modes)
    if len(given) != len(start):
        raise StateError(f"{len(given)} modes of {len(start)} states; expected: one name, or as many as states")
    known = tuple(dict.fromkeys(definition.modes))
    for name in set(given) - {*known, ""}:
        raise StateError(f"{name!r} is not a mode; expected: one of {', '.join(known)}{near_match(name, known)}")
    phase = start[:, n] if table.rate > 0 else np.zeros(len(start))
    chosen = modes_of(definition, table, start[:, :n], phase, given)
    found = record(np.full((len(start), m), np.nan), 1, start.shape[1] if derivative else 0)
    arrivals(table, chosen, np.ascontiguousarray(start[:, :n]), phase, found, memory(table, found.tangents.shape[-1]))
    names_of_modes = np.array([*definition.modes, ""])[chosen]
    slopes = found.tangents[0] if derivative else None
    rows = found.states[1], found.turns[0], found.codes[0], found.outcome[0], found.time[0]
    return Arrivals(definition.coordinates, names, definition.letters, start, names_of_modes, *rows, slopes)


def start_names(definition: Definition, forced: bool) -> Coordinates:
    """The states and, with forcing, the phase, by the name that the section has for it or `phi`."""
    angles = [name for name in definition.coordinates if name not in definition.states] or ["phi"]
    return Coordinates((*definition.states, *angles[:forced]), angles=angles[:forced])


def modes_of(definition: Definition, table: Tables, states: Floats, phase: Floats, given: Sequence[str]) -> Ints:
    """The mode of each state, -1 for none: that given, or the first whose guards are positive, but for sliding and contact."""
    waves = [
        wave
        for m in range(1, (table.functions.shape[1] - states.shape[1] + 1) // 2)
        for wave in (np.cos(m * phase), np.sin(m * phase))
    ]
    features = np.column_stack([states, np.ones(len(states)), *waves])
    values, named, found = features @ table.functions.T, np.array(given, str), np.full(len(states), NOWHERE)
    derived = {one.mode for one in definition.transitions if one.held}
    for mode, name in reversed(list(enumerate(definition.modes))):
        own = values[:, table.watched[mode] : table.watched[mode + 1]]
        obeyed: Bools = (named == name) & (own >= 0).all(axis=1)
        if mode not in derived:
            obeyed |= (named == "") & (own > 0).all(axis=1)
        found[obeyed & np.isfinite(features).all(axis=1) & (np.abs(phase) <= MOST_PHASE)] = mode
    return found
