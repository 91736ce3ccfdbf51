"""Letters of the equations in LaTeX: those of a system's parameters and states are not used for anything else."""

import re

import sympy as sp
from pydantic import Field

from nsmaps import Guard, HybridSystem, ImpactSystem, PoincareSection, Wall
from nsmaps.exports.equations.letters import CHOICES, letters_beside
from nsmaps.exports.equations.modes import mode_files
from nsmaps.exports.equations.system import system_files


class Taken(ImpactSystem):
    """A damped spring whose parameters have the letters of the equations."""

    P: float = Field(2.0)
    w: float = Field(3.0)
    Z: float = Field(0.5)
    t: float = Field(0.1)
    u_0: float = Field(0.2)
    rho: float = Field(0.7)

    def walls(self):
        return {"A": Wall(at=self.Z, side=1)}

    def period(self):
        return self.P

    def rebound(self, speed, wall):
        return self.rho * speed / (1 + self.u_0 * speed)

    def displacement(self, t, hit):
        s, rate = t - hit.t, sp.sqrt(self.w**2 - self.t**2)
        pushed = sp.cos(2 * sp.pi * hit.t / self.P)
        free = sp.exp(-self.t * s) * ((hit.z - pushed) * sp.cos(rate * s) + (hit.w + self.t * hit.z) / rate * sp.sin(rate * s))
        return free + sp.cos(2 * sp.pi * t / self.P)


class Parcel(HybridSystem):
    """A state and a parameter named as the time and the functions of events."""

    g: float = 9.81
    P: float = 2.0
    states = ("t", "v")

    def period(self):
        return self.P

    def modes(self, t, y):
        return {"fly": {"t": y.v, "v": -self.g + sp.cos(2 * sp.pi * t / self.P)}}

    def guards(self, t, y):
        return {"B": Guard("fly", y.t, reset={"v": -0.5 * y.v})}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


def test_quantities_have_letters_that_no_parameter_has():
    (text,) = system_files(Taken()).values()
    period = re.search(r"The forcing has the period \$(\S+) = P\$", text)
    assert period is not None
    assert period[1] not in ("P", "w", "Z", "t")
    assert r"_j = " not in text.split("Between")[0]
    between = re.search(r"the one at time \$(\S+)_j\$ at displacement \$(\S+)_j\$ with velocity \$(\S+)_j\$", text)
    assert between is not None
    assert not {"P", "w", "Z", "t", "u"} & set(between.groups())
    assert len(set(between.groups())) == 3
    assert r"\rho_{A}" not in text
    assert text.count("&=") + text.count("&\\quad") < 14  # not multiplied out


def test_systems_with_modes_have_a_time_and_a_period_of_their_own():
    (text,) = mode_files(Parcel()).values()
    assert "The forcing has the period $T = P$." in text
    assert r"\cos{\left(\frac{2 \pi \tau}{P} \right)}" in text
    assert "\nf &= t\n" in text


def test_a_system_that_takes_all_choices_leaves_one_with_a_prime():
    taken = [choice.strip("\\") for choice in CHOICES["period"]]
    own = letters_beside(taken)
    assert own["period"] == "P'"
    assert len(set(own.values())) == len(own)
