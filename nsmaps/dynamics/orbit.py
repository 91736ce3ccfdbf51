"""Orbits of return maps, in batches."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.errors import StateError
from nsmaps.exact.impacts import Floats, Outcome


@dataclass(frozen=True, slots=True, eq=False)
class Orbit:
    """The orbits of one or more starts under a return map; `...` is the shape of the starts without their last axis."""

    coordinates: tuple[str, ...]
    states: Floats  #: shape (n + 1, ..., dim), the starts first; NaN after an orbit's end
    words: NDArray[np.str_]  #: shape (n, ...), the word of each return; "" after an orbit's end
    outcome: NDArray[np.int8]  #: shape (n, ...), values of `Outcome`; that which ended an orbit is repeated after its end

    @property
    def final(self) -> Floats:
        """The last states, shape (..., dim)."""
        return self.states[-1]


def orbit(map: ReturnMap, state: ArrayLike, n: int, progress: Callable[[int], None] | None = None, **how: Any) -> Orbit:
    """The first n returns of one state, shape (dim,), or of many, shape (..., dim).

    Args:
        map: an exact system, a composite map, or anything else with `coordinates` and `first_return`.
        progress: called with the number of returns made, after each.
        how: passed on to `map.first_return`, such as `chatter=inf` of an exact system.

    Raises:
        StateError: the state has not the map's coordinates, or n is negative.
    """
    start = np.asarray(state, float)
    dim = len(map.coordinates)
    if start.ndim == 0 or start.shape[-1] != dim:
        raise StateError(f"the start has shape {start.shape}; its last axis must hold {', '.join(map.coordinates)}")
    if n < 0:
        raise StateError(f"n is {n}; a number of returns >= 0 is accepted")
    flat = start.reshape(-1, dim)
    states = np.full((n + 1, *flat.shape), np.nan)
    outcome = np.full((n, len(flat)), Outcome.invalid, np.int8)
    words: list[NDArray[np.str_]] = []
    states[0] = flat
    alive = np.arange(len(flat))
    for k in range(n):
        returns = map.first_return(states[k, alive], **how)
        states[k + 1, alive] = returns.image
        outcome[k:, alive] = returns.outcome
        made = returns.words
        word = np.full(len(flat), "", made.dtype)
        word[alive] = made
        words.append(word)
        alive = alive[returns.valid]
        if progress is not None:
            progress(k + 1)
    shape = start.shape[:-1]
    table = np.array(words, dtype=str).reshape(n, *shape) if n else np.empty((0, *shape), "U1")
    return Orbit(map.coordinates, states.reshape(n + 1, *start.shape), table, outcome.reshape(n, *shape))
