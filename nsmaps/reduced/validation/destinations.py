"""Which of the exact map's attractors orbits end on, and the pieces of a composite map that lead them to another."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.attractor import Attractor, find_attractors
from nsmaps.dynamics.attractors.distance import Nearest
from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.reduced.composite.composite import CompositeMap

SEARCHED, STARTS = 100, 500  #: random starts from which attractors are sought, and whose orbits are compared
RETURNS, TAIL = 160, 32  #: of these orbits, and last ones that show where they end
WRONG = 100  #: orbits that end elsewhere, of which the step is sought that misleads them
FAR = 0.05  #: share of the box's sides: median distance of the last states beyond which they are on no known attractor
MISLED = 0.01  #: share of the starts that may end elsewhere, as beside the boundary of a basin
FEWEST = 0.1  #: least share of those that do, for a piece to count as the reason


def random_states(box: Floats, count: int) -> Floats:
    """Random states of a box, shape (count, n); the same in every call."""
    low, high = box.T
    return np.random.default_rng(7).uniform(low, high, (count, len(low)))


def ends(return_map: ReturnMap, composite: CompositeMap, box: Floats) -> Ints:
    """The pieces in which orbits of a map from random starts end, shape (TAIL, STARTS); -1 for none."""
    tail = orbit(return_map, random_states(box, STARTS), RETURNS).states[-TAIL:]
    return composite.piece_of(tail.reshape(-1, tail.shape[-1])).reshape(tail.shape[:2])


@dataclass(frozen=True, eq=False)
class Destinations:
    """The attractors of a map that orbits from a box end on."""

    map: ReturnMap
    box: Floats  #: shape (n, 2)
    attractors: tuple[Attractor, ...]

    @classmethod
    def of(cls, return_map: ReturnMap, box: Floats) -> Self:
        """Those that orbits of random starts end on."""
        return cls(return_map, box, tuple(find_attractors(return_map, random_states(box, SEARCHED), RETURNS)))

    @cached_property
    def right(self) -> Ints:
        """The numbers of the attractors on which random starts end, -1 for none, shape (STARTS,)."""
        return self.on(self._path(self.map))

    def agreement(self, composite: CompositeMap) -> float:
        """The share of random starts whose orbits of a composite map end where those of the map do; NaN without attractors."""
        known = self.right >= 0
        return float((self.on(self._path(composite)) == self.right)[known].mean()) if known.any() else float("nan")

    def misleading(self, composite: CompositeMap) -> set[str]:
        """The pieces by which orbits of random starts leave the basin of their attractor, where more than a few do.

        Such a step leads to a state from which the map itself ends on another attractor than from the state before.
        """
        path = self._path(composite)
        wrong = np.flatnonzero((self.on(path) != self.right) & (self.right >= 0))
        if len(self.attractors) < 2 or len(wrong) <= MISLED * STARTS:
            return set()
        wrong = wrong[:: -(-len(wrong) // WRONG)]
        steps = path[:, wrong]
        there = self.on(orbit(self.map, steps.reshape(-1, steps.shape[2]), RETURNS).states).reshape(steps.shape[:2])
        leaves = there[1:] != there[:-1]
        own = np.flatnonzero(leaves.any(axis=0))
        pieces, counts = np.unique(composite.piece_of(steps[leaves.argmax(axis=0)[own], own]), return_counts=True)
        return {composite.pieces[k].name for k in pieces[counts >= FEWEST * len(wrong)].tolist() if k >= 0}

    def on(self, path: Floats) -> Ints:
        """The number of the attractor on which orbits (K, S, n) end, -1 for none, shape (S,)."""
        tail, names = path[-TAIL:], Coordinates(self.map.coordinates)
        alive = np.flatnonzero(np.isfinite(tail).all(axis=(0, 2)))
        found = np.full(path.shape[1], -1)
        if not self.attractors or not len(alive):
            return found
        sides, states = np.ptp(self.box, axis=1), names.wrap(tail[:, alive]).reshape(-1, len(self.box))
        sides = np.where(sides > 0, sides, 1.0)
        near = [Nearest(each.states, names, sides).distances(states).reshape(len(tail), -1) for each in self.attractors]
        distance = np.median(near, axis=1)
        found[alive] = np.where(distance.min(axis=0) <= FAR, distance.argmin(axis=0), -1)
        return found

    def _path(self, return_map: ReturnMap) -> Floats:
        """The orbits of random starts under a map, shape (RETURNS + 1, STARTS, n)."""
        return orbit(return_map, random_states(self.box, STARTS), RETURNS).states
