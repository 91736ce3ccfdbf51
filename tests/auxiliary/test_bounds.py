"""Closed forms, the Statement's conditions, p and q found twice, and bounds that hold for the map that they name."""

from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
import pytest
from messages import message

from nsmaps.auxiliary.attracting_domain import attracting_domain, smallest_box
from nsmaps.auxiliary.bounds import ErrorBound, auxiliary_maps, envelopes, held_out_error
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.polymap import PolyMap

WIDE = [[-2, 2], [-2, 2], [-2, 2]]


def polynomials(names, images, absolute=()):
    terms = {name: {k: Fraction(c) for k, c in image.items()} for name, image in zip(names, images, strict=True)}
    return PolyMap.of_monomials(names, terms, WIDE[: len(names)], absolute)


#: x' = 0.4 - 0.5 x - 0.2 y: falls with y. y' = 0.3 y + 0.2 x^2: its curves over y cross at x and -x.
PAIR = polynomials(("x", "y"), [{(0, 0): 0.4, (1, 0): -0.5, (0, 1): -0.2}, {(0, 1): 0.3, (2, 0): 0.2}])


ROOM = [[-1, 1.2], [-1, 1]]


def test_curves_that_do_not_cross_are_a_closed_form():
    x, y = envelopes(PAIR, ROOM)
    assert (x.kind, x.status, y.kind) == ("closed form", "outer", "numeric")
    assert x.held[1].tolist() == [1, -1]  # the lower curve is that of the largest y
    assert x.lower == pytest.approx(0.4 - 0.5 * x.x - 0.2, abs=1e-12)
    assert x.upper == pytest.approx(0.4 - 0.5 * x.x + 0.2, abs=1e-12)
    assert y.held is None
    assert y.lower == pytest.approx(0.3 * y.x, abs=1e-12)
    assert y.upper == pytest.approx(0.3 * y.x + 0.2 * 1.2**2, abs=1e-12)
    grid = np.stack(np.meshgrid(x.x, np.linspace(-1, 1, 400), indexing="ij"), axis=-1)
    images = PAIR(grid.reshape(-1, 2))[:, 0].reshape(len(x.x), -1)
    assert (x.lower <= images.min(axis=1)).all()  # outer of every curve, not only of the sampled ones
    assert (x.upper >= images.max(axis=1)).all()


def test_an_absolute_value_that_changes_sign_is_no_closed_form():
    return_map = polynomials(("x", "y"), [{(1, 0): 1, (0, 1): 1}, {(0, 1): 0.5}], absolute=("x",))
    assert envelopes(return_map, [[0.5, 1], [0, 1]])[0].kind == "closed form"
    turned = envelopes(return_map, [[-2, -1.5], [0, 1]])[0]
    assert turned.held[1].tolist() == [1, 0]
    assert envelopes(return_map, [[-1, 1], [-1, 1]])[0].kind == "numeric"


def test_falling_curves_are_part_1_and_p_and_q_agree_to_rounding():
    """On y in [-1, 1]: xi_U = 0.6 - 0.5 x and xi_L = 0.2 - 0.5 x; p = -1/15, q = 19/30. Later updates go on from there."""
    domain = attracting_domain(PAIR, ROOM, max_updates=1)
    p, q = (0.2 - 0.5 * 0.6) / (1 - 0.25), (0.6 - 0.5 * 0.2) / (1 - 0.25)
    x, y = domain.cycles
    assert (domain.status, domain.forward_invariant, domain.part) == ("outer", True, (1, 1))
    assert x.iterated == pytest.approx([p, q], abs=1e-11)
    assert x.roots == pytest.approx([p, q], abs=1e-11)
    assert (x.places, x.agree, x.stable) == (("q", "p"), True, True)
    assert x.slope == pytest.approx(0.25, abs=1e-6)
    assert y.places == ("p", "q")  # rising curves: eta_L(p) = p and eta_U(q) = q, which the generic iteration misses
    assert not domain.generic_agrees
    assert y.roots == pytest.approx([0, 0.2 * 1.2**2 / 0.7], abs=1e-11)
    assert y.agree
    settled = attracting_domain(PAIR, ROOM)
    assert all(cycle.agree for cycle in settled.cycles)
    fixed = np.array([[0.2575, 0.0189]])
    for _ in range(200):
        fixed = PAIR(fixed)
    assert (settled.box[:, 0] <= fixed[0]).all()
    assert (fixed[0] <= settled.box[:, 1]).all()


def test_a_hump_inside_the_interval_is_part_2():
    """x' = 0.8 - 3 (x - 0.35)^2, in one coordinate: q is the hump's top, p its image; the top is inside [p, q]."""
    hump = {(0,): 0.8 - 3 * 0.35**2, (1,): 2.1, (2,): -3}
    domain = attracting_domain(polynomials(("x",), [hump]), [[-0.2, 0.9]], max_updates=3)
    (cycle,) = domain.cycles
    assert domain.part == (2,)
    assert not domain.updates[0].conditions[-1, 0]
    assert domain.box[0] == pytest.approx([0.8 - 3 * 0.45**2, 0.8], abs=1e-9)
    assert cycle.places == ("q", "inside")
    assert cycle.slope == 0
    assert cycle.agree


def test_three_coordinates():
    terms = [
        {(1, 0, 0): -0.5, (0, 1, 0): 0.2, (0, 0, 1): 0.1},
        {(0, 1, 0): 0.3, (1, 0, 1): 0.2},
        {(0, 0, 2): 0.3, (1, 0, 0): 0.1, (0, 0, 0): 0.1},
    ]
    return_map = polynomials(("x", "y", "z"), terms)
    domain = attracting_domain(return_map, [[-1, 1], [-1, 1], [-1, 1]], max_updates=6)
    assert domain.forward_invariant
    assert [e.kind for e in domain.updates[0].envelopes] == ["closed form", "numeric", "closed form"]
    assert all(cycle.agree for cycle in domain.cycles)
    states = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    for _ in range(300):
        states = return_map(states)
    assert (states >= domain.box[:, 0] - 1e-12).all()
    assert (states <= domain.box[:, 1] + 1e-12).all()


def test_the_bound_of_a_henon_map_holds_its_attractor():
    """The Henon map in (x, y): 10^5 states of its attractor lie in every box of its updates."""
    henon = polynomials(("x", "y"), [{(0, 0): 1, (2, 0): -1.2, (0, 1): 1}, {(1, 0): 0.2}])
    domain = attracting_domain(henon, [[-1.2, 1.26], [-0.25, 0.255]], max_updates=11)
    assert domain.forward_invariant, domain.reason
    states = np.zeros((100, 2))
    for step in range(1100):
        states = henon(states)
        if step >= 100:
            assert (states >= domain.box[:, 0]).all()
            assert (states <= domain.box[:, 1]).all()


def test_inflated_bounds_are_those_of_the_map_that_the_polynomial_stands_for():
    truth = polynomials(("x", "y"), [{(0, 0): 0.41, (1, 0): -0.5, (0, 1): -0.2}, {(0, 1): 0.3, (2, 0): 0.2, (1, 1): 0.01}])
    error = held_out_error(PAIR, truth, ROOM)
    assert error.how == "held-out"
    assert error.values == pytest.approx([0.01, 0.012], abs=1e-12)  # the largest is at corners
    domain = attracting_domain(PAIR, ROOM, error=error)
    assert (domain.of, domain.status) == ("exact map", "inflated by held-out error")
    assert domain.claim == "estimated for the exact map: inflated by held-out error"
    certified = attracting_domain(PAIR, ROOM, error=ErrorBound(error.values, "certified"))
    assert certified.claim == "enclosed for the exact map: inflated by certified error"
    assert attracting_domain(PAIR, ROOM, max_updates=1, bounds_kind="sampled").claim == "sampled for the fitted map"
    own = attracting_domain(truth, ROOM)
    assert (domain.box[:, 0] <= own.box[:, 0]).all()
    assert (own.box[:, 1] <= domain.box[:, 1]).all()
    assert not (attracting_domain(PAIR, ROOM).box[0, 1] >= own.box[0, 1])  # without the error it is none
    assert attracting_domain(PAIR, ROOM, error=ErrorBound(np.full(2, 9.0), "certified")).forward_invariant is False


@dataclass
class Enclosing:
    """x' = -0.5 x + 0.1 cos y, y' = 0.3 y + 0.2 sin x, enclosed by their Lipschitz constants about the middle."""

    coordinates: tuple = ("x", Angle("y"))
    holes: list = field(default_factory=list)

    def __call__(self, states):
        x, y = states.T
        return np.column_stack([-0.5 * x + 0.1 * np.cos(y), 0.3 * y + 0.2 * np.sin(x)])

    def image_boxes(self, boxes):
        half = np.ptp(boxes, axis=2) / 2
        reach = half @ np.array([[0.5, 0.1], [0.2, 0.3]]).T + 1e-15
        middle = self(boxes.mean(axis=2)) + np.array([0, 4 * np.pi])
        inside = np.zeros(len(boxes), bool)
        for hole in self.holes:
            inside |= ((boxes[:, :, 0] <= hole) & (boxes[:, :, 1] >= hole)).all(axis=1)
        rows = np.arange(len(boxes))
        images = np.stack([middle - reach, middle + reach], axis=2)
        return BoxImages(rows, images, np.full(len(boxes), ""), ~inside, inside)


def test_an_enclosed_worst_case_is_outer_and_next_to_the_sampled_one():
    box = [[-1, 1], [-1, 1]]
    outer = attracting_domain(Enclosing(), box, max_updates=1)
    inner = attracting_domain(Enclosing(), box, max_updates=1, bounds_kind="sampled")
    assert (outer.status, inner.status, outer.forward_invariant) == ("enclosed", "sampled", True)
    for ours, theirs in zip(outer.boxes, inner.boxes, strict=True):
        assert (ours[:, 0] <= theirs[:, 0]).all()
        assert (theirs[:, 1] <= ours[:, 1]).all()
        assert ours == pytest.approx(theirs, abs=1e-4)


def test_states_without_a_bounded_image_trap_nothing():
    domain = attracting_domain(Enclosing(holes=[np.array([0.3, 0.1])]), [[-1, 1], [-1, 1]], max_updates=1)
    assert not domain.forward_invariant
    unknown = "the enclosure does not decide for all states of the box where, or whether, they have an image"
    assert f"{unknown}; all 1004 states tried in it have one" in domain.reason
    none, why = smallest_box(Enclosing(holes=[np.array([0.3, 0.1])]), [[0.2, 0.4], [0, 0.2]])
    assert none is None
    assert unknown in why


def test_a_start_box_is_found_around_a_small_one():
    box, why = smallest_box(Enclosing(), [[0.05, 0.1], [-0.02, 0.02]])
    assert box is not None, why
    assert attracting_domain(Enclosing(), box, max_updates=1).forward_invariant


@pytest.mark.parametrize(
    ("return_map", "how", "error", "text"),
    [
        (PAIR, "enclosed", None, message("auxiliary.bounds-of-map", kind="enclosed", map="PolyMap")),
        (Enclosing(), "outer", None, message("auxiliary.bounds-of-map", kind="outer", map="Enclosing")),
        (PAIR, "inflated", None, message("auxiliary.bounds-without-error", kind="inflated", which="no")),
        (
            PAIR,
            "outer",
            ErrorBound(np.zeros(2), "certified"),
            message("auxiliary.bounds-without-error", kind="outer", which="an"),
        ),
    ],
)
def test_bounds_that_a_map_has_not(return_map, how, error, text):
    with pytest.raises(NsmapsError, match=text):
        auxiliary_maps(return_map, how, error)


def test_a_map_of_pieces_is_enclosed():
    pieces = CompositeMap(("x", "y"), ("B",), (Piece("all", Box.of(("x", "y"), [[-2, 2], [-2, 2]]), PAIR, "BB"),))
    domain, outer = attracting_domain(pieces, ROOM, max_updates=2), attracting_domain(PAIR, ROOM, max_updates=2)
    inner = attracting_domain(pieces, ROOM, max_updates=2, bounds_kind="sampled")
    assert (domain.status, inner.status, domain.forward_invariant) == ("enclosed", "sampled", outer.forward_invariant)
    assert domain.box == pytest.approx(outer.box, abs=1e-4)
    assert (domain.box[:, 0] <= inner.box[:, 0]).all()
    assert (domain.box[:, 1] >= inner.box[:, 1]).all()
