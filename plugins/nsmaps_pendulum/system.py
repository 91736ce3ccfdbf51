"""A pendulum with a stop, by its equation of motion."""

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class PendulumStop(ImpactSystem):
    """Pendulum theta'' + c theta' + sin theta = f cos(w t) with a stop at theta = stop: there growing theta' becomes -r theta'.

    Time is in units of the small oscillations, angles are radians from the lowest place. The angle counts turns: a pendulum that
    goes over the top leaves the stop by one turn and meets it again only when it comes back the same way.
    """

    dimensionless: ClassVar[bool] = True

    c: float = Field(ge=0, description="damping")
    f: float = Field(ge=0, description="amplitude of the torque")
    w: float = Field(gt=0, description="angular frequency of the torque")
    stop: float = Field(description="angle of the stop")
    r: float = Field(0.8, ge=0, le=1, description="restitution coefficient")

    def walls(self) -> Mapping[str, Wall]:
        """The stop."""
        return {"B": Wall(at=self.stop, side=1)}

    def period(self) -> Any:
        """Of the torque."""
        from sympy import pi

        return 2 * pi / self.w

    def acceleration(self, t: Any, place: Any, velocity: Any) -> Any:
        """The equation of motion."""
        from sympy import cos, sin

        return self.f * cos(self.w * t) - self.c * velocity - sin(place)
