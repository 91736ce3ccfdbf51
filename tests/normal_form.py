"""The normal form of a border collision in the plane: a map in two linear pieces."""

from dataclasses import dataclass

import numpy as np

from nsmaps.coordinates import Coordinates
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import encode

CODES = np.array([encode(word, ("L", "R")) for word in ("LL", "RR")])


@dataclass(frozen=True)
class NormalForm(ReturnMap):
    """x' = tau x + y + mu, y' = -delta x, with (tau, delta) by the sign of x: the normal form of a border collision."""

    left: tuple[float, float]
    right: tuple[float, float]
    mu: float

    coordinates = Coordinates(("x", "y"))

    def matrices(self):
        return [np.array([[tau, 1.0], [-delta, 0.0]]) for tau, delta in (self.left, self.right)]

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        right = (start[:, 0] > 0).astype(int)
        slopes = np.array(self.matrices())[right]
        image = np.einsum("kij,kj->ki", slopes, start) + np.array([self.mu, 0.0])
        codes = CODES[right]
        blank = np.zeros(len(start))
        turns = np.zeros(start.shape, np.int32)
        return Returns(
            self.coordinates, ("L", "R"), start, image, turns, codes, blank.astype(np.int8), blank, slopes if derivative else None
        )
