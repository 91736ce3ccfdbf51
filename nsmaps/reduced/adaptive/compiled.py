"""Orbits of a map of strips in a compiled loop, interrupted only by returns that the exact map computes."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.exact.returns import Returns
from nsmaps.reduced.adaptive.kernel import chain
from nsmaps.reduced.adaptive.surrogate import StripMap

Number = TypeVar("Number", bound=np.generic)


def orbits(map: StripMap, start: Floats, n: int) -> Returns:
    """The first n returns of each of M states, shape (M, 2): those of `StripMap.first_return` up to rounding."""
    m, strips, rate = len(start), map.strips, map.system.phase_rate()
    states, turns = np.empty((m, n + 1, 2)), np.empty((m, n, 2), np.int32)
    codes, outcome, time = np.empty((m, n), np.int64), np.empty((m, n), np.int8), np.empty((m, n))
    states[:, 0] = start
    for k in range(m):
        own, at = (states[k], turns[k], codes[k], outcome[k], time[k]), 0
        while (at := chain(strips.tables, strips.bounds[1], strips.words, rate, at, *own)) < n:
            exact = map.system.first_return(states[k, at : at + 1])
            states[k, at + 1], turns[k, at], codes[k, at] = exact.image[0], exact.turns[0], exact.codes[0]
            outcome[k, at], time[k, at] = exact.outcome[0], exact.time[0]
            at += 1
    start, image, each = _by_return(states[:, :-1]), _by_return(states[:, 1:]), (_by_return(codes), _by_return(outcome))
    return Returns(map.coordinates, map.walls, start, image, _by_return(turns), *each, _by_return(time), fitted=True)


def _by_return(rows: NDArray[Number]) -> NDArray[Number]:
    """Rows of n returns of each of M states, shape (M, n, ...), as (n M, ...): the first return of every state first."""
    return np.swapaxes(rows, 0, 1).reshape(-1, *rows.shape[2:])
