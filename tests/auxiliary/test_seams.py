"""Sampled auxiliary maps at jumps, kinks and smooth extremes between samples, on maps whose extremes are known."""

from fractions import Fraction

import numpy as np
import pytest

from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.auxiliary.bounds import envelopes
from nsmaps.auxiliary.sampled import zoomed
from nsmaps.coordinates import Coordinates
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap

NAMES = Coordinates(("x", "y"))
SEAM = 0.3717  #: between two samples of 201 in [-1, 1]
Q = (0.25 + 0.3 * SEAM) / 0.75  #: with xi_U = 0.2 - x/2 + 0.3 SEAM and xi_L = -0.1 - x/2, q = xi_U(p) and p = xi_L(q)
P = -0.1 - Q / 2


class Plain:
    """A map of some coordinates by a formula."""

    def __init__(self, formula, coordinates=("x", "y")):
        self.formula, self.coordinates = formula, coordinates

    def __call__(self, states):
        return np.column_stack(self.formula(*states.T))


def jumping(unit):
    """x' = 0.2 - x/2 + (0.3 y below the seam, else -0.1 y), y' = y/2, in units of which one is `unit` long."""
    return Plain(lambda x, y: (0.2 * unit - x / 2 + np.where(y < SEAM * unit, 0.3 * y, -0.1 * y), y / 2))


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_a_jump_between_samples_is_not_exceeded_and_both_iterations_end_at_it(unit):
    domain = attracting_domain(jumping(unit), unit * np.array([[-1, 1], [-1, 1]]), max_updates=1)
    (x, _), sup = domain.updates[0].envelopes, 0.2 - domain.updates[0].envelopes[0].x / unit / 2 + 0.3 * SEAM
    assert (x.upper / unit <= sup).all()
    assert x.upper / unit == pytest.approx(sup, abs=2e-7)
    assert domain.box[0] / unit == pytest.approx([P, Q], abs=1e-6)
    assert np.sort(domain.updates[0].generic[-2:, 0]) / unit == pytest.approx([P, Q], abs=1e-6)
    assert domain.generic_agrees
    assert domain.cycles[0].agree
    assert domain.cycles[0].roots / unit == pytest.approx([P, Q], abs=1e-6)


def test_a_composite_map_is_sampled_within_its_enclosure_at_a_seam():
    """The same map as two pieces: the enclosed box holds the generic iterates, and roots and iterations agree."""
    falls, room = {(0, 0): Fraction(1, 5), (1, 0): Fraction(-1, 2)}, [[-2, 2], [-2, 2]]
    pieces = []
    for name, sign, slope in (("below", "<", Fraction(3, 10)), ("above", ">=", Fraction(-1, 10))):
        return_map = PolyMap.of_monomials(NAMES, {"x": {**falls, (0, 1): slope}, "y": {(0, 1): Fraction(1, 2)}}, room)
        pieces.append(Piece(name, ConditionRegion(coordinates=NAMES, text=f"y {sign} {SEAM}"), return_map))
    domain = attracting_domain(CompositeMap(NAMES, ("S",), tuple(pieces)), [[-1, 1], [-1, 1]], max_updates=1)
    assert domain.status == "enclosed"
    assert domain.box[0] == pytest.approx([P, Q], abs=1e-4)
    (x, _), generic = domain.cycles, domain.updates[0].generic[2:, 0]
    assert generic.max() <= domain.box[0, 1]
    assert generic.min() >= domain.box[0, 0]
    assert x.agree
    assert domain.generic_agrees


def test_a_jump_along_the_coordinate_itself():
    """x' = x below 0.2341, else x - 0.6: the upper map is largest just before the jump, and no more than 0.2341."""
    return_map = Plain(lambda x, y: (np.where(x < 0.2341, x, x - 0.6) + 0 * y, y / 2))
    domain = attracting_domain(return_map, [[-0.5, 0.5], [-1, 1]], max_updates=1)
    low, high = domain.updates[0].worst[1, 0]
    assert 0.2341 - 2e-7 < high <= 0.2341
    assert low == -0.5
    assert domain.updates[0].at[0, 0, 1] == pytest.approx(0.2341, abs=2e-7)


@pytest.mark.parametrize("samples", [21, 201])
def test_a_kink_and_a_smooth_extreme_between_samples(samples):
    """x' = -|y - 0.1234| and y' = cos(3 x - 0.4): the extremes are 0 at the kink and 1 at x = 0.1333."""
    x_map, y_map = envelopes(
        Plain(lambda x, y: (-np.abs(y - 0.1234), np.cos(3 * x - 0.4))), [[-1, 1], [-1, 1]], n_samples=samples
    )
    assert (x_map.upper <= 0).all()
    assert x_map.upper == pytest.approx(0, abs=1e-4 / samples)
    assert (y_map.upper <= 1).all()
    assert y_map.upper == pytest.approx(1, abs=1e-11)


def test_axes_that_depend_on_each_other():
    """z' = -(x + y - 0.123)^2 - (x - y + 0.05)^2 - (x - 0.31 y)^2 / 4 over x and y: largest where the gradient is zero."""

    def z_map(x, y):
        return -((x + y - 0.123) ** 2) - (x - y + 0.05) ** 2 - (x - 0.31 * y) ** 2 / 4

    hessian = np.array([[4.5, -0.155], [-0.155, 4 + 0.31**2 / 2]])
    at = np.linalg.solve(hessian, [2 * 0.123 - 2 * 0.05, 2 * 0.123 + 2 * 0.05])
    return_map = Plain(lambda x, y, z: (x / 2, y / 2, z_map(x, y) + 0 * z), ("x", "y", "z"))
    *_, z = envelopes(return_map, [[-1, 1], [-1, 1], [-1, 1]], n_samples=21)
    assert (z.upper <= z_map(*at) + 1e-15).all()
    assert z.upper == pytest.approx(z_map(*at), abs=1e-6)


def test_states_without_an_image_between_samples_are_passed_over():
    """An image is missing in |y - 0.1234| < 1e-6 alone, where no sample is: the extreme beside it is found."""
    return_map = Plain(lambda x, y: (np.where(np.abs(y - 0.1234) < 1e-6, np.nan, -np.abs(y - 0.1234)), y))
    x_map, _ = envelopes(return_map, [[-1, 1], [-1, 1]])
    assert x_map.upper == pytest.approx(0, abs=1e-5)
    assert x_map.lower == pytest.approx(-1.1234, abs=1e-12)


@pytest.mark.parametrize("place", [0.0, 1.0, 1e-4, 0.003, 0.4])
def test_an_extreme_beside_an_end_is_found_and_one_at_an_end_takes_one_call(place):
    """A kink at a place of [0, 1] of which one end is the best of two samples."""
    calls = []

    def kink(x):
        calls.append(x.size)
        return -np.abs(x - place)

    end = np.array([round(place)], float)
    at, top = zoomed(kink, end, -np.abs(end - place), np.array([[0.0, 1.0]]))
    assert at == pytest.approx(place, abs=8.0**-5)
    assert top == -np.abs(at - place)
    assert (len(calls) == 1) == (place in (0.0, 1.0))
