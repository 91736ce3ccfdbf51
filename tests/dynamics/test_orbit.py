"""Orbits in one compiled loop against single returns, where they end and where they do not."""

import numpy as np
import pytest
from messages import message
from systems import BouncingBall

import nsmaps
from nsmaps.errors import StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap


class OneByOne(ReturnMap):
    """The first returns of a system, without its compiled orbits."""

    def __init__(self, system):
        self.coordinates, self.system = system.coordinates, system

    def first_return(self, states, derivative=False, **how):
        return self.system.first_return(states, derivative, **how)


@pytest.mark.parametrize("count", [1, 15, 16, 200])
@pytest.mark.parametrize("a", [0.3, 1.2])  # below one the ball comes to rest for ever
def test_compiled_orbits_are_those_of_single_returns(count, a):
    system = BouncingBall(a=a, r=0.7)
    assert system.has_orbits
    assert not OneByOne(system).has_orbits
    starts = np.random.default_rng(count).uniform([-0.2, 0], [3, 7], (count, 2))
    starts[-1] = np.nan
    ours, theirs = (nsmaps.orbit(formulas, starts, 150) for formulas in (system, OneByOne(system)))
    for name in ("states", "turns", "codes", "outcome"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name), equal_nan=name == "states"), name
    alive, words = np.isfinite(ours.states).all(axis=-1), ours.words
    for k in range(150):  # every step by itself
        returns = system.first_return(ours.states[k][alive[k]])
        assert np.array_equal(returns.image, ours.states[k + 1][alive[k]], equal_nan=True)
        assert np.array_equal(returns.outcome, ours.outcome[k][alive[k]])
        assert returns.words.tolist() == words[k][alive[k]].tolist()
        if k:
            assert np.array_equal(ours.outcome[k][~alive[k]], ours.outcome[k - 1][~alive[k]])
            assert set(words[k][~alive[k]]) <= {""}
    if a < 1 and count > 1:
        assert Outcome.rests in ours.outcome[-1]


def test_chatter_is_passed_on(pair):
    for chatter in (0, np.inf):
        ours, theirs = (
            nsmaps.orbit(formulas, [0.2, 0.1], 60, chatter=chatter) for formulas in (pair(0.35), OneByOne(pair(0.35)))
        )
        assert ours.words.tolist() == theirs.words.tolist()
        assert ("B~" in ours.words) == (chatter > 0)


def test_no_returns_and_no_starts(pair):
    none = nsmaps.orbit(pair(0.35), [0.2, 0.1], 0)
    assert (none.states.tolist(), none.words.shape) == ([[0.2, 0.1]], (0,))
    assert nsmaps.orbit(pair(0.35), np.empty((0, 2)), 3).words.shape == (3, 0)


def test_long_orbits_go_in_parts(pair):
    seen = []
    long = nsmaps.orbit(pair(0.26), np.full((90, 2), 0.4), 2500, progress=seen.append)
    assert seen == [1111 / 2500, 2222 / 2500, 1]
    short = nsmaps.orbit(pair(0.26), long.states[1200], 1300)
    assert np.array_equal(short.states, long.states[1200:])


@pytest.mark.parametrize("state", [{"v": 0.5, "phi": 1.0}, "abc", [[0.5, 1.0], [0.5]]])
def test_what_is_no_array_of_numbers_is_told(state):
    return_map, told = BouncingBall(a=1.2, r=0.5), message("coordinates.not-numbers", names="v, phi")
    one = (
        ()
        if isinstance(state, dict)
        else (lambda x: nsmaps.orbit(return_map, x, 3), lambda x: nsmaps.lyapunov(return_map, starts=x, n_returns=100))
    )
    for ask in (return_map.first_return, *one):  # of one orbit a start may be given by name
        with pytest.raises(StateError, match=told):
            ask(state)
