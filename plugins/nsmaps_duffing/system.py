"""A Duffing oscillator with a stop, by its equation of motion."""

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class DuffingStop(ImpactSystem):
    """Oscillator x'' + c x' + a x + b x^3 = f cos(w t) below a stop at x = d, where growing x is stopped: x' becomes -r x'.

    A spring that hardens has a > 0 and b > 0, one with two wells a < 0 and b > 0. With b < 0 the oscillator may escape over the
    edge of its well to minus infinity; its return is `escaped` then. At b = 0 it is the linear impact oscillator.
    """

    dimensionless: ClassVar[bool] = True

    c: float = Field(ge=0, description="damping")
    a: float = Field(description="linear stiffness; negative for two wells")
    b: float = Field(description="cubic stiffness")
    f: float = Field(ge=0, description="amplitude of the forcing")
    w: float = Field(gt=0, description="angular frequency of the forcing")
    d: float = Field(description="place of the stop; the spring's force vanishes at zero")
    r: float = Field(0.8, ge=0, le=1, description="restitution coefficient")

    def walls(self) -> Mapping[str, Wall]:
        """The stop."""
        return {"B": Wall(at=self.d, side=1)}

    def period(self) -> Any:
        """Of the forcing."""
        from sympy import pi

        return 2 * pi / self.w

    def acceleration(self, t: Any, place: Any, velocity: Any) -> Any:
        """The equation of motion."""
        from sympy import cos

        return self.f * cos(self.w * t) - self.c * velocity - self.a * place - self.b * place**3
