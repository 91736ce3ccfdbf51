"""The rocking block of Housner for small angles: a flight that grows, an impact at each crossing, overturning."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class RockingBlock(HybridSystem):
    """Block x'' = x - sgn(x) + a cos(w t); at x = 0 x' becomes r x'; at |x| = 2 it has overturned, which ends the motion.

    S. J. Hogan, Proc. R. Soc. Lond. A 425 (1989) 441.
    """

    a: float = Field(ge=0, description="amplitude of the forcing")
    w: float = Field(gt=0, description="angular frequency of the forcing")
    r: float = Field(0.9, gt=0, le=1, description="restitution coefficient")

    states = ("x", "v")
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "loss": {"formula": "(v**2 - v_after**2)/2"},
        "work": {"formula": "a*cos(w*t)*v", "of": "flights"},
    }

    def period(self) -> Any:
        """Period of the forcing."""
        from sympy import pi

        return 2 * pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """About the right and about the left corner."""
        from sympy import cos

        force = y.x + self.a * cos(self.w * t)
        return {"right": {"x": y.v, "v": force - 1}, "left": {"x": y.v, "v": force + 1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """On to the left corner (L) and to the right one (R), each with a loss, and overturning (E)."""
        loss = {"v": self.r * y.v}
        return {
            "L": Guard("right", y.x, to="left", reset=loss),
            "R": Guard("left", -y.x, to="right", reset=loss),
            "E to the right": Guard("right", 2 - y.x, ends=True),
            "E to the left": Guard("left", 2 + y.x, ends=True),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just after the block came to its right corner: speed and phase."""
        return PoincareSection("R", ("v", "phi"), side="after")
