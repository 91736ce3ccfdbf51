"""Envelopes, worst-case and generic iteration, and growing boxes, on maps whose answers are known."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from boxmaps import one_each, plain_returns
from messages import message

from nsmaps.auxiliary.attracting_domain import attracting_domain, smallest_box
from nsmaps.auxiliary.bounds import envelopes
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap


@dataclass
class Plain:
    """A map of (x, y) by a formula."""

    formula: object
    coordinates: tuple[str, ...] = ("x", "y")

    def __call__(self, states):
        return np.column_stack(self.formula(*states.T))


def test_envelopes_of_a_known_map_have_the_extremes_of_its_parabola():
    """x' = x - (y - 0.3)^2 over y in [0, 1]: the upper map touches at y = 0.3, the lower at y = 1."""
    return_map = Plain(lambda x, y: (x - (y - 0.3) ** 2, y))
    x_map, y_map = envelopes(return_map, [[0, 1], [0, 1]], n_samples=21)
    assert x_map.upper == pytest.approx(x_map.x, abs=1e-14)
    assert x_map.lower == pytest.approx(x_map.x - 0.49, abs=1e-14)
    assert y_map.lower == pytest.approx(y_map.x)
    assert y_map.upper == pytest.approx(y_map.x)


def test_envelopes_in_four_coordinates_are_those_of_the_formula():
    """x' = x - (y - 0.3)^2 + z w over the unit cube: from x - 0.49 at y = 1, z w = 0 to x + 1 at y = 0.3, z w = 1."""
    return_map = Plain(lambda x, y, z, w: (x - (y - 0.3) ** 2 + z * w, y / 2, z / 2, w / 2), ("x", "y", "z", "w"))
    first, *_ = envelopes(return_map, [[0, 1]] * 4)
    assert first.upper == pytest.approx(first.x + 1, abs=1e-12)
    assert first.lower == pytest.approx(first.x - 0.49, abs=1e-12)


def test_the_worst_case_settles_on_its_two_cycle():
    """x' = -0.5 x + 0.1 y with |y| <= 1: xi_U = -0.5 x + 0.1, xi_L = -0.5 x - 0.1; p = -0.2, q = 0.2 in the first update."""
    return_map = Plain(lambda x, y: (-0.5 * x + 0.1 * y, 0.2 * y))
    domain = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1)
    assert domain.forward_invariant
    assert domain.boxes[-1] == pytest.approx(np.array([[-0.2, 0.2], [0, 0]]), abs=1e-9)
    generic = domain.updates[0].generic
    assert sorted(generic[-2:, 0]) == pytest.approx([-0.2, 0.2], abs=1e-9)
    assert domain.generic_agrees
    shrunk = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=8)
    assert shrunk.converged
    assert shrunk.sizes[-1] == pytest.approx(0, abs=1e-9)


def test_a_generic_cobweb_may_underestimate_the_worst_case():
    """A hump that the generic iterates miss: x' = 0.8 - 3 (x - 0.35)^2, no y. The worst case keeps the hump's top."""
    return_map = Plain(lambda x, y: (0.8 - 3 * (x - 0.35) ** 2 + 0 * y, 0.5 * y))
    domain = attracting_domain(return_map, [[-0.2, 0.9], [-1, 1]], max_updates=2)
    assert domain.forward_invariant
    assert domain.boxes[-1][0, 1] == pytest.approx(0.8, abs=1e-9)


@dataclass
class Wavy(ReturnMap):
    """x' = 0.3 - 0.5 x + 0.1 sin(3 y), y' = 0.2 y, in units of which one is `unit` long, enclosed by a Lipschitz constant."""

    unit: float = 1.0
    coordinates: tuple[str, ...] = ("x", "y")

    def image_boxes(self, boxes):
        (x0, x1), (y0, y1) = boxes[:, 0].T / self.unit, boxes[:, 1].T / self.unit
        middle, reach = np.sin(1.5 * (y0 + y1)), 1.5 * (y1 - y0)
        low, high = np.maximum(middle - reach, -1), np.minimum(middle + reach, 1)
        sides = [[0.3 - 0.5 * x1 + 0.1 * low, 0.3 - 0.5 * x0 + 0.1 * high], [0.2 * y0, 0.2 * y1]]
        return one_each(self.unit * np.array(sides).transpose(2, 0, 1))

    def first_return(self, states, derivative=False):
        x, y = np.asarray(states, float).T / self.unit
        image = np.column_stack([0.3 - 0.5 * x + 0.1 * np.sin(3 * y), 0.2 * y])
        return plain_returns(self.coordinates, np.asarray(states, float), self.unit * image)


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_p_and_q_of_an_enclosure_agree_to_its_own_accuracy(unit):
    """xi_U = 0.4 - 0.5 x, xi_L = 0.2 - 0.5 x: p = 0, q = 0.4. The enclosure ends within 1e-5 of the box."""
    domain = attracting_domain(Wavy(unit), unit * np.array([[-1, 1], [-1, 1]]), max_updates=1)
    (x, _) = domain.cycles
    assert domain.status == "enclosed"
    apart = np.abs(x.iterated - x.roots).max()
    assert apart > 1e-10 * unit
    assert x.agree
    assert domain.generic_agrees
    assert np.abs(x.iterated - unit * np.array([0, 0.4])).max() < x.accuracy < 1e-3 * unit
    assert not replace(x, roots=x.roots + 2e-4 * unit).agree, "what is told apart does not agree"


def test_the_agreement_of_a_formula_is_that_of_rounding():
    return_map = Plain(lambda x, y: (-0.5 * x + 0.1 * y, 0.2 * y))
    (x, _) = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1).cycles
    assert x.agree
    assert not replace(x, roots=x.roots + 1e-8).agree
    assert replace(x, slope=np.nan).stable is None


def test_a_box_that_is_left_stops_the_updates_and_says_how():
    return_map = Plain(lambda x, y: (2 * x, 0.5 * y))
    domain = attracting_domain(return_map, [[-1, 1], [-1, 1]])
    assert not domain.forward_invariant
    assert not domain.converged
    assert len(domain.updates) == 1
    assert "x down to -2 (box -1), x up to 2 (box 1)" in domain.reason
    assert np.isnan(domain.two_cycle).all()


def test_a_contraction_that_is_not_at_rest_is_not_settled():
    return_map = Plain(lambda x, y: (-0.9 * x + 0.099 * y, -0.9 * y + 0.099 * x))
    domain = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1)
    assert domain.forward_invariant
    assert domain.converged == (np.max(1 - np.abs(domain.boxes[-1])) <= 0.02)
    quick = Plain(lambda x, y: (-0.5 * x + 0.3 * y, -0.5 * y + 0.3 * x))
    assert not attracting_domain(quick, [[-1, 1], [-1, 1]], max_updates=2).converged


@pytest.mark.parametrize("share", [0.99, 0.999999])
def test_what_still_moves_says_by_more_than_what_and_what_to_do(share):
    """Bounds that move by a little more than is allowed, told with digits enough to see it."""
    return_map = Plain(lambda x, y: (-0.5 * x + 0.1 * y, 0.2 * y))
    moved = np.abs(np.diff(attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1).boxes, axis=0)).max() / 2
    reason = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1, tolerance=share * moved).reason
    told = float(reason.partition("moved a bound by ")[2].partition(" %")[0])
    assert told == pytest.approx(100 * moved, rel=1e-2)
    assert told > 100 * share * moved
    assert reason.endswith(f"more than {100 * share * moved:g} %; raise `max_updates`")
    assert "raise" not in attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1, tolerance=moved).reason


def test_an_angle_is_taken_on_the_turn_of_the_box():
    """phi' = phi + 0.5 sin(phi) near phi = pi, given with whole turns to spare."""
    return_map = Plain(lambda x, y: (0.5 * x, y + 0.5 * np.sin(y) + 4 * np.pi), ("x", Angle("y")))
    domain = attracting_domain(return_map, [[-1, 1], [2.5, 3.8]], max_updates=3)
    assert domain.forward_invariant
    assert domain.boxes[-1][1] == pytest.approx([np.pi, np.pi], abs=1e-6)


def test_the_smallest_box_is_grown_to_a_trapped_one_or_given_up():
    return_map = Plain(lambda x, y: (-0.5 * x + 0.2, 0.5 * y + 0.1))
    box, why = smallest_box(return_map, [[0.5, 0.6], [0.2, 0.21]], max_growth=40)
    assert box is not None, why
    assert attracting_domain(return_map, box, max_updates=1).forward_invariant
    assert (
        attracting_domain(return_map, [[0.5, 0.6], [0.2, 0.21]], grow=True).forward_invariant is False
    )  # beyond four times the start
    none, why = smallest_box(Plain(lambda x, y: (1.5 * x, 0.5 * y)), [[-1, 1], [-1, 1]])
    assert none is None
    assert "no useful box: x in [-1, 1]" in why


def test_states_without_an_image_are_said():
    return_map = Plain(lambda x, y: (np.sqrt(x - 0.5), 0.5 * y))
    with np.errstate(invalid="ignore"):
        domain = attracting_domain(return_map, [[0, 1], [-1, 1]])
    assert not domain.forward_invariant
    assert "no image" in domain.reason


@pytest.mark.parametrize("box", [[[0, 1]], [[0, 1], [1, 0]], [[0, 1], [0, np.nan]]])
def test_a_bad_box_is_an_error(box):
    with pytest.raises(NsmapsError, match=message("coordinates.box")):
        attracting_domain(Plain(lambda x, y: (x, y)), box)
