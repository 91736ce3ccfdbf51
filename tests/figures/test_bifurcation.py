"""The bifurcation diagram shows the states kept, by word, with the motions named."""

from types import SimpleNamespace

import numpy as np

from nsmaps import bifurcation as compute
from nsmaps.figures.bifurcation import bifurcation


def drawn(ax, pair, low, high, coordinate):
    made = compute(pair, np.linspace(low, high, 41), [0.83, 0.36], returns=20, transient=600, follow="down")
    result = SimpleNamespace(bifurcation={"exact": made}, study=SimpleNamespace(bifurcation=SimpleNamespace(parameter="d")))
    bifurcation(result, ax, "exact", coordinate)
    return made


def test_every_state_is_a_point(pair, ax):
    made = drawn(ax, pair, 0.26, 0.35, 1)
    (line,) = [line for line in ax.lines if line.get_label() == "BTB"]
    assert np.array_equal(line.get_ydata(), made.states[..., 1].ravel())
    assert np.array_equal(line.get_xdata(), np.repeat(made.values, 20))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$ (dimensionless)", r"$\phi_{k}$ (rad)")


def test_motions_are_named_where_they_are(pair, ax):
    drawn(ax, pair, 0.28, 0.35, 0)
    places = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert set(places) == {"1:1/T", "1:1/2T"}
    assert 0.28 < places["1:1/2T"] < 0.32418854 < places["1:1/T"] < 0.35


def test_words_have_their_colours_and_gaps_are_grey(result, ax):
    bifurcation(result, ax)
    assert {line.get_label() for line in ax.lines if not line.get_label().startswith("_")} == {"BTB", "BB"}
    assert len(ax.patches) == 1
    assert ax.patches[0].get_x() == -0.1


def test_a_narrow_window_is_named_upwards_and_three_values_are_none(ax):
    labels = np.array(["1:1/T"] * 60 + ["1:1/2T"] * 4 + ["C"] * 3 + ["2:1/T"] * 33)[:, np.newaxis]
    values, shape = np.linspace(0, 1, 100), (100, 1, 2)
    made = SimpleNamespace(
        values=values,
        labels=labels,
        codes=np.zeros(shape),
        words=np.full(shape, "BB"),
        states=np.zeros((*shape, 2)),
        coordinates=("v", "w"),
    )
    study = SimpleNamespace(bifurcation=SimpleNamespace(parameter="d"))
    bifurcation(SimpleNamespace(bifurcation={"exact": made}, study=study), ax)
    assert {text.get_text(): text.get_rotation() for text in ax.texts} == {"1:1/T": 0, "1:1/2T": 90, "2:1/T": 0}


def test_a_diagram_without_an_attractor_says_so(ax):
    shape = (5, 1, 2)
    made = SimpleNamespace(
        values=np.linspace(0, 1, 5),
        labels=np.full((5, 1), ""),
        codes=np.zeros(shape),
        words=np.full(shape, ""),
        states=np.full((*shape, 2), np.nan),
        coordinates=("v", "w"),
    )
    study = SimpleNamespace(bifurcation=SimpleNamespace(parameter="d"))
    bifurcation(SimpleNamespace(bifurcation={"exact": made}, study=study), ax)
    assert [text.get_text() for text in ax.texts] == ["no attractor"]
    assert ax.get_legend() is None
