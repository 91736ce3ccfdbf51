"""The pictures of the motion: over time, in the phase plane, at impacts, along a slice; the algorithm and the sketches."""

import re
from dataclasses import replace

import numpy as np
import pytest
from figures.conftest import COORDINATES, WALLS, panel, study_of
from matplotlib import rc_context
from matplotlib.colors import to_rgba
from matplotlib.patches import FancyBboxPatch
from messages import message

from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import encode
from nsmaps.figures.page import lay_out
from nsmaps.figures.returns.slices import sheets as slice_sheets
from nsmaps.figures.returns.slices import slices
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, STYLE
from nsmaps.figures.system.algorithm import STEPS, algorithm
from nsmaps.figures.system.algorithm import sheets as algorithm_sheets
from nsmaps.figures.system.impacts import impacts
from nsmaps.figures.system.motion import motion, phase_plane, sheets
from nsmaps.figures.system.sketch import sketch
from nsmaps.plugins import system_names


def marked(ax, marker, colour):
    """The points drawn in one mark."""
    (line,) = [one for one in ax.lines if one.get_marker() == marker and to_rgba(one.get_color()) == to_rgba(colour)]
    return line.get_xydata()


def test_the_ball_and_the_walls_over_time(result, ax):
    track = result.orbits[0].track
    motion(track, ax)
    drawn = [line.get_xydata() for line in ax.lines if line.get_marker() == "None"]
    for line, place in zip(drawn, (*track.walls, track.ball), strict=True):
        assert np.array_equal(line, np.column_stack([track.time.ravel(), place.ravel()]))
    assert np.allclose(marked(ax, "*", GREEN), [[0, -0.2], [3, np.sin(3) - 0.2]])  # on the wall below, which is B
    assert np.allclose(marked(ax, "o", BLUE), [[1, np.sin(1) + 0.2]])
    assert ax.get_ylabel() == "absolute displacement"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["walls", "ball", "impact on B", "impact on T"]


def test_the_phase_plane_has_arrows_of_time_and_velocities_before_impacts(result, ax):
    phase_plane(result.orbits[0].track, ax)
    assert np.allclose(marked(ax, "*", GREEN), [[0.2, 0.4], [0.2, 0.8]])
    assert np.allclose(marked(ax, "o", BLUE), [[-0.2, -0.6]])
    (first, second) = ax.texts
    assert (first.xy[0] - first.xyann[0]) * -0.4 > 0
    assert (second.xy[0] - second.xyann[0]) * 0.2 > 0
    turned = [np.ravel(line.get_ydata()).tolist() for line in ax.lines if len(line.get_xdata()) == 2]
    assert [0.4, -0.4] in turned
    assert [-0.6, 0.2] in turned


def test_motion_has_a_row_an_orbit(result):
    (sheet,) = sheets([pair.track for pair in result.orbits])
    assert (len(sheet.panels), sheet.columns) == (4, 2)


def test_impacts_are_joined_in_their_order(result, ax):
    impacts(result.orbits[0].track, ax)
    (way,) = [line for line in ax.lines if line.get_linestyle() == ":"]
    assert np.allclose(way.get_xydata(), [[0.4, 0.5], [-0.6, 3.0], [0.8, 6.0]])
    assert np.allclose(marked(ax, "*", GREEN), [[0.4, 0.5], [0.8, 6.0]])
    assert np.allclose(marked(ax, "o", BLUE), [[-0.6, 3.0]])
    assert ax.get_ylabel() == r"phase $\psi_j$ (rad)"


def test_slices_have_a_line_a_piece_in_the_colour_of_its_word(result, ax):
    slices(result.slices[0], ax, "phi", over="v")
    made = result.slices[0]
    assert [len(line.get_xdata()) for line in ax.lines] == [3, 4, 4]
    assert [to_rgba(line.get_color()) for line in ax.lines] == [to_rgba(colour) for colour in (BLACK, MAGENTA, MAGENTA)]
    drawn = np.concatenate([line.get_xydata() for line in ax.lines])
    assert np.array_equal(drawn, np.column_stack([made.returns.start[:, 0], made.returns.image[:, 1]]))
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["BB", "BTB"]
    assert ax.get_title() == r"$\phi_{k}$ = 1 rad"


def test_a_slice_has_the_phase_planes_of_all_coordinates_and_the_images_of_those_held(result):
    (sheet,) = slice_sheets(result.slices)
    assert [(panel.keywords["coordinate"], panel.keywords.get("over", "")) for panel in sheet.panels] == [
        ("v", ""),
        ("phi", ""),
        ("phi", "v"),
    ]


def test_in_the_phase_plane_of_a_coordinate_held_all_images_stand_over_it_and_both_words_are_seen(result, ax):
    slices(result.slices[0], ax, "phi")
    (first, *others), made = ax.lines[:3], result.slices[0]
    drawn = np.concatenate([line.get_xydata() for line in ax.lines[:3]])
    assert np.array_equal(drawn, np.column_stack([np.ones(11), made.returns.image[:, 1]]))
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\phi_{k}$ (rad)", r"$\phi_{k+1}$ (rad)")
    assert all(line.get_linewidth() > 2 * first.get_linewidth() and line.get_zorder() < first.get_zorder() for line in others)
    low, high = ax.lines[3].get_xydata()
    assert ax.lines[3].get_label() == "diagonal"
    assert low[0] == low[1] < high[0] == high[1]


def test_the_phase_plane_of_the_coordinate_that_runs_has_the_map_and_its_diagonal(result, ax):
    slices(result.slices[0], ax)
    drawn, made = np.concatenate([line.get_xydata() for line in ax.lines[:3]]), result.slices[0]
    assert np.array_equal(drawn, np.column_stack([made.returns.start[:, 0], made.returns.image[:, 0]]))
    assert ax.lines[3].get_label() == "diagonal"


def test_the_algorithm_names_every_step_and_counts_the_log(result, ax):
    panel(algorithm, result, ax)
    texts = [text.get_text() for text in ax.texts]
    assert [step[0] for _, _, steps in STEPS for step in steps] == ["0", "i", "ii", "iii", "iv", "v", "vi", "vii"]
    assert {part for _, _, steps in STEPS for step in steps for part in step} <= set(texts)
    (told,) = [text for text in texts if "log" in text]
    assert re.search(r"4 regions .* \(1 split, 2 accepted, 1 given up\), 3 pieces, 1 attracting", told.replace("\n", " "))


@pytest.mark.parametrize(("width", "texts_of_a_box"), [(5.1, 4), (3.4, 2)])
def test_no_text_of_the_algorithm_leaves_its_box(result, width, texts_of_a_box):
    with rc_context(STYLE):
        figure = algorithm_sheets(result.partition)[0].figure(width=width)
        figure.canvas.draw()
        (ax,) = figure.axes
        boxes = [patch.get_window_extent() for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
        texts = [text.get_window_extent() for text in ax.texts if text.get_text()]
    assert len(boxes) == 9
    inside = [(text, box) for text in texts for box in boxes if box.contains(text.x0, (text.y0 + text.y1) / 2)]
    assert len(inside) == texts_of_a_box * 9
    assert all(text.x1 <= box.x1 and box.y0 <= text.y0 < text.y1 <= box.y1 for text, box in inside)


@pytest.mark.parametrize("name", ["vi_pair", "bouncing_ball", "impact_oscillator"])
def test_every_system_of_the_project_has_a_sketch(result, ax, name):
    assert name in system_names()
    assert panel(sketch, replace(result, study=study_of(system=name)), ax) is ax
    texts = {text.get_text() for text in ax.texts}
    named = {"vi_pair": r"$\beta$", "bouncing_ball": "$g$", "impact_oscillator": r"$2\zeta$"}
    assert named[name] in texts


def test_a_system_without_a_sketch_says_so(result, ax):
    with pytest.raises(NsmapsError, match=message("plugins.no-sketch", system="mine.py:Mine")):
        panel(sketch, replace(result, study=study_of(system="mine.py:Mine")), ax)


def test_slices_of_many_words_count_those_beyond_eight_below_the_panels(result, ax):
    words = [f"B{'T' * k}B" for k in range(11)]
    start, image = np.column_stack([np.linspace(0.1, 1, 22), np.ones(22)]), np.full((22, 2), 0.5)
    codes = np.repeat([encode(word, WALLS) for word in words], 2)
    zeros = np.zeros(22)
    returns = Returns(COORDINATES, WALLS, start, image, np.zeros((22, 2), np.int32), codes, zeros.astype(np.int8), zeros)
    many = replace(result.slices[0], returns=returns, jump=np.zeros(21, bool))
    slices(many, ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [*words[:8], "3 more words", "diagonal"]
    (sheet,) = slice_sheets(many)
    figure = sheet.figure(50)
    lay_out(figure)
    (legend,) = figure.legends
    assert legend.get_window_extent().y1 <= min(panel.get_tightbbox().y0 for panel in figure.axes)
