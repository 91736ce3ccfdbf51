"""A wheel of spokes without a rim that rolls down a slope."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class RimlessWheel(HybridSystem):
    """The spoke on the ground is an inverted pendulum, th'' = sin(th), th from the vertical, down the slope.

    Spokes are 2 alpha apart. The next one strikes the slope at th = gamma + alpha or, backwards, at gamma - alpha. It becomes the
    one on the ground, and th' is multiplied by cos(2 alpha). Time is in units of (l/g)^(1/2), the mass is in the hub.
    """

    dimensionless: ClassVar[bool] = True

    alpha: float = Field(gt=0, lt=0.785, description="half of the angle between spokes, radians")
    gamma: float = Field(ge=0, description="slope, radians")

    states = ("th", "w")
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {"loss": {"formula": "(w**2 - w_after**2)/2"}}

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Rolling on one spoke."""
        from sympy import sin

        return {"roll": {"th": y.w, "w": sin(y.th)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Steps forwards, F, and backwards, B."""
        from sympy import cos

        slower = cos(2 * self.alpha) * y.w
        return {
            "F": Guard("roll", self.gamma + self.alpha - y.th, reset={"th": y.th - 2 * self.alpha, "w": slower}),
            "B": Guard("roll", y.th + self.alpha - self.gamma, reset={"th": y.th + 2 * self.alpha, "w": slower}),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before a step forwards: the angular speed."""
        return PoincareSection("F", ("w",))
