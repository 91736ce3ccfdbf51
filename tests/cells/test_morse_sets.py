"""Covers and closed sets on maps whose recurrent sets are known, and the graph of cells against brute force."""

import re

import numpy as np
import pytest
from boxmaps import Henon, Logistic, Turn, one_each
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

from nsmaps.cells.conley import _in_window, conley_indices
from nsmaps.cells.grid import Cells, counted, painted, targets_of
from nsmaps.cells.morse import forward_invariant_set, morse_sets
from nsmaps.cells.transition_graph import graph_of, recurrent
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.interrupts import Interrupted

TURN = 2 * np.pi


def met(cells, box):
    """The cells that a box meets, by looking at each: borders count as of the upper cell, angles on every turn."""
    found = []
    for number in range(cells.size):
        cell = cells.boxes(np.array([number]))[0]
        meets = True
        for k, name in enumerate(cells.coordinates):
            turns = TURN * np.arange(-9, 10) if isinstance(name, Angle) else [0.0]
            at_end = cell[k, 1] == cells.box[k, 1]
            meets &= any(
                box[k, 1] + t >= cell[k, 0] and (box[k, 0] + t <= cell[k, 1] if at_end else box[k, 0] + t < cell[k, 1])
                for t in turns
            )
        found += [number] if meets else []
    return found


SIDES = st.tuples(*[st.floats(-0.5, 1.5), st.floats(0.01, 0.8), st.floats(-20, 20), st.floats(0.01, 7)])


@settings(deadline=None)
@given(st.lists(SIDES, min_size=1, max_size=4))
def test_image_boxes_meet_the_cells_that_brute_force_finds(sides):
    boxes = np.array([[[x, x + w], [p, p + q]] for x, w, p, q in sides])
    every = np.ones(len(boxes), bool)
    images = BoxImages(np.arange(len(boxes)), boxes, np.full(len(boxes), ""), every, ~every)
    for turn in ([0.0, TURN], [0.5, 2.0]):
        cells = Cells.over(("x", Angle("phi")), [[0, 1], turn], (3, 5))
        found = cells.targets(images)
        for n, box in enumerate(boxes):
            rows = found.of(np.arange(len(boxes)) == n)
            found_here = set(np.flatnonzero(painted(cells, rows)).tolist())
            assert set(met(cells, box)) <= found_here <= set(met(cells, box + np.array([-1e-9, 1e-9])))
        mask = np.arange(cells.size) % 3 == 0
        here = np.bincount(found.source, counted(cells, mask, found), len(boxes)) > 0
        painted_here = [painted(cells, found.of(np.arange(len(boxes)) == n)) for n in range(len(boxes))]
        assert here.tolist() == [bool((mask & row).any()) for row in painted_here]


def test_arcs_are_those_of_every_cell_by_itself():
    return_map, cells = Henon(), Cells.over(("x", "y"), [[-2, 2], [-1, 1]], (9, 7))
    numbers = np.flatnonzero(np.arange(cells.size) % 5 != 2)
    graph = graph_of(cells, numbers, targets_of(return_map, cells, numbers)).toarray()
    images = return_map.image_boxes(cells.boxes(numbers)).images
    expected = [np.isin(numbers, met(cells, box)) for box in images]
    assert (graph[:-1, :-1] == np.array(expected)).all()
    assert not graph[-1].any()


def test_the_window_and_periodic_points_of_the_logistic_map():
    """At a = 3.2: the fixed points 0 and 1 - 1/a repel, the two-cycle attracts; every closed form lies in its component."""
    cover = morse_sets(Logistic(3.2), [[0, 1]], depth=9)
    a = 3.2
    cycle = [(a + 1 + s * np.sqrt((a - 3) * (a + 1))) / (2 * a) for s in (1, -1)]
    numbers = [cover.cells.numbers_of([[x]])[0] for x in (*cycle, 0.0, 1 - 1 / a)]
    component = dict(zip(cover.numbers.tolist(), cover.component.tolist(), strict=True))
    two, again, zero, fixed = (component[n] for n in numbers)
    assert two == again
    assert cover.minimal == (two,)
    assert len({two, zero, fixed}) == 3
    assert [zero, fixed] in cover.edges.tolist()
    held = forward_invariant_set(Logistic(3.2), cover, two)
    assert held.forward_invariant
    assert held.contains(np.array(cycle)[:, None]).all()
    assert held.hull[0] == pytest.approx([cycle[1], cycle[0]], abs=0.01)


def test_an_attractor_stays_in_its_cover():
    """Henon's attractor: 10^4 iterates from a start on it, no cell dropped that it visits, finer levels nested in coarser."""
    return_map = Henon()
    covers = [morse_sets(return_map, [[-1.5, 1.5], [-0.5, 0.5]], depth=depth) for depth in (3, 6)]
    x, seen = np.array([[0.1, 0.1]]), []
    for _ in range(10_100):
        x = return_map.first_return(x).image
        seen.append(x[0])
    for cover in covers:
        assert cover.contains(seen[100:]).all()
    assert covers[0].contains(covers[1].cells.centres(covers[1].numbers)).all()
    assert covers[1].share < 0.5 * covers[0].share
    assert covers[1].finished
    assert [level.shape for level in covers[1].levels[:2]] == [(8, 8), (16, 16)]


def test_what_does_not_stay_is_empty():
    cover = morse_sets(Henon(), [[1.3, 1.5], [-0.5, 0.5]], depth=4)
    assert cover.numbers.size == 0
    assert cover.hulls.shape == (0, 2, 2)
    assert cover.minimal == ()


@pytest.mark.parametrize("shift", [0.0, 1.0, -2.5])
def test_a_circle_has_no_seam(shift):
    cover = morse_sets(Turn(shift), [[-1, 1], [shift, shift + TURN]], depth=4)
    held = forward_invariant_set(Turn(shift), cover, cover.minimal[0])
    assert held.forward_invariant
    assert held.contains([[0.0, angle] for angle in np.linspace(-9, 9, 50)]).all()
    assert not held.contains([[0.5, 1.0]]).any()


def test_the_hull_of_cells_about_the_seam_passes_it():
    cells = Cells.over(("x", Angle("phi")), [[0, 1], [0, TURN]], (1, 16))
    assert cells.hull(np.array([0, 1, 15]))[1] == pytest.approx([15 / 16 * TURN, TURN + 2 / 16 * TURN])
    assert cells.hull(np.array([3, 6]))[1] == pytest.approx([3 / 16 * TURN, 7 / 16 * TURN])


class Patchy(Henon):
    """Henon's map of which nothing is known where x > 1, and of which some state has no image where y > 0.4."""

    def image_boxes(self, boxes):
        plain = Henon.image_boxes(self, boxes)
        return one_each(plain.images, boxes[:, 0, 1] <= 1, boxes[:, 1, 1] > 0.4)


def test_what_is_not_known_is_kept():
    """All cells of unknown images are recurrent if anything leads to them; a set with lost states is not forward invariant."""
    window = [[-2, 2], [-1, 1]]
    plain, patchy = morse_sets(Henon(0.9), window, depth=2), morse_sets(Patchy(0.9), window, depth=2)
    assert np.isin(plain.numbers, patchy.numbers).all()
    unknown = patchy.cells.boxes(np.arange(patchy.cells.size))[:, 0, 1] > 1
    assert unknown[plain.numbers].any()
    assert not unknown[plain.numbers].all()
    assert not patchy.stays[unknown[patchy.numbers]].any()
    held = forward_invariant_set(Patchy(0.9), patchy, 0)
    assert not held.forward_invariant
    assert "not bounded" in held.reason
    x, y = map(float, re.fullmatch(r"images of the cell around x = (\S+), y = (\S+) leave .*", held.reason).groups())
    assert not patchy.cells.targets(Patchy(0.9).image_boxes(patchy.cells.boxes(patchy.cells.numbers_of([[x, y]])))).stays.any()


def test_the_node_of_unknown_images_adds_no_recurrence_of_its_own():
    return_map, cells = Patchy(), Cells.over(("x", "y"), [[1.2, 1.9], [-0.9, 0.3]], 3)
    numbers = np.arange(cells.size)
    component = recurrent(graph_of(cells, numbers, targets_of(return_map, cells, numbers)))
    assert (component == 0).all()
    assert (recurrent(graph_of(cells, numbers, targets_of(Henon(), cells, numbers))) == -1).all()


def test_interruption_keeps_the_last_finished_level():
    shares = []

    def stop(share):
        shares.append(share)
        if share > 2.0**-3:  # in the midst of the fourth of six levels
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        morse_sets(Henon(), [[-2, 2], [-1, 1]], depth=5, progress=stop)
    cover = stopped.value.result
    assert not cover.finished
    assert cover.cells.shape == (32, 32)
    assert shares == sorted(shares)
    assert 2.0**-5 * 9 / 64 in shares  # within the first level
    assert np.array_equal(cover.numbers, morse_sets(Henon(), [[-2, 2], [-1, 1]], depth=2).numbers)


def test_too_many_arcs_are_refused_before_all_images_are_enclosed(monkeypatch):
    asked = []

    class Counted(Henon):
        def image_boxes(self, boxes):
            asked.append(len(boxes))
            return super().image_boxes(boxes)

    monkeypatch.setattr("nsmaps.cells.transition_graph.MOST_ARCS", 2000)
    with pytest.raises(NsmapsError, match=message("cells.too-many-arcs", most=2000)):
        morse_sets(Counted(), [[-2, 2], [-1, 1]], depth=0, n_cells=100)
    assert sum(asked) < 100**2 / 2


@pytest.mark.parametrize(
    ("window", "how", "said"),
    [
        ([[1, 0], [0, 1]], {}, message("coordinates.box-with-angles")),
        ([[0, 1]], {}, message("coordinates.box-with-angles", names="x, y")),
        ([[0, 1], [0, 1]], {"depth": -1}, message("errors.value", name="depth", value=-1)),
        ([[0, 1], [0, 1]], {"n_cells": (3,)}, message("cells.number")),
        ([[0, 1], [0, 1]], {"n_cells": 3000}, message("cells.too-many-cells", most=4000000)),
    ],
)
def test_calls_that_are_wrong(window, how, said):
    with pytest.raises(NsmapsError, match=said):
        morse_sets(Henon(), window, **how)


def test_an_angle_of_more_than_a_turn():
    with pytest.raises(NsmapsError, match=message("coordinates.box-with-angles")):
        morse_sets(Turn(), [[-1, 1], [0, 7]])


def test_conley_indices_of_known_sets():
    """CMGDB on our images: an attracting two-cycle has x^2 - 1, the saddle between it x + 1, an attracting circle x - 1 twice."""
    pytest.importorskip("CMGDB", reason="Conley indices need the extra 'morse'")
    indices = conley_indices(Henon(0.6), [[-2, 2], [-1, 1]], depth=8).indices
    assert ("x^2-1", "0", "0") in indices
    assert ("0", "x+1", "0") in indices
    assert conley_indices(Turn(), [[-1, 1], [0, TURN]], depth=5).indices[0] == ("x-1", "x-1", "0")


@pytest.mark.parametrize("window", [(0.2, 0.6), (0.0, 6.0), (-1.0, 3.0), (5.0, 8.0)])
def test_images_about_either_end_of_a_part_of_a_turn_are_kept(window):
    """Every angle of an image that lies in the window on some turn lies in the box that stands for the image."""
    rng = np.random.default_rng(0)
    low = rng.uniform(-9, 9, 400)
    hulls = np.stack([low, low + rng.uniform(0, 2, 400)], axis=1)
    (moved,) = _in_window(Cells.over((Angle("a"),), [window], 1), hulls[:, None, :].copy()).transpose(1, 0, 2)
    angles = np.linspace(*hulls.T, 50)[..., None] + TURN * np.arange(-4, 5)
    inside = (window[0] <= angles) & (angles <= window[1])
    held = (moved[:, :1] <= angles + 1e-12) & (angles - 1e-12 <= moved[:, 1:])
    assert inside.any()
    assert held[inside].all()


def test_without_the_extra_the_error_names_it():
    try:
        import CMGDB  # noqa: F401
    except ImportError:
        with pytest.raises(NsmapsError, match=message("cells.no-cmgdb")):
            conley_indices(Henon(), [[-2, 2], [-1, 1]])
