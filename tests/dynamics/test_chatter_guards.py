"""Complete chatter of systems with modes as one event, at the impacts of their section."""

import numpy as np
import pytest
from chattering import Held, slopes_to_rest, sums_to_rest
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_buck_converter import BuckConverter
from systems import BallInModes

import nsmaps
from nsmaps import Outcome, continue_branch
from nsmaps.dynamics import CompleteChatter, chatter_cascade
from nsmaps.errors import NsmapsError

VALUES = {"Gamma": 1.3, "r": 0.5}


BALL, PAIR = CompleteChatter(BallInModes(**VALUES)), CompleteChatter(Held(b=0.05, w=0.3, f=1.5, d=0, r=0.4, k2=2.0))


def test_the_map_is_that_of_the_impact_system():
    states = np.column_stack([np.linspace(0.05, 3, 30), np.linspace(0, 6.2, 30)])
    expected, found = (CompleteChatter(one) for one in (BouncingBall(**VALUES), BallInModes(**VALUES)))
    here, there = expected.first_return(states, derivative=True), found.first_return(states * [-1, 1], derivative=True)
    assert (np.char.find(here.words, "B~B") == 0).sum() > 5
    assert here.words.tolist() == there.words.tolist()
    assert there.image * [-1, 1] == pytest.approx(here.image, abs=1e-12)
    assert there.time == pytest.approx(here.time, abs=1e-12)
    assert (there.turns == here.turns).all()
    signs = np.array([[1, -1], [-1, 1]])
    assert there.derivative * signs == pytest.approx(here.derivative, abs=1e-10)
    by = [formulas.sensitivity(given, {"Gamma": 1.0}) for formulas, given in ((expected, states), (found, states * [-1, 1]))]
    assert by[1] * [-1, 1] == pytest.approx(by[0], abs=1e-9)
    chatters = np.char.find(here.words, "~") > 0
    assert found.rests(states * [-1, 1])[chatters] == pytest.approx(expected.rests(states)[chatters], abs=1e-4)
    assert np.isnan(found.rests(states * [-1, 1])[~chatters]).all()


def test_other_bodies_move_on_and_their_derivatives_are_carried():
    """Against single returns to the default's speed, and differences of these."""
    start = np.array([[0.5, 0.6, 0.1, 0.5], [0.2, 0.3, -0.2, 0.9]])
    found, system = PAIR.first_return(start, derivative=True), PAIR.system
    assert found.words.tolist() == ["I~I"] * 2

    def image(state, system=system):
        run = system.orbits(state[None], 60)
        return run.image[int(np.argmax(run.outcome == Outcome.stuck)) + 1]

    by = PAIR.sensitivity(start, {"f": 1.0, "r": 0.5})
    for k, state in enumerate(start):
        assert found.image[k] == pytest.approx(image(state), abs=1e-13)
        slopes = [(image(state + h) - image(state - h)) / 2e-6 for h in 1e-6 * np.eye(4)]
        assert found.derivative[k] == pytest.approx(np.array(slopes).T, abs=1e-7)
        ends = [image(state, system.at(f=1.5 + h, r=0.4 + h / 2)) for h in (1e-6, -1e-6)]
        assert by[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)
    assert np.abs(found.derivative[:, :, 1:3]).max() > 0.1


def test_the_rest_shrinks_towards_its_end_as_that_of_the_impact_system():
    at = {"Gamma": 1.5973, "r": 0.5}
    rests = [
        formulas.rests(nsmaps.periodic_orbit(formulas, [sign, 2.0]).states)[0]
        for formulas, sign in ((CompleteChatter(BouncingBall(**at)), 1), (CompleteChatter(BallInModes(**at)), -1))
    ]
    assert rests[1] == pytest.approx(rests[0], abs=2e-7)
    assert 0.01 < rests[1] < 0.02


@pytest.mark.thorough
def test_a_branch_ends_where_that_of_the_impact_system_ends():
    cycle = nsmaps.periodic_orbit(BALL, [-1.0, 2.0])
    branch = continue_branch(lambda gamma: BALL.at(Gamma=gamma), "Gamma", cycle, 1.3, (1.0, 2.0))
    (end,) = branch.events
    assert (cycle.words, end.kind) == (("B~B",), "end of complete chatter")
    assert end.value == pytest.approx(1.59734883, abs=2e-8)
    (first,) = chatter_cascade(BALL, "Gamma", end, (1, end.value + 2e-6), 1)
    assert (first.impacts, first.near.ended, first.far.ended) == (19, "grazing", "period doubling")
    assert first.near.events[-1].value == pytest.approx(1.5973498688241232, abs=1e-13)  # of the impact system


@pytest.mark.parametrize(("name", "by"), [("Gamma", (1, 0)), ("r", (0, 1))])
def test_means_and_their_derivatives_are_those_of_the_summed_impacts(name, by):
    chosen = [
        {"name": "loss", "formula": "(v**2 - v_after**2)/2", "at": "B"},
        {"name": "wave", "formula": "-v*cos(phi)", "at": "B"},
        {"name": "gap", "formula": "x + Gamma*sin(phi)**2", "of": "flights"},
    ]
    cycle, held = nsmaps.periodic_orbit(BALL, [-1.0, 2.0]), np.array([0, 0, np.pi])
    found = nsmaps.observe(BALL, cycle, chosen, rates={name: 1.0})
    value, slope = sums_to_rest(1.3, 0.5).astype(float), slopes_to_rest(1.3, 0.5, by)
    assert found.per_period.value == pytest.approx(value + 1.3 * held, rel=1e-11)
    assert found.per_period.derivative == pytest.approx(slope + by[0] * held, rel=1e-10)


def test_a_section_without_contact_is_refused():
    with pytest.raises(NsmapsError, match=message("dynamics.no-rests", system="BuckConverter")):
        CompleteChatter(BuckConverter(E=12.0))
