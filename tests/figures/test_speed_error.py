"""The figure of error against time."""

from dataclasses import replace

import numpy as np
from figures.conftest import panel

from nsmaps.figures.composite.speed_error import speed_error


def points(ax):
    """What is drawn under each label: x and y."""
    return {line.get_label(): (line.get_xdata()[0], line.get_ydata()[0]) for line in ax.get_lines()}


def test_errors_of_strips_stand_at_their_time(result, ax):
    drawn = points(panel(speed_error, result, ax))
    made = result.accurate
    assert drawn["over the box"] == (20.0, made.uniform.largest)
    assert "beside edges" not in drawn, "the box of this run has no edge"
    assert drawn["time of the exact map"][0] == 100.0
    assert drawn["tolerance"][1] == 1e-3
    assert ax.get_xlim()[0] < 20 < 100 < ax.get_xlim()[1]


def test_errors_of_closed_forms_are_told_apart_by_role(result, ax):
    told = [("attracting", (1e-4, 4e-4)), ("transient", (0.1, 0.3)), ("transient", (0.2, 0.1)), ("outside", (9.0, 9.0))]
    rows = [replace(result.partition.log[0], role=role, max_error=error, became="accepted") for role, error in told]
    made = replace(result.partition, log=tuple(rows), max_error=4e-4)
    drawn = points(panel(speed_error, result.with_parts({"accurate": None, "partition": made}), ax))
    assert (drawn["attracting pieces"], drawn["transient pieces"]) == ((20.0, 4e-4), (20.0, 0.3))
    ax.clear()
    drawn = points(panel(speed_error, result.with_parts({"accurate": None, "partition": replace(made, max_error=np.nan)}), ax))
    assert "attracting pieces" not in drawn, "what was not measured is not drawn"
