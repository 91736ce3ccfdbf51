"""The Hausdorff distance against all pairs."""

import numpy as np
import pytest

from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.distance import Nearest, extents, hausdorff
from nsmaps.errors import StateError

COORDINATES = ("v", Angle("phi"))


def test_distance_is_that_of_all_pairs():
    g = np.random.default_rng(0)
    a, b = g.uniform([0, -7], [1, 7], (300, 2)), g.uniform([0, 0], [0.7, 5], (200, 2))
    apart = a[:, None] - b
    apart[..., 1] = np.angle(np.exp(1j * apart[..., 1]))
    lengths = np.hypot(*np.moveaxis(apart, -1, 0))
    assert np.isclose(hausdorff(a, b, COORDINATES), max(lengths.min(axis=0).max(), lengths.min(axis=1).max()), rtol=1e-12)
    assert hausdorff(a, b, COORDINATES) == hausdorff(b, a, COORDINATES)


def test_circle_is_counted():
    assert np.isclose(hausdorff([[0.5, 0.1]], [[0.5, 2 * np.pi - 0.1]], COORDINATES), 0.2)
    assert np.isclose(hausdorff([[0.5, 0.1]], [[0.5, 2 * np.pi - 0.1]], ("v", "w")), 2 * np.pi - 0.2)


def test_a_subset_is_as_far_as_what_it_lacks():
    assert hausdorff([[0, 0], [3, 0]], [[0, 0]], ("x", "y")) == 3


@pytest.mark.parametrize("wrong", [np.empty((0, 2)), [[np.nan, 0]], [[0.0, 1, 2]]])
def test_what_is_no_set_of_states_is_an_error(wrong):
    with pytest.raises(StateError):
        hausdorff(wrong, [[0, 0]], COORDINATES)


def test_extents_are_of_each_coordinate_and_around_the_circle():
    states = [[0.5, 6.1], [3.5, 0.3], [1.0, 0.1]]
    assert np.allclose(extents(states, COORDINATES), [3.0, 0.2 + (2 * np.pi - 6.1) + 0.1], rtol=1e-14)
    assert np.allclose(extents(states, ("v", "w")), [3.0, 6.0], rtol=1e-14)
    assert np.allclose(extents([[2.0, 1.0], [2.0 + 1e-9, 1.0]], COORDINATES), [0.02, 0.02 * np.pi], rtol=1e-8)
    assert extents([[0.0, 0.0]], ("v", "w")).tolist() == [1.0, 1.0]


def test_distances_in_a_scale_do_not_know_the_units():
    rng = np.random.default_rng(2)
    a, b = rng.uniform([0, 0], [1, 2 * np.pi], (30, 2)), rng.uniform([0, 0], [1, 2 * np.pi], (20, 2))
    scale = extents(np.concatenate([a, b]), COORDINATES)
    turn = np.angle(np.exp(1j * (a[:, None, 1] - b[None, :, 1])))
    lengths = np.hypot((a[:, None, 0] - b[None, :, 0]) / scale[0], turn / scale[1])
    found = hausdorff(a, b, COORDINATES, scale)
    assert np.isclose(found, max(lengths.min(axis=0).max(), lengths.min(axis=1).max()), rtol=1e-12)
    inches = [1e4, 1]
    assert np.isclose(hausdorff(a * inches, b * inches, COORDINATES, scale * inches), found, rtol=1e-12)


@pytest.mark.parametrize("scale", [1.0, np.array([0.3, 2.0])])
def test_few_known_states_have_the_digits_of_the_tree(scale):
    """Within a bound, around the circle, on other turns, and where states agree."""
    rng = np.random.default_rng(3)
    known, states = (rng.uniform([0, 0], [1, 2 * np.pi], (count, 2)) for count in (3, 400))
    states[:3], states[3:6, 1] = known, states[3:6, 1] + 4 * np.pi
    nearest = Nearest(known, COORDINATES, scale)
    for bound in (np.inf, 0.5, 0.0):
        expected = nearest.tree.query(states / scale, p=np.inf, distance_upper_bound=np.nextafter(bound, np.inf))[0]
        assert np.array_equal(nearest.distances(states, np.inf, bound), expected)
