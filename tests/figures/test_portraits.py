"""The motion of attractors over a period, and their Poincare sections."""

import numpy as np
import pytest
from matplotlib.image import AxesImage
from messages import message

from nsmaps import continue_branch, load_system, periodic_orbit, track
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.portraits.graze import graze, graze_of
from nsmaps.dynamics.portraits.portrait import phase_portrait
from nsmaps.errors import NsmapsError
from nsmaps.figures.attractors.poincare import poincare
from nsmaps.figures.attractors.portrait import over_time, portrait
from nsmaps.figures.domains.boxes import boxes
from nsmaps.figures.system.graze import flights, sheets
from nsmaps.study.study import CATALOGUE

NAMES = ("v", Angle("phi"))


def attractor(states, period, names=NAMES):
    return Attractor(Coordinates(names), np.asarray(states, float), period, "C" if not period else "1:0/T", ("BB",), 1e-6)


@pytest.fixture(scope="module")
def bounce():
    """The ball that bounces once a period: v = 2 pi/(1 + r) at cos phi = pi (1 - r)/(Gamma (1 + r))."""
    system = load_system("bouncing_ball", Gamma=1.4, r=0.5)
    state = [2 * np.pi / 1.5, np.arccos(np.pi / 3 / 1.4)]
    return phase_portrait(system, [attractor([state], 1)]), state


def test_a_motion_is_followed_for_one_period(bounce):
    (track,) = bounce[0].tracks
    assert track.impacts.time == pytest.approx([0, 2 * np.pi], abs=1e-12)
    assert track.time.shape == (1, 60)
    assert track.displacement[0, [0, -1]] == pytest.approx([0, 0], abs=1e-12)
    assert track.velocity[0, 0] == pytest.approx(0.5 * bounce[1][0], abs=1e-12), "r v after the impact"
    assert track.ball[0, 0] == pytest.approx(1.4 * np.sin(bounce[1][1]), abs=1e-12)


def test_a_portrait_has_the_motion_in_the_plane_and_over_time(bounce, ax):
    figure = bounce[0].plot()
    plane, time = figure.axes
    assert plane.get_title() == "1:0/T"
    assert time.get_xlim() == pytest.approx((0, 2 * np.pi))
    assert not any("start" in text.get_text() for text in figure.legends[0].get_texts())
    portrait(bounce[0], ax)
    (place, rate) = next(line.get_data() for line in ax.lines if len(line.get_xdata()) == 60)
    assert np.array_equal(place, bounce[0].tracks[0].displacement[0])
    assert np.array_equal(rate, bounce[0].tracks[0].velocity[0])


def test_a_map_without_motions_shows_its_states(ax):
    tent = load_system("border_collision_1", a_L=0.0, a_R=-1.5)
    found = phase_portrait(tent, [attractor([[1.0], [-0.5]], 2, ("x",))])
    assert found.tracks == (None,)
    over_time(found, ax)
    assert ax.lines[0].get_ydata().tolist() == [1.0, -0.5, 1.0, -0.5, 1.0]
    with pytest.raises(NsmapsError, match=message("dynamics.no-attractor-to-show")):
        phase_portrait(tent, [])


def test_many_states_are_shades_and_a_window_of_them_is_enlarged(ax):
    turned = np.linspace(0, 1, 20001)
    found = attractor(np.column_stack([turned, 0.5 + turned**2]), 0)
    poincare(found, ax)
    (image,) = [each for each in ax.get_children() if isinstance(each, AxesImage)]
    assert image.get_array().sum() == len(turned), "every state is counted once"
    (inner,) = ax.child_axes
    assert len(inner.get_xticks()) >= 2
    assert ax.get_title() == "chaos"


def test_the_coefficient_of_a_square_root_is_found():
    """Nordmark's map x -> mu - sqrt(x), x > 0: coefficient -1 at x = 0."""
    found = graze(load_system("square_root", a=0.5, mu=0.1), [-0.1], [0.2])
    assert found.words == ("L", "R")
    assert found.state == pytest.approx([0], abs=1e-15)
    assert found.coefficient == pytest.approx([-1], abs=1e-9)
    assert np.ptp(found.distance) == pytest.approx(0.2)
    smooth = found.distance < 0
    assert found.image[smooth, 0] == pytest.approx(0.1 + 0.5 * found.distance[smooth])
    assert found.image[~smooth, 0] == pytest.approx(0.1 - np.sqrt(found.distance[~smooth]))
    assert found.tracks == ()


def test_states_of_one_word_and_jumps_have_no_graze():
    with pytest.raises(NsmapsError, match=message("dynamics.same-word", word="R")):
        graze(load_system("square_root", a=0.5, mu=0.1), [0.1], [0.2])
    with pytest.raises(NsmapsError, match=message("dynamics.no-square-root")):
        graze(load_system("border_collision_1", a_L=0.4, a_R=-1.5), [-0.1], [0.2])


def test_the_motion_at_a_graze_touches_the_wall(ax):
    pair = load_system("vi_pair", d=0.35, r=0.5, g_bar=0.2113)
    found = graze(pair, [0.512, 0.4], {"v": 0.514, "phi": 0.4})
    assert found.words == ("BB", "BTB")
    gap = track(pair, found.state, 2, n_samples=4001).displacement - found.tracks[1].at[1]
    assert 0 <= gap.min() < 1e-6
    small = pair.first_return(np.array([found.state + 1e-10 * found.direction])).lifted[0]
    assert (small - found.value) / 1e-5 == pytest.approx(found.coefficient, rel=1e-3)
    flights(found, ax)
    assert [line.get_xdata()[-1] for line in ax.lines[:3]] == [each.time.max() for each in found.tracks]
    figure = found.plot()
    assert r"$v^* +18.59\sqrt{s}$" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_boxes_of_a_domain_stand_in_the_plane_with_orbits(result, ax):
    domain, orbits = result.domain, [pair.exact for pair in result.orbits]
    boxes(domain, ax, orbits=orbits)
    drawn = [patch for patch in ax.patches if patch.get_label() == "_"][: len(domain.boxes)]
    corners = [[patch.get_xy(), np.add(patch.get_xy(), [patch.get_width(), patch.get_height()])] for patch in drawn]
    assert np.allclose(np.swapaxes(corners, 1, 2), domain.boxes)
    dots = [line.get_xydata() for line in ax.lines if line.get_marker() == "."]
    assert np.array_equal(dots[0], orbits[0].states)
    assert "start box" in ax.get_legend().get_texts()[0].get_text()


def test_a_study_at_a_glance_has_its_pictures_and_one_legend(result):
    (sheet,) = CATALOGUE["summary"].sheets(result)
    figure = sheet.figure(50)
    assert len(figure.axes) == 4, "sketch, diagram, portrait, basins"
    assert all(ax.get_legend() is None for ax in figure.axes)
    diagram = figure.axes[1]
    assert (diagram.get_xlabel(), diagram.xaxis.label.get_visible()) == ("$d$", True)
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(named) == len(set(named)) > 0
    assert {text.get_text() for text in diagram.texts if text.get_text().isdigit()} <= {
        marker.strip("$") for handle in figure.legends[0].legend_handles if (marker := str(getattr(handle, "get_marker", str)()))
    }


def test_a_graze_is_found_beside_a_periodic_orbit():
    """Nordmark's map has the fixed point mu/(1 - a) for mu < 0, which grazes at mu = 0."""
    system = load_system("square_root", a=0.5, mu=-0.1)
    (event,) = continue_branch(system, "mu", periodic_orbit(system, [-0.2]), -0.1, (-0.2, 0.2)).events
    assert event.value == pytest.approx(0, abs=1e-9)
    found = graze_of(system, event)
    assert found.coefficient == pytest.approx([-1], abs=1e-6)
    assert sheets([event], system)[0].name == "graze"
