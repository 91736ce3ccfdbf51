"""Relief valve, hopper and neuron: lasting contact, published facts, and spikes by an integrator."""

import pytest
from nsmaps_hopper import Hopper
from nsmaps_neuron import Neuron
from nsmaps_relief_valve import ReliefValve, ReliefValveLift
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps.exact.outcome import Outcome

pytest.importorskip("heyoka")


def test_a_closed_valve_opens_where_the_pressure_is_that_of_the_spring():
    """Chatter on the seat ends in contact; from its release at p = delta without speed every motion is the same."""
    valve = ReliefValve(q=0.1, contact=True)
    for start in ([-2.0, 0.75], [-1.4, 3.0], [-0.5, 1.5]):
        closes = nsmaps.orbit(valve, start, 160)
        k = closes.words.tolist().index("I~")
        assert closes.outcome[k] == Outcome.stuck
        assert closes.states[k + 1] == pytest.approx([0, valve.delta], abs=1e-12)
        bounces = nsmaps.orbit(valve.at(contact=False), start, 60)  # to 1e-6 of the first speed: p grows as in contact
        left = (valve.delta - bounces.states[-1, 1]) / (valve.beta * valve.q)
        assert closes.time[: k + 1].sum() == pytest.approx(bounces.time.sum() + left, rel=1e-9)


def test_the_valve_rests_open_below_its_hopf_bifurcation():
    """Above q = 8.491117635183 oscillations decay to the open valve, below they grow to the cycle."""
    after, before = (nsmaps.orbit(ReliefValveLift(q=q), [3.0, 12.0], 400).states[:, 0] for q in (8.6, 8.4))
    assert after[-1] - after[-2] == pytest.approx(0, abs=1e-3)
    assert before[-1] > 3.0


def test_running_at_68_degrees_is_stable_as_published():
    orbit = nsmaps.periodic_orbit(Hopper(), [0.95])
    assert orbit.states[0, 0] == pytest.approx(0.940267144379607, rel=1e-13)
    assert orbit.multipliers[0] == pytest.approx(-0.161307631037475, abs=1e-11)
    assert nsmaps.orbit(Hopper(), [1.0], 60).final == pytest.approx(orbit.states[0], rel=1e-12)


def test_spikes_are_those_of_an_integrator():
    neuron, u = Neuron(c=-50, d=2), -7.0

    def rates(t, y):
        return [y[0] ** 2 / 25 + 5 * y[0] + 140 - y[1] + neuron.current, neuron.a * (neuron.b * y[0] - y[1])]

    def spike(t, y):
        return y[0] - neuron.peak

    spike.terminal = True
    orbit = nsmaps.orbit(neuron, [u], 30)
    for k in range(30):
        start = [neuron.c, u + neuron.d]
        u = solve_ivp(rates, (0, 500), start, "DOP853", rtol=1e-12, atol=1e-12, events=spike).y_events[0][0, 1]
        assert orbit.states[k + 1, 0] == pytest.approx(u, abs=1e-8)
