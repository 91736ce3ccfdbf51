"""The orders of the cells of a certificate at states, for pictures and for comparison with orbits; nothing is proved here."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.verify.arrivals import LEFT, Tree, compiled
from nsmaps.verify.cells import Grid, tree_of
from nsmaps.verify.certificate import Certificate


@dataclass(frozen=True)
class Shares:
    """The cells of a wall in pixels of phase (rows) and speed (columns), each of which is sampled at several states."""

    order: Floats  #: the median of the orders in a pixel, NaN where no state of it is in a cell with an order
    left: Floats  #: the share of the states of a pixel that are left open
    top: float  #: the largest speed


@dataclass(frozen=True)
class Orders:
    """The cells of a certificate, found by states."""

    tree: Tree
    letters: tuple[str, ...]  #: of the walls

    @classmethod
    def of(cls, certificate: Certificate) -> "Orders":
        """The cells of a certificate; `CertificateError` where its codes describe none."""
        walls = certificate.system["walls"]
        tree = tree_of(Grid(**certificate.grid), len(walls), certificate.codes, certificate.slopes)
        return cls(tree, tuple(wall["letter"] for wall in walls))

    def cells(self, wall: ArrayLike, phase: ArrayLike, speed: ArrayLike) -> Ints:
        """The cells of impacts, arrays of one shape: number of the wall, phase (radians, any turn), speed; -1 above all cells."""
        walls, phases, speeds = np.broadcast_arrays(np.asarray(wall, np.int64), phase, np.asarray(speed, float))
        places = np.mod(phases, TWO_PI) / TWO_PI * self.tree.n
        return cells_at(self.tree, walls.ravel(), places.ravel(), speeds.ravel()).reshape(walls.shape)

    def orders(self, cells: Ints) -> Ints:
        """The orders of cells; `LEFT` for those that are left open, and above all cells."""
        return np.where(cells < 0, LEFT, self.tree.order[cells])

    def pixels(self, wall: int, shape: tuple[int, int], parts: int = 4) -> Shares:
        """The cells of a wall in pixels, shape (rows, columns), each sampled at the middles of `parts` x `parts` equal boxes."""
        (rows, columns), (high, wide) = shape, (parts * side for side in shape)
        speed, phase = np.meshgrid((np.arange(wide) + 0.5) * self.tree.top / wide, (np.arange(high) + 0.5) * TWO_PI / high)
        orders = self.orders(self.cells(wall, phase, speed)).reshape(rows, parts, columns, parts)
        found = np.sort(orders.swapaxes(1, 2).reshape(rows, columns, parts * parts), axis=2)  # those left open are the last
        some = (found < LEFT).sum(axis=2)
        middle = np.stack([np.maximum(some - 1, 0) // 2, np.minimum(some // 2, parts**2 - 1)], axis=2)
        order = np.where(some > 0, np.take_along_axis(found, middle, axis=2).mean(axis=2), np.nan)
        return Shares(order, 1 - some / parts**2, self.tree.top)


@compiled
def cells_at(tree: Tree, wall: Ints, place: Floats, speed: Floats) -> Ints:
    """The cells of states: walls, phases in parts of 2 pi/n and speeds, each of shape (M,)."""
    found, base, height = np.full(wall.size, -1), tree.n // tree.side, tree.top / tree.side
    for i in range(wall.size):
        if not 0 <= speed[i] < tree.top:
            continue
        column, row = min(int(place[i] / base), tree.side - 1), min(int(speed[i] / height), tree.side - 1)
        node = (wall[i] * tree.side + column) * tree.side + row
        while tree.child[node] >= 0:
            node = tree.child[node]
            level = speed[i] - tree.slope[node] * (place[i] - tree.first[node] - tree.width[node] / 2)
            if tree.slope[node] == 0 and place[i] >= tree.first[node + 2]:
                node += 2
            node += level >= tree.high[node]
        found[i] = node
    return found
