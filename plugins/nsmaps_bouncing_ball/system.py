"""The bouncing ball on a sinusoidal table, by its exact implicit map."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class BouncingBall(ImpactSystem):
    """Ball on a table that moves as Gamma sin t; the displacement is the gap x between them, x'' = -1 + Gamma sin t.

    Time is in units of 1/omega, length in g/omega^2, speed in g/omega, with the table's motion A sin(omega t), its angular
    frequency omega and gravity g. The time of the next impact solves the flight's equation, and is not taken from the
    high-bounce approximation (standard map), whose table does not move between impacts: N. B. Tufillaro, T. Abbott, J. Reilly,
    An Experimental Approach to Nonlinear Dynamics and Chaos, Addison-Wesley 1992, chapter 1.

    One impact a period, v = 2 pi/(1 + r) at cos phi = pi (1 - r)/(Gamma (1 + r)), is there from Gamma = pi (1 - r)/(1 + r) on and
    doubles its period at Gamma^2 = (pi (1 - r)/(1 + r))^2 + (2 (1 + r^2)/(1 + r)^2)^2. A ball at rest is released where
    Gamma sin phi = 1, permanently at rest if Gamma < 1.
    """

    dimensionless: ClassVar[bool] = True

    Gamma: float = Field(gt=0, description="largest acceleration of the table in units of gravity, A omega^2/g")
    r: float = Field(0.5, ge=0, le=1, description="restitution coefficient")

    def walls(self) -> Mapping[str, Wall]:
        """The table: it stops a gap that falls."""
        return {"B": Wall(at=0, side=-1)}

    def period(self) -> Any:
        """Of the table's motion."""
        from sympy import pi

        return 2 * pi

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        """The ball's parabola less the table's motion."""
        from sympy import cos, sin

        s = t - hit.t
        lift = hit.w + self.Gamma * cos(hit.t)
        return hit.z + lift * s - s**2 / 2 - self.Gamma * (sin(t) - sin(hit.t))

    def absolute(self, t: Any, displacement: Any) -> Any:
        """Height, the table's mean at zero."""
        from numpy import sin

        return self.Gamma * sin(t) + displacement
