"""Sets around saddles, as floats have them: centres, bases, and the relations that cycles follow."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit

TURNS = 20  #: around a cycle, after which directions have converged


class View(ABC):
    """A map as the search sees it: its n coordinates, in some order, and what the verification says of its sets."""

    angles: Bools  #: shape (n,)

    @abstractmethod
    def states(self, orbit: "PeriodicOrbit") -> Floats:
        """The states of a cycle, shape (q, n)."""

    @abstractmethod
    def derivatives(self, orbit: "PeriodicOrbit") -> Floats:
        """The derivatives of its returns, shape (q, n, n)."""

    @abstractmethod
    def words(self, orbit: "PeriodicOrbit", returns: int) -> list[str]:
        """The words of some returns from each state of a cycle."""

    @abstractmethod
    def iterated(self, states: Floats, returns: int) -> tuple[Floats, Any]:
        """Images of states (N, n) after some returns, NaN where there are none, and the words (N,) of these."""

    @abstractmethod
    def stated(self, centres: Floats, matrices: Floats, words: Any) -> list[Any]:
        """Sets as the verification reads them."""

    @abstractmethod
    def meeting(self, stated: Sequence[Any]) -> Sequence[tuple[int, int]]:
        """The pairs of sets that are not shown to be disjoint."""

    @abstractmethod
    def covers(self, source: Any, targets: Sequence[Any]) -> None:
        """`UnprovedError` unless a set is shown to cover others."""

    @abstractmethod
    def written(self, kept: Sequence[Any], relations: list[list[int]], returns: int) -> dict[str, Any]:
        """The horseshoe of some sets as a certificate states it."""


class Sets(NamedTuple):
    """Sets in coordinates divided by their scales."""

    centres: Floats  #: (m, n)
    bases: Floats  #: (m, n, n), unit vectors as columns, the unstable direction first
    covers: Bools  #: (m, m), whether a set is to cover another one
    scale: Floats  #: (n,)
    returns: int  #: after which they cover others

    def only(self, which: Bools | Ints) -> "Sets":
        """Some of them."""
        return Sets(self.centres[which], self.bases[which], self.covers[which][:, which], self.scale, self.returns)


def around(view: View, saddles: Sequence["PeriodicOrbit"], near: float, returns: int) -> Sets:
    """Sets around states of saddles, with the relations that the cycles follow."""
    states = np.concatenate([view.states(orbit) for orbit in saddles])
    words = [word for orbit in saddles for word in view.words(orbit, returns)]
    reach = np.where(np.abs(states).max(axis=0) > 0, np.abs(states).max(axis=0), 1.0)
    scale = np.where(view.angles, 1.0, reach)
    states, following = states / scale, np.empty(len(states), int)
    bases, count = [], 0
    for orbit in saddles:
        size = len(orbit.states)
        following[count : count + size] = count + (np.arange(size) + returns) % size
        bases.append(directions(view.derivatives(orbit) * scale / scale[:, None]))
        count += size
    group = _groups(view, states, np.array(words), following, near)
    return _hulls(view, states, np.concatenate(bases), group, following, scale, returns)


def directions(derivatives: Floats) -> Floats:
    """Bases (q, n, n) along a cycle with derivatives (q, n, n): the unstable direction, and columns that span the stable ones.

    The stable directions are orthogonal to the left eigenvector of the largest multiplier, which exists where the derivative is
    singular too.
    """
    size, n = derivatives.shape[:2]
    bases, left = np.empty((size, n, n)), np.empty((size, n))
    forth, back = np.linspace(1.0, 0.3, n), np.linspace(1.0, -0.3, n)
    for k in range(TURNS * size):
        forth, back = derivatives[k % size] @ forth, back @ derivatives[-1 - k % size]
        forth, back = forth / np.linalg.norm(forth), back / np.linalg.norm(back)
        bases[(k + 1) % size, :, 0], left[-1 - k % size] = forth, back
    for k in range(size):
        bases[k, :, 1:] = np.linalg.svd(left[k][None])[2][1:].T
    return bases


def _groups(view: View, states: Floats, words: Any, following: Ints, near: float) -> Ints:
    """Numbers of groups of states (N, n): each is near another of the same word, and so are the next ones."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    angles = states[:, view.angles]
    placed = np.concatenate([np.cos(angles), np.sin(angles), states[:, ~view.angles]], 1)
    pairs = cKDTree(np.concatenate([placed, placed[following]], 1)).query_pairs(near, p=np.inf, output_type="ndarray")
    one, other = pairs[words[pairs[:, 0]] == words[pairs[:, 1]]].T
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(states),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1])


def _hulls(view: View, states: Floats, bases: Floats, group: Ints, following: Ints, scale: Floats, returns: int) -> Sets:
    """Sets in the middle of groups of states, along the means of their directions."""
    count, n = int(group.max()) + 1, states.shape[1]
    centres, means, covered = np.empty((count, n)), np.empty((count, n, n)), np.zeros((count, count), bool)
    covered[group, group[following]] = True
    for i in range(count):
        members = np.flatnonzero(group == i)
        first = members[0]
        signs = np.sign((bases[members] * bases[first]).sum(axis=1))
        mean = (bases[members] * signs[:, None]).sum(axis=0)
        means[i] = mean / np.linalg.norm(mean, axis=0)
        way = states[members] - states[first]
        way[:, view.angles] -= TWO_PI * np.round(way[:, view.angles] / TWO_PI)
        places = way @ np.linalg.inv(means[i]).T
        centres[i] = states[first] + means[i] @ (places.max(axis=0) + places.min(axis=0)) / 2
    return Sets(centres, means, covered, scale, returns)
