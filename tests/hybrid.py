"""Piecewise-linear systems with independent references of 40 digits, and these references."""

import json
from pathlib import Path

import sympy as sp
from nsmaps_belt import Belt
from nsmaps_buck_converter import BuckConverter
from nsmaps_recoil_pair import RecoilPair
from nsmaps_rocking_block import RockingBlock
from nsmaps_soft_impact import SoftImpact
from nsmaps_two_masses import TwoMasses
from systems import BallInModes

from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface

DATA = Path(__file__).parent / "data" / "hybrid"
SYSTEMS = {
    "S1_recoil": RecoilPair,
    "S2_bilinear": SoftImpact,
    "S3_stickslip": Belt,
    "S4_rocking": RockingBlock,
    "S5_buck": BuckConverter,
    "S6_twomass": TwoMasses,
}


def reference(name):
    """The references of a system."""
    return json.loads((DATA / f"{name}.json").read_text())


def system(name, parameters, **changes):
    """A system with parameters as the references have them, decimals."""
    return SYSTEMS[name](**{key: float(value) for key, value in {**parameters, **changes}.items()})


def numbers(row):
    """Decimals as floats."""
    return [float(x) for x in row]


def word(name, found):
    """A word as the references write it: without the letter of the start, of the converter without that of the end."""
    if name == "S5_buck":
        return found if found.endswith("...") else found[:-1]
    return found[1:]


class BeforeWall(HybridSystem):
    """An oscillator before a wall, without the impact."""

    zeta: float
    w: float
    A: float
    wall: float
    r: float

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / self.w

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": self.A * sp.cos(self.w * t) - 2 * self.zeta * y.v - y.x}}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


class Friction(HybridSystem):
    """Mass on a belt of speed 1/5 whose friction is a surface of sliding, where sticking ends."""

    mu: float = 0.5

    states = ("x", "u")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = sp.cos(t) / 2 - y.u / 20 - 3 * y.x
        return {"slower": {"x": y.u, "u": force + self.mu}, "faster": {"x": y.u, "u": force - self.mu}}

    def guards(self, t, y):
        return {"stick": SlidingSurface("faster", "slower", y.u - sp.Rational(1, 5))}

    def section(self, t, y):
        return PoincareSection(("slower to stick", "faster to stick"), ("x", "phi"))


class StrobedFriction(Friction):
    """The same, once a period."""

    def guards(self, t, y):
        return {**super().guards(t, y), "O": Guard(("slower", "faster", "stick"), -sp.sin(t))}

    def section(self, t, y):
        return PoincareSection("O", ("x", "u"))


class BallUnderNoise(BallInModes):
    """The bouncing ball with noise in its acceleration."""

    noise = "noise"

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": self.Gamma * sp.sin(t) - 1 + y.noise}}
