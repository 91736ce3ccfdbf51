"""Iterates of a return map against single returns, and families of their words."""

from math import pi

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.dynamics.iterated import IteratedMap
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.family import WordFamily


def starts(n):
    return np.random.default_rng(n).uniform([0, 0], [3, 2 * pi], (n, 2))


@pytest.mark.parametrize("times", [1, 2, 3])
def test_iterates_are_single_returns(pair, times):
    system, states = pair(0.35), starts(400)
    made = IteratedMap(system, times).first_return(states, derivative=True)
    slopes, turns, now = np.broadcast_to(np.eye(2), (400, 2, 2)), 0, states
    words = np.full(400, "B", object)
    for _ in range(times):
        one = system.first_return(now, derivative=True)
        slopes, turns, now = one.derivative @ slopes, turns + one.turns, one.image
        words = words + np.array([word[1:] for word in one.words], object)
    assert np.array_equal(made.image, now)
    assert np.array_equal(made.turns, turns)
    assert np.allclose(made.derivative, slopes, rtol=1e-12)
    assert made.words.tolist() == words.tolist()


def test_families_of_longer_words(pair):
    """Over the starts of pairs of returns, each family takes just the starts whose two words make its word."""
    system, states = pair(0.21, r=0.25, beta=pi / 6), starts(3000)
    first = system.first_return(states)
    second = system.first_return(first.image).words
    made = IteratedMap(system, 2).first_return(states)
    for word, pairs in {"BBTB": ("BB", "BTB"), "BTBB": ("BTB", "BB"), "BBB": ("BB", "BB"), "BTTBTB": ("BTTB", "BTB")}.items():
        inside = (first.words == pairs[0]) & (second == pairs[1])
        assert inside.any()
        assert np.array_equal(WordFamily(name=word, words=(word,)).contains(made), inside)
    wanted = np.array([word in ("BBTB", "BTB") for word in made.words])
    assert np.array_equal(WordFamily(name="low", words=("B+TB",)).contains(made), wanted)
    several = WordFamily(name="high", words=("BT+B",)).contains(first)
    assert set(first.words[several]) >= {"BTB", "BTTB"}
    assert not several[first.words == "BB"].any()


def test_a_cycle_has_the_word_of_its_returns(pair):
    system = pair(0.21, r=0.25, beta=pi / 6)
    cycle = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [0.6, 0.3], 3000).final, 2)
    assert {cycle.word} <= {"BBTB", "BTBB"}
    fixed = nsmaps.periodic_orbit(IteratedMap(system, 2), cycle.states[0])
    assert fixed.word == cycle.word
    assert np.allclose(fixed.multipliers, cycle.multipliers, rtol=1e-8)


def test_an_orbit_that_ends_keeps_why(pair):
    made = IteratedMap(pair(0.35), 2).first_return([[np.nan, 0], [0.2, 0.1], [0.0, 1.0]])
    assert made.outcome.tolist() == [Outcome.invalid, Outcome.returned, Outcome.returned]
    assert made.words.tolist()[0] == ""
    assert made.words.tolist()[2].startswith("B_")


def test_words_longer_than_a_code_holds_are_marked(pair):
    made = IteratedMap(pair(0.35), 40).first_return([[0.2, 0.1]])
    assert made.words.item() == "B" * 26 + "..."


def test_wrong_calls_are_errors(pair):
    with pytest.raises(NsmapsError, match=message("dynamics.no-iterate", number=0)):
        IteratedMap(pair(0.35), 0)
