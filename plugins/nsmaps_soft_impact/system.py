"""The bilinear oscillator: a linear oscillator with an elastic stop."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class SoftImpact(HybridSystem):
    """Oscillator x'' + 2 xi x' + x + beta (x - e) H(x - e) = a w^2 sin(w t), H the step function: a stop at x = e.

    As beta grows, the motion tends to that of the impact oscillator with restitution 1.
    """

    xi: float = Field(ge=0, description="damping ratio")
    e: float = Field(description="place of the stop")
    a: float = Field(description="amplitude of the forcing")
    beta: float = Field(gt=0, description="stiffness of the stop over that of the spring")
    w: float = Field(gt=0, description="angular frequency of the forcing")

    states, noise = ("x", "v"), "noise"
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "work": {"formula": "a*w**2*sin(w*t)*v", "of": "flights"},
        "damping": {"formula": "2*xi*v**2", "of": "flights"},
    }

    def period(self) -> Any:
        """Period of the forcing."""
        from sympy import pi

        return 2 * pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Free, and in contact with the stop."""
        from sympy import sin

        free = self.a * self.w**2 * sin(self.w * t) + y.noise - 2 * self.xi * y.v - y.x
        return {"free": {"x": y.v, "v": free}, "contact": {"x": y.v, "v": free - self.beta * (y.x - self.e)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Contact C begins, free flight F begins; nothing jumps."""
        return {"C": Guard("free", self.e - y.x, to="contact"), "F": Guard("contact", y.x - self.e, to="free")}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Where contact begins: speed and phase."""
        return PoincareSection("C", ("v", "phi"))
