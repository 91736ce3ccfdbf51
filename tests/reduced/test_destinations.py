"""On which attractor orbits end: of a map of the line with two fixed points, and of the pair where 1:1 and 2:1 motion coexist."""

from dataclasses import dataclass
from math import pi

import numpy as np
import pytest

import nsmaps
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.partition.candidates import ends_of_orbits
from nsmaps.reduced.partition.partition import partition
from nsmaps.reduced.partition.spec import Partition
from nsmaps.reduced.validation.destinations import MISLED, Destinations

BOX = np.array([(-2.0, 2.0)])


@dataclass(frozen=True)
class Halves(ReturnMap):
    """x' = (x + 1)/2 where x is above 0, and (x - 1)/2 elsewhere: the fixed points 1 and -1 attract one half of the line each."""

    coordinates = ("x",)

    def first_return(self, states, derivative=False) -> Returns:
        x = np.asarray(states, float)
        slopes = np.full((len(x), 1, 1), 0.5) if derivative else None
        return Returns.of_map(("x",), x, (x + np.where(x > 0, 1, -1)) / 2, slopes)


def piece(name, text, slope, offset):
    """x' = slope x + offset."""
    region = ConditionRegion(text=text, coordinates=("x",))
    terms = (np.array([[0], [1]]),)
    return Piece(name, region, PolyMap(("x",), terms, (np.array([offset, slope]),), np.zeros(1), np.ones(1), BOX))


def test_a_piece_that_leads_to_another_attractor_is_named():
    """States of [0.7, 0.75] are sent to the other half, and with them those of [0.4, 0.5], which come there; no others do."""
    own = piece("R1", "x > 0", 0.5, 0.5), piece("R2", "x <= 0", 0.5, -0.5)
    there = Destinations.of(Halves(), BOX)
    assert sorted(each.states[0, 0] for each in there.attractors) == pytest.approx([-1, 1])
    right = CompositeMap(("x",), (), own)
    assert there.agreement(right) == 1
    assert there.misleading(right) == set()
    wrong = CompositeMap(("x",), (), (piece("R3", "0.7 <= x <= 0.75", 0.5, -1.0), *own))
    share = 0.05 / 4 + (0.5 - 0.4) / 4  # of [0.7, 0.75], and of [0.4, 0.5], which goes there
    assert there.agreement(wrong) == pytest.approx(1 - share, abs=4 * np.sqrt(share / 500))
    assert there.misleading(wrong) == {"R3"}


def test_an_end_elsewhere_is_none_of_the_attractors():
    there = Destinations.of(Halves(), BOX)
    stays = CompositeMap(("x",), (), (piece("R1", "x > -5", 0.0, 0.25),))
    assert there.agreement(stays) == 0


@dataclass(frozen=True)
class Cycle(ReturnMap):
    """x' = x - 1 down to 0, from where x' = 3: a cycle of 3, 2, 1, 0."""

    coordinates = ("x",)

    def first_return(self, states, derivative=False) -> Returns:
        x = np.asarray(states, float)
        return Returns.of_map(("x",), x, np.where(np.rint(x) <= 0, 3.0, np.rint(x) - 1))


@pytest.mark.parametrize(("low", "states"), [(0.5, [0, 1, 2, 3]), (1.5, [2, 3])])
def test_single_states_outside_of_the_grid_belong_to_the_attractor(low, states):
    """From 1.5 on two states are outside, one after the other: a way that a reset replaces."""
    found = ends_of_orbits(Cycle(), Grid(axes={"x": Axis(low=low, high=3.5, points=20)}))
    assert found[:, 0].tolist() == states


@pytest.mark.thorough
@pytest.mark.parametrize("turn", [pi, 2 * pi])
def test_a_partition_ends_on_the_right_one_of_two_attractors(pair, turn):
    system = pair(0.2265, r=0.25, beta=pi / 6)
    axes = {"v": Axis(low=0.0033, high=1, points=300), "phi": Axis(low=0, high=turn, points=300)}
    found = partition(system, Grid(axes=axes), Partition(tolerance=1e-3))
    assert found.met
    assert found.same_end >= 1 - MISLED
    for start, period in (([0.67, 0.48], 0), ([0.67, 0.3], 2), ([0.35, pi / 2], 2), ([0.2, 0.1], 2)):
        path = nsmaps.orbit(found.composite, start, 3000).states[-1000:]
        near = nsmaps.dynamics.hausdorff(path, nsmaps.orbit(system, start, 3000).states[-1000:], system.coordinates)
        assert near < (0.005 if period else 0.02)
