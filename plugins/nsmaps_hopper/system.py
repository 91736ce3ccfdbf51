"""The spring-loaded inverted pendulum: a mass on a spring that runs and hops."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class Hopper(HybridSystem):
    """A mass m in flight, and on a massless spring of stiffness k and length l0 whose foot rests on the ground, in SI units.

    The spring touches down at a fixed angle of attack and lifts off at its own length; y is the height of the mass, x its place
    from the foot, zero in flight. Energy is kept: at the apex of a flight the height y alone is the state, and the speed follows.
    """

    m: float = Field(80, gt=0, description="mass, kg")
    k: float = Field(20_000, gt=0, description="stiffness of the spring, N/m")
    l0: float = Field(1, gt=0, description="length of the spring without load, m")
    angle: float = Field(68, gt=0, lt=90, description="angle of attack, between spring and ground at touchdown, degrees")
    E: float = Field(1784.8, gt=0, description="energy, J")
    g: float = Field(9.81, gt=0, description="gravity, m/s^2")

    states = ("x", "y", "vx", "vy")
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "height": {"formula": "y", "of": "flights"},
        "speed": {"formula": "vx", "of": "flights"},
    }

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Free flight upwards and downwards, and stance on the spring."""
        from sympy import sqrt

        pull = self.k / self.m * (self.l0 / sqrt(y.x**2 + y.y**2) - 1)
        flight = {"x": 0, "y": y.vy, "vx": 0, "vy": -self.g}
        stance = {"x": y.vx, "y": y.vy, "vx": pull * y.x, "vy": pull * y.y - self.g}
        return {"rise": flight, "fall": flight, "stance": stance}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Touchdown T, lift-off L upwards or downwards, the apex A, and G, the ground, which ends the motion."""
        from sympy import cos, pi, sin

        attack = pi * self.angle / 180
        shorter, foot = self.l0**2 - y.x**2 - y.y**2, {"x": -self.l0 * cos(attack)}
        return {
            "T": Guard("fall", y.y - self.l0 * sin(attack), to="stance", reset=foot, crossing=True),
            "L": Guard("stance", shorter, to="rise", reset={"x": 0}, where=[y.vy]),
            "L downwards": Guard("stance", shorter, to="fall", reset={"x": 0}, where=[-y.vy]),
            "A": Guard("rise", y.vy, to="fall"),
            "G": Guard(("rise", "fall", "stance"), y.y, ends=True),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """The apex: its height."""
        from sympy import sqrt

        return PoincareSection("A", ("y",), states={"x": 0, "vx": sqrt(2 * (self.E / self.m - self.g * y.y))})
