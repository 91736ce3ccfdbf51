"""The bifurcation diagram shows the states kept, by word, with the motions named."""

from dataclasses import replace

import numpy as np
from figures.conftest import COORDINATES, WALLS

from nsmaps import bifurcation as compute
from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
from nsmaps.exact.words import encode
from nsmaps.figures.longrun.bifurcation import bifurcation


def drawn(result, ax, pair, low, high, coordinate):
    made = compute(pair, np.linspace(low, high, 41), [0.83, 0.36], returns=20, discard=600, direction="down")
    bifurcation(replace(result, bifurcation={"exact": made}), ax, "exact", coordinate)
    return made


def test_every_state_is_a_point(result, pair, ax):
    made = drawn(result, ax, pair, 0.26, 0.35, 1)
    (line,) = [line for line in ax.lines if line.get_label() == "BTB"]
    assert np.array_equal(line.get_ydata(), made.states[..., 1].ravel())
    assert np.array_equal(line.get_xdata(), np.repeat(made.values, 20))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$ (dimensionless)", r"$\phi_{k}$ (rad)")


def test_motions_are_named_where_they_are(result, pair, ax):
    drawn(result, ax, pair, 0.28, 0.35, 0)
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert set(places) == {"1:1/T", "1:1/2T"}
    assert 0.28 < places["1:1/2T"] < 0.32418854 < places["1:1/T"] < 0.35


def test_words_have_their_colours_and_gaps_are_grey(result, ax):
    bifurcation(result, ax)
    assert {line.get_label() for line in ax.lines if not line.get_label().startswith("_")} == {"BTB", "BB"}
    assert len(ax.patches) == 1
    assert ax.patches[0].get_x() == -0.1


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
    return Bifurcation(COORDINATES, WALLS, np.linspace(0, 1, count), states, turns, codes, outcome, ("",) * count, period)


def test_a_narrow_window_is_named_upwards_and_three_values_are_none(result, ax):
    made = diagram(["1:1/T"] * 60 + ["1:1/2T"] * 4 + ["C"] * 3 + ["2:1/T"] * 33)
    bifurcation(replace(result, bifurcation={"exact": made}), ax)
    assert {text.get_text(): text.get_rotation() for text in ax.texts} == {"1:1/T": 0, "1:1/2T": 90, "2:1/T": 0}


def test_a_diagram_without_an_attractor_says_so(result, ax):
    made = diagram(["1:1/T"] * 5, np.nan)
    none = replace(made, codes=np.zeros_like(made.codes))
    bifurcation(replace(result, bifurcation={"exact": none}), ax)
    assert [text.get_text() for text in ax.texts] == ["no attractor"]
    assert ax.get_legend() is None


def test_words_beyond_the_colours_are_one_entry(result, ax):
    words = ["B" + "T" * k + "B" for k in range(12)]
    made = diagram(["C"] * 12)
    codes = np.array([[[encode(word, WALLS)] * 2] for word in words])
    bifurcation(replace(result, bifurcation={"exact": replace(made, codes=codes)}), ax)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[-1] == f"{12 - len(labels) + 1} more words"
    assert set(labels[:-1]) < set(words)
    assert sum(len(line.get_xdata()) for line in ax.lines if line.get_label() in labels) == 24
