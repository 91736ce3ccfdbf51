"""The Hausdorff distance against all pairs."""

import numpy as np
import pytest

from nsmaps.dynamics.distance import hausdorff
from nsmaps.errors import StateError
from nsmaps.exact.impacts import Angle

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
