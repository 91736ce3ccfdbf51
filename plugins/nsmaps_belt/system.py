"""Stick-slip: a mass on a belt, held by a spring, with static and kinetic friction."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class Belt(HybridSystem):
    """Mass x'' + 2 zeta x' + x = F + A cos(w t) on a belt of speed vb, with F = -mu_k sgn(x' - vb), and up to mu_s in stick."""

    zeta: float = Field(ge=0, description="damping ratio")
    vb: float = Field(gt=0, description="speed of the belt")
    mu_k: float = Field(ge=0, description="kinetic friction")
    mu_s: float = Field(gt=0, description="largest static friction")
    w: float = Field(gt=0, description="angular frequency of the forcing")
    A: float = Field(ge=0, description="amplitude of the forcing")

    states, noise = ("x", "u"), "noise"
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "work": {"formula": "A*cos(w*t)*u", "of": "flights"},
        "damping": {"formula": "2*zeta*u**2", "of": "flights"},
    }

    def period(self) -> Any:
        """Period of the forcing."""
        from sympy import pi

        return 2 * pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Slip slower and faster than the belt, and stick."""
        from sympy import cos

        force = self.A * cos(self.w * t) + y.noise - 2 * self.zeta * y.u - y.x
        slower, faster = {"x": y.u, "u": force + self.mu_k}, {"x": y.u, "u": force - self.mu_k}
        return {"slower": slower, "faster": faster, "stick": {"x": self.vb, "u": 0}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Stick K, slip below (M) and above (P) the speed of the belt, by the friction that sticking takes."""
        from sympy import cos

        normal = 2 * self.zeta * self.vb + y.x - self.A * cos(self.w * t) - y.noise
        held: dict[str, Any] = {"to": "stick", "reset": {"u": self.vb}, "where": (self.mu_s - normal, self.mu_s + normal)}
        return {
            "K from below": Guard("slower", self.vb - y.u, **held),
            "K from above": Guard("faster", y.u - self.vb, **held),
            "P through": Guard("slower", self.vb - y.u, to="faster", where=(-normal,)),
            "M through": Guard("faster", y.u - self.vb, to="slower", where=(normal,)),
            "M": Guard("stick", self.mu_s - normal, to="slower"),
            "P": Guard("stick", self.mu_s + normal, to="faster"),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Where sticking ends: place and phase."""
        return PoincareSection(("M", "P"), ("x", "phi"), states={"u": self.vb})
