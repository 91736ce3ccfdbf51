"""All rows of a system with modes, in floats."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.tables.nonlinear import states_to_recompute


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
    for one in definition.transitions:
        functions.append(next(waiting))
        reset = np.array([next(waiting) for _ in one.reset])
        for d in set(range(len(definition.states), n)) - set(states_to_recompute(definition, one)):
            reset[d] = np.eye(n, width)[d]
        resets.append(reset)
        where.append(np.array([next(waiting) for _ in one.where]).reshape(-1, width))
        begins.append([next(waiting) for _ in one.begins] or np.zeros((2, width)))
        held.append(np.array([next(waiting) for _ in one.held]).reshape(-1, width))
    starts = np.array([[next(waiting) for _ in range(n)] for _ in definition.starts])
    surfaces = np.array([[next(waiting) for _ in one.rows] for one in definition.surfaces]).reshape(-1, 3, width)
    return Rows(rates, np.array(functions), np.array(resets), where, np.array(begins), held, starts, surfaces)
