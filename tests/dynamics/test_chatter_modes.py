"""Complete chatter of systems with modes, once a period: against formulas, impacts in 60 digits, and an integrator."""

import warnings
from functools import cache
from math import sqrt

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from chattering import after_release, slopes_to_rest, sums_to_rest, until_rest
from hybrid import BeforeWall
from messages import message
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_two_masses import TwoMasses
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection, continue_branch
from nsmaps.dynamics import CompleteChatter
from nsmaps.errors import NsmapsError
from nsmaps.testing import check_system

ENDS = "end of complete chatter"
WAYS = {"Gamma": (1, 0), "s": (0, 1)}  #: parameters by which an image is differentiated


class Table(HybridSystem):
    """The bouncing ball once a period, in phase s of the table."""

    Gamma: float
    r: float
    s: float = 2.0

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1 + self.Gamma * sp.sin(t + self.s)}}

    def guards(self, t, y):
        impact = Guard("flight", y.x, reset={"v": -self.r * y.v}, rests="table")
        return {"B": impact, "clock": Guard(("flight", "table"), -sp.sin(t), letter="c")}

    def section(self, t, y):
        return PoincareSection("clock", ("x", "v"))


def test_the_image_and_its_derivatives_are_those_of_the_flight_from_the_release():
    def released(gamma, s):
        """Place and speed at the phase s, of a flight that starts at rest where gamma sin = 1."""
        start = mp.asin(1 / gamma)
        flown = s - start
        speed = -flown - gamma * (mp.cos(s) - mp.cos(start))
        return speed, -(flown**2) / 2 - gamma * (mp.sin(s) - mp.sin(start)) + gamma * flown * mp.cos(start)

    table, starts = Table(Gamma=1.3, r=0.5), [[0.2, 0.1], [1e-3, -0.3], [0.0, 0.0]]
    found = table.first_return(starts, derivative=True)
    assert found.words.tolist() == ["cB~c"] * 3
    with mp.workdps(40):
        at = mp.mpf("1.3"), mp.mpf(2)
        image = [float(released(*at)[k]) for k in (1, 0)]
        slopes = {p: [float(mp.diff(lambda x, y, k=k: released(x, y)[k], at, n)) for k in (1, 0)] for p, n in WAYS.items()}
    assert np.abs(found.image - image).max() < 1e-14
    assert (found.derivative == 0).all()
    for name, slope in slopes.items():
        assert np.abs(table.sensitivity(starts, {name: 1.0}) - slope).max() < 1e-13
    assert np.abs(table.sensitivity(starts, {"r": 1.0})).max() < 1e-30


def test_a_clock_in_contact_begins_and_ends_returns_at_rest():
    """At its phase 0.5 the table presses: the ball is released later, flies, and comes to rest before the next period ends."""
    table = Table(Gamma=1.3, r=0.5, s=0.5)
    cycle = nsmaps.periodic_orbit(table, [0.1, 0.1])
    assert (cycle.words, cycle.states.tolist(), cycle.multipliers.tolist()) == (("cB~c",), [[0, 0]], [0, 0])
    assert np.isnan(table.rests(cycle.states)).all()
    assert (table.sensitivity(cycle.states, {"Gamma": 1.0}) == 0).all()
    assert table.orbits([[0.1, 0.1]], 4).words.tolist() == ["cB~c"] * 4


def test_the_branch_ends_where_impacts_accumulate_at_the_release():
    cycle = nsmaps.periodic_orbit(Table(Gamma=1.58, r=0.5), [0.1, 0.1])
    branch = continue_branch(lambda gamma: Table(Gamma=gamma, r=0.5), "gamma", cycle, 1.58, (1.55, 1.65), step=0.2)
    assert branch.ended == ENDS
    assert np.abs(branch.multipliers).max() < 1e-20
    (end,) = branch.events
    assert end.precision < 2e-9
    for step, complete in ((-end.precision, True), (end.precision, False)):
        gamma = mp.mpf(end.value) + step
        assert (until_rest(gamma, 0.5, *after_release(gamma)) is not None) == complete


def test_the_inelastic_ball_lands_at_its_release():
    border = np.sqrt(1 + np.pi**2)
    cycle = nsmaps.periodic_orbit(Table(Gamma=border - 0.1, r=0), [0.1, 0.1])
    branch = continue_branch(
        lambda gamma: Table(Gamma=gamma, r=0), "gamma", cycle, border - 0.1, (border - 0.2, border + 0.2), step=0.2
    )
    (end,) = branch.events
    assert (cycle.words, end.kind) == (("cB_c",), ENDS)
    assert abs(end.value - border) < 2 * end.precision < 1e-11


@pytest.mark.thorough
def test_the_curve_on_which_a_ball_at_rest_begins_to_be_released():
    """Gamma = 1, whatever r: seen once a period it grazes its release, and no state beside it is in contact."""
    held = nsmaps.periodic_orbit(Table(Gamma=0.9, r=0.5), [0.0, 0.0])
    branch = continue_branch(lambda gamma: Table(Gamma=gamma, r=0.5), "gamma", held, 0.9, (0.5, 1.5), step=0.3)
    assert (held.words, branch.ended) == (("cc",), "grazing")
    curve = nsmaps.bifurcation_curve(Table(Gamma=1.0, r=0.5), branch.events[0], {"Gamma": (0.5, 1.5), "r": (0.4, 0.6)}, step=0.5)
    assert np.abs(curve.parameters[:, 0] - 1).max() < 1e-12
    assert curve.parameters[[0, -1], 1] == pytest.approx([0.4, 0.6], abs=1e-14)


def test_means_and_their_derivatives_are_those_of_the_summed_impacts():
    """The contact takes what is left of the speed below the resolution of flights, where impacts by number still have some."""
    chosen = [
        {"name": "loss", "formula": "(v**2 - v_after**2)/2", "at": "B"},
        {"name": "gap", "formula": "x + Gamma*sin(phi + s)**2", "of": "flights"},
    ]
    table = Table(Gamma=1.3, r=0.5)
    cycle, held = nsmaps.periodic_orbit(table, [0.1, 0.1]), np.array([0, np.pi])
    value = sums_to_rest(1.3, 0.5).astype(float)[[0, 2]]
    for name, by in (("Gamma", (1, 0)), ("r", (0, 1))):
        found, slope = nsmaps.observe(table, cycle, chosen, rates={name: 1.0}), slopes_to_rest(1.3, 0.5, by)[[0, 2]]
        assert found.per_period.value == pytest.approx(value + 1.3 * held, rel=1e-12)
        assert found.per_period.derivative == pytest.approx(slope + by[0] * held, rel=1e-11)


class Oscillator(BeforeWall):
    """The impact oscillator once a period, a third of a period after the force is largest."""

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": self.A * sp.cos(self.w * t + 2) - 2 * self.zeta * y.v - y.x}}

    def guards(self, t, y):
        impact = Guard("free", self.wall - y.x, reset={"v": -self.r * y.v}, rests="pressed")
        return {"B": impact, "clock": Guard(("free", "pressed"), -sp.sin(self.w * t), letter="c")}

    def section(self, t, y):
        return PoincareSection("clock", ("x", "v"))


def test_the_rest_and_its_end_are_those_of_the_impact_oscillator():
    values = {"zeta": 0.05, "w": 0.7, "wall": -0.5, "r": 0.6}
    single = CompleteChatter(ImpactOscillator(A=1.67, **values))
    landed = nsmaps.periodic_orbit(single, nsmaps.orbit(single, [0.2, 0.1], 30).states[-1])
    system = Oscillator(A=1.67, **values)
    cycle = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [-0.9, 0.1], 30).states[-1])
    assert cycle.words == ("cB~c",)
    assert system.rests(cycle.states) == pytest.approx(single.rests(landed.states), rel=1e-3)
    branch = continue_branch(lambda A: Oscillator(A=A, **values), "A", cycle, 1.67, (1.66, 1.69), step=0.2)
    other = continue_branch(lambda A: single.at(A=A), "A", landed, 1.67, (1.66, 1.69), step=0.2)
    ends = branch.events[-1], other.events[-1]
    assert [end.kind for end in ends] == [ENDS, ENDS]
    assert abs(ends[0].value - ends[1].value) < ends[0].precision + ends[1].precision < 3e-8


class Held(TwoMasses):
    """Two masses once a period; the first may rest at its stop, and its release depends on the second."""

    def guards(self, t, y):
        impact = Guard("free", self.d - y.x, reset={"v": -self.r * y.v}, rests="held")
        return {"I": impact, "clock": Guard(("free", "held"), -sp.sin(self.w * t), letter="c")}

    def section(self, t, y):
        return PoincareSection("clock", ("x", "v", "x2", "v2"))


@cache
def integrated(start, f):
    """The states of two masses after a period, by an integrator, impact by impact; whether the first has rested."""
    w, b, k2, r, free = 0.3, 0.05, 2.0, 0.4, True

    def rates(t, z):
        link = k2 * (z[2] - z[0]) + b * k2 * (z[3] - z[1])
        pull = f * np.cos(w * t) - z[0] - b * z[1] + link
        return np.array([z[1], pull, z[3], -link] if free else [0, 0, z[3], -link])

    def gap(t, z):
        return -z[0]

    def pressure(t, z):
        return f * np.cos(w * t) - z[0] + k2 * (z[2] - z[0]) + b * k2 * z[3]

    gap.direction = pressure.direction = -1
    gap.terminal = pressure.terminal = True
    t, z, rested, end = 0.0, np.array(start), False, 2 * np.pi / w
    while True:
        way = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "events": gap if free else pressure}
        found = solve_ivp(rates, (t, end), z, **way)
        t, z = found.t[-1], found.y[:, -1].copy()
        if not found.t_events[0].size:
            return z, rested
        z[0] = 0.0
        if free:
            free = bool(z[1] > 1e-7 or pressure(t, z) < 0)
            z[1] = -r * z[1] if free else 0.0
            rested = rested or not free
        else:
            free = True


def test_derivatives_pass_chatter_of_one_of_two_masses():
    """Those by the second mass, which moves while the first rests, and by the force."""
    start, h = (-0.3, 0.0, 0.6, -0.8), 1e-3
    system = Held(b=0.05, w=0.3, f=1.5, d=0, r=0.4, k2=2.0)
    found = system.first_return([start], derivative=True)
    image, rested = integrated(start, 1.5)
    assert rested
    assert "I~" in found.words[0]
    assert np.abs(found.image[0] - image).max() < 1e-6

    def slope(way, by_force):
        ends = [integrated(tuple(np.add(start, k * h * way)), 1.5 + k * h * by_force)[0] for k in (-2, -1, 1, 2)]
        return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * h)

    expected = np.column_stack([slope(way, 0) for way in np.eye(4)])
    assert np.abs(expected).max() > 0.1
    assert np.abs(found.derivative[0] - expected).max() < 1e-5
    assert np.abs(system.sensitivity([start], {"f": 1.0})[0] - slope(np.zeros(4), 1)).max() < 1e-5


@pytest.mark.filterwarnings("ignore:no description of")
def test_starts_in_contact_are_followed_as_by_an_integrator():
    check_system(Table(Gamma=1.3, r=0.5, s=0.5), states=[[0.0, 0.0], [0.3, -0.2], [1.0, 1.0]])
    check_system(Held(b=0.05, w=0.3, f=1.5, d=0, r=0.4, k2=2.0), states=[[0, 0, 0.6, -0.8], [-0.3, 0, 0.6, -0.8]])


def test_chatter_as_one_event_is_refused_with_what_to_write():
    said = message("dynamics.no-rests", system="Table")
    with pytest.raises(NsmapsError, match=said):
        CompleteChatter(Table(Gamma=1.3, r=0.5))


class Strobe(HybridSystem):
    """A ball on a table with the acceleration -8a, and 8a from each second whole time to the next; the section is a clock."""

    a: float = 0.13
    r: float = 0.5

    states = ("z", "w")

    def period(self):
        return 2

    def modes(self, t, y):
        return {"up": {"z": y.w, "w": 8 * self.a - 1}, "down": {"z": y.w, "w": -8 * self.a - 1}}

    def guards(self, t, y):
        hit, clock = {"w": -self.r * y.w}, sp.sin(sp.pi * t)
        return {
            "B": Guard("up", y.z, reset=hit, rests="table up"),
            "D": Guard("down", y.z, reset=hit, rests="table down"),
            "half": Guard("up", clock, to="down"),
            "full": Guard("down", -clock, to="up"),
            "x": Guard("table up", clock, to="table down"),
            "y": Guard("table down", -clock, to="table up"),
        }

    def section(self, t, y):
        return PoincareSection(("full", "y"), ("z", "w"))


def test_chatter_that_ends_at_a_clock_is_extrapolated_without_warnings():
    """With b = 8a - 1 and r = 1/2 the first impact has the speed V^2 = b^2 + (b + 2) b, and impacts end at b + 3 V = b + 2."""
    system = Strobe()
    start = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [0.1, 0.1], 60).final)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        branch = nsmaps.continue_branch(system, "a", start, system.a, (0.126, 0.2))
    end = (1 + (sqrt(17) - 3) / 6) / 8
    assert abs(branch.events[-1].value - end) < branch.events[-1].precision < 1e-8
