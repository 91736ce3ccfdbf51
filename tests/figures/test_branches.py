"""Branches are drawn where they are, dashed where they are unstable, with a mark at each event."""

from dataclasses import replace

import numpy as np
import pytest
from messages import message
from nsmaps_border_collision import BorderCollision

import nsmaps
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.follow import continue_branch, switch_branch
from nsmaps.errors import NsmapsError
from nsmaps.figures.parameters.branches import branches, enlarged, sheets
from nsmaps.figures.style import darker


def test_lines_and_marks_are_those_of_the_branch(pair, ax):
    system = pair(0.35)
    one = continue_branch(system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.28, 0.36), direction="down")
    (event,) = one.events
    two = switch_branch(system, "d", event, (0.28, 0.36))
    branches([one, two], ax, 1)
    drawn = [(line.get_linestyle(), np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in ax.lines]
    solid, dashed = drawn[0], drawn[1]
    assert (solid[0], dashed[0]) == ("-", "--")
    stable = one.stable.astype(bool)
    assert np.array_equal(solid[1][np.isfinite(solid[2])], one.values[stable])
    assert np.array_equal(solid[2][stable], one.points[stable, 0, 1])
    assert np.array_equal(dashed[2][~stable], one.points[~stable, 0, 1])
    assert np.isfinite(dashed[2]).sum() == (~stable).sum() + 1  # on to where it becomes stable
    marks = [(x.tolist(), y.tolist()) for style, x, y in drawn if style == "None"]
    assert marks == [([event.value], event.orbit.states[:, 1].tolist())]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["stable", "unstable", "period doubling"]
    names = {text.get_text(): text for text in ax.texts}
    assert set(names) == {"1:1/T", "1:1/2T"}
    for branch, name in ((one, "1:1/T"), (two, "1:1/2T")):
        line = next(line for line in ax.lines if np.array_equal(line.get_xdata(), branch.values))
        assert names[name].get_color() == darker(line.get_color())
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", r"$\phi_{k}$ (rad)")


def test_a_sheet_has_a_panel_a_coordinate_and_one_legend(result):
    (sheet,) = sheets(result.branches["one"])
    figure = sheet.figure()
    (branch,) = result.branches["one"]
    assert (sheet.name, len(figure.axes)) == ("branches", 2)
    assert [len(figure.legends), *(ax.get_legend() for ax in figure.axes)] == [1, None, None]
    for i, ax in enumerate(figure.axes):
        solid = next(line for line in ax.lines if line.get_linestyle() == "-")
        assert np.array_equal(solid.get_xdata(), branch.values)
        assert np.array_equal(solid.get_ydata(), branch.points[:, 0, i])
    assert [ax.get_ylabel() for ax in figure.axes] == ["$v_{k}$", r"$\phi_{k}$ (rad)"]


def test_motions_in_a_small_part_of_the_range_are_enlarged_in_a_second_row(pair):
    system = pair(0.35)
    one = continue_branch(system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.3, 0.36), direction="down")
    two = switch_branch(system, "d", one.events[0], (0.322, 0.36))
    figure = sheets([one, two])[0].figure()
    assert len(figure.axes) == 4
    for i, (above, below) in enumerate(zip(figure.axes[:2], figure.axes[2:], strict=True)):
        (frame,) = above.patches
        corners = np.array([frame.get_xy(), np.add(frame.get_xy(), (frame.get_width(), frame.get_height()))])
        assert corners == pytest.approx(np.column_stack([below.get_xlim(), below.get_ylim()]))
        path = two.points[:, int(np.ptp(two.points[..., i], axis=0).argmax()), i]
        assert corners[0, 1] < path.min() < path.max() < corners[1, 1]
    with pytest.raises(NsmapsError, match=message("figures.no-narrow-branch")):
        enlarged(one, figure.axes[0])


def test_parameters_have_sheets_of_their_own_and_starts_that_led_nowhere_none(result):
    (branch,) = result.branches["one"]
    several = [replace(branch, parameter=name) for name in "dr"] + [Branch.empty(branch.orbits[0], "M", "no orbit at 1")]
    assert [sheet.name for sheet in sheets(several)] == ["branches-d", "branches-r"]


def test_lines_are_the_finer_the_longer_the_period(pair, ax):
    system = pair(0.35)
    one = continue_branch(system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.28, 0.36), direction="down")
    two = switch_branch(system, "d", one.events[0], (0.28, 0.36))
    branches([one, two], ax)
    width = {line.get_color(): line.get_linewidth() for line in ax.lines if line.get_linestyle() == "-"}
    assert list(width.values()) == sorted(width.values(), reverse=True)
    assert len(set(width.values())) == 2


def test_an_unstable_branch_of_two_orbits_is_drawn(pair, ax):
    """A start at the end of its range leaves two orbits one way."""
    system = pair(0.35)
    saddle = nsmaps.periodic_orbit(system, [0.34, 2.87])
    up = continue_branch(system, "r", saddle, 0.5, (0.1, 0.5))
    assert (len(up.values), set(up.stable)) == (2, {False})
    branches(up, ax)
    assert np.isfinite(np.asarray(ax.lines[1].get_ydata(), float)).sum() == 2


def test_nothing_to_draw_is_an_error(ax):
    with pytest.raises(NsmapsError, match=message("figures.no-branch")):
        branches([], ax)


def test_orbits_of_unknown_stability_are_dotted_and_in_the_legend(pair, ax):
    """One orbit of a branch without a derivative, as on a graze: neither solid nor dashed."""
    system = pair(0.35)
    one = continue_branch(system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.34, 0.36), direction="down")
    derivative = one.returns.derivative.copy()
    derivative[1] = np.nan
    unknown = replace(one, returns=replace(one.returns, derivative=derivative), events=())
    assert unknown.stable[:3].tolist() == [True, None, True]
    branches([unknown], ax, 1)
    drawn = {line.get_linestyle(): np.isfinite(np.asarray(line.get_ydata())) for line in ax.lines}
    assert drawn["-"].tolist() == [stable is True for stable in unknown.stable]
    assert np.flatnonzero(drawn[":"]).tolist() == [0, 1, 2]
    assert not drawn["--"].any()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["stable", "of unknown stability"]
    assert [text.get_text() for text in ax.texts] == ["1:1/T"]


def test_names_of_motions_lie_on_no_line_and_the_others_are_in_the_legend(pair, ax):
    """Of the cascade to period 16 the short branches have no room for a name."""
    system = pair(0.35)
    found = nsmaps.period_doubling_cascade(
        system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.26, 0.36), direction="down", n_doublings=4
    )
    branches(found, ax)
    ax.figure.canvas.draw()
    boxes = {text.get_text(): text.get_window_extent() for text in ax.texts}
    assert "1:1/T" in boxes
    for box in boxes.values():
        for line in ax.lines:
            assert not line.get_path().transformed(line.get_transform()).intersects_bbox(box, filled=False)
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    every = {str(branch.labels[-1]) for branch in found}
    assert {*boxes, *legend} == every | {"stable", "unstable", "period doubling"}
    assert not set(boxes) & set(legend)


def test_a_cycle_at_infinity_is_an_asymptote(ax):
    return_map = BorderCollision(tau_L=0.2, delta_L=0.8, tau_R=1.7, delta_R=0.9)
    branch = continue_branch(
        return_map, "delta_R", nsmaps.periodic_orbit(return_map, [5.0, -4.0]), 0.9, (0.1, 2), direction="down"
    )
    branches([branch], ax)
    dotted = [line.get_xdata() for line in ax.lines if line.get_linestyle() == ":"]
    assert pytest.approx([0.7, 0.7]) in [list(x) for x in dotted if len(x) == 2]
    assert "cycle at infinity" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_multipliers_are_those_of_the_bouncing_ball_in_closed_form():
    """Their product is e^2 and their sum 1 + e^2 - (1 + e)^2 s, where s^2 = a^2 - (pi (1 - e)/(1 + e))^2."""
    e = 0.5
    ball = nsmaps.load_system("bouncing_ball", Gamma=1.4, r=e)
    branch = continue_branch(ball, "Gamma", nsmaps.periodic_orbit(ball, [4.19, 0.45]), 1.4, (1.06, 1.7), direction="both")
    figure = branch.plot(multipliers=True)
    moduli, plane = figure.axes
    lines = [line for line in moduli.lines if len(line.get_xdata()) == len(branch.values)]
    total = 1 + e * e - (1 + e) ** 2 * np.emath.sqrt(branch.values**2 - (np.pi * (1 - e) / (1 + e)) ** 2)
    roots = np.array([total / 2 + sign * np.emath.sqrt(total**2 / 4 - e * e) for sign in (1, -1)])
    drawn = np.sort([line.get_ydata() for line in lines], axis=0)
    assert np.allclose(drawn, np.sort(np.abs(roots), axis=0), atol=1e-6)
    dots = np.concatenate([line.get_xydata() for line in plane.lines if line.get_marker() == "."])
    assert np.allclose(np.sort(dots[:, 0]), np.sort(roots.real.ravel()), atol=1e-6)
    circle = plane.lines[0].get_xydata()
    assert np.allclose(np.linalg.norm(circle, axis=1), 1.0)
    (doubling,) = branch.of_kind("period doubling")
    marks = [line.get_xydata() for line in moduli.lines if line.get_marker() == "o"]
    assert marks[0][0].tolist() == [doubling.value, pytest.approx(1.0, abs=1e-6)]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["1:0/T", "period doubling"]


def test_a_coordinate_that_is_constant_but_for_rounding_is_a_straight_line(ax):
    ball = nsmaps.load_system("bouncing_ball", Gamma=1.4, r=0.5)
    branch = continue_branch(ball, "Gamma", nsmaps.periodic_orbit(ball, [4.19, 0.45]), 1.4, (1.2, 1.5), direction="both")
    branches(branch, ax, 0)
    low, high = ax.get_ylim()
    assert 0 < np.ptp(branch.points[..., 0]) < 1e-3 * (high - low)
