"""First returns of large batches in parts, in any executor."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import as_states
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns, arrays_of
from nsmaps.parallel import SERIAL, Arrays, Parallel, begun, divides

PART = 20_000  #: returns of a part, unless `parallel` says how many states


@divides
def divided_returns(
    system: ReturnMap, states: ArrayLike, n: int, derivative: bool, *, parallel: Parallel = SERIAL, **how: Any
) -> Returns:
    """The first n returns of each of M states, as `system.orbits(states, n, derivative)`, in parts of `parallel`.

    The numbers are the same to the last bit. n M rows, the first return of every state first.

    Raises:
        StateError: `states` is not a batch of states.
        NsmapsError: n is below 1.
        Interrupted: Ctrl-C; `result` has the returns of the first states, up to a part that was not finished.
    """
    start = as_states(states, system.coordinates)
    if n < 1:
        raise NsmapsError(f"n is {n}; expected: at least one return")
    if not (parallel.divided and len(start)):
        return system.orbits(start, n, derivative, **how)
    cuts = parallel.cuts(len(start), max(1, PART // n))
    like = system.orbits(start[:0], n, derivative, **how)

    def join_parts(parts: Sequence[Arrays]) -> Returns | None:
        if not parts:
            return None
        first, *_ = parts
        rows: dict[str, Any] = {name: np.concatenate([part[name] for part in parts], axis=1) for name in first}
        starts = np.concatenate([start[None, : rows["image"].shape[1]], rows["image"][:-1]]).reshape(-1, start.shape[1])
        flat = {name: row.reshape(-1, *row.shape[2:]) for name, row in rows.items()}
        return replace(like, start=starts, **flat)

    parts = [(system, start[k], n, derivative, how) for k in cuts]
    found = join_parts(parallel.run(_part, parts, lambda found: join_parts(begun(found))))
    assert found is not None, "there are states"
    return found


def _part(system: ReturnMap, start: Floats, n: int, derivative: bool, how: dict[str, Any]) -> Arrays:
    """The first n returns of some states, in arrays of n rows; without their starts."""
    found = arrays_of(system.orbits(start, n, derivative, **how))
    return {name: row.reshape(n, len(start), *row.shape[1:]) for name, row in found.items() if name != "start"}
