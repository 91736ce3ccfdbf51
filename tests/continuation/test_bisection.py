"""Bisection for edges against edges that are known, in coordinates of any size."""

import numpy as np
import pytest

from nsmaps.continuation.bisection import bisect_change, bisect_changes


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_edges_of_a_disc_are_found_to_rounding(unit):
    """Rays from the centre of an ellipse meet its edge where its equation says."""
    angle = np.linspace(0.1, 6.2, 50)
    rays = np.column_stack([3 * unit * np.cos(angle), 3 * np.sin(angle)])

    def label(states):
        return ((states / [unit, 1.0]) ** 2).sum(axis=1) > 2.0

    low, high, beyond = bisect_change(label, 0 * rays, rays, label(0 * rays), label(rays))
    assert beyond.all()
    assert not label(low).any()
    assert label(high).all()
    assert np.abs(high / rays - np.sqrt(2) / 3).max() < 1e-15


def test_the_label_beyond_the_edge_is_that_of_the_far_side():
    """Of the changes at 1, 2 and 3 the one is taken that bisection meets, and the label behind it is told."""
    low, high, beyond = bisect_change(np.floor, np.array([0.5, 0.5, 2.5]), np.array([3.6, 1.2, 3.1]), [0, 0, 2], [3, 1, 3])
    assert np.array_equal(beyond, np.floor(high))
    assert np.array_equal(np.floor(low), [0, 0, 2])
    assert np.array_equal(high, [1, 1, 3])


def test_rows_of_labels_are_compared_as_a_whole_and_a_width_ends_it():
    """Either column of a label may change; segments are halved until each coordinate is as short as asked for."""
    calls = []

    def label(states):
        calls.append(len(states))
        return np.column_stack([states[:, 0] > 0.3, states[:, 1] > 0.7])

    low, high, _ = bisect_change(label, np.zeros((1, 2)), np.ones((1, 2)), [[0, 0]], [[1, 1]], width=[2.0**-10, 1.0])
    assert low[0, 0] <= 0.3 < high[0, 0]
    assert high[0, 0] - low[0, 0] == 2.0**-10
    assert calls == [1] * 10


def test_no_segments_need_no_labels():
    none = np.empty((0, 2))

    def label(states):
        raise AssertionError

    low, high, beyond = bisect_change(label, none, none, np.empty(0, int), np.empty(0, int))
    assert low.shape == high.shape == (0, 2)
    assert beyond.shape == (0,)
    assert [len(found) for found in bisect_changes(label, none, none, np.empty((0, 2)), np.empty((0, 2)), 3)] == [0, 0, 0]


def test_changes_are_found_one_after_another_as_long_as_the_end_is_not_reached():
    """Of the steps at 1, 2, ..., 5 those on each segment, both sides to rounding; no more than are asked for."""
    low, high = np.array([0.5, 1.5]), np.array([5.4, 3.5])
    ends = np.floor(low), np.floor(high)
    rows, below, above = bisect_changes(np.floor, low, high, *ends, 9)
    assert sorted(zip(rows.tolist(), above.tolist(), strict=True)) == [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (1, 2), (1, 3)]
    assert np.array_equal(np.nextafter(below, 9), above)
    rows, _, above = bisect_changes(np.floor, low[:1], high[:1], ends[0][:1], ends[1][:1], 2)
    assert rows.tolist() == [0, 0]
    assert len(set(above)) == 2
