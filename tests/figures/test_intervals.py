"""Pictures of results over intervals of a parameter, of searches, of curves and of times."""

from types import SimpleNamespace

import numpy as np
import pytest
from messages import message

from nsmaps import load_system, staircase
from nsmaps.dynamics.attractors.coexistence import Coexistence
from nsmaps.dynamics.curves.curve import BifurcationCurve
from nsmaps.errors import NsmapsError
from nsmaps.figures.longrun.optimum import optimum
from nsmaps.reduced.validation.speed import Speed


def test_attractors_that_coexist_have_a_row_each(ax):
    numbers, names = np.array([[0, 0], [0, 1], [0, 1], [-1, 1]]), np.array([["a", "a"], ["a", "b"], ["a", "b"], ["", "c"]])
    found = Coexistence(np.arange(4.0), numbers, names, "d")
    found.plot(ax)
    drawn = [(*line.get_xdata(), line.get_ydata()[0]) for line in ax.lines]
    assert drawn == [(0, 2, 1), (1, 2, 2), (3, 3, 2)]
    assert [text.get_text() for text in ax.texts] == ["a", "b"]
    assert ax.get_xlabel() == "$d$"


def test_steps_of_a_staircase_stand_at_their_rotation_numbers(ax):
    """Of x -> x/2 + mu, less one for x >= 0: 1/2 where the two-cycle has both signs, mu in (1/3, 2/3)."""
    found = staircase(
        load_system("border_collision_1", a_L=0.5, a_R=0.5, jump=-1.0, mu=0.5), "mu", (0.2, 0.8), [0.1], max_period=2
    )
    found.plot(ax)
    (half,) = [line for line in ax.lines if line.get_ydata()[0] == 0.5]
    assert half.get_xdata() == pytest.approx([1 / 3, 2 / 3], abs=1e-9)
    assert "1/2" in [text.get_text() for text in ax.texts]


@pytest.mark.parametrize(("names", "places"), [(("d", "r"), [(2, 4), (3, 5)]), (("d",), [(2, 7), (3, 8)])])
def test_a_search_has_its_ends_and_the_optimum(ax, names, places):
    ends = [dict(zip(("d", "r"), end, strict=True)) for end in ((2, 4), (3, 5))]
    attempts = [SimpleNamespace(start={"d": 0, "r": 1}, end=end, value=7 + k, optimal=bool(k)) for k, end in enumerate(ends)]
    best = SimpleNamespace(name="energy")
    found = SimpleNamespace(parameters={name: ends[1][name] for name in names}, value=8.0, attempts=attempts, observable=best)
    optimum(found, ax)
    by_name = {line.get_label(): line.get_xydata().tolist() for line in ax.lines}
    assert by_name["local optimum"] == [list(places[1])]
    assert by_name["end of a search elsewhere"] == [list(places[0])]
    assert by_name["optimum, energy = 8"] == [list(places[1])]


def test_a_curve_stands_in_the_plane_of_its_parameters(ax):
    places = np.array([[0.1, 0.2], [0.2, 0.25], [0.3, 0.2]])
    found = BifurcationCurve(
        "fold", places, np.zeros((3, 1, 2)), ("BB",), np.ones((3, 2), complex), (), ("", ""), names=("d", "r")
    )
    found.plot(ax)
    assert np.array_equal(ax.lines[-1].get_xydata(), places)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$d$", "$r$")
    with pytest.raises(NsmapsError, match=message("figures.curve-without-orbits", why="lost")):
        BifurcationCurve.empty("fold", "lost").plot()


def test_times_of_two_maps_are_bars(ax):
    Speed(exact=100.0, composite=20.0).plot(ax)
    assert [bar.get_width() for bar in ax.patches] == [100, 20]
    assert [text.get_text() for text in ax.texts] == ["100 ns", "20 ns"]


def test_an_auxiliary_orbit_draws_itself_without_pieces(result, ax):
    result.auxiliary_map.plot(ax)
    region = result.auxiliary_map.regions[0].envelopes[0]
    assert np.array_equal(ax.lines[0].get_ydata(), region.upper)
