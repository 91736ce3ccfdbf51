"""Ranges by branch and bound: what is known is used again, and the enclosure is called for many boxes at a time."""

from dataclasses import dataclass, field
from math import pi

import numpy as np
import pytest

import nsmaps
from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.enclosures.bernstein import Polynomials
from nsmaps.enclosures.branch_and_bound import ranges
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.reduced.fit.polymap import PolyMap

START = [[0.7, 1], [0.2, 1.14]]  # of the exact map in vi_pair/fp


@dataclass
class Counted(ReturnMap):
    """A map that encloses images of boxes, with how often it is asked for them and for how many boxes, and for returns."""

    map: nsmaps.ImpactSystem
    asked: list[int] = field(default_factory=list)
    returns: list[int] = field(default_factory=list)

    @property
    def coordinates(self):
        return self.map.coordinates

    def first_return(self, states, derivative=False):
        self.returns.append(len(states))
        return self.map.first_return(states, derivative)

    def image_boxes(self, boxes):
        self.asked.append(len(boxes))
        return self.map.image_boxes(boxes)


def test_the_domain_of_fp_takes_hundreds_of_calls_of_the_enclosure_not_thousands():
    """Eleven updates with some 160 worst-case steps: a few rounds each, as pieces of the step before are used again."""
    return_map = Counted(nsmaps.load_system("vi_pair", d=0.35, M=0.1245, g=9.8, beta=pi / 3, F=5))
    domain = attracting_domain(return_map, START, max_updates=11)
    steps = sum(len(update.worst) - 1 for update in domain.updates)
    assert domain.converged
    assert domain.status == "enclosed"
    assert steps > 100
    assert len(return_map.asked) < 4 * steps
    assert len(return_map.asked) < 600
    assert sum(return_map.asked) < 40_000
    assert len(return_map.returns) < 1000  # one for all states in the boxes of a round; places are sampled once an update


def test_the_fitted_domain_takes_hundreds_of_calls_of_bernstein_hulls(monkeypatch):
    """A map whose generic iterates come to no cycle, 400 an update: those of all updates are made side by side."""
    calls = []
    plain = Polynomials.hulls
    monkeypatch.setattr(Polynomials, "hulls", lambda self, boxes: calls.append(len(boxes)) or plain(self, boxes))
    terms = {"x": {(0, 0): 1.0, (2, 0): -1.4, (0, 1): 0.1}, "y": {(1, 0): 0.3, (0, 2): 0.1}}
    return_map = PolyMap.of_monomials(("x", "y"), terms, [[-1, 2], [-1, 1]])
    domain = attracting_domain(return_map, [[-0.75, 1.1], [-0.4, 0.4]], max_updates=11)
    iterates = sum(len(update.generic) for update in domain.updates if update.forward_invariant)
    assert domain.forward_invariant
    assert iterates > 4000
    assert len(calls) < 1000


@pytest.mark.parametrize("low", [-0.9, -0.3, 0.1])
def test_what_is_known_of_a_box_bounds_parts_of_it(low):
    """x^3 - x^2 y + y with ranges over ever shorter intervals of x, against a fine grid and against ranges from nothing."""
    terms = {(3, 0): 1.0, (2, 1): -1.0, (0, 1): 1.0}
    hulls = Polynomials.of(PolyMap.of_monomials(("x", "y"), {"x": terms, "y": terms}, [[-1, 1], [0, 1]])).hulls
    known = None
    for high in np.linspace(1, low + 0.05, 7):
        boxes = np.array([[[low, high], [0.0, 0.8]]])
        again, alone = ranges(hulls, boxes, 0, 1e-9, known), ranges(hulls, boxes, 0, 1e-9)
        x, y = np.meshgrid(np.linspace(low, high, 801), np.linspace(0, 0.8, 801))
        values = x**3 - x**2 * y + y
        assert again.bounds[0, 0] <= values.min()
        assert values.max() <= again.bounds[0, 1]
        assert again.bounds == pytest.approx(alone.bounds, abs=3e-9 * np.ptp(values))
        assert (again.pieces.boxes[:, 0, 0].min(), again.pieces.boxes[:, 0, 1].max()) == (low, high)
        assert np.ptp(again.pieces.boxes, axis=2).prod(axis=1).sum() == pytest.approx((high - low) * 0.8)  # they tile the box
        known = again


def test_what_is_known_of_a_smaller_box_is_not_used():
    """x over [0, 1] is not bounded by what is known of [0.25, 0.5]."""
    hulls = Polynomials.of(PolyMap.of_monomials(("x",), {"x": {(1,): 1.0}}, [[0, 1]])).hulls
    known = ranges(hulls, np.array([[[0.25, 0.5]]]))
    assert ranges(hulls, np.array([[[0.0, 1.0]]]), known=known).bounds[0] == pytest.approx([0, 1])
