"""The exact map of the paper's three cases in cells, by enclosure: the attractors, and that corners of boxes are not enough."""

import numpy as np
import pytest

from nsmaps import load_study, read_result, run_study
from nsmaps.cells.morse import forward_invariant_box, forward_invariant_set, morse_sets
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.dynamics.orbit import orbit
from nsmaps.study.pictures.draw import draw

WINDOW = [[0.55, 1], [0.05, 1.25]]
START = [0.8, 0.3]


@pytest.mark.parametrize(
    ("d", "depth", "most"), [(0.35, 5, (0.06, 0.12)), (0.30, 5, (0.12, 0.31)), (0.26, 5, (0.14, 0.75))], ids=["FP", "PD", "CD"]
)
def test_the_attractor_is_one_minimal_component_in_a_closed_set_of_cells(pair, d, depth, most):
    """10^5 returns of the exact orbit, once it is there, lie in the component and in the closed set."""
    return_map = pair(d)
    cover = morse_sets(return_map, WINDOW, depth=depth)
    assert len(cover.minimal) == 1
    k = cover.minimal[0]
    assert (np.ptp(cover.hulls[k], axis=1) <= most).all()
    held = forward_invariant_set(return_map, cover, k)
    assert held.forward_invariant
    assert (np.ptp(held.hull, axis=1) <= most).all()
    states = orbit(return_map, START, 102_000).states[2000:]
    assert held.contains(states).all()
    own = cover.numbers[cover.component == k]
    assert np.isin(cover.cells.numbers_of(states), own).all()


@pytest.mark.parametrize(("d", "cells", "most"), [(0.35, 24, (0.06, 0.12)), (0.26, 32, (0.14, 0.75))], ids=["FP", "CD"])
def test_what_stays_in_the_window_is_one_component(pair, d, cells, most):
    """At d = 0.30 it is not: the unstable fixed point inside of the two-cycle is a Morse set of its own."""
    cover = morse_sets(pair(d), WINDOW, depth=2, n_cells=cells)
    assert len(cover.hulls) == 1
    assert (np.ptp(cover.hulls[0], axis=1) <= most).all()


def test_the_unstable_fixed_point_of_case_pd_is_a_morse_set_of_its_own(pair):
    cover = morse_sets(pair(0.30), WINDOW, depth=4)
    point = np.array([0.776278, 0.266398])
    inside = ((cover.hulls[..., 0] <= point) & (point <= cover.hulls[..., 1])).all(axis=1)
    assert any(inside[k] and k not in cover.minimal for k in range(len(inside)))
    assert (np.ptp(cover.hulls[cover.minimal[0]], axis=1) <= (0.12, 0.31)).all()


def test_corners_miss_part_of_an_image_that_the_enclosure_holds(pair):
    """v in [0.55, 0.5640625], phi in [0.125, 0.1625]: a state goes 9 sides of a 32 x 32 grid beyond the hull of the corners."""
    return_map, box = pair(0.35), np.array([[0.55, 0.5640625], [0.125, 0.1625]])
    share = np.linspace(0, 1, 41)
    states = box[:, 0] + np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2) * np.ptp(box, axis=1)
    images = return_map.first_return(states).image
    corners = images[np.isin(states[:, 0], box[0]) & np.isin(states[:, 1], box[1])]
    assert len(corners) == 4
    missed = np.maximum(corners.min(axis=0) - images.min(axis=0), images.max(axis=0) - corners.max(axis=0))
    assert missed[1] > 9 * 1.2 / 32
    boxes = return_map.image_boxes(box[None]).images[:, None]
    lifted = [images + np.array([0, 2 * np.pi * turn]) for turn in range(-1, 4)]
    held = [((boxes[..., 0] <= x) & (x <= boxes[..., 1])).all(axis=2).any(axis=0) for x in lifted]
    assert np.any(held, axis=0).all()


def test_the_start_box_of_case_fp_is_carried_into_itself_by_enclosure(pair):
    assert forward_invariant_box(pair(0.35), [[0.7, 1], [0.2, 1.14]], n_cells=32).forward_invariant
    # an image reaches phi = 1.1317
    assert not forward_invariant_box(pair(0.35), [[0.7, 1], [0.2, np.pi / 3]], n_cells=32).forward_invariant


def test_the_fixed_points_of_case_fp(pair):
    """The stable one and two saddles, known in 50 digits, each found in a window of their own."""
    known = {
        (0.833385990208561, 0.363611564551622): [[0.75, 0.95], [0.2, 0.6]],
        (0.281770025375305, 2.91844362963194): [[0.25, 0.32], [2.8, 3.0]],
        (0.343255510718990, 2.87685171619735): [[0.33, 0.36], [2.86, 2.89]],
    }
    for state, window in known.items():
        found = find_cycles(pair(0.35), window, max_period=1, depth=3)
        assert any(cycle.states[0] == pytest.approx(state, abs=1e-10) for cycle in found.cycles)
        number = found.cells.numbers_of([state])[0]
        assert number in found.numbers


def test_the_study_of_cells_is_written_and_read_and_drawn(tmp_path):
    result = run_study(load_study("vi_pair/morse"), tmp_path / "run")
    assert result.holds
    (verdict,) = [verdict for verdict in result.verdicts if verdict.name == "morse_sets: forward invariant"]
    assert verdict.required
    assert "(enclosed)" in verdict.text
    again = read_result(tmp_path / "run")
    assert np.array_equal(again.forward_invariant_set.numbers, result.forward_invariant_set.numbers)
    assert np.array_equal(again.morse_sets.component, result.morse_sets.component)
    (path,) = draw(again, ["morse_sets"], tmp_path)
    assert path.stat().st_size > 0
