"""Cycles of the VI pair at d = 0.35 against 40-digit values that share nothing with nsmaps: `docs/benchmarks/make_cycles.py`."""

import numpy as np
import pytest

import nsmaps
from nsmaps.cells.periodic_points import find_cycles

COUNTS = [0, 3, 3, 10, 21, 58, 149]  #: of least period 0, 1, ..., 6


@pytest.fixture(scope="module")
def cycles(reference):
    """Of each cycle: words, the state of least v, multipliers."""
    return [(tuple(row["words"].split()), np.array(row["state"], float), row["multipliers"]) for row in reference("cycles")]


def test_periodic_orbits_are_the_cycles_of_forty_digits(pair, cycles):
    """From all states of a cycle, each 1e-8 off."""
    system, rng = pair(0.35), np.random.default_rng(0)
    assert np.bincount([len(words) for words, _, _ in cycles]).tolist() == COUNTS
    for words, state, multipliers in cycles:
        guess = nsmaps.orbit(system, state, len(words) - 1).states * (1 + 1e-8 * rng.uniform(-1, 1, (len(words), 2)))
        made = nsmaps.periodic_orbit(system, guess, len(words))
        assert made.words == words
        assert np.abs(made.states[0] - state).max() < 1e-12
        assert made.multipliers[0] == pytest.approx(multipliers[0], rel=1e-9)


def missed(system, cycles, window, period, depth):
    """How many of the known cycles in a window a search does not find; what it finds must be known."""
    found = find_cycles(system, window, max_period=period, depth=depth, n_cells=16)
    states = [nsmaps.orbit(system, state, len(words) - 1).states for words, state, _ in cycles if len(words) <= period]
    inside = [each for each in states if (found.cells.numbers_of(each) >= 0).all()]
    here = np.array([each[0] for each in inside])
    firsts = np.array([cycle.states[np.argmin(cycle.states[:, 0])] for cycle in found.cycles])
    off = np.abs(system.coordinates.difference(firsts[:, None], here)).max(axis=2)
    assert off.min(axis=1).max() < 1e-12
    assert np.isin(found.cells.numbers_of(np.concatenate(inside)), found.numbers).all()
    return int((off.min(axis=0) > 1e-12).sum())


@pytest.mark.thorough
def test_the_search_finds_all_but_one_of_the_cycles_of_up_to_two_returns(pair, cycles):
    """The other saddle of 2 returns, of multiplier 21902, needs smaller cells."""
    assert missed(pair(0.35), cycles, [[0.1, 0.9], [0.2, 3.8]], 2, 1) <= 1


@pytest.mark.thorough
def test_the_search_finds_nine_tenths_of_the_cycles_of_up_to_six_returns(pair, cycles):
    assert missed(pair(0.35), cycles, [[0.02, 1.07], [0, 2 * np.pi]], 6, 3) <= 22
