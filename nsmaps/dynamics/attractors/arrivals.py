"""Starts followed until they reach one of some attractors."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.limits.cycles import comes_nearer
from nsmaps.dynamics.limits.path import vast
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.interrupts import Interrupted
from nsmaps.progress import Progress

PARTS = 4  #: last parts of an orbit that has not arrived, whose distances from cycles are compared
SHARE = 8  #: such a part is this share of the returns of the orbit
UNRESOLVED, ENDED = -1, -2  #: labels of starts that reach no attractor, and of those whose orbit ends


class Ends(NamedTuple):
    """The attractors that some starts reach, as in `Basins`."""

    label: NDArray[np.int32]
    arrival: NDArray[np.int32]
    outcome: NDArray[np.int8]
    stuck: NDArray[np.bool_]

    @classmethod
    def unreached(cls, n: int) -> "Ends":
        """Those of n starts before their first return."""
        return cls(
            np.full(n, UNRESOLVED, np.int32), np.zeros(n, np.int32), np.full(n, Outcome.returned, np.int8), np.zeros(n, bool)
        )

    def of(self, which: Ints) -> "Ends":
        """Those of some of the starts."""
        return Ends(self.label[which], self.arrival[which], self.outcome[which], self.stuck[which])

    def write(self, where: Ints | slice, some: Iterable[NDArray[Any]]) -> None:
        """Write those of some of the starts, if there are any."""
        for name, new in zip(self._fields, some, strict=False):
            getattr(self, name)[where] = new


def follow(
    return_map: ReturnMap,
    start: Floats,
    attractors: Sequence[Attractor],
    returns: int,
    progress: Progress | None = None,
    in_time: bool = False,
) -> Ends:
    """Label, arrival, outcome and stuck of each start, shape (N, n), as in `Basins`.

    Ctrl-C raises Interrupted, with those that are known.

    Args:
        in_time: whether orbits must arrive within the returns; otherwise they may still come nearer and nearer to a cycle then.
    """
    ends = Ends.unreached(len(start))
    try:
        _follow(return_map, start, attractors, returns, progress, ends, in_time)
    except KeyboardInterrupt as stopped:
        raise Interrupted.of(stopped, ends) from None
    return ends


def _follow(
    return_map: ReturnMap,
    start: Floats,
    attractors: Sequence[Attractor],
    returns: int,
    progress: Progress | None,
    ends: Ends,
    in_time: bool,
) -> None:
    """As `follow`, written to ends."""
    n, (label, arrival, outcome, _) = len(start), ends
    streak, since = np.zeros((2, len(attractors), n), np.int32)  # successive states near each, and the returns before the first
    going, states = np.arange(n), Coordinates(return_map.coordinates).wrap(start)
    scale = Coordinates(return_map.coordinates).magnitudes(start, *(attractor.states for attractor in attractors))
    approach = _Approach(attractors, 0 if in_time else returns // SHARE, n)
    for k in range(returns + 1):
        open_ = np.isfinite(states).all(axis=1)
        if not open_.all():
            ended = going[~open_]
            label[ended] = ENDED
            outcome[ended[outcome[ended] == Outcome.returned]] = Outcome.invalid
        for number, attractor in enumerate(attractors):
            near = approach.near(number, states, going, returns - k)
            since[number, going] = np.where(streak[number, going] == 0, arrival[going], since[number, going])
            streak[number, going] = np.where(near, streak[number, going] + 1, 0)
            near = open_ & (streak[number, going] >= attractor.stay)
            if near.any():
                label[going[near]], arrival[going[near]] = number, since[number, going[near]]
                open_ &= ~near
        if not open_.all():
            going, states = going[open_], states[open_]
        if progress is not None:
            progress(max(k / max(returns, 1), 1 - len(going) / max(n, 1)))
        if not len(going) or k == returns:
            break
        states = _next_states(return_map, states, going, ends, scale)
    for number in approach.cycles:
        label[going[comes_nearer(approach.distances[:, number, going])]] = number


def _next_states(return_map: ReturnMap, states: Floats, going: Ints, ends: Ends, scale: Floats) -> Floats:
    """The images of the states of orbits that have not ended, with what they end on written; NaN of those that escape."""
    returns = return_map.first_return(states)
    ends.outcome[going] = returns.outcome
    ends.arrival[going] += returns.numbers * returns.valid
    ends.stuck[going] |= returns.outcome == Outcome.stuck
    gone = vast(returns.coordinates, returns.image, scale)
    ends.outcome[going[gone]] = Outcome.escaped
    return np.where(gone[:, None], np.nan, returns.image) if gone.any() else returns.image


class _Approach:
    """The largest distances of orbits from each cycle in their last parts, of `length` returns; none if that is 0."""

    def __init__(self, attractors: Sequence[Attractor], length: int, n: int) -> None:
        self.attractors, self.length = attractors, length
        self.cycles = [number for number, attractor in enumerate(attractors) if 0 < attractor.period <= length]
        self.distances = np.zeros((PARTS, len(attractors), n if length else 0))

    def near(self, number: int, states: Floats, going: Ints, left: int) -> NDArray[np.bool_]:
        """Which states, of orbits by number, are near an attractor, so many returns before the last; distances are kept."""
        attractor, part = self.attractors[number], PARTS - 1 - left // max(self.length, 1)
        if part < 0 or number not in self.cycles:
            return attractor.near(states)
        distance = attractor.distances(states)
        self.distances[part, number, going] = np.maximum(self.distances[part, number, going], distance)
        return np.asarray(distance <= attractor.reach)
