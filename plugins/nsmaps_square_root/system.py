"""Nordmark's square-root map, the normal form of a graze: in one coordinate and in two."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps import PiecewiseMap
from nsmaps.exact import Coordinates

Pieces = Mapping[str, tuple[Any, Mapping[str, Any]]]


class SquareRoot(PiecewiseMap):
    """x -> a x + mu for x <= 0 (L, no impact), mu - sqrt(x) for x > 0 (R, an impact of low speed).

    At mu = 0 the orbit of period one without impacts grazes: A. B. Nordmark, J. Sound Vib. 145 (1991) 279.
    """

    dimensionless: ClassVar[bool] = True

    a: float = Field(gt=0, lt=1, description="multiplier of the motion without impacts")
    mu: float = Field(description="distance from the graze; impacts for positive values")

    coordinates = Coordinates(("x",))

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Without an impact and with one."""
        from sympy import sqrt

        return {"L": (x.x <= 0, {"x": self.a * x.x + self.mu}), "R": (True, {"x": self.mu - sqrt(x.x)})}


class SquareRootPlane(PiecewiseMap):
    """x -> alpha x + y + rho, y -> -gamma x for x <= 0 (L); -sqrt(x) + y + rho, -gamma tau2 x for x > 0 (R).

    The product of the multipliers of the motion without impacts is gamma, their sum alpha; tau2 is the square of the restitution
    coefficient. W. Chin, E. Ott, H. E. Nusse, C. Grebogi, Phys. Rev. E 50 (1994) 4427. At gamma = 0 it is `SquareRoot`.
    """

    dimensionless: ClassVar[bool] = True

    alpha: float = Field(description="trace of the motion without impacts")
    gamma: float = Field(ge=0, description="determinant of the motion without impacts")
    tau2: float = Field(0.25, ge=0, le=1, description="square of the restitution coefficient")
    rho: float = Field(description="distance from the graze; impacts for positive values")

    coordinates = Coordinates(("x", "y"))

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Without an impact and with one."""
        from sympy import sqrt

        return {
            "L": (x.x <= 0, {"x": self.alpha * x.x + x.y + self.rho, "y": -self.gamma * x.x}),
            "R": (True, {"x": -sqrt(x.x) + x.y + self.rho, "y": -self.gamma * self.tau2 * x.x}),
        }
