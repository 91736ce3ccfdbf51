"""Impacts with friction, whose direction is that of the slip, on a plate along which the body is pushed either way."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection, SlidingSurface

FLIGHTS = ("R", "L")


class Hopper(HybridSystem):
    """A mass on a spring along a shaken plate, at x above and q along it, which it strikes with friction and sticks to."""

    a: float
    mu: float = 0.3
    r: float = 0.4
    states = ("x", "v", "q", "u")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        flight = {"x": y.v, "v": -1 - self.a * sp.cos(t), "q": y.u, "u": -y.q / 2 + sp.cos(t + 1) * 3 / 10}
        return dict.fromkeys(FLIGHTS, flight)

    def guards(self, t, y):
        hit, push = {"v": -self.r * y.v}, -self.mu * (1 + self.r) * y.v
        right, left = y.u - push, y.u + push
        return {
            "I": Guard("R", y.x, reset=hit | {"u": right}, where=[right], rests="to the right"),
            "J": Guard("L", y.x, reset=hit | {"u": left}, where=[-left], rests="to the left"),
            "S": Guard("R", y.x, reset=hit | {"u": 0}, where=[-right]),
            "T": Guard("L", y.x, reset=hit | {"u": 0}, where=[left]),
            "l": Guard("R", y.u, to="L"),
            "r": Guard("L", -y.u, to="R"),
            "stick": SlidingSurface("to the right", "to the left", y.u),
            "c": Guard((*FLIGHTS, "to the right", "to the left", "stick"), -sp.sin(t - 1)),
        }

    def section(self, t, y):
        return PoincareSection("c", self.states)

    def follow(self, state):
        """The states a period later, by an integrator and the law of impacts in one line."""
        t, y, end = 1.0, np.array(state), 1 + 2 * np.pi

        def rates(t, y):
            return [y[1], -1 - self.a * np.cos(t), y[3], -y[2] / 2 + 0.3 * np.cos(t + 1)]

        def place(t, y):
            return y[0]

        place.terminal, place.direction = True, -1
        while True:
            if y[0] == 0:
                start = solve_ivp(rates, (t, t + 1e-7), y, rtol=1e-13, atol=1e-15)
                t, y = start.t[-1], start.y[:, -1]
            flight = solve_ivp(rates, (t, end), y, "DOP853", events=place, rtol=1e-12, atol=1e-13)
            t, y = flight.t[-1], flight.y[:, -1]
            if t >= end:
                return y
            stopped = max(abs(y[3]) + self.mu * (1 + self.r) * y[1], 0)
            y = np.array([0, -self.r * y[1], y[2], np.sign(y[3]) * stopped])


def test_returns_of_impacts_that_stop_a_slip_are_those_of_the_law():
    """A slip that is stopped begins in its mode with zero speed, and often at once in the other one."""
    hopper, rng = Hopper(a=3.0), np.random.default_rng(1)
    rows = np.column_stack([rng.uniform(0, 2, 20), rng.uniform(-2, 2, 20), rng.uniform(-1, 1, (20, 2))])
    returns = hopper.first_return(rows)
    assert {letter for word in returns.words for letter in word} >= {"S", "T"}
    assert returns.image == pytest.approx(np.array([hopper.follow(row) for row in rows]), abs=1e-9)


@pytest.mark.parametrize("a", [0.5, 1.6])
def test_no_return_is_undecided(a):
    """They return, or impacts S or T accumulate, of which no lasting contact is declared."""
    rng = np.random.default_rng(2)
    rows = np.column_stack([rng.uniform(0, 2, 300), rng.uniform(-2, 2, 300), rng.uniform(-1, 1, (300, 2))])
    returns = Hopper(a=a).first_return(rows)
    assert set(returns.outcome.tolist()) == {Outcome.returned, Outcome.accumulates}
    assert (returns.outcome == Outcome.returned).sum() > 250
