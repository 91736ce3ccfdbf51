"""The pictures of the motion of a system with modes: all states over time, a plane of two, and its events."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import nsmaps
from nsmaps.exact.trajectory import track as track_of
from nsmaps.figures.style import GREEN, RED, SKY
from nsmaps.figures.system.flights import at_events
from nsmaps.figures.system.impacts import impacts
from nsmaps.figures.system.motion import motion, phase_plane, sheets
from nsmaps.study.store.archive import read_result

STUDY = """
title: "Slip and stick"
system: belt
parameters: {zeta: 0.02, vb: 0.3, mu_k: 0.4, mu_s: 0.6, w: 0.9, A: 0.25}
orbits:
  - {start: {x: 0.838, phi: 0}, n_returns: 20, track: 8}
  - {start: {x: 0.838, phi: 0}, n_returns: 20}
figures: [motion, impacts]
"""


@pytest.fixture(scope="module")
def slip(tmp_path_factory):
    """The result of the study as read back from its folder."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "slip.yaml").write_text(STUDY)
    nsmaps.run_study(str(folder / "slip.yaml"), folder / "out")
    return read_result(folder / "out")


def test_a_run_keeps_it(slip):
    track, again = slip.orbits[0].track, track_of(slip.system, [0.838, 0.0], 8)
    assert np.array_equal(track.states, again.states)
    assert track.modes.tolist() == again.modes.tolist() == ["slower", "stick"] * 3 + ["slower"]
    assert slip.orbits[1].track is None


def test_all_states_over_time_and_a_plane(slip):
    (sheet,) = sheets(slip.orbits[0].track)
    assert len(sheet.panels) == 3
    drawn = sheet.figure()
    assert [axes.get_ylabel()[:3] for axes in drawn.axes] == ["$x$", "$u$", "$u$"]


@pytest.mark.parametrize("k", [0, 1])
def test_a_state_over_time_has_a_curve_a_flight_in_the_colour_of_its_mode(slip, ax, k):
    motion(slip.orbits[0].track, ax, state=k)
    track = slip.orbits[0].track
    curves = [line for line in ax.lines if len(line.get_xdata()) == track.time.shape[1]]
    assert [to_rgba(line.get_color()) for line in curves] == [to_rgba(RED if mode == "slower" else SKY) for mode in track.modes]
    for line, time, states in zip(curves, track.time, track.states, strict=True):
        assert np.array_equal(line.get_xydata(), np.column_stack([time, states[:, k]]))
    (stars,) = [line for line in ax.lines if line.get_marker() == "*" and to_rgba(line.get_color()) == to_rgba(GREEN)]
    assert np.array_equal(stars.get_xdata(), track.events.time[track.events.letter == "M"])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["slower", "stick", "event M", "event K from below"]
    assert ax.get_ylabel() == f"${'xu'[k]}$"


def test_the_plane_and_the_events(slip, ax):
    track = slip.orbits[0].track
    phase_plane(track, ax)
    curves = [line.get_xydata() for line in ax.lines if len(line.get_xdata()) == track.time.shape[1]]
    assert np.array_equal(np.array(curves), track.states)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$", "$u$")
    ax.clear()
    impacts(track, ax)
    (way,) = [line for line in ax.lines if len(line.get_xdata()) == 8]
    assert np.array_equal(way.get_xydata(), np.column_stack([track.events.before[:, 0], track.events.phase]))
    assert ax.get_ylabel() == r"$\phi$ (rad)"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["event M", "event K from below", "start"]


def test_events_without_a_phase_are_shown_by_two_states(ax):
    converter = nsmaps.load_system("buck_converter", E=22.0)
    track = track_of(converter, [12.0, 0.55], 6)
    at_events(track, ax)
    (way,) = [line for line in ax.lines if len(line.get_xdata()) == 6]
    assert np.array_equal(way.get_xydata(), track.events.before[:, :2])


@pytest.mark.parametrize(("n_events", "places"), [(8, {0.3}), (2, set())])
def test_a_grey_line_is_where_one_state_alone_is_the_same_at_events(slip, ax, n_events, places):
    """The mass sticks and slips at the belt's speed, wherever it is; of two events no place is known."""
    phase_plane(track_of(slip.system, [0.838, 0.0], n_events), ax)
    assert {round(float(line.get_ydata()[0]), 12) for line in ax.lines if line.get_label() == "places of events"} == places
    assert ("places of events" in [text.get_text() for text in ax.get_legend().get_texts()]) == bool(places)
