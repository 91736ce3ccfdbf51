"""Lyapunov exponents, basins and noise show the numbers that they were given."""

from dataclasses import replace

import numpy as np
import pytest

from nsmaps.figures.longrun.basins import arrival, basins
from nsmaps.figures.longrun.noise import impacts, rates, shares
from nsmaps.figures.parameters.lyapunov import lyapunov


def test_exponents_run_along_the_parameter(result, ax):
    lyapunov(result.lyapunov, ax)
    drawn = [line.get_ydata() for line in ax.lines if len(line.get_xdata()) == 3]
    assert np.array_equal(ax.lines[0].get_xdata(), [0.1, 0.2, 0.3])
    assert np.array_equal(drawn[0], [np.nan, -1, -1], equal_nan=True)
    assert np.array_equal(drawn[1], [np.nan, -2, -2], equal_nan=True)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", r"$\lambda$ per return")
    assert {text.get_text() for text in ax.get_legend().get_texts()} == {r"$\lambda_{1}$", r"$\lambda_{2}$"}


def test_basins_have_a_colour_each_and_their_share(result, ax):
    basins(result.basins, ax)
    made = result.basins
    kinds = [k for k in (*range(len(made.attractors)), -1, -2) if (made.label == k).any()]
    mesh = np.asarray(ax.images[0].get_array())
    assert np.array_equal(mesh.reshape(made.grid.shape[::-1]).T.ravel(), [kinds.index(k) for k in made.label])
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert made.attractors[0].label == "1:1, period 1"
    assert texts[0] == f"1:1, period 1: {100 * made.fractions[0]:.3g} %"
    assert texts[len(kinds) :] == ["states of the attractors"]
    for line, attractor in zip(ax.lines, made.attractors, strict=True):
        assert np.allclose(line.get_xydata(), attractor.states)


@pytest.mark.parametrize(("kind", "name"), [(-1, "unresolved"), (-2, "ended")])
def test_what_reaches_no_attractor_has_its_own_share(result, ax, kind, name):
    label = np.full_like(result.basins.label, kind)
    label[: len(label) // 4] = 0
    basins(replace(result.basins, label=label), ax)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[1] == f"{name}: {100 * np.mean(label == kind):.3g} %"


def test_without_any_arrival_there_is_no_scale_of_returns(result, ax):
    arrival(replace(result.basins, label=np.full_like(result.basins.label, -1)), ax)
    assert [text.get_text() for text in ax.texts] == ["no start arrives"]
    assert len(ax.figure.axes) == 1


def test_arrival_counts_returns(result, ax):
    arrival(result.basins, ax)
    mesh = np.asarray(ax.images[0].get_array())
    made = result.basins
    shown = np.where(made.label >= 0, made.arrival, np.nan)
    assert np.array_equal(np.ma.filled(mesh.astype(float), np.nan).T.ravel(), shown, equal_nan=True)


def test_counts_of_returns_over_decades_are_told_apart_by_their_logarithm(result, ax):
    counts = np.where(np.arange(len(result.basins.label)) % 7, 12, 300)
    arrival(replace(result.basins, label=np.zeros_like(counts), arrival=counts), ax)
    (mesh,) = ax.images
    assert (mesh.norm(12), mesh.norm(60), mesh.norm(300)) == pytest.approx((0, 0.5, 1))
    bar = ax.figure.axes[-1]
    ax.figure.canvas.draw()
    names = [text.get_text() for text in bar.get_yticklabels(which="both")]
    assert " ".join(filter(None, names)) == "10 20 50 100 200 500"


def test_a_hundredth_of_the_starts_on_the_attractor_does_not_stretch_the_colours(result, ax):
    counts = np.linspace(20, 40, len(result.basins.label)).astype(int)
    counts[: max(len(counts) // 100, 1)] = 1
    arrival(replace(result.basins, label=np.zeros_like(counts), arrival=counts), ax)
    assert ax.images[0].norm.vmin >= 20


def test_impacts_have_the_sign_of_their_wall(result, ax):
    impacts(result.noise.impacts[2:], ax)
    by_name = {line.get_label(): line for line in ax.lines}
    assert sorted(by_name["B, no noise"].get_ydata()) == [0.4, 0.5, 0.6]
    assert sorted(by_name["T, no noise"].get_ydata()) == [-0.3, -0.2]
    assert by_name["T, no noise"].get_markerfacecolor() == "none"
    assert r"B, $\sigma = 0.1$" in by_name


def test_shares_and_rates_are_those_of_the_residence(result, ax):
    shares(result.noise, ax)
    assert np.allclose(ax.lines[0].get_ydata(), [5 / 6, 5 / 6])
    ax.clear()
    rates(result.noise, ax)
    assert np.allclose([bar.lines[0].get_ydata() for bar in ax.containers], [[3 / 50], [4 / 10]])
