"""The pictures of cells: components of a cover, steps until a region is left."""

from dataclasses import dataclass

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.figures.cells.exit_times import exit_times, sheets
from nsmaps.figures.cells.morse_sets import morse_sets
from nsmaps.figures.grey import alike_in_grey
from nsmaps.figures.style import piece_label


@dataclass
class Half:
    """Every state to its half."""

    coordinates: tuple[str, ...]

    def image_boxes(self, boxes):
        count, every = len(boxes), np.ones(len(boxes), bool)
        return BoxImages(np.arange(count), np.asarray(boxes) / 2, np.full(count, ""), every, ~every)


def shown(ax):
    """The numbers drawn, with -1 where there is none, in the order of cells."""
    return np.ma.filled(ax.images[0].get_array(), -1).T.ravel()


def test_components_have_their_colours_and_cells(result, ax):
    assert morse_sets(result.morse_sets, ax, [pair.exact for pair in result.orbits]) is ax
    cover = result.morse_sets
    drawn = shown(ax)
    assert np.flatnonzero(drawn >= 0).tolist() == cover.numbers.tolist()
    assert (drawn[cover.numbers] == cover.component + 1).all()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["Morse set 0, no exit", "Morse set 1", "between", "exact orbits"]
    states = np.concatenate([pair.exact.states[20:] for pair in result.orbits])
    assert np.array_equal(np.column_stack(ax.lines[0].get_data()), states)


def test_cells_out_of_a_plane_are_refused():
    for names in (("x",), ("x", "y", "z")):
        cover = nsmaps.cells.morse_sets(Half(names), [[-1.0, 1.0]] * len(names), depth=1, n_cells=2)
        with pytest.raises(NsmapsError, match=message("figures.cells-in-space", number=len(names))):
            cover.plot()


def test_what_stays_is_apart_from_what_is_left(result, ax):
    exit_times(result.exit_times, ax)
    made, drawn = result.exit_times, shown(ax)
    assert np.flatnonzero(drawn == 1).tolist() == [5]
    left = (made.left > 0) & (made.region >= 0)
    assert (drawn[left] == 1 + made.left[left]).all()
    assert (drawn[made.region < 0] == -1).all()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["not proved", "periodic points"]
    assert np.array_equal(np.column_stack(ax.lines[0].get_data()), made.points)
    names = {text.get_text(): text.get_position() for text in ax.texts}
    assert names
    for k, region in enumerate(made.regions):
        if piece_label(region) in names:  # there is room
            low, high = made.cells.box.T
            place = np.floor((np.array(names[piece_label(region)]) - low) / (high - low) * made.cells.shape).astype(int)
            assert made.region.reshape(made.cells.shape)[tuple(place)] == k


def test_arrival_is_a_second_panel_with_its_target(result, ax):
    (sheet,) = sheets(result.exit_times)
    assert len(sheet.panels) == 2
    sheet.panels[1](ax)
    drawn = shown(ax)
    assert np.flatnonzero(drawn == 0).tolist() == np.flatnonzero(result.exit_times.arrived == 0).tolist()
    assert [text.get_text() for text in ax.get_legend().get_texts()][:2] == ["not proved", "target"]
    assert alike_in_grey(ax.figure) == []


def test_results_draw_themselves_and_name_their_axes(result):
    pytest.importorskip("xarray")
    (branch,), attractors = result.branches["one"], result.global_continuation
    impacts, means = result.noise.impacts[0], result.observe["bifurcation_diagram"]
    others = (result.manifolds["saddle"][0], result.morse_sets, result.exit_times, result.noise, impacts)
    for each in (branch, result.basins, attractors, *others):
        assert each.plot(width=3.4).axes
        table = each.to_xarray()
        assert table.sizes
        assert not any("_" in str(name) for name in table.sizes)
    assert (branch.to_xarray().d.values == branch.values).all()
    assert means.plot(width=3.4).axes
    assert means.to_xarray().means.dims == ("d", "start", "observable")
    assert impacts.to_xarray().speed.dims == ("d", "impact")
    assert (attractors.to_xarray().d.values == attractors.values).all()
