"""The stability diagram shows each point's period or motion in the colour that the legend gives it."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from nsmaps.dynamics.curves.curve import BifurcationCurve
from nsmaps.dynamics.curves.special import SpecialPoint
from nsmaps.dynamics.diagrams.stability import StabilityDiagram
from nsmaps.errors import NsmapsError
from nsmaps.figures.parameters.stability import stability
from nsmaps.study.study import CATALOGUE

DIAGRAM = StabilityDiagram(
    parameters=("d", "r"),
    along=np.array([0.1, 0.2, 0.3, 0.4]),
    across=np.array([0.5, 0.6]),
    period=np.array([[1, 2, 0, -1], [1, 2, 2, 16]]),
    labels=np.array([["1:1/T", "1:1/2T", "1:1/C", ""], ["1:1/T", "1:1/2T", "2:1/T", "1:1/16T"]]),
    outcome=np.zeros((2, 4), np.int8),
    reasons=("", ""),
)


def seen(ax):
    """The name of each point by its colour and the legend."""
    names = {to_hex(patch.get_facecolor()): patch.get_label() for patch in ax.get_legend().get_patches()}
    (mesh,) = ax.collections
    colours = mesh.to_rgba(mesh.get_array())
    return [[names[to_hex(colour)] for colour in row] for row in colours.reshape(2, 4, 4)]


def test_colours_are_those_of_the_legend(ax):
    stability(DIAGRAM, ax, by="period")
    assert seen(ax) == [["1", "2", "chaos", "no attractor"], ["1", "2", "2", "16"]]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", "$r$")


def test_motions_are_told_apart(ax):
    stability(DIAGRAM, ax)
    assert seen(ax)[1] == ["1:1/T", "1:1/2T", "2:1/T", "1:1/16T"]


def test_the_rest_is_other(ax):
    period = np.arange(1, 9).reshape(2, 4)
    stability(replace(DIAGRAM, period=period), ax, by="period")
    assert sorted(np.ravel(seen(ax)).tolist()) == sorted(["other", "other", *map(str, range(1, 7))])


def test_curves_lie_over_it_with_their_special_points(ax):
    line = np.array([[0.2, 0.5], [0.9, 0.55], [0.3, 0.6]])
    cusp = SpecialPoint("cusp", (0.25, 0.55), (1e-9, 1e-9), None)
    curve = BifurcationCurve("fold", line, np.zeros((3, 1, 2)), ("BTB",), np.ones((3, 2), complex), (cusp,), ("", ""))
    doubling = replace(curve, kind="period doubling", parameters=line[:1], special=())
    stability(DIAGRAM, ax, curves={"fold of 1:1": curve, "period doubling of 1:1": doubling})
    drawn = {each.get_label(): each.get_xydata() for each in ax.lines}
    assert np.array_equal(drawn["fold of 1:1"], line)
    assert np.array_equal(drawn["cusp"], [[0.25, 0.55]])
    assert np.array_equal(drawn["period doubling of 1:1"], line[:1])
    assert ax.get_xlim() == pytest.approx((0.05, 0.45))  # that of the diagram
    assert [text.get_text() for text in ax.get_legend().get_texts()][-3:] == ["fold of 1:1", "period doubling of 1:1", "cusp"]


def test_the_sheet_shows_motions_and_curves_of_the_study(result):
    (sheet,) = CATALOGUE["stability"].sheets(result)
    figure = sheet.figure()
    (ax,), (legend,) = figure.axes, figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["1:1/T", "1:1/2T", "period doubling of one"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", "$r$")
    (line,) = [line for line in ax.lines if line.get_label() == "period doubling of one"]
    assert np.array_equal(line.get_xydata(), [[0.05, 0.4], [0.15, 0.6]])


def test_wrong_calls_are_errors(ax):
    with pytest.raises(NsmapsError, match="by 'words'"):
        stability(DIAGRAM, ax, by="words")
