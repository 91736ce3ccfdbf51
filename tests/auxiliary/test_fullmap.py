"""The full auxiliary map eq. auxM: products of the worst case in its boxes, the map elsewhere."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from boxmaps import Henon, one_each

from nsmaps.auxiliary.bounds import envelopes
from nsmaps.auxiliary.full_map import SLICES, AuxiliaryRegion, FullAuxiliaryMap, auxiliary_orbit
from nsmaps.cells.grid import images_of
from nsmaps.cells.morse import forward_invariant_box, forward_invariant_set, morse_sets
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap


class Linear:
    """v' = -0.5 v + 0.2 phi, phi' = 0.3 phi + 0.1 v + 3, phi an angle."""

    coordinates = ("v", Angle("phi"))

    def image_boxes(self, boxes):
        (v0, v1), (p0, p1) = boxes[:, 0].T, boxes[:, 1].T
        sides = [[-0.5 * v1 + 0.2 * p0, -0.5 * v0 + 0.2 * p1], [0.3 * p0 + 0.1 * v0 + 3, 0.3 * p1 + 0.1 * v1 + 3]]
        return one_each(np.array(sides).transpose(2, 0, 1))


REGION = np.array([[[0.0, 1.0], [4.0, 5.0]]])


def test_products_of_the_worst_case_within_the_region():
    """xi_L = -0.5 v + 0.8, xi_U = -0.5 v + 1 over v in [0.2, 0.4]; eta_L = 0.3 phi + 3, eta_U = 0.3 phi + 3.1 over phi."""
    made = FullAuxiliaryMap(Linear(), REGION).image_boxes(np.array([[[0.2, 0.4], [4.5, 4.6]]]))
    assert made.source.tolist() == [0]
    assert made.images[0] == pytest.approx(np.array([[0.6, 0.9], [4.35, 4.48]]))


def test_the_map_itself_elsewhere_and_both_on_the_border():
    boxes = np.array([[[2.0, 2.1], [4.5, 4.6]], [[0.9, 1.1], [4.5, 4.6]], [[0.2, 0.4], [4.5 - 2 * np.pi, 4.6 - 2 * np.pi]]])
    made = FullAuxiliaryMap(Linear(), REGION).image_boxes(boxes)
    assert made.source.tolist() == [0, 1, 1, 2]
    assert made.images[0] == pytest.approx(Linear().image_boxes(boxes[:1]).images[0])
    assert made.images[2] == pytest.approx(Linear().image_boxes(boxes[1:2]).images[0])
    assert made.images[1] == pytest.approx(np.array([[0.3, 0.55], [4.35, 4.48]]))
    assert made.images[3] == pytest.approx(np.array([[0.6, 0.9], [4.35, 4.48]]))


def test_what_the_map_does_is_among_what_it_may_do():
    """The images of 1000 states of every cell by Henon's map lie in the cell's images by its full auxiliary map."""
    return_map, rng = Henon(0.6), np.random.default_rng(3)
    full = FullAuxiliaryMap(return_map, np.array([[[-0.5, 0.5], [-0.3, 0.3]], [[0.4, 1.2], [-0.3, 0.1]]]))
    boxes = np.sort(rng.uniform([[-1.5], [-0.5]], [[1.5], [0.5]], (40, 2, 2)), axis=2)
    made = full.image_boxes(boxes)
    for n, box in enumerate(boxes):
        images = return_map.first_return(rng.uniform(*box.T, (1000, 2))).image
        own = made.images[made.source == n]
        held = ((own[:, None, :, 0] <= images) & (images <= own[:, None, :, 1])).all(axis=2)
        assert held.any(axis=0).all()


@pytest.mark.parametrize("region", [[0.1, 6.2], [5.9, 6.5], [0.0, 2 * np.pi], [-1.0, 1.0]])
@pytest.mark.parametrize("turns", [0, 3])
@pytest.mark.parametrize("box", [[6.0, 6.6], [6.2, 12.4], [0.0, 0.05], [-0.3, 9.0]])
def test_a_box_meets_a_region_on_every_turn(region, turns, box):
    """Both coordinates' own images of 500 states of the box that lie in the region, with the others anywhere in it."""
    rng = np.random.default_rng(5)
    moved = [0.2, 0.4], (np.array(box) + turns * 2 * np.pi).tolist()
    made = FullAuxiliaryMap(Linear(), [[[0.0, 1.0], region]]).image_boxes([moved])
    v, phi = rng.uniform(0.2, 0.4, 500), rng.uniform(*moved[1], 500)
    inside = region[0] + np.mod(phi - region[0], 2 * np.pi)
    held = inside <= region[1]
    others = rng.uniform([[0.0], [region[0]]], [[1.0], [region[1]]], (2, 500))
    there = np.column_stack([-0.5 * v + 0.2 * others[1], 0.3 * inside + 0.1 * others[0] + 3])[held]
    sides = made.images[:, None]
    reached = ((sides[..., 0] <= there) & (there <= sides[..., 1])).all(axis=2)
    assert reached.any(axis=0).all(), "some states of the box may go where no image is"


@mp.workdps(50)
def test_a_shift_by_whole_turns_is_rounded_outwards():
    """The end of a box on a far turn, at 50 digits: no state of it may be cut off by rounding."""
    for turns in range(1, 2000, 37):
        low, high = 4.5 + turns * 2 * np.pi, 4.6 + turns * 2 * np.pi
        made = FullAuxiliaryMap(Linear(), REGION).image_boxes(np.array([[[0.2, 0.4], [low, high]]]))
        ends = [mp.mpf(0.3) * (mp.mpf(end) - turns * 2 * mp.pi) + 3 for end in (low, high)]
        assert made.images[0, 1, 0] + 1e-13 <= ends[0], "beyond the reserve of the map itself"
        assert made.images[0, 1, 1] - 1e-13 >= ends[1] + mp.mpf(0.1)


def test_covers_take_it_as_any_other():
    return_map = Henon(0.2)
    plain = morse_sets(return_map, [[-2, 2], [-1, 1]], depth=4)
    full = morse_sets(FullAuxiliaryMap(return_map, np.array([[[0.9, 1.3], [0.2, 0.5]]])), [[-2, 2], [-1, 1]], depth=4)
    assert np.isin(plain.numbers, full.numbers).all()
    assert len(full.numbers) > len(plain.numbers)


def test_a_closed_box_and_one_that_is_not():
    """Henon's map at a = 0.2 takes [0.5, 1.5] x [0, 0.5] into itself; at a = 1.4 not."""
    held = forward_invariant_box(Henon(0.2), [[0.5, 1.5], [0, 0.5]], n_cells=16)
    assert held.forward_invariant
    assert held.contains([[0.5, 0.0], [1.5, 0.5]]).all()
    assert not forward_invariant_box(Henon(1.4), [[0.5, 1.5], [0, 0.5]], n_cells=16).forward_invariant
    cover = morse_sets(Henon(0.2), [[0.5, 1.5], [0, 0.5]], depth=4)
    inner = forward_invariant_set(Henon(0.2), cover, cover.minimal[0])
    assert (inner.hull[:, 0] >= held.hull[:, 0]).all()


class Coarse(Henon):
    """Henon's map, of which nothing is known on boxes wider than 0.1 and little on those wider than 0.05."""

    def image_boxes(self, boxes):
        plain = Henon.image_boxes(self, boxes)
        side = np.ptp(boxes[:, 0], axis=1)
        images = plain.images.copy()
        images[side > 0.05] += np.array([-4.0, 4.0])
        return one_each(images, side <= 0.1)


def test_unknown_and_wide_images_are_those_of_parts():
    boxes = np.array([[[0.0, 0.03], [0.0, 0.03]], [[0.0, 0.16], [0.0, 0.1]], [[0.2, 0.28], [0.1, 0.15]]])
    made = images_of(Coarse(), boxes, np.array([4.0, 2.0]))
    assert made.bounded.all()
    assert np.bincount(made.source).tolist() == [1, 16, 4]
    for n, box in enumerate(boxes):
        exact = Henon().image_boxes(box[None]).hulls()[0]
        assert made.hulls()[n] == pytest.approx(exact, abs=0.02)
    few = images_of(Coarse(), boxes, np.array([4.0, 2.0]), 0)
    assert isinstance(few, BoxImages)
    assert few.bounded.tolist() == [True, False, True]


NAMES = Coordinates(("x", "y"))


def linear(x, y, room=((-4, 4), (-4, 4))):
    """The map with these coefficients of 1, x and y."""
    terms = [{(0, 0): one, (1, 0): by_x, (0, 1): by_y} for one, by_x, by_y in (x, y)]
    exact = [{power: Fraction(value) for power, value in each.items()} for each in terms]
    return PolyMap.of_monomials(NAMES, dict(zip(NAMES, exact, strict=True)), [list(side) for side in room])


WEDGE = Piece(
    "wedge",
    ConditionRegion(coordinates=NAMES, text="x >= 0 and y >= 0 and x + y <= 1"),
    linear(("0", "0.5", "0.3"), ("2", "0", "0.5")),
)
ROOM = Piece("room", Box.of(NAMES, [[-1, 1], [-1, 0]]), linear(("0", "-0.5", "0.1"), ("-0.5", "0", "0.2")))
REST = Piece("rest", ConditionRegion(coordinates=NAMES, text="0 == 0"), linear(("0.3", "0", "0"), ("-0.5", "0", "0")))
MAP = CompositeMap(NAMES, ("S",), (ROOM, WEDGE, REST))
FULL = FullAuxiliaryMap(MAP, [[[-1.0, 1.0], [-1.0, 0.0]]], ((WEDGE, [[0, 1], [0, 1]]),))


def test_auxiliary_maps_of_a_region_that_is_no_box():
    """Over the wedge xi_L = x/2 at y = 0, xi_U = x/2 + 0.3 (1 - x), eta_L = eta_U = 2 + y/2, by slices of 1/32."""
    x, y = np.array([0.2, 0.21]), np.array([0.4, 0.41])
    made = FULL.image_boxes([[x, y]])
    products = made.images[made.inherent]
    assert products == pytest.approx(np.array([[[0.1, 0.105 + 0.3 * 0.8], [2.2, 2.205]]]), abs=0.3 * 0.02 + 0.5 / SLICES)
    low, high = products[0].T
    assert (low <= [0.1, 2.2]).all()
    assert (high >= [0.1 + 0.3 * 0.8, 2.205]).all()
    assert not FULL.image_boxes([[[0.7, 0.71], [0.5, 0.51]]]).inherent.any(), "outside of the wedge the map alone leads on"


def test_what_a_composite_map_does_is_among_what_its_full_auxiliary_map_may_do():
    rng = np.random.default_rng(7)
    boxes = np.sort(rng.uniform(-1.3, 1.3, (200, 2, 2)), axis=2)
    boxes[:, :, 1] = boxes[:, :, 0] + 0.3 * (boxes[:, :, 1] - boxes[:, :, 0])
    made = FULL.image_boxes(boxes)
    for n, box in enumerate(boxes):
        states = rng.uniform(*box.T, (300, 2))
        own = made.images[made.source == n]
        images = MAP.first_return(states).image
        assert ((own[:, None, :, 0] <= images) & (images <= own[:, None, :, 1])).all(axis=2).any(axis=0).all()
        wedge = WEDGE.region.contains(states) & ~ROOM.region.contains(states)
        y = rng.uniform(0, 1, 300) * (1 - states[:, 0])  # anywhere in the wedge, beside x
        free = np.column_stack([0.5 * states[:, 0] + 0.3 * y, 2 + 0.5 * states[:, 1]])
        assert ((own[:, None, :, 0] <= free) & (free <= own[:, None, :, 1])).all(axis=2).any(axis=0)[wedge].all()


def test_images_that_are_wide_by_themselves_are_not_halved(monkeypatch):
    """A wide image of a thin box of the wedge: no part of the box has a narrower one, and the map is asked once."""
    calls = []
    image_boxes = FullAuxiliaryMap.image_boxes
    monkeypatch.setattr(
        FullAuxiliaryMap, "image_boxes", lambda return_map, boxes: calls.append(len(boxes)) or image_boxes(return_map, boxes)
    )
    made = images_of(FULL, np.array([[[0.2, 0.2001], [0.1, 0.1001]]]), np.array([2.0, 2.0]))
    assert calls == [1]
    assert np.ptp(made.images, axis=2).max() > 0.2


def test_a_generic_orbit_comes_by_the_map_and_ends_between_p_and_q():
    """From the rest into the wedge's neighbour, the box, where xi = -x/2 + 0.1 y over y in [-1, 0]: q = -p/2, p = -q/2 - 0.1."""
    room = AuxiliaryRegion("A1", np.array([[-1.0, 1.0], [-1.0, 0.0]]), envelopes(ROOM.map, [[-1, 1], [-1, 0]]))
    wedge = AuxiliaryRegion.of_piece(WEDGE, [[0, 1], [0, 1]], NAMES)
    orbit = auxiliary_orbit(MAP, room, [(WEDGE, wedge)], [2.0, 2.0], 300)
    assert orbit.region[:2].tolist() == [-1, 0]
    assert np.sort(orbit.states[-2:, 0]) == pytest.approx([-0.4 / 3, 0.2 / 3], abs=1e-9)
    assert orbit.states[-1, 1] == pytest.approx(-0.5 / 0.8)
    through = auxiliary_orbit(MAP, room, [(WEDGE, wedge)], {"x": 0.5, "y": 0.2}, 3)
    assert through.region.tolist() == [1, -1, 0]
    assert through.states[1] == pytest.approx([0.25 + 0.3 * 0.5, 2.1], abs=2e-3), "by the upper map first"
