"""The bifurcation diagram shows the states kept, by word, with the windows of motions between their borders."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from figures.conftest import COORDINATES, WALLS
from matplotlib.colors import to_hex, to_rgb
from matplotlib.markers import TICKUP
from messages import message
from systems import Logistic

import nsmaps
from nsmaps import bifurcation_diagram as compute
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border, Window
from nsmaps.errors import NsmapsError
from nsmaps.exact.words import encode
from nsmaps.figures.parameters.bifurcation_diagram import bifurcation_diagram, sheets
from nsmaps.figures.parameters.motions import Interval, intervals, strip
from nsmaps.figures.parameters.raster import ROWS, raster
from nsmaps.figures.style import BLACK, INK, INKS, MAGENTA
from nsmaps.study.sections.parameters.bifurcation import DIAGRAMS

START = np.array([0.83, 0.36])


def drawn(ax, pair, low, high, coordinate):
    made = compute(pair, "d", np.linspace(low, high, 41), START, n_returns=20, transient=600, direction="down", borders=True)
    bifurcation_diagram(made, ax, coordinate=coordinate)
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
    states = np.array([[np.zeros(200)], [np.linspace(-1, 1, 200)]])
    image, ends = raster(np.array([0.0, 1.0]), states, np.zeros(states.shape, int), [MAGENTA], (-1.0, 1.0))
    assert np.allclose(image[:, 0].min(axis=0), to_rgb(MAGENTA))
    assert (image[:, 1].min(axis=0) > image[:, 0].min(axis=0)).all()
    assert ends == (-0.5, 1.5)


def test_values_that_are_not_equidistant_keep_their_places():
    values, states = np.array([0.0, 0.1, 1.0]), np.array([-1.0, 0.0, 1.0]).reshape(3, 1, 1)
    image, (left, right) = raster(values, states, np.zeros(states.shape, int), [MAGENTA], (-1.0, 1.0))
    middles = left + (np.arange(image.shape[1]) + 0.5) * (right - left) / image.shape[1]
    rows = [int(np.flatnonzero((image[:, k] < 1).any(axis=1)).mean()) for k in range(image.shape[1])]
    assert [rows[int(np.abs(middles - value).argmin())] for value in values] == [0, ROWS // 2, ROWS - 2]


def ticks(ax):
    """Where the borders of motions are marked above a panel."""
    return [float(x) for line in ax.lines if line.get_marker() == TICKUP for x in line.get_xdata()]


def test_motions_are_named_between_their_borders(pair, ax):
    drawn(ax, pair, 0.28, 0.35, 0)
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert set(places) == {"1:1/T", "1:1/2T"}
    assert any(border == pytest.approx(0.32418854, abs=1e-8) for border in ticks(ax))
    assert not any(ax.get_window_extent().overlaps(text.get_window_extent()) for text in ax.texts), "names stand above"
    assert ax.get_ylim()[1] < 1.1 * ax.images[0].get_extent()[3], "and take no room of the states"
    assert 0.28 < places["1:1/2T"] < 0.32418854 < places["1:1/T"] < 0.35


def test_a_chaotic_region_that_windows_cut_is_named(pair, ax):
    made = drawn(ax, pair, 0.26, 0.31, 0)
    motions = made.labels[made.values < 0.2683, 0].tolist()
    assert len(set(motions)) > 1, "there are windows in it"
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    first = min(x for x in ticks(ax) if x > 0.2601)
    assert places["1:1/C"] == pytest.approx((0.26 + first) / 2, abs=1e-4), "up to the first window with borders"


def test_no_window_of_many_values_is_called_chaos():
    """The logistic map from the accumulation of its doublings; its windows of periods 6, 5 and 3 begin at folds."""
    made = compute(Logistic(r=3.6), "r", np.linspace(3.54, 3.9, 181), [0.3], transient=4000, direction="up")
    ((_, row),) = intervals({"exact": made}, "exact").items()
    chaos = [each for each in row if each.name == "C"]
    step = 0.36 / 180
    assert chaos[0].low == pytest.approx(3.569946, abs=2 * step)
    assert [each.high for each in chaos] == pytest.approx([3.626554, 3.738173, 1 + 8**0.5, 3.9], abs=2 * step)


def test_words_have_their_colours_and_gaps_are_grey(result, ax):
    bifurcation_diagram(result.bifurcation_diagram, ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["BB", "BTB"]
    present = {to_hex(colour) for colour in np.unique(ax.images[0].get_array().reshape(-1, 3), axis=0)}
    assert {to_hex(handle.get_color()) for handle in ax.get_legend().legend_handles} == {BLACK, INKS[1].lower()}
    assert len(present) > 1
    assert len(ax.patches) == 1
    assert ax.patches[0].get_x() == -0.1


def test_panels_of_one_coordinate_have_the_same_limits_and_names(result):
    exact = diagram(["1:1/T"] * 20)
    composite = replace(exact, states=exact.states + 0.2, turns=0 * exact.turns)
    borders = Border(0.0, 0.0, "end of the range"), Border(1.0, 0.0, "end of the range")
    exact = replace(exact, windows=(Window("1:1/T", "1:1, period 1", *borders, (0.0, 1.0)),))
    composite = replace(composite, windows=(Window("1:1, period 1", "1:1, period 1", *borders, (0.0, 1.0)),))
    maps = DIAGRAMS.of(result.with_parts({"bifurcation_diagram": {"composite": composite, "exact": exact}}), "bifurcation")
    (sheet,) = sheets(maps)
    figure = sheet.figure()
    for one, other in zip(figure.axes[::2], figure.axes[1::2], strict=True):
        assert (one.get_xlim(), one.get_ylim()) == (other.get_xlim(), other.get_ylim())
        assert [text.get_text() for text in one.texts] == [text.get_text() for text in other.texts]
    assert [[text.get_text() for text in ax.texts] for ax in figure.axes] == [["1:1/T"]] * 2 + [[]] * 2
    assert [ax.get_title(loc="right") for ax in figure.axes] == ["composite map", "exact map", "", ""]
    assert [ax.xaxis.label.get_visible() for ax in figure.axes] == [False] * 2 + [True] * 2
    assert not figure.legends, "all returns have one word"


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


def test_a_name_that_does_not_fit_is_a_number_of_the_legend(ax):
    ends = [Border(value, 0.0, "fold") for value in (0.0, 0.6, 0.66, 0.68, 1.0)]
    names = ["1:1/T", "1:1/2T", "C", "2:1/T"]
    found = [Window(name, name, *pair, (pair[0].value, pair[1].value)) for name, pair in zip(names, pairwise(ends), strict=True)]
    bifurcation_diagram(replace(diagram(["1:1/T"] * 60), windows=tuple(found)), ax)
    assert [text.get_text() for text in ax.texts] == ["1:1/T", "1", "C", "2:1/T"]
    entries = {text.get_text(): handle.get_marker() for text, handle in zip(*legend_of(ax), strict=True)}
    assert entries == {"1:1/2T": r"$\mathrm{1}$", "chaos": r"$\mathrm{C}$"}
    assert ticks(ax) == [0.6, 0.66, 0.68]


def test_a_border_that_orbits_show_less_well_than_the_states_has_no_line(ax):
    ends = [Border(0.0, 0.0, "end of the range"), Border(0.4, 0.3, "change of motion"), Border(0.8, 0.01, "fold")]
    found = [Window("1:1/T", "", *ends[:2], (0.0, 0.25)), Window("1:1/2T", "", *ends[1:], (0.3, 0.8))]
    bifurcation_diagram(replace(diagram(["1:1/T"] * 21), windows=tuple(found)), ax)
    assert ticks(ax) == [0.25, 0.3, 0.8], "where the orbits show the end of a motion best"
    assert ax.texts[0].get_position()[0] == pytest.approx(0.125)


def test_a_diagram_without_an_attractor_says_so(ax):
    made = diagram(["1:1/T"] * 5, np.nan)
    none = replace(made, codes=np.zeros_like(made.codes))
    bifurcation_diagram(none, ax)
    assert [text.get_text() for text in ax.texts] == ["no attractor"]
    assert ax.get_legend() is None


def test_a_number_has_one_meaning_in_all_panels(ax):
    ax.set_xlim(0, 1)
    narrow = Interval("1:1/4T", 0.5, 0.53), Interval("1:1/2T", 0.6, 0.63)
    entries = strip(ax, {"": narrow[:1]}, (), others=[narrow[1:]])
    assert [text.get_text() for text in ax.texts] == ["2"], "1 is of the other panel"
    assert [(each.get_label(), each.get_marker()) for each in entries] == [("1:1/4T", r"$\mathrm{2}$")]


def test_words_beyond_the_colours_are_one_entry(ax):
    words = ["B" + "T" * k + "B" for k in range(12)]
    made = diagram(["C"] * 12)
    codes = np.array([[[encode(word, WALLS)] * 2] for word in words])
    bifurcation_diagram(replace(made, codes=codes), ax)
    *labels, chaos = [text.get_text() for text in ax.get_legend().get_texts()]
    assert chaos == "chaos"
    assert labels[-1] == f"{12 - len(labels) + 1} more words"
    assert set(labels[:-1]) < set(words)
    grey = np.isclose(ax.images[0].get_array(), to_rgb(INK)).all(axis=-1)
    assert grey.any(axis=0).sum() == 12 - len(labels) + 1


def legend_of(ax):
    return ax.get_legend().get_texts(), ax.get_legend().legend_handles


def beside(one, other, **about):
    """The diagram of two orbits."""
    rows = {name: np.concatenate([getattr(one, name), getattr(other, name)], axis=1) for name in ROWS_OF}
    return replace(one, **rows, **about)


ROWS_OF = ("states", "turns", "codes", "outcome", "period", "labels", "length")


def test_orbits_on_other_attractors_have_their_rows_and_colours(ax):
    made = beside(diagram(["1:1/T"] * 20), diagram(["1:1/T"] * 10 + ["1:1/2T"] * 10, 0.5), direction="both")
    bifurcation_diagram(made, ax)
    assert [(text.get_text(), text.get_position()[0]) for text in ax.texts if "/" in text.get_text()] == [
        ("1:1/T", 0.5),
        ("1:1/T", pytest.approx(0.25, abs=0.03)),
        ("1:1/2T", pytest.approx(0.75, abs=0.03)),
    ]
    assert [text.get_text() for text in ax.texts if "/" not in text.get_text()] == ["→", "←"]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["→ followed upwards", "← followed downwards"]
    image = ax.images[0].get_array()
    seen = [{to_hex(c) for c in column[(column < 1).any(axis=1)]} for column in np.moveaxis(image, 1, 0)]
    assert seen == [{INKS[0], INKS[1].lower()}] * 20, "the cycle at 0.5 is apart from that at 0, whatever its name"
    ax.clear()
    bifurcation_diagram(beside(diagram(["1:1/T"] * 20), diagram(["1:1/T"] * 20)), ax)
    assert (ax.get_legend(), [text.get_text() for text in ax.texts]) == (None, ["1:1/T"]), "one attractor"


def test_an_angle_is_cut_in_the_widest_gap_of_its_states(ax):
    made = diagram(["1:1/T"] * 20)
    made.states[..., 1] = np.linspace(-0.4, 0.3, 20)[:, None, None] % (2 * np.pi)
    bifurcation_diagram(made, ax, coordinate=1)
    low, high = ax.get_ylim()
    assert -0.45 < low < -0.4
    assert 0.3 < high < 0.35
    rows = [int(np.flatnonzero((column < 1).any(axis=1)).mean()) for column in np.moveaxis(ax.images[0].get_array(), 1, 0)]
    assert (np.diff(rows) > 0).all(), "one line without a jump"
    ax.clear()
    made.states[..., 1] = np.linspace(0, 2 * np.pi, 41)[:-1].reshape(20, 1, 2)
    bifurcation_diagram(made, ax, coordinate=1)
    assert ax.get_ylim() == (0.0, 2 * np.pi)
    assert 2 * np.pi in ax.get_yticks()


def test_colours_by_density_or_an_unknown_name(ax):
    made = diagram(["2:1/T"] * 5)
    bifurcation_diagram(made, ax, by="density")
    assert ax.get_legend() is None
    with pytest.raises(NsmapsError, match=message("figures.colours", name="words")):
        bifurcation_diagram(made, ax, by="words")


def test_branches_and_exponents_of_the_same_parameter_stand_in_the_diagram(pair):
    values = np.linspace(0.3, 0.35, 11)
    made = compute(pair, "d", values, START, n_returns=20, transient=300, direction="down")
    branch = nsmaps.continue_branch(pair, "d", nsmaps.periodic_orbit(pair(0.35), START), 0.35, (0.3, 0.35), direction="both")
    exponents = nsmaps.lyapunov(pair, "d", values, START, n_returns=50)
    figure = made.plot(branches=[branch], lyapunov=exponents)
    speed, phase, below = figure.axes
    assert [ax.get_xlim() for ax in figure.axes] == [(0.3, 0.35)] * 3
    assert [ax.xaxis.label.get_visible() for ax in figure.axes] == [False, False, True]
    for k, ax in enumerate((speed, phase)):
        shown = [line.get_ydata() for line in ax.lines if len(line.get_xdata()) == len(branch.values)]
        assert np.allclose(np.nanmax(shown, axis=0), branch.points[:, 0, k], rtol=0, atol=1e-14)
        assert any(line.get_marker() == "o" and line.get_xdata() == [branch.events[0].value] for line in ax.lines)
    assert np.array_equal(below.lines[0].get_ydata(), exponents.exponents[:, 0])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"stable cycle", "unstable cycle", "period doubling"} < set(texts)
    other = replace(branch, parameter="r"), replace(exponents, parameter="r")
    assert len(sheets(made, [other[0]], other[1])[0].panels) == 2
