"""Flights that grow, over many periods: a block that rocks and may overturn, a pendulum upside down between two walls.

Each return is compared with one of 45 digits from the same state (`rocking.py`), which also says what speed and phase may be off
by in floats: with every number and every sum off by 2^-53 of the sizes of its terms, and what becomes of that by the derivative
of the flights on the way. So the conditioning of a return is accounted for; `SHARE` of 2^-53 times it is allowed.
"""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from rocking import DIGITS, EPS, Block, Flight, Return, first_return
from systems import BouncingBall

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns

SHARE = 4  # 4.5e-16 of the conditioning
LOST = 1e-3  # of phase and speed: what rounding may do to a return that must be decided
BETWEEN = {"floor": -1.0, "ceiling": 1.0, "ceiled": True}

ORBITS = {
    "block": (Block(tilt=1.0, A=2.0, w=20.0, r=0.9), (0.3, 1.0)),
    "damped block, at times at rest": (Block(tilt=1.0, A=8.0, w=20.0, zeta=0.1, r=0.5), (0.3, 1.0)),
    "pendulum": (Block(A=50.0, w=20.0, **BETWEEN), (1.0, 1.0)),
    "damped pendulum": (Block(A=5.0, w=2.0, zeta=0.3, r=0.5, **BETWEEN), (1.0, 1.0)),
}
MORE = {
    "block, shaken hard": (Block(tilt=1.0, A=4.0, w=20.0, r=0.7), (0.5, 2.0)),
    "block, damped well": (Block(tilt=1.0, A=4.0, w=10.0, zeta=0.5, r=0.9), (0.3, 1.0)),
    "pendulum, shaken slowly": (Block(A=5.0, w=1.0, **BETWEEN), (1.0, 1.0)),
    "pendulum between near walls": (Block(A=3.0, w=3.0, zeta=0.1, r=0.7, floor=-0.2, ceiling=0.3, ceiled=True), (1.0, 1.0)),
}


def off(block: Block, returns: Returns, i: int, expected: Return) -> float:
    """How far phase, speed and time of a return are off, the largest in units of what they may be off by."""
    phi = expected.phi - 2 * mp.pi * int(returns.turns[i, 1])
    far = abs(phi - returns.image[i, 1]), abs(expected.v - returns.image[i, 0]), abs(expected.time - returns.time[i])
    allowed = *expected.spread, expected.spread[0] / block.w + EPS * float(expected.time)
    return max(float(x) / (SHARE * may) if may else float(x > 0) for x, may in zip(far, allowed, strict=True))


@pytest.mark.parametrize("kind", [*ORBITS, *(pytest.param(kind, marks=pytest.mark.thorough) for kind in MORE)])
def test_orbits_of_growing_flights_over_hundreds_of_periods(kind: str) -> None:
    block, start = {**ORBITS, **MORE}[kind]
    returns = block.orbits([start], 200)
    assert set(returns.outcome.tolist()) <= {Outcome.returned, Outcome.stuck}
    assert returns.turns[:, 1].sum() > 50
    with mp.workdps(DIGITS):
        for i, (state, word) in enumerate(zip(returns.start, returns.words, strict=True)):
            expected = first_return(block, *state)
            assert word == expected.word
            assert off(block, returns, i, expected) < 1


LINGERING = {
    "block": (Block(tilt=1.0, A=1.5, w=5.0, r=0.9), 20),
    "damped block": (Block(tilt=1.0, A=10.5, w=25.0, zeta=0.3, r=0.9), 100),
    "pendulum": (Block(A=50.0, w=20.0, **BETWEEN), 80),
    "damped pendulum": (Block(A=50.0, w=40.0, zeta=0.5, **BETWEEN), 200),
}


def next_to_the_saddle(block: Block, phi: float, nearest: int) -> list[list[float]]:
    """States of a phase at shares of 1e-1 to 10^-nearest on both sides of that whose flight stays at the saddle for ever."""
    still = Flight(block, mp.mpf(phi), mp.mpf(block.floor), mp.mpf(0))
    speed = -2 * still.k * still.up / mp.mpf(block.r)  # what grows is gone
    return [[float(speed * (1 + side * mp.mpf(10) ** -n)), phi] for n in range(1, nearest + 1) for side in (1, -1)]


@pytest.mark.parametrize("kind", LINGERING)
def test_flights_that_hang_at_the_saddle_fall_where_they_must(kind: str) -> None:
    """Starts next to its stable manifold: to the floor or the ceiling, or over; undecided only what rounding decides."""
    block, periods = LINGERING[kind]
    with mp.workdps(DIGITS):
        states = [state for phi in (0.0, 3.0) for state in next_to_the_saddle(block, phi, 16) if state[0] > 0]
        returns = block.first_return(states)
        expected = [first_return(block, *state) for state in states]
        decided, words = returns.outcome != Outcome.undecided, returns.words
        for i in np.flatnonzero(decided):
            if expected[i].word == "escaped":
                assert returns.outcome[i] == Outcome.escaped
            else:
                assert words[i] == expected[i].word
                assert off(block, returns, i, expected[i]) < 1
    assert decided[[max(*one.spread, one.lost) < LOST for one in expected]].all()
    assert not decided[[one.lost > 1 for one in expected]].any()
    flown = [float(one.phi - state[1]) / TWO_PI for one, state in zip(expected, states, strict=True)]
    assert np.nanmax(np.where(decided, flown, np.nan)) > periods


@pytest.mark.parametrize("kind", ["block", "damped pendulum"])
def test_derivatives_of_flights_that_grow(kind: str) -> None:
    """Against differences in many digits."""
    block, start = ORBITS[kind]
    returns = block.first_return(block.orbits([start], 12).start, derivative=True)
    with mp.workdps(DIGITS):
        step = mp.mpf(10) ** -15
        for i, (v, phi) in enumerate(returns.start):
            ends = [[first_return(block, v + h, phi), first_return(block, v, phi + h)] for h in (step, -step)]
            slopes = [[(getattr(a, x) - getattr(b, x)) / (2 * step) for a, b in zip(*ends, strict=True)] for x in ("v", "phi")]
            assert returns.derivative is not None
            assert returns.derivative[i] == pytest.approx(np.array(slopes, float), rel=1e-10)


def test_flights_that_grow_for_ever_escape() -> None:
    """Bounds are taken step by step: no horizon is too long for them."""

    class Growing(BouncingBall):
        k: float

        def displacement(self, t, hit):  # type: ignore[no-untyped-def]
            s = t - hit.t
            return hit.z + hit.w * (sp.exp(self.k * s) - 1) / self.k

    for k in (-1, 1e-3, 1, 30):
        assert Growing(a=1, k=k).first_return([[1.0, 0.0]]).counts() == {"escaped": 1}
