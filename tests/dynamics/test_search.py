"""Periodic orbits from many starts against the cycles of a map that has them all in closed form, and those known of the pair."""

from math import pi

import numpy as np
import pytest
from systems import BouncingBall

import nsmaps
from nsmaps.dynamics.search import periodic_orbits


def grid(low, high, n):
    return np.stack(np.meshgrid(*(np.linspace(a, b, n) for a, b in zip(low, high, strict=True))), -1).reshape(-1, 2)


def test_fixed_points_of_the_pair(pair):
    found = periodic_orbits(pair(0.35), grid([0.2, 0.1], [1.0, 6.0], 9))
    known = [[0.281770025375305, 2.91844362963194], [0.343255510718990, 2.87685171619735], [0.833385990208561, 0.363611564551622]]
    assert np.allclose(sorted(orbit.states[0].tolist() for orbit in found), known, atol=1e-12)
    saddles = periodic_orbits(pair(0.35), grid([0.2, 2.7], [0.4, 3.0], 4), words=["BTB"])
    assert np.allclose([orbit.states[0] for orbit in saddles], known[1:2], atol=1e-12)


def test_cycles_are_found_once_without_divisors(pair):
    system = pair(0.30)
    found = periodic_orbits(system, grid([0.7, 0.1], [0.85, 0.6], 5), period=2, words=["BTB", "BTB"])
    (cycle,) = (orbit for orbit in found if orbit.stable)  # from starts next to each of its states
    for orbit in found:
        path = nsmaps.orbit(system, orbit.states[0], 2).states
        assert np.allclose(path[2], path[0], atol=1e-12)
        assert not np.allclose(path[1], path[0], atol=1e-3)  # not the fixed point between them
    assert np.allclose(sorted(cycle.states.tolist()), [[0.730550, 0.222750], [0.810226, 0.412905]], atol=5e-7)


@pytest.mark.parametrize("words", [["BB", "BTB"], ["BTB", "BB"]])
def test_words_count_from_any_state_on(pair, words):
    (found,) = periodic_orbits(pair(0.21, r=0.25, beta=pi / 6), [[0.62, 0.34], [0.1, 1.49]], 2, words=words)
    assert found.word in ("BBTB", "BTBB")


class Counted(BouncingBall):
    """A ball whose returns are counted."""

    def first_return(self, states, *args, **options):
        COUNT[0] += len(states)
        return super().first_return(states, *args, **options)


COUNT = [0]


def test_a_search_ends_where_impacts_follow_one_another_at_once():
    """It halves the speed with each return: from 1e-6 to the least speed that is resolved it would take 20 steps and more."""
    COUNT[0], starts = 0, grid([0.1, 0.0], [5.0, 6.0], 6)
    assert periodic_orbits(Counted(a=0.9, r=0.5), starts) == ()
    assert COUNT[0] < 55 * len(starts)


def test_a_ball_at_rest_is_no_orbit():
    """Below Gamma = pi (1 - e)/(1 + e) the table never throws the ball once a period; above it does so at two phases."""
    assert periodic_orbits(BouncingBall(a=0.9, r=0.5), grid([0.0, 0.0], [5.0, 6.0], 6)) == ()
    assert len(periodic_orbits(BouncingBall(a=1.2, r=0.5), grid([3.5, 0.0], [5.0, 6.0], 6))) == 2
