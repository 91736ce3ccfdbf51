"""A map of strips whose returns run in a compiled loop, which only the exact map's own returns interrupt."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike
from nsmaps.exact.impacts import Returns, as_states
from nsmaps.reduced.stripkernel import chain
from nsmaps.reduced.strips import StripMap

Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class CompiledStrips:
    """A map of strips for many returns of few states: a `CompiledOrbit`, as `StripMap.first_return` but for rounding."""

    map: StripMap

    def orbits(self, states: ArrayLike, n: int) -> Returns:
        """The first n returns of each of M states, shape (M, 2): n M rows, the first return of every state first."""
        map, start = self.map, as_states(states, self.map.coordinates)
        m, strips, rate = len(start), map.strips, map.system.phase_rate()
        made, turns = np.empty((m, n + 1, 2)), np.empty((m, n, 2), np.int32)
        codes, outcome, time = np.empty((m, n), np.int64), np.empty((m, n), np.int8), np.empty((m, n))
        made[:, 0] = start
        for k in range(m):
            own, at = (made[k], turns[k], codes[k], outcome[k], time[k]), 0
            while (at := chain(strips.tables, strips.bounds[1], strips.words, rate, at, *own)) < n:
                exact = map.system.first_return(made[k, at : at + 1])
                made[k, at + 1], turns[k, at], codes[k, at] = exact.image[0], exact.turns[0], exact.codes[0]
                outcome[k, at], time[k, at] = exact.outcome[0], exact.time[0]
                at += 1
        start, image, each = _by_return(made[:, :-1]), _by_return(made[:, 1:]), (_by_return(codes), _by_return(outcome))
        return Returns(map.coordinates, map.walls, start, image, _by_return(turns), *each, _by_return(time), fitted=True)


def _by_return(rows: NDArray[Number]) -> NDArray[Number]:
    """Rows of n returns of each of M states, shape (M, n, ...), as (n M, ...): the first return of every state first."""
    return np.swapaxes(rows, 0, 1).reshape(-1, *rows.shape[2:])
