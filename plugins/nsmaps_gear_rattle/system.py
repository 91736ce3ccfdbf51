"""Gear rattle, by the closed form of the free motion within the backlash."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class GearRattle(ImpactSystem):
    """Gears with backlash: x'' + delta x' = 4 pi delta - 4 pi^2 eps cos 2 pi t - 2 pi delta eps sin 2 pi t, relative rotation x.

    At its ends, D at x = 1, to which the drag drives the gear, and C at x = -1, x' becomes -r x'. Rotation is in units of half of
    the backlash, time in periods of the eccentric drive: J. F. Mason, P. T. Piiroinen, SIAM J. Appl. Dyn. Syst. 8 (2009) 1694.

    The motion between impacts is a sum of 4 pi t, eps cos 2 pi t, a constant and a multiple of exp(-delta t). Where eps is less
    than 2 delta/sqrt(4 pi^2 + delta^2) the force always presses on D, and contact with it lasts: silent operation, besides which
    the gears may rattle.
    """

    dimensionless: ClassVar[bool] = True

    delta: float = Field(gt=0, description="drag")
    eps: float = Field(ge=0, description="eccentricity of the driving gear")
    r: float = Field(0.9, ge=0, le=1, description="restitution coefficient")

    def walls(self) -> Mapping[str, Wall]:
        """The driven side of the backlash, to which the map returns, and the other."""
        return {"D": Wall(at=1, side=1), "C": Wall(at=-1, side=-1)}

    def period(self) -> Any:
        """Of the eccentricity."""
        return 1

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        """The forced motion, and a free one that takes it to the place and velocity after the impact."""
        from sympy import cos, exp, pi, sin

        s, turn = t - hit.t, 2 * pi
        drift = hit.w - 2 * turn + turn * self.eps * sin(turn * hit.t)
        forced = 2 * turn * s + self.eps * (cos(turn * t) - cos(turn * hit.t))
        return hit.z + forced + drift * (1 - exp(-self.delta * s)) / self.delta
