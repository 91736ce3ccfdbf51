"""The names of the motions of a bifurcation diagram, whose orbits without a period are followed to what they end on."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.limits.limit import Limit, limits
from nsmaps.dynamics.limits.releases import ROUNDED
from nsmaps.dynamics.motion import label
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.words import Alphabet, words_of
from nsmaps.parallel import Arrays, Parallel, begun

OPEN = 20  #: orbits without a period in a part, which are followed for longer


class ResolvedMotion(NamedTuple):
    """What an orbit without a period was found to end on."""

    length: int  #: number of states of a period; 0 without one
    period: int  #: its returns
    label: str
    states: Floats  #: shape (length, n)


def alphabet_as_arrays(alphabet: Alphabet) -> Arrays:
    """An alphabet among the arrays of a part; see `alphabet_among`."""
    section = np.array(alphabet.section or (), str)
    return {"section": section, "clocks": np.array(alphabet.clocks, str), "turning": np.array(alphabet.turns)}


def alphabet_among(arrays: Arrays) -> Alphabet:
    """The alphabet that `alphabet_as_arrays` has put there."""
    section, clocks = (tuple(arrays[name].tolist()) for name in ("section", "clocks"))
    return Alphabet(section or None, clocks, int(arrays["turning"]))


def names(
    coordinates: Coordinates,
    walls: tuple[str, ...],
    alphabet: Alphabet,
    codes: Ints,
    turns: NDArray[np.int32],
    length: Ints,
    period: Ints,
) -> NDArray[np.object_]:
    """The motion of each orbit with a period of so many states and returns, shape (V, S); "" of others."""
    turned, table, known = turns[..., coordinates.angles].sum(axis=-1), np.full(period.shape, "", object), dict[Any, str]()
    for k in zip(*np.nonzero(period), strict=True):
        q = int(length[k])
        key = codes[k][:q].tobytes(), turned[k][:q].tobytes(), int(period[k])
        if key not in known:
            known[key] = label(words_of(codes[k][:q], walls).tolist(), turned[k][:q].tolist(), int(period[k]), alphabet)
        table[k] = known[key]
    return table


def open_ends(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    states: Floats,
    open_: Bools,
    scale: Floats,
    tolerance: float,
    parallel: Parallel,
    unfinished: Callable[[list[ResolvedMotion]], Any],
) -> list[ResolvedMotion]:
    """Length, period and name of the motions of open orbits, from their last states (V, S, n) on, in the order of the orbits.

    After Ctrl-C the result is what `unfinished` makes of the first of them, if the work is divided.
    """
    rows = np.flatnonzero(open_.any(axis=1))
    last = np.where(open_[:, :, None], states, np.nan)
    cuts = [rows[cut] for cut in parallel.cuts(len(rows), -(-OPEN // max(states.shape[1], 1)))] if parallel.divided else [rows]
    parts = [(map_of, values[cut], last[cut], scale, tolerance) for cut in cuts]
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


def _limits(map_of: Callable[[float], ReturnMap], values: Floats, states: Floats, scale: Floats, tolerance: float) -> Arrays:
    """The motions of orbits from states (V, S, n) that are not NaN; the states of their periods one after the other."""
    found: list[Limit] = []
    for value, there in zip(values.tolist(), states, strict=True):
        found += limits(map_of(value), there[np.isfinite(there).all(axis=1)], scale, tolerance)
    numbers = {name: np.array([getattr(one, name) for one in found], int) for name in ("length", "period")}
    cycles = np.concatenate([states[:0, 0], *(one.states[: one.length] for one in found)])
    return {**numbers, "states": cycles, "label": np.array([one.label for one in found], str)}


def are_exact(coordinates: Coordinates, states: Floats, length: Ints, scale: Floats) -> Bools:
    """A mask of the orbits (V, S) that repeat up to rounding; others may still approach a cycle of another period."""
    count = states.shape[2]
    before = np.take_along_axis(states, (count - 1 - length)[:, :, None, None].clip(0), axis=2)[:, :, 0]
    return coordinates.near(states[:, :, -1], before, ROUNDED, scale)
