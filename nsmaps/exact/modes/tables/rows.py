"""All rows of a system with modes, in floats, and the fields of a table that describe its transitions."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.modes.definitions.definition import Definition, Start, Transition
from nsmaps.exact.words import base_of_words


@dataclass(frozen=True)
class Rows:
    """All rows in floats, in the parts of a definition."""

    rates: Floats  #: shape (M, n, N)
    functions: Floats  #: shape (T, N)
    resets: Floats  #: shape (T, n, N)
    where: list[Floats]  #: of each transition
    begins: Floats  #: shape (T, 2, N), zero but where contact begins
    held: list[Floats]  #: of each transition, what is zero all along before it
    starts: Floats  #: shape (number of starts, n, N)
    surfaces: Floats  #: shape (Q, 3, N)


def rows_of(definition: Definition, given: Floats) -> Rows:
    """The rows of a definition, given in the order of `Definition.rows`, shape (R, N).

    Derived states that no event changes are their own after resets.
    """
    waiting = iter(given)
    n, width = len(definition.states) + len(definition.derived), given.shape[1]
    rates = np.array([[next(waiting) for _ in mode] for mode in definition.rates])
    functions, resets, where, begins, held = [], [], [], [], []
    for one, changing in zip(definition.transitions, definition.states_to_recompute, strict=True):
        functions.append(next(waiting))
        reset = np.array([next(waiting) for _ in one.reset])
        for d in set(range(len(definition.states), n)) - set(changing):
            reset[d] = np.eye(n, width)[d]
        resets.append(reset)
        where.append(np.array([next(waiting) for _ in one.where]).reshape(-1, width))
        begins.append([next(waiting) for _ in one.begins] or np.zeros((2, width)))
        held.append(np.array([next(waiting) for _ in one.held]).reshape(-1, width))
    starts = np.array([[next(waiting) for _ in range(n)] for _ in definition.starts])
    surfaces = np.array([[next(waiting) for _ in one.rows] for one in definition.surfaces]).reshape(-1, 3, width)
    return Rows(rates, np.array(functions), np.array(resets), where, np.array(begins), held, starts, surfaces)


def flow_matrices(rates: Floats, turns: Any) -> Floats:
    """The matrices of z' by z, (M, N, N), by rates of states, (M, n, N), and of the phase, one or (M,): floats, or all balls."""
    count, n, width = rates.shape
    flows = np.zeros((count, width, width), rates.dtype)
    flows[:, :n] = rates
    for m in range(1, (width - n - 1) // 2 + 1):
        sine = n + 2 * m
        cosine = sine - 1
        flows[:, cosine, sine], flows[:, sine, cosine] = -m * turns, m * turns
    return flows


@lru_cache(maxsize=64)
def plain_of(definition: Definition) -> list[bool]:
    """Whether a motion continues from a transition with a linear reset, and neither contact nor sliding may begin there."""
    bound = bool(definition.surfaces) or any(one.begins or one.releases for one in definition.transitions)
    ends = {definition.transitions[start.transition].name for start in definition.starts} if definition.after else set()
    return [not (bound or one.curved or one.target < 0 or one.name in ends) for one in definition.transitions]


def transitions_of(definition: Definition, rows: Rows) -> dict[str, Any]:
    """The fields of a table that describe its transitions."""
    n, width = rows.resets.shape[1:]
    fixed, own = fixed_fields(definition), len(definition.states)
    jumps = (rows.resets != np.eye(n, width)).any(axis=2)
    return {
        **fixed,
        "resets": rows.resets,
        "moves": (fixed["curved"] | jumps[:, :own]).any(axis=1),
        "jumps": jumps,
        "where": np.concatenate([np.empty((0, width)), *rows.where]),
        "begins": rows.begins,
        "surfaces": rows.surfaces,
    }


@lru_cache(maxsize=64)
def fixed_fields(definition: Definition) -> dict[str, Any]:
    """The fields of a table that describe its transitions and starts, and are the same at all parameters."""
    letters, transitions, states, modes = definition.letters, definition.transitions, definition.states, definition.modes
    names = {transitions[start.transition].name for start in definition.starts}
    guards = [one.guard for one in transitions if one.begins]
    flat = [one for one in definition.surfaces if not any(next(iter(one.rows)).coefficients[len(states) :])]
    slides = {f"{mode} to {one.name}": len(guards) for one in flat for mode in one.modes}
    return {
        "mode": np.array([one.mode for one in transitions]),
        "target": np.array([one.target for one in transitions]),
        "laws": np.array([law_address(definition, one) for one in transitions]),
        "curved": np.array([[k in dict(one.curved) for k in range(len(states))] for one in transitions]),
        "conditions": np.cumsum([0, *(len(one.where) for one in transitions)]),
        "digit": np.array([letters.index(one.letter) + 1 if one.letter else 0 for one in transitions]),
        "base": base_of_words(letters),
        "impacts": np.array([guards.index(one.guard) if one.guard and not one.begins else -1 for one in transitions]),
        "contacts": np.array([guards.index(one.guard) if one.begins else slides.get(one.name, -1) for one in transitions]),
        "releases": np.array([one.releases for one in transitions]),
        "resting": np.isin(range(len(modes)), [one.mode for one in transitions if one.releases]),
        "below": np.array(definition.below),
        "is_section": np.array([one.name in names for one in transitions]),
        "beside": np.array([[mode in one.modes for mode in modes] for one in definition.surfaces], bool).reshape(-1, len(modes)),
        "starts": np.array([start.transition for start in definition.starts]),
        "start_laws": np.array([law_address(definition, start) for start in definition.starts]),
        "start_curved": np.array([[k in dict(start.curved) for k in range(len(states))] for start in definition.starts]),
        "places": np.array([states.index(name) if name in states else -1 for name in definition.coordinates]),
    }


def law_address(definition: Definition, one: Transition | Start) -> int:
    """The address of the compiled function that writes the states of `curved`, and their derivatives; zero if there are none.

    It takes the phase, and the addresses of the n own states, of the parameters and of a table of n rows, to which it writes for
    each state that it gives the value, and the derivatives by every own state, by the phase and by every parameter at a fixed
    phase. States are those before a reset, or for a start the coordinates among them.
    """
    if not one.curved:
        return 0
    by = (*definition.variables, PHI, *definition.symbols)
    width = 1 + len(by)
    places = [k * width + j for k, _ in one.curved for j in range(width)]
    formulas = [entry for _, formula in one.curved for entry in (formula, *(sp.diff(formula, x) for x in by))]
    return rows_address(rows_source(formulas, places, definition.variables, definition.symbols))
