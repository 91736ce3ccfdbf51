"""Neimark-Sacker and border-collision curves in two parameters against closed forms, with the strong resonances."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import sympy as sp
from boxmaps import plain_returns
from messages import message
from normal_form import NormalForm

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.continuation.events import BifurcationPoint
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap

TORUS = "Neimark-Sacker"


@dataclass(frozen=True)
class Delayed(ReturnMap):
    """x' = a x (1 - s x - (1 - s) y), y' = x: at (1 - 1/a) trace 1 - s (a - 1), determinant (1 - s)(a - 1)."""

    a: float
    s: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        (x, y), a, s = start.T, self.a, self.s
        image = np.column_stack([a * x * (1 - s * x - (1 - s) * y), x])
        slopes = np.array([[a * (1 - 2 * s * x - (1 - s) * y), -a * (1 - s) * x], [np.ones_like(x), 0 * x]])
        return plain_returns(self.coordinates, start, image, slopes.transpose(2, 0, 1) if derivative else None)


@dataclass(frozen=True)
class Bogdanov(ReturnMap):
    """x' = x + y, y' = y + a + b y + x^2: at x = -sqrt(-a) determinant 1 + b - 2 x, trace 2 + b."""

    a: float
    b: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        (x, y), one = start.T, np.ones(len(start))
        slopes = np.array([[one, one], [2 * x, (1 + self.b) * one]]).transpose(2, 0, 1)
        image = np.column_stack([x + y, y + self.a + self.b * y + x**2])
        return plain_returns(self.coordinates, start, image, slopes if derivative else None)


MAPS = {  #: start, bounds of both parameters, the first on the curve by the second, the strong resonances in the curve's order
    Delayed: (
        (1.8, 0.2, [4 / 9, 4 / 9]),
        ((1.2, 7), (-1, 0.9)),
        lambda s: (2 - s) / (1 - s),
        {"1:4 resonance": (3, 1 / 2), "1:3 resonance": (4, 2 / 3), "1:2 resonance": (5, 3 / 4)},
    ),
    Bogdanov: (
        (-0.3, -1.0, [-0.55, 0]),
        ((-4, 1), (-3.5, 1)),
        lambda b: -(b**2) / 4,
        {"1:3 resonance": (-9 / 4, -3), "1:4 resonance": (-1, -2), "1:1 resonance": (0, 0)},
    ),
}


@pytest.mark.parametrize("kind", MAPS)
def test_a_torus_in_two_parameters_and_its_strong_resonances(kind):
    (first, second, guess), bounds, form, resonances = MAPS[kind]
    orbit = nsmaps.periodic_orbit(kind(first, second), guess)
    branch = nsmaps.continue_branch(lambda a: kind(a, second), "a", orbit, first, bounds[0], step=0.05, until=(TORUS,))
    found = nsmaps.bifurcation_curve(kind, branch.of_kind(TORUS)[0], dict(zip("pq", bounds, strict=True)), second, step=0.1)
    one, other = found.parameters.T
    assert found.kind == TORUS
    assert np.abs(one - form(other)).max() < 1e-12
    assert other[0] == pytest.approx(bounds[1][0])
    assert np.abs(np.abs(found.multipliers) - 1).max() < 1e-7  # two that nearly agree are known to the root of rounding
    assert [point.kind for point in found.special] == list(resonances)
    for point in found.special:
        assert point.parameters == pytest.approx(resonances[point.kind], abs=1e-10)
    assert found.ended[1] == list(resonances)[-1]  # where the multipliers become real


class Stop(HybridSystem):
    """Oscillator with an elastic stop, whose damping may be negative."""

    zeta: float
    k: float

    states = ("x", "v")

    def period(self):
        return sp.pi

    def modes(self, t, y):
        force = sp.cos(2 * t) - 2 * self.zeta * y.v - y.x
        return {"free": {"x": y.v, "v": force}, "contact": {"x": y.v, "v": force - self.k * y.x}}

    def guards(self, t, y):
        return {"C": Guard("free", -y.x, to="contact"), "F": Guard("contact", y.x, to="free")}

    def section(self, t, y):
        return PoincareSection("C", ("v", "phi"))


def test_a_torus_of_a_system_with_modes_begins_where_damping_vanishes():
    """A period of the flow multiplies areas by exp(-2 zeta P), whatever the stop's stiffness."""
    system = Stop(zeta=0.05, k=3)
    start = nsmaps.periodic_orbit(system, [0.8, 1.9])
    branch = nsmaps.continue_branch(system, "zeta", start, 0.05, (-0.02, 0.06), direction="down", until=(TORUS,))
    event = branch.of_kind(TORUS)[0]
    found = nsmaps.bifurcation_curve(system, event, {"zeta": (-0.02, 0.06), "k": (2.8, 3.2)}, 3.0, step=0.3)
    assert len(found.parameters) > 3
    assert np.abs(found.parameters[:, 0]).max() < 1e-11


@dataclass(frozen=True)
class Moved(ReturnMap):
    """The normal form of a border collision, its border at x = 0.3: the fixed point meets it at mu = 0.3 (1 - tau + delta)."""

    mu: float
    tau: float
    coordinates = NormalForm.coordinates

    def first_return(self, states, derivative=False):
        start, border = np.asarray(states, float), np.array([0.3, 0.0])
        fixed = self.mu - 0.3 * (1 - self.tau + 0.4)  # about the border, where mu x = tau x + y + mu and y = -delta x
        found = NormalForm((0.5, 0.4), (self.tau, 0.4), fixed).first_return(start - border - [0, -0.12], derivative)
        return replace(found, start=start, image=found.image + border + [0, -0.12])


def test_the_normal_form_of_a_border_collision():
    orbit = nsmaps.periodic_orbit(Moved(1.2, -0.5), [0.6, -0.2])
    branch = nsmaps.continue_branch(lambda mu: Moved(mu, -0.5), "mu", orbit, 1.2, (-1, 2), direction="down")
    found = nsmaps.bifurcation_curve(
        Moved, branch.of_kind("border collision")[0], {"p": (-1, 2), "q": (-1.2, 0.9)}, -0.5, step=0.1
    )
    mu, tau = found.parameters.T
    assert np.ptp(mu) > 0.5
    assert np.abs(mu - 0.3 * (1 - tau + 0.4)).max() < 1e-12
    assert found.ended == ("the range of the second parameter ends at -1.2", "the range of the second parameter ends at 0.9")


@pytest.mark.thorough
def test_the_buck_converter_ceases_to_switch_where_its_ramp_begins():
    """Its switch is on for the whole ramp at v = E, which meets the ramp's lower end at E = Vref + gamma/a1."""
    system = nsmaps.load_system("buck_converter", E=12.0)
    start = nsmaps.periodic_orbit(system, [11.763, 0.537])
    branch = nsmaps.continue_branch(system, "E", start, 12.0, (11.5, 12.5), direction="down")
    event = branch.of_kind("border collision")[0]
    assert event.value == pytest.approx(11.3 + 3.8 / 8.4, abs=2 * event.precision)
    found = nsmaps.bifurcation_curve(system, event, {"E": (11.5, 12.5), "a1": (8.3, 8.5)}, 8.4, step=0.4)
    voltage, gain = found.parameters.T
    assert len(gain) > 4
    assert np.abs(voltage - 11.3 - 3.8 / gain).max() < 1e-8
    assert found.words == ("FNF",)


def test_an_orbit_that_is_at_no_border_has_no_curve():
    orbit = nsmaps.periodic_orbit(Moved(1.2, -0.5), [0.6, -0.2])
    with pytest.raises(NsmapsError, match=message("dynamics.no-border-near", distance=0.0001)):
        nsmaps.bifurcation_curve(
            Moved, BifurcationPoint("border collision", 1.2, 1e-9, orbit), {"p": (-1, 2), "q": (-1, 1)}, -0.5
        )
