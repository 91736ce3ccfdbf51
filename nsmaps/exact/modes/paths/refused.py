"""Why a state is not a start, in sentences."""

import math
from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.arriving import features_of, velocities
from nsmaps.exact.modes.tables.memory import END
from nsmaps.exact.modes.tables.nonlinear import start_states
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.modes.tables.taylor import ROUNDING


def no_number(names: Sequence[str], row: Floats, phase: float) -> str:
    """Which of the numbers of a state cannot be followed; "" for none."""
    for name, value in zip(names, row.tolist(), strict=True):
        if not math.isfinite(value):
            return f"{name} is {value}; expected: a finite number."
    return f"The phase is {phase:.6g}; expected: at most {MOST_PHASE:g} in size." if abs(phase) > MOST_PHASE else ""


def not_a_start(definition: Definition, table: Tables, row: Floats) -> str:
    """Why coordinates of the section are not a start."""
    n, places = len(definition.states), table.places.tolist()
    phase = float(row[places.index(-1)]) if -1 in places else table.phase
    if why := no_number(definition.coordinates, row, phase):
        return why
    given = np.zeros((1, n))
    given[:, table.places[table.places >= 0]] = row[table.places >= 0]
    phases = np.array([phase % TWO_PI])
    features = features_of(table, given, phases)
    reasons: dict[str, str] = {}
    for start, k in enumerate(table.starts.tolist()):
        states, _ = start_states(table, start, given, features, phases)
        (features_there,) = features_of(table, states, phases)
        name, (kept, why) = definition.transitions[k].name, _at(definition, table, k, features_there, phases)
        if name not in reasons or kept:
            reasons[name] = f"{name!r} {why} at {in_words(definition.states, features_there)}"
    return f"No event of the section takes place: {'; '.join(reasons.values())}."


def _at(definition: Definition, table: Tables, k: int, features: Floats, phase: Floats) -> tuple[bool, str]:
    """Whether the conditions of a transition hold at a state, and why it does not take place there."""
    conditions = table.where[table.conditions[k] : table.conditions[k + END]] @ features
    if len(conditions) and conditions.min() < 0:
        return False, f"has a condition that is {conditions.min():.6g}, and expected not to be negative,"
    mode = int(table.mode[k])
    (velocity,) = velocities(table, mode, features[None], phase)
    rate = float(table.functions[table.function[k]] @ velocity / table.steps[mode])
    return True, f"has a function that rises, at the rate {rate:.6g} in the mode {definition.modes[mode]!r},"


def in_no_mode(definition: Definition, table: Tables, state: Floats, mode: str) -> str:
    """Why a state, with the phase where there is forcing, belongs to no mode, or not to one that is given."""
    n = len(definition.states)
    phase = float(state[n]) if table.rate > 0 else 0.0
    if why := no_number([*definition.states, "phase"][: len(state)], state, phase):
        return why
    (features,) = features_of(table, state[None, :n], np.array([phase]))
    values, sizes = table.functions @ features, np.abs(table.functions) @ np.abs(features)
    reasons: dict[str, str] = {}
    for number, name in enumerate(definition.modes):
        watched = range(table.watched[number], table.watched[number + END])
        below = [f for f in watched if values[f] < -ROUNDING * sizes[f]]
        guards = {definition.transitions[table.chosen[table.choices[f]]].name: values[f] for f in below}
        if (mode in ("", name)) and guards:
            known = [f"the guard {guard!r} is {value:.6g}" for guard, value in guards.items() if guard]
            reasons.setdefault(name, f"in the mode {name!r} {' and '.join(known or ['a section lies behind'])}")
    kind = f"the mode {mode!r}" if mode else "any mode"
    return f"The state {in_words(definition.states, features)} does not belong to {kind}: {'; '.join(reasons.values())}."


def in_words(names: Sequence[str], values: Floats) -> str:
    """The first numbers of an array by name."""
    return ", ".join(f"{name} = {value:.10g}" for name, value in zip(names, values[: len(names)].tolist(), strict=True))
