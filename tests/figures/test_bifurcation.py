"""The bifurcation diagram shows the states kept, by word, with the windows of motions between their borders."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from figures.conftest import COORDINATES, WALLS
from matplotlib.colors import to_hex, to_rgb

import nsmaps
from nsmaps import bifurcation_diagram as compute
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border, Window
from nsmaps.exact.words import encode
from nsmaps.figures.parameters.bifurcation import ROWS, bifurcation, raster, sheets
from nsmaps.figures.style import BLACK, GREY, MAGENTA
from nsmaps.study.sections.parameters.bifurcation import DIAGRAMS

START = np.array([0.83, 0.36])


def drawn(ax, pair, low, high, coordinate):
    made = compute(pair, "d", np.linspace(low, high, 41), START, n_returns=20, transient=600, direction="down", borders=True)
    bifurcation(made, ax, coordinate=coordinate)
    return made


def test_the_raster_has_a_column_a_value_and_its_marks_are_the_states(pair, ax):
    made = drawn(ax, pair, 0.26, 0.35, 1)
    (image,) = ax.images
    assert image.get_array().shape == (ROWS, 41, 3)
    left, right, low, high = image.get_extent()
    assert np.allclose(left + (np.arange(41) + 0.5) * (right - left) / 41, made.values)
    for column, states in zip(np.moveaxis(image.get_array(), 1, 0), made.states[:, 0, :, 1], strict=True):
        rows = np.unique(np.rint((states - low) / (high - low) * (ROWS - 1)).astype(int))
        marked = np.flatnonzero((column < 1).any(axis=1))
        assert set(marked.tolist()) == {row + k for row in rows.tolist() for k in (-1, 0, 1)}
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", r"$\phi_{k}$ (rad)")


def test_a_cycle_is_darker_than_chaos_and_has_the_colour_of_its_word(ax):
    orbits = np.zeros((2, 1, 200, 2))
    orbits[1, 0, :, 0] = np.linspace(-1, 1, 200)
    blank = np.zeros(orbits.shape[:3])
    codes = np.full(blank.shape, encode("BTB", WALLS))
    values, turns, period = np.array([0.0, 1.0]), np.zeros(orbits.shape, np.int32), np.array([[1], [0]])
    about = turns, codes, blank[..., 0].astype(np.int8), ("", ""), period, np.ones(2), np.array([["1:1/T"], ["C"]]), period
    made = BifurcationDiagram(COORDINATES, WALLS, "d", values, orbits, *about)
    image, ends = raster(made, 0, (-1.0, 1.0), {"BTB": MAGENTA})
    assert np.allclose(image[:, 0].min(axis=0), to_rgb(MAGENTA))
    assert (image[:, 1].min(axis=0) > image[:, 0].min(axis=0)).all()
    assert ends == (-0.5, 1.5)


def test_values_that_are_not_equidistant_keep_their_places():
    made = replace(diagram(["1:1/T"] * 3), values=np.array([0.0, 0.1, 1.0]))
    made.states[:, 0, :, 0] = np.array([-1.0, 0.0, 1.0])[:, None]
    image, (left, right) = raster(made, 0, (-1.0, 1.0), {"BTB": MAGENTA})
    middles = left + (np.arange(image.shape[1]) + 0.5) * (right - left) / image.shape[1]
    rows = [int(np.flatnonzero((image[:, k] < 1).any(axis=1)).mean()) for k in range(image.shape[1])]
    assert [rows[int(np.abs(middles - value).argmin())] for value in made.values] == [0, ROWS // 2, ROWS - 2]


def test_motions_are_named_between_their_borders(pair, ax):
    drawn(ax, pair, 0.28, 0.35, 0)
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert set(places) == {"1:1/T", "1:1/2T"}
    borders = {line.get_xdata()[0] for line in ax.lines}
    assert any(border == pytest.approx(0.32418854, abs=1e-8) for border in borders)
    assert 0.28 < places["1:1/2T"] < 0.32418854 < places["1:1/T"] < 0.35


def test_a_chaotic_region_that_windows_cut_is_named(pair, ax):
    made = drawn(ax, pair, 0.26, 0.31, 0)
    motions = made.labels[made.values < 0.2683, 0].tolist()
    assert len(set(motions)) > 1, "there are windows in it"
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    first = min(x for line in ax.lines if (x := line.get_xdata()[0]) > 0.2601)
    assert places["1:1/C"] == pytest.approx((0.26 + first) / 2, abs=1e-4), "up to the first window with borders"


def test_words_have_their_colours_and_gaps_are_grey(result, ax):
    bifurcation(result.bifurcation, ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["BB", "BTB"]
    present = {to_hex(colour) for colour in np.unique(ax.images[0].get_array().reshape(-1, 3), axis=0)}
    assert {to_hex(handle.get_color()) for handle in ax.get_legend().legend_handles} == {BLACK.lower(), MAGENTA.lower()}
    assert len(present) > 1
    assert len(ax.patches) == 1
    assert ax.patches[0].get_x() == -0.1


def test_panels_of_one_coordinate_have_the_same_limits_and_names(result):
    exact = diagram(["1:1/T"] * 20)
    composite = replace(exact, states=exact.states + 0.2, turns=0 * exact.turns)
    borders = Border(0.0, 0.0, "end of the range"), Border(1.0, 0.0, "end of the range")
    exact = replace(exact, windows=(Window("1:1/T", "1:1, period 1", *borders, (0.0, 1.0)),))
    composite = replace(composite, windows=(Window("1:1, period 1", "1:1, period 1", *borders, (0.0, 1.0)),))
    maps = DIAGRAMS.of(result.with_parts({"bifurcation": {"composite": composite, "exact": exact}}), "bifurcation")
    (sheet,) = sheets(maps)
    figure = sheet.figure()
    for one, other in zip(figure.axes[:2], figure.axes[2:], strict=True):
        assert (one.get_xlim(), one.get_ylim()) == (other.get_xlim(), other.get_ylim())
        assert [text.get_text() for text in one.texts] == [text.get_text() for text in other.texts] == ["1:1/T"]
    assert [ax.get_title(loc="right") for ax in figure.axes] == ["composite map"] * 2 + ["exact map"] * 2
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["BTB"]


def test_flights_that_are_integrated_make_no_exact_map(result):
    system = nsmaps.load_system("duffing", c=0.1, a=-1, b=1, f=0.7, w=1.2, d=0.9, r=0.8)
    assert list(DIAGRAMS.of(replace(result, system=system), "bifurcation")) == ["integrated map"]


MOTIONS = {
    "1:1/T": (1, ("BTB", "BTB"), (1, 1)),
    "1:1/2T": (2, ("BTB", "BTB"), (1, 1)),
    "C": (0, ("BTB", "BB"), (1, 1)),
    "2:1/T": (2, ("BB", "BTB"), (1, 0)),
}  #: period, words and turns of two returns


def diagram(motions, state=0.0):
    """A diagram of one start and two returns with these motions one after the other, over parameters from 0 to 1."""
    count = len(motions)
    rows = [MOTIONS[name] for name in motions]
    turns = np.zeros((count, 1, 2, 2), np.int32)
    turns[:, 0, :, 1] = [row[2] for row in rows]
    codes = np.array([[encode(word, WALLS) for word in row[1]] for row in rows])[:, np.newaxis]
    period = np.array([[row[0]] for row in rows])
    states, outcome = np.full((count, 1, 2, 2), state), np.zeros((count, 1), np.int8)
    about = states, turns, codes, outcome, ("",) * count, period, np.ones(2), np.array([[name] for name in motions]), period
    return BifurcationDiagram(COORDINATES, WALLS, "d", np.linspace(0, 1, count), *about)


def test_a_narrow_window_is_named_upwards(ax):
    ends = [Border(value, 0.0, "fold") for value in (0.0, 0.6, 0.66, 0.68, 1.0)]
    names = ["1:1/T", "1:1/2T", "C", "2:1/T"]
    found = [Window(name, name, *pair, (pair[0].value, pair[1].value)) for name, pair in zip(names, pairwise(ends), strict=True)]
    bifurcation(replace(diagram(["1:1/T"] * 60), windows=tuple(found)), ax)
    assert {text.get_text(): text.get_rotation() for text in ax.texts} == {"1:1/T": 0, "1:1/2T": 90, "2:1/T": 0}


def test_a_border_that_orbits_show_less_well_than_the_states_has_no_line(ax):
    ends = [Border(0.0, 0.0, "end of the range"), Border(0.4, 0.3, "change of motion"), Border(0.8, 0.01, "fold")]
    found = [Window("1:1/T", "", *ends[:2], (0.0, 0.25)), Window("1:1/2T", "", *ends[1:], (0.3, 0.8))]
    bifurcation(replace(diagram(["1:1/T"] * 21), windows=tuple(found)), ax)
    assert {float(line.get_xdata()[0]) for line in ax.lines} == {0.0, 0.8}
    assert ax.texts[0].get_position()[0] == pytest.approx(0.125)


def test_a_diagram_without_an_attractor_says_so(ax):
    made = diagram(["1:1/T"] * 5, np.nan)
    none = replace(made, codes=np.zeros_like(made.codes))
    bifurcation(none, ax)
    assert [text.get_text() for text in ax.texts] == ["no attractor"]
    assert ax.get_legend() is None


def test_words_beyond_the_colours_are_one_entry(ax):
    words = ["B" + "T" * k + "B" for k in range(12)]
    made = diagram(["C"] * 12)
    codes = np.array([[[encode(word, WALLS)] * 2] for word in words])
    bifurcation(replace(made, codes=codes), ax)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[-1] == f"{12 - len(labels) + 1} more words"
    assert set(labels[:-1]) < set(words)
    grey = np.isclose(ax.images[0].get_array(), to_rgb(GREY)).all(axis=-1)
    assert grey.any(axis=0).sum() == 12 - len(labels) + 1
