"""Turning points, clearance and the certificate of first returns, on both sides of grazes and on them."""

import numpy as np
import pytest

from nsmaps.errors import StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.exact.surfaces.sweep import surfaces_among


def grazes(reference):
    """Impact speeds on the grazing curves, from the hard references on either side of them."""
    rows = [row for row in reference("hard_returns") if row["kind"] == "graze" and abs(row["eps"]) == 1e-11]
    assert rows
    return [(row["d"], row["v"] - row["eps"], row["phi"]) for row in rows]


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_turns_are_those_of_the_sampled_flight(pair, d):
    """Against 4000 samples of each flight: as many sign changes of the velocity as turns."""
    system = pair(d)
    rng = np.random.default_rng(8)
    states = np.column_stack([rng.uniform(0.01, 1, 120), rng.uniform(0, np.pi, 120)])
    itineraries, words = system.itineraries(states), system.first_return(states).words
    for state, turns, itinerary, word in zip(states, itineraries.turns, itineraries.words, words, strict=True):
        assert itinerary.replace("^", "").replace("v", "") == word
        assert turns == itinerary.count("^") + itinerary.count("v")
        _, place = system.trajectory(state, len(word), n_samples=4000)
        slopes = np.sign(np.diff(place.reshape(-1, 4000), axis=1))
        assert turns == int((slopes[:, 1:] * slopes[:, :-1] < 0).sum())


def test_clearance_falls_to_zero_towards_a_graze(pair, reference):
    """From the side on which the wall is missed the clearance shrinks with the distance; on the other the impact is slow."""
    for d, v, phi in grazes(reference):
        system = pair(d)
        for eps in (1e-4, 1e-6, 1e-8):
            itineraries = system.itineraries([[v - eps, phi], [v + eps, phi]])
            near = min(itineraries.clearance)
            assert near < 10 * eps
            assert min(itineraries.slowest) < 10 * np.sqrt(eps) or near < 10 * eps


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
    itineraries = pair(0.35).itineraries([[np.nan, 0], [-1, 0], [0.0, 1.0], [0.0, 1.8]])
    assert itineraries.outcome.tolist() == [Outcome.invalid, Outcome.invalid, Outcome.stuck, Outcome.returned]
    assert itineraries.words[2] == "B_"
    with pytest.raises(StateError):
        pair(0.35).itineraries([[0.1, 0.1]], chatter=-1)


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_margin_is_that_of_the_sampled_flight(pair, d):
    """Against 4000 samples of each flight: the least gap where its slope changes sign, and the least speed of its impacts."""
    system = pair(d)
    rng = np.random.default_rng(10)
    states = np.column_stack([rng.uniform(0.05, 1, 60), rng.uniform(0, 2 * np.pi, 60)])
    returns = system.first_return(states, margin=True)
    for state, clearance, slowest, word in zip(
        states, returns.margin.clearance, returns.margin.slowest, returns.words, strict=True
    ):
        _, place = system.trajectory(state, len(word), n_samples=4000)
        slopes = np.sign(np.diff(place.reshape(-1, 4000), axis=1))
        flight, k = np.nonzero(slopes[:, 1:] * slopes[:, :-1] < 0)
        gaps = d / 2 - slopes[flight, k] * place.reshape(-1, 4000)[flight, k + 1]
        assert clearance == pytest.approx(gaps.min(initial=np.inf), abs=1e-5)
        assert slowest == system.impacts(state, len(word)).speed[1:].min()


def test_margin_only_where_it_is_asked_for_and_kept_by_what_selects(pair):
    system = pair(0.3)
    grid = Grid(axes={"v": Axis(low=0.1, high=1, points=30), "phi": Axis(low=0, high=3, points=20)})
    whole = system.first_return(grid.states(), margin=True)
    plain = system.first_return(grid.states())
    assert plain.margin is None
    assert plain.select([0]).margin is None
    assert np.array_equal(plain.image, whole.image)
    assert (whole.margin.slowest <= whole.image[:, 0]).all()
    some = whole.select(whole.has_word("BB"))
    itineraries = system.itineraries(some.start)
    assert np.array_equal(some.margin.clearance, itineraries.clearance)
    assert np.array_equal(some.margin.slowest, itineraries.slowest)
    parts = [system.first_return(grid.states(k, k + 250), margin=True) for k in range(0, grid.size, 250)]
    assert [len(part) for part in parts] == [250, 250, 100]
    assert np.array_equal(np.concatenate([part.margin.clearance for part in parts]), whole.margin.clearance)
    surface = surfaces_among(system, whole, grid, [WordFamily(name="BB", words=("BB",))])["BB"]
    assert np.array_equal(surface.returns.margin.slowest, some.margin.slowest)


def test_margin_where_there_is_no_flight(pair):
    margin = pair(0.35).first_return([[np.nan, 0], [0.0, 1.0]], margin=True).margin
    assert np.isnan([margin.clearance[0], margin.slowest[0]]).all()
    assert (margin.clearance[1], margin.slowest[1]) == (np.inf, np.inf)
