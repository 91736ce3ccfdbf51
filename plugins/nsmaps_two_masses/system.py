"""Two masses on springs, the first with a stop."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class TwoMasses(HybridSystem):
    """A chain of two masses, m1 x'' + (c1 + c2) x' - c2 x2' + (k1 + k2) x - k2 x2 = f cos(w t), with a stop at x = d.

    The second mass hangs on the first, m2 x2'' + c2 (x2' - x') + k2 (x2 - x) = 0; c1 = b k1, c2 = b k2. At x = d, x' becomes
    -r x'.
    """

    m1: float = Field(1, gt=0, description="mass with the stop")
    m2: float = Field(1, gt=0, description="second mass")
    k1: float = Field(1, ge=0, description="stiffness of the first spring")
    k2: float = Field(1, ge=0, description="stiffness of the second spring")
    b: float = Field(0.1, ge=0, description="damping of the springs over their stiffness")
    f: float = Field(1, description="amplitude of the force on the first mass")
    r: float = Field(0.8, ge=0, le=1, description="restitution coefficient")
    d: float = Field(0, description="place of the stop")
    w: float = Field(gt=0, description="angular frequency of the force")

    states = ("x", "v", "x2", "v2")
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "loss": {"formula": "m1*(v**2 - v_after**2)/2"},
        "work": {"formula": "f*cos(w*t)*v", "of": "flights"},
        "damping": {"formula": "b*k1*v**2 + b*k2*(v2 - v)**2", "of": "flights"},
    }

    def period(self) -> Any:
        """Period of the force."""
        from sympy import pi

        return 2 * pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Free motion of both masses."""
        from sympy import cos

        link = self.k2 * (y.x2 - y.x) + self.b * self.k2 * (y.v2 - y.v)
        force = self.f * cos(self.w * t) - self.k1 * y.x - self.b * self.k1 * y.v
        return {"free": {"x": y.v, "v": (force + link) / self.m1, "x2": y.v2, "v2": -link / self.m2}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Impact I of the first mass."""
        return {"I": Guard("free", self.d - y.x, reset={"v": -self.r * y.v})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before an impact: speed, place and velocity of the second mass, phase."""
        return PoincareSection("I", ("v", "x2", "v2", "phi"))
