"""The search for cycles, on the map of Henon, whose cycles are counted in the literature (Galias 1999)."""

from dataclasses import replace

import numpy as np
import pytest
from boxmaps import Henon, Sway, Turn, one_each
from messages import message

from nsmaps.cells.closed_walks import on_closed_walks
from nsmaps.cells.grid import Cells, targets_of
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.transition_graph import graph_of
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.errors import NsmapsError

WINDOW = [[-2, 2], [-1, 1]]


@pytest.mark.thorough
def test_all_cycles_of_henons_map_up_to_period_eight():
    """On the attractor 1, 1, 0, 1, 0, 2, 4, 7 cycles of least period 1 to 8; one more fixed point beside it."""
    found = find_cycles(Henon(), WINDOW, max_period=8, depth=8)
    assert np.bincount([len(cycle.states) for cycle in found.cycles], minlength=9).tolist() == [0, 2, 1, 0, 1, 0, 2, 4, 7]
    points = np.concatenate([cycle.states for cycle in found.cycles])
    held = found.cells.numbers_of(points)
    assert np.isin(held, found.numbers).all()
    for cycle in found.cycles:
        allowed = found.may[np.searchsorted(found.numbers, found.cells.numbers_of(cycle.states))]
        assert allowed[:, len(cycle.states) - 1].all()
        assert cycle.converged
    assert f"{len(found.numbers)} of its {found.cells.size} cells" in found.coverage
    assert f"{int((~found.known).sum())} do not" in found.coverage
    assert len(found.table().splitlines()) == 17


def test_fixed_points_leave_no_cell_open():
    found = find_cycles(Henon(), WINDOW, max_period=1, depth=8)
    roots = np.roots([-1.4, 0.3 - 1, 1])
    assert sorted(cycle.states[0, 0] for cycle in found.cycles) == pytest.approx(sorted(roots), abs=1e-12)
    assert found.known.all()


def test_a_cycle_without_multipliers_is_not_called_unstable():
    found = find_cycles(Henon(), WINDOW, max_period=1, depth=6)
    returns = found.cycles[0].returns
    resting = PeriodicOrbit(replace(returns, derivative=np.full_like(returns.derivative, np.nan)), 1e-10, found.cycles[0].scale)
    assert resting.stable is None
    lines = replace(found, cycles=(resting, *found.cycles)).table().splitlines()
    assert "of unknown stability" in lines[0]
    assert [line.split(")")[1].split()[0] for line in lines[1:]] == ["unstable", "unstable"]


def test_closed_walks_against_powers_of_the_matrix():
    return_map, cells = Henon(), Cells.over(("x", "y"), WINDOW, 12)
    numbers = np.arange(cells.size)
    graph = graph_of(cells, numbers, targets_of(return_map, cells, numbers))
    dense = graph.toarray()[:-1, :-1].astype(float)
    may, walks = on_closed_walks(graph, 4)
    for p in range(1, 5):
        expected = np.diag(np.linalg.matrix_power(dense, p)) > 0
        assert (may[:, p - 1] == expected).all()
        walk = walks[p - 1]
        assert sorted(walk[:, 0]) == np.flatnonzero(expected).tolist()
        assert all(dense[walk[:, k], walk[:, (k + 1) % p]].all() for k in range(p))


class Unknown(Henon):
    """Henon's map of which nothing is known in a corner."""

    def image_boxes(self, boxes):
        return one_each(Henon.image_boxes(self, boxes).images, ~((boxes[:, 0, 1] > 1.2) & (boxes[:, 1, 0] < 0.2)))


def test_closed_walks_through_cells_of_unknown_images_against_brute_force():
    return_map, cells = Unknown(), Cells.over(("x", "y"), WINDOW, 10)
    numbers = np.arange(cells.size)
    graph = graph_of(cells, numbers, targets_of(return_map, cells, numbers))
    dense = graph.toarray()[:-1, :-1].astype(float)
    dense[graph.toarray()[:-1, -1]] = 1
    may, _ = on_closed_walks(graph, 3)
    plain = np.linalg.matrix_power(dense, 3)
    assert may[np.diag(dense) > 0, 0].all()
    assert may[np.diag(plain) > 0, 2].all()


def test_a_fixed_point_on_the_end_of_a_circle_is_found_once():
    found = find_cycles(Sway(), [[-1, 1], [0, 2 * np.pi]], max_period=2, depth=5)
    ends = [np.abs(np.exp(1j * cycle.states[0, 1]) - np.array([1, -1])).argmin() for cycle in found.cycles]
    assert sorted(ends) == [0, 1]
    assert [len(cycle.states) for cycle in found.cycles] == [1, 1]


def test_where_nothing_returns_nothing_is_found():
    found = find_cycles(Turn(np.pi), [[-1, 1], [0, 2 * np.pi]], max_period=1, depth=3)
    assert found.cycles == ()
    assert len(found.numbers) == 0


@pytest.mark.parametrize("wrong", [{"max_period": 0}, {"depth": -1}])
def test_calls_that_are_wrong(wrong):
    with pytest.raises(NsmapsError, match=message("cells.periods")):
        find_cycles(Henon(), WINDOW, **wrong)
