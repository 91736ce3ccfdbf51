"""The vibro-impact pair whose capsule recoils: a ball in a capsule of finite mass on a weak spring."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class RecoilPair(HybridSystem):
    """Capsule X'' = cos(pi t) - kappa X - Lambda X', ball of mass ratio eta in it; x is the capsule's place less the ball's.

    At |x| = d/2 momentum is kept and x' becomes -r x'. For eta = 0 the ball does not act on the capsule, and x moves as the
    displacement of the vibro-impact pair.
    """

    eta: float = Field(ge=0, description="mass of the ball over that of the capsule")
    kappa: float = Field(ge=0, description="stiffness of the capsule's spring")
    Lambda: float = Field(ge=0, description="damping of the capsule")
    d: float = Field(gt=0, description="length of the capsule")
    r: float = Field(0.5, ge=0, le=1, description="restitution coefficient")
    g_bar: float = Field(description="gravity along the capsule")

    contact: bool = False  #: whether impacts that accumulate lead to contact that lasts; without it they are followed one by one

    states, noise = ("x", "v", "X", "V"), "noise"
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "loss": {"formula": "eta/(1 + eta)*(v**2 - v_after**2)/2"},
        "work": {"formula": "cos(pi*t)*V", "of": "flights"},
        "damping": {"formula": "Lambda*V**2", "of": "flights"},
        "ball": {"formula": "eta*(V - v)**2/2", "of": "flights", "per": "V**2/2 + kappa*X**2/2 + eta*(V - v)**2/2"},
    }

    def period(self) -> Any:
        """Period of the forcing."""
        return 2

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Free flight of the ball, and the capsule on its spring."""
        from sympy import cos, pi

        capsule = cos(pi * t) + y.noise - self.kappa * y.X - self.Lambda * y.V
        return {"flight": {"x": y.v, "v": capsule + self.g_bar, "X": y.V, "V": capsule}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Impacts at the base B and at the top T."""
        reset = {"v": -self.r * y.v, "V": y.V - self.eta * (1 + self.r) / (1 + self.eta) * y.v}
        return {
            "B": Guard("flight", self.d / 2 - y.x, reset=reset, rests="base" * self.contact),
            "T": Guard("flight", self.d / 2 + y.x, reset=reset, rests="top" * self.contact),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before an impact at B: relative speed, place and velocity of the capsule, phase."""
        return PoincareSection("B", ("v", "X", "V", "phi"))
