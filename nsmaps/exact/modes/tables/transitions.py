"""The fields of a table that describe the transitions of a system with modes."""

from functools import lru_cache
from typing import Any

import numpy as np

from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.resets import law_address
from nsmaps.exact.modes.tables.rows import Rows
from nsmaps.exact.words import base_of_words


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
    """The fields of a table that describe its transitions, and are the same at all parameters."""
    letters, transitions = definition.letters, definition.transitions
    names = {transitions[start.transition].name for start in definition.starts}
    guards = [one.guard for one in transitions if one.begins]
    return {
        "mode": np.array([one.mode for one in transitions]),
        "target": np.array([one.target for one in transitions]),
        "laws": np.array([law_address(definition, one) for one in transitions]),
        "curved": np.array([[k in dict(one.curved) for k in range(len(definition.states))] for one in transitions]),
        "conditions": np.cumsum([0, *(len(one.where) for one in transitions)]),
        "digit": np.array([letters.index(one.letter) + 1 if one.letter else 0 for one in transitions]),
        "base": base_of_words(letters),
        "impacts": np.array([guards.index(one.guard) if one.guard and not one.begins else -1 for one in transitions]),
        "contacts": np.array([guards.index(one.guard) if one.begins else -1 for one in transitions]),
        "releases": np.array([one.releases for one in transitions]),
        "resting": np.isin(range(len(definition.modes)), [one.mode for one in transitions if one.releases]),
        "below": np.array(definition.below),
        "is_section": np.array([one.name in names for one in transitions]),
        "beside": np.array([[mode in one.modes for mode in definition.modes] for one in definition.surfaces], bool).reshape(
            len(definition.surfaces), len(definition.modes)
        ),
    }
