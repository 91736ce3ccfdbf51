"""Bifurcations and exponents of systems with modes that closed forms and references of 40 digits know, and slips in classes."""

import re
from math import atan2, cos, pi, sqrt

import numpy as np
import pytest
import sympy as sp
from hybrid import numbers, reference, system
from messages import message

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.outcome import Outcome

BESIDE = 1e-9  #: a share of a parameter, to either side of its value at an event


class Stop(HybridSystem):
    """Oscillator with an elastic stop, whose damping may be negative."""

    zeta: float

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / 2

    def modes(self, t, y):
        force = sp.cos(2 * t) - 2 * self.zeta * y.v - y.x
        return {"free": {"x": y.v, "v": force}, "contact": {"x": y.v, "v": force - 3 * y.x}}

    def guards(self, t, y):
        return {"C": Guard("free", -y.x, to="contact"), "F": Guard("contact", y.x, to="free")}

    def section(self, t, y):
        return PoincareSection("C", ("v", "phi"))


def test_a_torus_begins_where_damping_vanishes():
    """A period of the flow multiplies areas by exp(-2 zeta P), so that complex multipliers pass the unit circle at zeta = 0."""
    start = nsmaps.periodic_orbit(Stop(zeta=0.05), [0.8, 1.9])
    assert start.multipliers[0].imag > 0.5
    branch = nsmaps.continue_branch(Stop(zeta=0.05), "zeta", start, 0.05, (-0.02, 0.06), direction="down")
    (torus,) = [event for event in branch.events if event.kind == "Neimark-Sacker"]
    assert abs(torus.value) < 1e-11
    assert np.abs(torus.orbit.multipliers) == pytest.approx(1, abs=1e-10)


def test_a_motion_beside_a_stop_touches_it_where_its_amplitude_is_the_gap():
    event = reference("S2_bilinear")["bifurcations"][0]
    w, values = float(event["value"]), event["other_parameters"]
    outcomes = []
    for share in (-BESIDE, BESIDE):
        one = system("S2_bilinear", values, w=w * (1 + share))
        force, stiff, drag = one.a * one.w**2, 1 - one.w**2, 2 * one.xi * one.w
        size, late = force / sqrt(stiff**2 + drag**2), atan2(drag, stiff)  # x = size sin(w t - late)
        rest = [size * np.sin(-late), one.w * size * np.cos(late), 0.0]
        outcomes.append(one.arrivals([rest], "free").outcome[0])
    assert outcomes == [Outcome.escaped, Outcome.returned]


def test_stick_and_slip_end_where_slip_grazes_the_speed_of_the_belt():
    event = reference("S3_stickslip")["bifurcations"][0]
    zeta, values = float(event["value"]), event["other_parameters"]
    outcomes = []
    for share in (-BESIDE, BESIDE):
        one = system("S3_stickslip", values, zeta=zeta * (1 + share))
        released = one.mu_s - 2 * one.zeta * one.vb  # the place where the spring overcomes static friction
        outcomes.append(one.first_return([[released, 1.0]]).outcome[0])
    assert outcomes == [Outcome.returned, Outcome.escaped]


def test_the_cycle_of_stick_and_slip_without_forcing():
    """It forgets where it came from, and moves the phase by w times its period."""
    given = reference("S3_stickslip")
    (cycle,) = [one for one in given["attractors"] if one["params"] == "A0"]
    belt = system("S3_stickslip", given["parameters"]["A0"])
    (x,), time = numbers(cycle["points"][0]), float(cycle["period_time"])
    made = belt.first_return([[x, 1.0]], derivative=True)
    assert made.image[0] == pytest.approx([x, (1.0 + belt.w * time) % (2 * pi)], abs=1e-12)
    assert made.time[0] == pytest.approx(time, rel=1e-13)
    assert made.words[0] == "MKM"
    assert made.derivative[0] == pytest.approx(np.array([[0, 0], [made.derivative[0, 1, 0], 1]]), abs=1e-12)


def test_exponents_of_four_coordinates_are_the_logarithms_of_multipliers():
    """Of a node and a pair of complex multipliers, in 40 digits; their sum is that of Liouville: two impacts and damping."""
    given = reference("S1_recoil")
    (cycle,) = [one for one in given["attractors"] if one["params"] == "p1"]
    pair = system("S1_recoil", given["parameters"]["p1"])
    exponents = nsmaps.lyapunov(pair, starts=numbers(cycle["points"][0]), n_returns=400).exponents
    wanted = sorted((np.log(abs(complex(*numbers(one)))) for one in cycle["multipliers"]), reverse=True)
    assert exponents == pytest.approx(wanted, abs=0.01)
    assert exponents.sum() == pytest.approx(4 * np.log(pair.r) - 2 * pair.Lambda, abs=1e-9)


class Far(Stop):
    """The same with a section that its motion, of amplitudes below 3, does not meet."""

    def guards(self, t, y):
        return {**super().guards(t, y), "O": Guard(("free", "contact"), 100 - y.x)}

    def section(self, t, y):
        return PoincareSection("O", ("v", "phi"))


def test_a_motion_that_meets_other_events_alone_says_so():
    one = Far(zeta=0.05)
    arrivals = one.arrivals([[-0.1, 0.5, 0.0]], "free")
    assert Outcome(arrivals.outcome[0]) == Outcome.endless
    (reason,) = one.reasons([[1.0, 0.0]])
    assert reason.startswith("More than 100,000 events without a return: the motion may never meet its section again")


@pytest.mark.parametrize(
    ("formula", "given", "said"),
    [
        (
            "modes",
            lambda self, t, y: {"free": {"x": y.v, "v": -y.x + t}},
            message("exact.rate-not-periodic", state="v", formula="phi/2"),
        ),
        (
            "modes",
            lambda self, t, y: {"free": {"x": y.vel, "v": -y.x}},
            message("exact.states-of-formulas", name="vel", names="y.x, y.v"),
        ),
        (
            "modes",
            lambda self, t, y: {"free": {"x": y.v, "v": cos(t)}},
            message("exact.sympys-functions-of", cls="Slip", formula="modes"),
        ),
        ("modes", lambda self, t, y: {"free": {"x": y.v, "v": 1 if y.x > 0 else -1}}, message("exact.branches")),
        ("modes", lambda self, t, y: {}, message("exact.modes", given="{}")),
        (
            "guards",
            lambda self, t, y: [Guard("free", -y.x)],
            message("exact.guards", given=re.compile(r"\[Guard.*")),
        ),
        ("guards", lambda self, t, y: {"C": ("free", -y.x)}, message("exact.guards")),
        ("section", lambda self, t, y: "C", message("exact.section", given="'C'")),
        ("section", lambda self, t, y: PoincareSection("C", ("v", "phi"), side="left"), message("exact.side")),
    ],
)
def test_slips_in_a_class_are_told_with_the_formula(formula, given, said):
    made = type("Slip", (Stop,), {formula: given, "__module__": __name__})(zeta=0.1)
    with pytest.raises(SystemDefinitionError, match=message("exact.formula", cls="Slip", formula=formula)) as raised:
        made.first_return([[1.0, 0.0]])
    assert re.search(said, str(raised.value))
