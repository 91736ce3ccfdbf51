"""The full auxiliary map eq. auxM: products of the worst case in its boxes, the map elsewhere."""

import mpmath as mp
import numpy as np
import pytest
from boxmaps import Henon, one_each

from nsmaps.auxiliary.set_valued import FullAuxiliaryMap
from nsmaps.cells.grid import images_of
from nsmaps.cells.morse_sets import closed_box, morse_sets, trap
from nsmaps.coordinates import Angle
from nsmaps.exact.enclosure.images import BoxImages


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
    map, rng = Henon(0.6), np.random.default_rng(3)
    full = FullAuxiliaryMap(map, np.array([[[-0.5, 0.5], [-0.3, 0.3]], [[0.4, 1.2], [-0.3, 0.1]]]))
    boxes = np.sort(rng.uniform([[-1.5], [-0.5]], [[1.5], [0.5]], (40, 2, 2)), axis=2)
    made = full.image_boxes(boxes)
    for n, box in enumerate(boxes):
        images = map.first_return(rng.uniform(*box.T, (1000, 2))).image
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


def test_a_shift_by_whole_turns_is_rounded_outwards():
    """The end of a box on a far turn, at 50 digits: no state of it may be cut off by rounding."""
    mp.mp.dps = 50
    for turns in range(1, 2000, 37):
        low, high = 4.5 + turns * 2 * np.pi, 4.6 + turns * 2 * np.pi
        made = FullAuxiliaryMap(Linear(), REGION).image_boxes(np.array([[[0.2, 0.4], [low, high]]]))
        ends = [mp.mpf(0.3) * (mp.mpf(end) - turns * 2 * mp.pi) + 3 for end in (low, high)]
        assert made.images[0, 1, 0] + 1e-13 <= ends[0], "beyond the reserve of the map itself"
        assert made.images[0, 1, 1] - 1e-13 >= ends[1] + mp.mpf(0.1)


def test_covers_take_it_as_any_other():
    map = Henon(0.2)
    plain = morse_sets(map, [[-2, 2], [-1, 1]], 4)
    full = morse_sets(FullAuxiliaryMap(map, np.array([[[0.9, 1.3], [0.2, 0.5]]])), [[-2, 2], [-1, 1]], 4)
    assert np.isin(plain.numbers, full.numbers).all()
    assert len(full.numbers) > len(plain.numbers)


def test_a_closed_box_and_one_that_is_not():
    """Henon's map at a = 0.2 takes [0.5, 1.5] x [0, 0.5] into itself; at a = 1.4 not."""
    held = closed_box(Henon(0.2), [[0.5, 1.5], [0, 0.5]], 16)
    assert held.forward_invariant
    assert held.contains([[0.5, 0.0], [1.5, 0.5]]).all()
    assert not closed_box(Henon(1.4), [[0.5, 1.5], [0, 0.5]], 16).forward_invariant
    cover = morse_sets(Henon(0.2), [[0.5, 1.5], [0, 0.5]], 4)
    inner = trap(Henon(0.2), cover, cover.minimal[0])
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
