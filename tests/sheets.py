"""Returns and surfaces of analytic maps, for the tests of what is made from surfaces."""

import math
from types import SimpleNamespace

import numpy as np

from nsmaps.coordinates import Angle, wrap
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface

NAMES = ("v", Angle("phi"))
TWO_PI = 2 * math.pi


def returns_of(start, lifted, names=NAMES):
    start, lifted = np.array(start, float), np.array(lifted, float)
    image = np.where([isinstance(name, Angle) for name in names], wrap(lifted), lifted)
    turns = np.nan_to_num(np.round((lifted - image) / TWO_PI)).astype(np.int32)
    m = len(start)
    zeros = np.zeros(m)
    return Returns(names, ("B",), start, image, turns, np.full(m, 5), zeros.astype(np.int8), zeros)


def surface_of(f, v, phi, member=None):
    """The surface of an analytic map f(v, phi) -> (v', phi' not wrapped) over a grid."""
    grid = Grid(axes={"v": Axis(low=v[0], high=v[1], points=v[2]), "phi": Axis(low=phi[0], high=phi[1], points=phi[2])})
    start = grid.states()
    mask = np.ones(grid.size, bool) if member is None else member(*start.T)
    return Surface("F", grid, mask, returns_of(start[mask], np.column_stack(f(*start[mask].T))))


class Analytic(ReturnMap):
    """An analytic map f(v, phi) -> (v', phi' not wrapped) as a system, whose smooth pieces `piece(v, phi)` numbers."""

    coordinates = NAMES
    letters = ("B",)
    dimensionless = True

    def __init__(self, f, piece=lambda v, phi: 0 * v):
        self._map, self._piece = f, piece

    def first_return(self, states, derivative=False):
        return returns_of(states, np.column_stack(self._map(*np.asarray(states, float).T)))

    def itineraries(self, states):
        return SimpleNamespace(codes=1 + np.asarray(self._piece(*np.asarray(states, float).T), np.int64))
