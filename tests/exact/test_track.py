"""The exact motion between impacts against the paper's formulas written out here, and where the map jumps along a slice."""

import numpy as np
import pytest
from messages import message
from systems import BouncingBall

from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.surfaces.slice import slice_along
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.exact.trajectory import track


def test_flights_are_those_of_the_papers_formula(pair):
    """Eqs. relvar and eq_impact: Z'' = cos(pi t) + g, Z' -> -r Z' at impacts, from the state of fig. model:abc."""
    system = pair(0.35)
    made = track(system, [0.43, 0.26], 16, n_samples=21)
    t0 = 0.26 / np.pi
    for k in range(15):
        t, t_hit = t0 + made.time[k], t0 + made.time[k, 0]
        z, w = made.at[made.impacts.wall[k]], -0.5 * made.rates[k]
        s = t - t_hit
        rate = w + system.g_bar * s + (np.sin(np.pi * t) - np.sin(np.pi * t_hit)) / np.pi
        place = z + (w - np.sin(np.pi * t_hit) / np.pi) * s + system.g_bar * s**2 / 2
        place -= (np.cos(np.pi * t) - np.cos(np.pi * t_hit)) / np.pi**2
        assert made.displacement[k] == pytest.approx(place, abs=1e-13)
        assert made.velocity[k] == pytest.approx(rate, abs=1e-13)
        assert made.displacement[k, -1] == pytest.approx(made.at[made.impacts.wall[k + 1]], abs=1e-13)
        assert made.velocity[k, -1] == pytest.approx(made.rates[k + 1], abs=1e-13)
    assert np.abs(made.displacement).max() <= 0.175 + 1e-13
    assert set(np.sign(made.rates[made.impacts.wall == 0])) == {1}
    assert set(np.sign(made.rates[made.impacts.wall == 1])) == {-1}


def test_at_rest_the_ball_falls_and_the_capsule_is_shaken(pair):
    """Eqs. cyl_dim and ball_dim, scaled: x'' = -g between impacts, X = -cos(pi t)/pi^2, membranes at X +- d/2."""
    system = pair(0.35)
    made = track(system, [0.43, 0.26], 8, n_samples=41)
    steps = np.diff(made.time, axis=1)[:, :1]
    assert np.diff(made.ball, 2, axis=1) / steps**2 == pytest.approx(np.full((7, 39), -system.g_bar), abs=1e-9)
    middle = -np.cos(np.pi * made.time + 0.26) / np.pi**2
    assert made.walls == pytest.approx(np.array([middle - 0.175, middle + 0.175]), abs=1e-14)
    ends = made.walls[made.impacts.wall[1:], np.arange(7), -1]
    assert made.ball[:, -1] == pytest.approx(ends, abs=1e-13)
    assert made.moving


def test_a_ball_that_rests_stays_on_its_wall():
    """At a = 1.2 the table throws the ball again at phase arcsin(1/1.2)."""
    system = BouncingBall(a=1.2)
    made = track(system, [0.05, 5.0], 40, n_samples=9)
    rests = np.flatnonzero(made.impacts.mark[1:] != "")
    assert len(rests)
    assert (made.displacement[rests] == 0).all()
    assert (made.velocity[rests] == 0).all()
    assert np.arcsin(1 / 1.2) == pytest.approx(made.impacts.phase[rests[0] + 1], abs=1e-9)
    assert not made.moving
    assert np.array_equal(made.ball, made.displacement)


def test_tracks_that_cannot_be(pair):
    for n, samples in ((1, 9), (5, 1)):
        with pytest.raises(StateError, match=message("exact.samples")):
            track(pair(0.35), [0.43, 0.26], n, samples)


def test_a_slice_jumps_where_a_finer_one_does(pair):
    """Fig. 2d-1phi: images jump where a graze of B comes first, and not, though as steep as a root, where one of T does."""
    system, at = pair(0.35), {"phi": 0.4}
    made = slice_along(system, "v", Axis(low=0.0005, high=1.0, points=400), at)
    x, words = made.returns.start[:, 0], made.returns.words
    assert (np.diff(x) > 0).all()
    assert np.isin(np.linspace(0.0005, 1.0, 400), x).all()
    (k,) = np.flatnonzero(made.jump)
    (change,) = np.flatnonzero(words[1:] != words[:-1])
    assert (words[k], words[k + 1]) == ("BB", "BB")
    assert change > k
    for low, high, jumps in ((x[k], x[k + 1], True), (x[change], x[change + 1], False)):
        fine = system.first_return(np.column_stack([np.linspace(low - 1e-9, high + 1e-9, 20_001), np.full(20_001, 0.4)]))
        assert high - low < 1e-14
        assert (np.abs(np.diff(fine.image, axis=0)).max() > 0.1) == jumps
    assert made.returns.image[k, 0] < 1e-5  # it just touches B there


def test_a_slice_is_cut_where_its_phase_is_wrapped(pair):
    made = slice_along(pair(0.35), "v", Axis(low=0.3, high=0.9, points=200), {"phi": 2.2})
    wrapped = np.flatnonzero(np.abs(np.diff(made.returns.image[:, 1])) > 6)
    assert len(wrapped)
    assert made.jump[wrapped].all()
    assert np.abs(np.diff(made.returns.lifted[:, 1]))[wrapped].max() < 1e-6


def test_slices_that_cannot_be(pair):
    axis = Axis(low=0.1, high=1.0, points=3)
    for along, at in (("v", {}), ("v", {"v": 1.0, "phi": 0.0}), ("w", {"phi": 0.0})):
        with pytest.raises(NsmapsError, match=message("exact.slice", names="v, phi")):
            slice_along(pair(0.35), along, axis, at)
