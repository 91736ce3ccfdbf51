"""Observables of integrated flights: those of closed forms of the same systems, and balances of energy."""

import numpy as np
import pytest
import sympy as sp
from by_equation import Oscillator, Pair
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_duffing import DuffingStop
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_pendulum import PendulumStop
from nsmaps_vi_pair import VIPair

import nsmaps

pytest.importorskip("heyoka")

CHOSEN = [
    "work",
    "damping",
    "loss",
    "momentum",
    {"name": "number", "formula": "1", "at": "B"},
    {"name": "mean", "formula": "v*cos(phi)", "per": "v", "scale": 3},
    {"name": "hardest", "formula": "v", "largest": True},
    {"name": "waves", "formula": "(place + 0.3)**2*sin(phi) + r*cos(2*phi)", "of": "flights", "at": "B"},
]


class Ball(BouncingBall):
    """The bouncing ball by its equation of motion, seen from the table."""

    def acceleration(self, t, place, velocity):
        return -1 + self.Gamma * sp.sin(t)


LINEAR = {"zeta": 0.05, "w": 0.81, "A": 0.7, "wall": 0.6}


@pytest.mark.parametrize(
    ("integrated", "exact", "starts"),
    [
        (Pair(d=0.35, g_bar=0.2113), VIPair(d=0.35, g_bar=0.2113), [[0.83, 0.36], [0.2, 0.1], [0.01, 3.0]]),
        (Oscillator(**LINEAR), ImpactOscillator(**LINEAR), [[0.8, 0.4], [0.1, 2.0]]),
        (Ball(Gamma=1.3, r=0.5), BouncingBall(Gamma=1.3, r=0.5), [[1.0, 2.0]]),
        (Ball(Gamma=0.9, r=0.5), BouncingBall(Gamma=0.9, r=0.5), [[1.0, 2.0]]),
    ],
    ids=["pair", "oscillator", "ball with chatter and release", "ball that rests"],
)
def test_totals_are_those_of_the_closed_form(integrated, exact, starts):
    got, expected = (
        nsmaps.observe(system, starts, CHOSEN, n_returns=60, transient=1, n_batches=3) for system in (integrated, exact)
    )
    assert got.outcome.tolist() == expected.outcome.tolist()
    for name in ("totals", "weights", "time", "final"):
        one, other = getattr(got, name), getattr(expected, name)
        assert one == pytest.approx(other, rel=1e-10, abs=1e-10, nan_ok=True), name


@pytest.mark.parametrize("name", ["work", "loss"])
def test_formulas_of_one_kind_alone_have_the_same_totals(name):
    system, start = Pair(d=0.35, g_bar=0.2113), [0.83, 0.36]
    both = nsmaps.observe(system, start, ["work", "loss"], n_returns=5, n_batches=1)
    assert nsmaps.observe(system, start, [name], n_returns=5, n_batches=1).totals[0, 0] == both.totals[0, both.names.index(name)]


@pytest.mark.parametrize(
    ("system", "start"),
    [
        (DuffingStop(c=0.1, a=1.0, b=0.5, f=0.7, w=1.0, d=0.6), [1.0, 0.5]),
        (PendulumStop(c=0.2, f=0.9, w=0.8, stop=0.3), [0.5, 1.0]),
    ],
    ids=["duffing", "pendulum"],
)
def test_the_work_of_the_forcing_is_what_impacts_and_damping_take(system, start):
    last = nsmaps.orbit(system, start, 300).final
    cycles = (nsmaps.periodic_orbit(system, last, n) for n in range(1, 9))
    cycle = next(cycle for cycle in cycles if cycle.converged and cycle.exists)
    work, loss, damping = nsmaps.observe(system, cycle, ["work", "loss", "damping"]).per_period.value
    assert min(work, loss, damping) > 1e-2
    assert abs(work - loss - damping) < 1e-12 * work


def test_largest_values_and_derivatives_are_those_of_the_closed_form():
    (system, exact), start = (Pair(d=0.35, g_bar=0.2113), VIPair(d=0.35, g_bar=0.2113)), [0.83, 0.36]
    chosen = ["displacement", {"name": "fastest", "formula": "abs(velocity)", "of": "flights", "largest": True}]
    found, expected = (nsmaps.observe(formulas, start, chosen, n_returns=20, n_batches=2).totals for formulas in (system, exact))
    assert found == pytest.approx(expected, abs=1e-12)
    cycles = (nsmaps.periodic_orbit(formulas, start) for formulas in (system, exact))
    names = ["loss", "work", "momentum", "mean speed"]
    asked = [*names[:3], {"name": names[3], "formula": "velocity**2", "of": "flights", "at": "B"}]
    slopes = [
        nsmaps.observe(formulas, cycle, asked, rates={"d": 1.0}).per_period.derivative
        for formulas, cycle in zip((system, exact), cycles, strict=True)
    ]
    assert np.isfinite(slopes[1]).all()
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-9, abs=1e-11)
