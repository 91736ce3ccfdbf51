"""First arrivals at the section of states that are given anywhere in a mode."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import StateError, near_match
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.events import Arrivals
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.numbers import Numbers
from nsmaps.exact.modes.flights.laws import VALUE
from nsmaps.exact.modes.march.returns import arrivals
from nsmaps.exact.modes.tables.memory import END, FIRST, RATE_ABOVE, SURFACE, Memory, memory, record
from nsmaps.exact.modes.tables.nonlinear import derived_at, rates_at, write_variations
from nsmaps.exact.modes.tables.tables import Tables
from nsmaps.exact.modes.tables.taylor import ROUNDING
from nsmaps.exact.outcome import Outcome

NOWHERE = -1
ON = 1e-9  #: of the sizes of its terms: how near a function is to zero on a surface


def arrivals_of(
    definition: Definition, table: Tables, states: ArrayLike, modes: str | Sequence[str] | None, derivative: bool
) -> Arrivals:
    """As `HybridSystem.arrivals`."""
    angles = [name for name in definition.coordinates if name not in definition.states] or ["phi"]
    angles = angles if table.rate > 0 else []  # with forcing the phase, by the name that the section has for it
    names = Coordinates((*definition.states, *angles[:1]), angles=angles[:1])
    start = as_states(states, names)
    n, m = len(definition.states), len(definition.coordinates)
    given = modes_given(modes, len(start))
    if len(given) != len(start):
        raise StateError(f"{len(given)} modes of {len(start)} states; expected: one name, or as many as states")
    known = tuple(dict.fromkeys(definition.modes))
    for name in set(given) - {*known, ""}:
        raise StateError(f"{name!r} is not a mode{near_match(name, known)}; expected: one of {', '.join(known)}")
    phase = np.ascontiguousarray(start[:, n]) if table.rate > 0 else np.zeros(len(start))
    features = features_of(table, start[:, :n], phase)
    check_surfaces(definition, table, features, np.array(given, str))
    chosen = modes_of(definition, table, features, phase, given)
    found = record(np.zeros((len(start), m)), 1, start.shape[1] if derivative else 0)
    if derivative:
        write_variations(definition, table.variations, along=False)
    begin, place, room = 0, np.ascontiguousarray(start[:, :n]), memory(table, found.tangents.shape[-1])
    while begin < len(start):
        begin = arrivals(table, chosen, place, phase, found, begin, room)
    (outcome,), (time,) = found.outcome, found.time
    unclear = (outcome == Outcome.repelling) & (time == 0)
    names_of_modes = np.array([*definition.modes, ""])[np.where(unclear, NOWHERE, chosen)]
    slopes = found.tangents[FIRST] if derivative else None
    (_, images), (turns,), (codes,) = found.states, found.turns, found.codes
    rows = images, turns, codes, outcome, time
    return Arrivals(definition.coordinates, names, definition.letters, start, names_of_modes, *rows, slopes)


def modes_given(modes: str | Sequence[str] | None, count: int) -> tuple[str, ...]:
    """The names of the modes in which so many states are given, "" for any."""
    return (modes or "",) * count if modes is None or isinstance(modes, str) else tuple(modes)


def arrived_alone(definition: Definition, table: Tables, state: Floats, mode: str) -> tuple[Outcome, float, int, Memory]:
    """How one motion, from a state with the phase where there is forcing, ended: outcome, time, first mode, and its memory."""
    n = len(definition.states)
    phase, place = state[n:] if table.rate > 0 else np.zeros(1), np.ascontiguousarray(state[None, :n])
    chosen = modes_of(definition, table, features_of(table, place, phase), phase, [mode])
    found, w = record(np.zeros((1, len(definition.coordinates))), 1, 0), memory(table, 0)
    arrivals(table, chosen, place, phase, found, 0, w)
    return Outcome(found.outcome.item()), found.time.item(), chosen.item(), w


def features_of(table: Tables, states: Floats, phase: Floats) -> Floats:
    """The features of states, shape (M, N)."""
    waves = [
        wave
        for m in range(1, (table.functions.shape[1] - table.first.shape[1]) // 2 + 1)
        for wave in (np.cos(m * phase), np.sin(m * phase))
    ]
    return np.column_stack([states, derived_at(table, states, phase)[..., VALUE], np.ones(len(states)), *waves])


def check_surfaces(definition: Definition, table: Tables, features: Floats, named: NDArray[np.str_]) -> None:
    """Refuse states that are given in sliding or in lasting contact and do not lie on its surface."""
    n = table.first.shape[1] - 1
    for mode, held in {definition.modes[one.mode]: one.held for one in definition.transitions if one.held}.items():
        if (own := features[named == mode]).size:
            rows = Numbers(held, definition.symbols, (features.shape[1] - n - 1) // 2).floats(table.parameters.tolist())
            values, sizes = own @ rows.T, abs(own) @ abs(rows).T
            if (off := (abs(values) > ON * sizes).any(axis=1)).any():
                (value, *_), (state, *_) = values[off], own[off]
                far, where = abs(value).max(), ", ".join(f"{x:.10g}" for x in state[: table.own])
                raise StateError(
                    f"the state ({where}) is given in the mode {mode!r}, and its surface is {far:.3g} away; expected: states of "
                    "sliding and of contact that lasts on their surface, or no mode"
                )


def modes_of(definition: Definition, table: Tables, features: Floats, phase: Floats, given: Sequence[str]) -> Ints:
    """The mode of each state, -1 for none: that given, or the first whose guards are not negative, but for sliding and contact.

    It is one in which fewest functions are below zero just after, those that are crossed and those that are zero and fall; of
    these one in which fewest fall, as others have been passed already. On a surface that repels it is one of the two beside it,
    from which the motion is not unique.
    """
    known = np.isfinite(features).all(axis=1) & (np.abs(phase) <= MOST_PHASE)
    features = np.where(known[:, None], features, 0.0)
    values, named = features @ table.functions.T, np.array(given, str)
    on = np.einsum("mj,qkj->mqk", features, table.surfaces)
    near = abs(on[..., SURFACE]) <= ROUNDING * (abs(features) @ abs(table.surfaces[:, SURFACE]).T)
    away = near & (on[..., RATE_ABOVE:] > 0).all(axis=-1)
    slack = ROUNDING * (abs(features) @ abs(table.functions).T)
    derived = {one.mode for one in definition.transitions if one.held}
    found, least = np.full(len(features), NOWHERE), np.full(len(features), np.inf)
    for mode, name in enumerate(definition.modes):
        watched = slice(table.watched[mode], table.watched[mode + END])
        own, edge = values[:, watched], slack[:, watched]
        obeyed: Bools = (named == name) | ((named == "") & (mode not in derived)) | away[:, table.beside[:, mode]].any(axis=1)
        obeyed &= (own >= -edge).all(axis=1) & known
        rates = velocities(table, mode, features, phase) @ table.functions[watched].T
        due = ((own <= edge) & (rates < 0)).sum(axis=1)
        rank = (table.below[mode] + due) * len(table.functions) + due
        better = obeyed & (rank < least)
        found[better], least[better] = mode, rank[better]
    return found


def velocities(table: Tables, mode: int, features: Floats, phase: Floats) -> Floats:
    """The rates of the features at phases (M,) in a mode, in its time unit, shape (M, N)."""
    n, turn = table.first.shape[1] - 1, table.rate * table.steps[mode]
    rates = np.zeros(features.shape)
    if table.taylor[mode]:
        rates[:, :n] = rates_at(table, mode, features[:, : table.own], phase) * table.steps[mode]
    for i in range(0 if table.taylor[mode] else n):
        row = slice(table.first[mode, i], table.first[mode, i + END])
        rates[:, i] = features[:, table.columns[row]] @ table.values[row]
    m = np.arange(1, (features.shape[1] - n - 1) // 2 + 1)
    rates[:, n + 1 :: 2], rates[:, n + 2 :: 2] = -m * turn * features[:, n + 2 :: 2], m * turn * features[:, n + 1 :: 2]
    return rates
