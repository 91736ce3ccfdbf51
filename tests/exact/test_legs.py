"""Turning points, clearance and the certificate of first returns, on both sides of grazes and on them."""

import numpy as np
import pytest

from nsmaps.errors import StateError
from nsmaps.exact.impacts import Outcome


def grazes(reference):
    """Impact speeds on the grazing curves, from the hard references on either side of them."""
    rows = [row for row in reference("hard_returns") if row["kind"] == "graze" and abs(row["eps"]) == 1e-11]
    return [(row["d"], row["v"] - row["eps"], row["phi"]) for row in rows]


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_turns_are_those_of_the_sampled_flight(pair, d):
    """Against 4000 samples of each flight: as many sign changes of the velocity as turns."""
    system = pair(d)
    rng = np.random.default_rng(8)
    states = np.column_stack([rng.uniform(0.01, 1, 120), rng.uniform(0, np.pi, 120)])
    legs, words = system.legs(states), system.first_return(states).words
    for state, turns, itinerary, word in zip(states, legs.turns, legs.itineraries, words, strict=True):
        assert itinerary.replace("^", "").replace("v", "") == word
        assert turns == itinerary.count("^") + itinerary.count("v")
        _, place = system.trajectory(state, len(word), samples=4000)
        slopes = np.sign(np.diff(place.reshape(-1, 4000), axis=1))
        assert turns == int((slopes[:, 1:] * slopes[:, :-1] < 0).sum())


def test_clearance_falls_to_zero_towards_a_graze(pair, reference):
    """From the side on which the wall is missed the clearance shrinks with the distance; on the other the impact is slow."""
    for d, v, phi in grazes(reference):
        system = pair(d)
        for eps in (1e-4, 1e-6, 1e-8):
            legs = system.legs([[v - eps, phi], [v + eps, phi]])
            near = min(legs.clearance)
            assert near < 10 * eps
            assert min(legs.slowest) < 10 * np.sqrt(eps) or near < 10 * eps


def test_on_a_graze_the_answer_is_one_of_two_and_doubt_is_told(pair, reference):
    """The 400 floats nearest to each graze: never lost, and undecided at most within 1e-12 of it."""
    for d, v, phi in grazes(reference):
        system = pair(d)
        near = system.first_return([[v + k * np.spacing(v), phi] for k in range(-200, 200)])
        assert np.isin(near.outcome, (Outcome.returned, Outcome.undecided)).all()
        assert set(near.words) <= {"BB", "BTB"}
        assert not near.certified.all()
        apart = system.first_return([[v + side * x, phi] for side in (-1, 1) for x in np.geomspace(2e-12, 1e-8, 50)])
        assert apart.certified.all()
        below, above = np.split(apart.words, 2)
        assert len(set(below)) == len(set(above)) == 1


def test_certified_is_all_of_a_random_batch(pair):
    rng = np.random.default_rng(9)
    states = np.column_stack([rng.uniform(0, 1.5, 100_000), rng.uniform(0, 2 * np.pi, 100_000)])
    returns = pair(0.35).first_return(states)
    assert returns.certified.all()
    assert len(returns.select(~returns.certified)) == 0


def test_edge_inputs(pair):
    legs = pair(0.35).legs([[np.nan, 0], [-1, 0], [0.0, 1.0], [0.0, 1.8]])
    assert legs.outcome.tolist() == [Outcome.invalid, Outcome.invalid, Outcome.stuck, Outcome.returned]
    assert legs.itineraries[2] == "B_"
    with pytest.raises(StateError):
        pair(0.35).legs([[0.1, 0.1]], chatter=-1)
