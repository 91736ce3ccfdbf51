"""The names of the motions of a bifurcation diagram, whose orbits without a period are followed to what they end on."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.limits.decision import limits
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.parallel import Arrays, Parallel, begun

OPEN = 20  #: orbits without a period in a part, which are followed for longer


class ResolvedMotion(NamedTuple):
    """What an orbit without a period was found to end on."""

    length: int  #: number of states of a period; 0 without one
    period: int  #: its returns
    label: str
    states: Floats  #: shape (length, n)


def open_ends(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    states: Floats,
    open_: Bools,
    scale: Floats,
    starts: Floats,
    tolerance: float,
    parallel: Parallel,
    unfinished: Callable[[list[ResolvedMotion]], Any],
) -> list[ResolvedMotion]:
    """Length, period and name of the motions of open orbits, from their last states (V, S, n) on, in the order of the orbits.

    Each has its scale, (V, S, n), and its start, (S, n).

    After Ctrl-C the result is what `unfinished` makes of the first of them, if the work is divided.
    """
    rows = np.flatnonzero(open_.any(axis=1))
    last = np.where(open_[:, :, None], states, np.nan)
    cuts = [rows[cut] for cut in parallel.cuts(len(rows), -(-OPEN // max(states.shape[1], 1)))] if parallel.divided else [rows]
    parts = [(map_of, values[cut], last[cut], scale[cut], starts, tolerance) for cut in cuts]
    if not parallel.divided:
        return _motions([_limits(*part) for part in parts])

    def first(found: Mapping[int, Arrays]) -> Any:
        return unfinished(_motions(begun(found)))

    return _motions(parallel.run(_limits, parts, first))


def _motions(parts: Iterable[Arrays]) -> list[ResolvedMotion]:
    """The motions from the arrays of parts."""
    found = list[ResolvedMotion]()
    for part in parts:
        states = np.split(part["states"], np.cumsum(part["length"])[:-1])
        found += map(ResolvedMotion, *(part[name].tolist() for name in ("length", "period", "label")), states)
    return found


def _limits(
    map_of: Callable[[float], ReturnMap], values: Floats, states: Floats, scale: Floats, starts: Floats, tolerance: float
) -> Arrays:
    """The motions of orbits from states (V, S, n) that are not NaN; the states of their periods one after the other."""
    found: list[Limit] = []
    for value, there, unit in zip(values.tolist(), states, scale, strict=True):
        own = np.isfinite(there).all(axis=1)
        found += limits(map_of(value), there[own], unit[own], tolerance, starts[own])
    numbers = {name: np.array([getattr(one, name) for one in found], int) for name in ("length", "period")}
    cycles = np.concatenate([states[:0, 0], *(one.states[: one.length] for one in found)])
    return {**numbers, "states": cycles, "label": np.array([one.label for one in found], str)}
