"""The figure of error against time, and what figures are called in words."""

from types import SimpleNamespace

import numpy as np

from nsmaps.figures import NAMES
from nsmaps.figures.captions import CAPTIONS
from nsmaps.figures.speed_error import speed_error


def points(ax):
    """What is drawn under each label: x and y."""
    return {line.get_label(): (line.get_xdata()[0], line.get_ydata()[0]) for line in ax.get_lines()}


def test_errors_of_strips_stand_at_their_time(result, ax):
    drawn = points(speed_error(result, ax))
    assert (drawn["over the box"], drawn["beside edges"]) == ((20.0, 2e-4), (20.0, 5e-4))
    assert drawn["time of the exact map"][0] == 100.0
    assert drawn["tolerance"][1] == 1e-3
    assert ax.get_xlim()[0] < 20 < 100 < ax.get_xlim()[1]


def test_errors_of_closed_forms_are_told_apart_by_role(result, ax):
    rows = [("attracting", (1e-4, 4e-4)), ("transient", (0.1, 0.3)), ("transient", (0.2, 0.1)), ("outside", (9.0, 9.0))]
    table = [SimpleNamespace(role=role, max_error=error) for role, error in rows]
    made = SimpleNamespace(table=lambda: table, max_error=4e-4)
    drawn = points(speed_error(SimpleNamespace(**{**vars(result), "accurate": None, "partition": made}), ax))
    assert (drawn["attracting pieces"], drawn["transient pieces"]) == ((20.0, 4e-4), (20.0, 0.3))
    made.max_error = np.nan
    ax.clear()
    drawn = points(speed_error(SimpleNamespace(**{**vars(result), "accurate": None, "partition": made}), ax))
    assert "attracting pieces" not in drawn, "what was not measured is not drawn"


def test_every_figure_is_told_in_words():
    assert set(CAPTIONS) == set(NAMES)
    assert all(alt and caption.endswith(".") for alt, caption in CAPTIONS.values())
