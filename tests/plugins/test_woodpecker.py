"""The woodpecker toy: numbers of 40 digits by others, published ones, and returns by an integrator."""

import numpy as np
import pytest
from nsmaps_woodpecker import Woodpecker

import nsmaps
from nsmaps import Outcome

CYCLE = [0.08940385274225082, -0.1355017900933991, -2.157455769263201, 16.91117736822086]  # and below: in 40 digits, by others


def test_the_cycle_of_the_toy_and_its_doubling():
    toy = Woodpecker()
    orbit = nsmaps.periodic_orbit(toy, CYCLE)
    assert orbit.states[0] == pytest.approx(CYCLE, rel=1e-14)
    assert orbit.returns.time == pytest.approx([0.1459760651437518], rel=1e-14)
    assert orbit.multipliers[0] == pytest.approx(-0.839155653047590, abs=1e-12)
    other = toy.at(c=0.005879338637143966)  # where it doubles
    assert nsmaps.periodic_orbit(other, CYCLE).multipliers[0] == pytest.approx(-1, abs=1e-11)


def test_the_cycle_passes_the_published_state():
    """The state on it from which Glocker's simulations start, phi_S = -0.2788, v = -0.3411 m/s, omega_S = -7.4583 rad/s."""
    motion = nsmaps.track(Woodpecker(), CYCLE, 12, n_samples=200)
    slides = motion.states[motion.modes == "2 d"][0]
    v, s = (np.interp(0.2788, -slides[:, 1], slides[:, column]) for column in (2, 4))
    assert (v, s) == pytest.approx((-0.3411, -7.4583), rel=6e-3)
    assert np.allclose(slides[:, 0], -0.6 / 5.8, atol=1e-15)  # on the lower edge; there, -0.1036


ROWS = np.array([[0.09, -0.14, -2.0, 17.0], [0.08, -0.12, -2.4, 18.0], [0.095, -0.15, -1.9, 15.5], [0.1, -0.13, -2.3, 19.0]])
IMAGES = [  #: and times, of DOP853 between events and the law of impacts by cases, written apart from this class
    [0.089189958089, -0.134565522053, -2.187560814227, 16.934709364936, 0.14579532466505668],
    [0.10341665219, -0.188824091551, 1.700853605664, 16.285638612416, 0.14117274613870437],
    [0.086966124252, -0.112697776614, -2.688039824893, 17.681978277465, 0.1532118142683569],
    [0.101031466452, -0.19593676046, 2.307149609217, 16.010083861517, 0.13796402668407806],
]


def test_returns_through_impacts_that_slip_stop_or_turn_are_those_of_an_integrator():
    returns = Woodpecker().first_return(ROWS)
    assert np.column_stack([returns.image, returns.time]) == pytest.approx(np.array(IMAGES), rel=1e-9)


def test_no_return_is_undecided():
    rows = np.array(CYCLE) * (1 + np.random.default_rng(1).uniform(-0.15, 0.15, (400, 4)))
    rows[:, 0] = np.minimum(rows[:, 0], 0.1034)
    assert Woodpecker().first_return(rows).outcome.tolist() == [Outcome.returned] * 400
