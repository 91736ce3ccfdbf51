"""Branches are drawn where they are, dashed where they are unstable, with a mark at each event."""

import numpy as np
import pytest

import nsmaps
from nsmaps.dynamics.branch import continue_branch, doubled_branch
from nsmaps.errors import NsmapsError
from nsmaps.figures.branches import branches


def test_lines_and_marks_are_those_of_the_branch(pair, ax):
    system = pair(0.35)
    one = continue_branch(lambda d: system.at(d=d), nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.28, 0.36), "down")
    (event,) = one.events
    two = doubled_branch(lambda d: system.at(d=d), event, (0.28, 0.36))
    branches([one, two], ax, 1, "d")
    drawn = [(line.get_linestyle(), np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in ax.lines]
    solid, dashed = drawn[0], drawn[1]
    assert (solid[0], dashed[0]) == ("-", "--")
    assert np.array_equal(solid[1][np.isfinite(solid[2])], one.parameter[one.stable])
    assert np.array_equal(solid[2][one.stable], one.points[one.stable, 0, 1])
    assert np.array_equal(dashed[2][~one.stable], one.points[~one.stable, 0, 1])
    assert np.isfinite(dashed[2]).sum() == (~one.stable).sum() + 1  # on to where it becomes stable
    marks = [(x.tolist(), y.tolist()) for style, x, y in drawn if style == "None"]
    assert marks == [([event.parameter], event.orbit.states[:, 1].tolist())]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["1:1/T", "1:1/2T", "period doubling", "unstable"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$ (dimensionless)", r"$\phi_{k}$ (rad)")


def test_nothing_to_draw_is_an_error(ax):
    with pytest.raises(NsmapsError, match="no branch with orbits"):
        branches([], ax)
