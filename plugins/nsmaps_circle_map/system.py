"""Maps of the circle: smooth, with a plateau, and with a gap. The angle is phi in radians, shifts are in turns."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps import Angle, PiecewiseMap
from nsmaps.exact import Coordinates

Pieces = Mapping[str, tuple[Any, Mapping[str, Any]]]


class CircleMap(PiecewiseMap):
    """phi' = phi + 2 pi Omega - K sin phi, a diffeomorphism for K < 1.

    A rotation number p/q is there for an interval of Omega, Arnold's tongue. It begins and ends at folds:
    P. L. Boyland, Commun. Math. Phys. 106 (1986) 353. Of the rotation number 0 it is |Omega| <= K/(2 pi).
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates((Angle("phi"),))

    Omega: float = Field(description="mean shift in turns")
    K: float = Field(0.5, ge=0, description="size of the nonlinearity")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """One piece."""
        from sympy import pi, sin

        return {"S": (True, {"phi": x.phi + 2 * pi * self.Omega - self.K * sin(x.phi)})}


class PlateauCircleMap(PiecewiseMap):
    """u' = Omega + min(u/(1 - w), 1) for u = phi/(2 pi) in [0, 1): slope (S), and flat on the last part w of a turn (F).

    It is continuous on the circle and monotone, and flat somewhere, so that the intervals of Omega with rational rotation numbers
    have full measure: P. L. Boyland, Commun. Math. Phys. 106 (1986) 353. The cycle with the rotation number p/q is there, of the
    multiplier zero, while a state of it is on the plateau.
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates((Angle("phi"),))

    Omega: float = Field(description="shift in turns")
    w: float = Field(0.2, gt=0, lt=1, description="part of a turn on which the map is flat")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """The slope and the plateau."""
        from sympy import pi

        turn, shift = 2 * pi, 2 * pi * self.Omega
        return {"S": (x.phi < turn * (1 - self.w), {"phi": shift + x.phi / (1 - self.w)}), "F": (True, {"phi": shift + turn})}


class GapCircleMap(PiecewiseMap):
    """u' = a u + b mod 1 for u = phi/(2 pi) in [0, 1): letter R where the image has passed a whole turn, else L.

    With a < 1 it has a gap and adds periods as b grows: J. P. Keener, Trans. Am. Math. Soc. 261 (1980) 589. With 1 < a <= 2 and
    b <= 2 - a it is the Lorenz map of constant slope, of the topological entropy and the exponent ln a.
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates((Angle("phi"),))

    a: float = Field(0.5, gt=0, le=2, description="slope")
    b: float = Field(ge=0, le=1, description="shift in turns")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Below and from a whole turn on."""
        from sympy import pi

        image = self.a * x.phi + 2 * pi * self.b
        return {"L": (image < 2 * pi, {"phi": image}), "R": (True, {"phi": image})}
