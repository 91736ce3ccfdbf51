"""Piecewise-linear maps: the normal forms of a border collision, and the Lozi map."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps import PiecewiseMap
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact import Coordinates

Pieces = Mapping[str, tuple[Any, Mapping[str, Any]]]


class BorderCollision(PiecewiseMap):
    """x' = tau x + y + mu, y' = -delta x with tau_L, delta_L for x < 0 (L) and tau_R, delta_R for x >= 0 (R).

    tau and delta are the trace and the determinant of the derivative on either side: to first order every continuous map of the
    plane is of this form next to a border that a fixed point meets at mu = 0, if the form is observable.
    H. E. Nusse, J. A. Yorke, Physica D 57 (1992) 39; S. Banerjee, C. Grebogi, Phys. Rev. E 59 (1999) 4052.
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates(("x", "y"))

    tau_L: float = Field(description="trace of the derivative for x < 0")
    delta_L: float = Field(description="its determinant")
    tau_R: float = Field(description="trace of the derivative for x >= 0")
    delta_R: float = Field(description="its determinant")
    mu: float = Field(1.0, description="distance from the border collision")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Left and right of the border x = 0."""

        def image(tau: float, delta: float) -> Mapping[str, Any]:
            return {"x": tau * x.x + x.y + self.mu, "y": -delta * x.x}

        return {"L": (x.x < 0, image(self.tau_L, self.delta_L)), "R": (True, image(self.tau_R, self.delta_R))}


class BorderCollision1(PiecewiseMap):
    """x' = a_L x + mu for x < 0 (L), a_R x + mu + jump for x >= 0 (R).

    Without a jump it is the skew tent map, with one the normal form of a map with a gap: P. Jain, S. Banerjee, Int. J.
    Bifurcation Chaos 13 (2003) 3341. With 0 < a < 1 on either side and the jump -1 it adds periods as mu grows from 0 to 1, with
    slopes above one it is a Lorenz map: V. Avrutin, L. Gardini, I. Sushko, F. Tramontana, Continuous and Discontinuous
    Piecewise-Smooth One-Dimensional Maps, World Scientific 2019.
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates(("x",))

    a_L: float = Field(description="slope for x < 0")
    a_R: float = Field(description="slope for x >= 0")
    mu: float = Field(1.0, description="image of the border from the left")
    jump: float = Field(0.0, description="its image from the right, less that from the left")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Left and right of the border x = 0."""
        return {"L": (x.x < 0, {"x": self.a_L * x.x + self.mu}), "R": (True, {"x": self.a_R * x.x + self.mu + self.jump})}


class BorderCollision3(PiecewiseMap):
    """x' = tau x + y + mu, y' = -sigma x + z, z' = delta x: the normal form in three dimensions.

    tau, sigma and delta are the trace, the second trace and the determinant of the derivative, for x < 0 (L) and x >= 0 (R).
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates(("x", "y", "z"))

    tau_L: float = Field(description="trace of the derivative for x < 0")
    sigma_L: float = Field(description="sum of its principal minors of order two")
    delta_L: float = Field(description="its determinant")
    tau_R: float = Field(description="trace of the derivative for x >= 0")
    sigma_R: float = Field(description="sum of its principal minors of order two")
    delta_R: float = Field(description="its determinant")
    mu: float = Field(1.0, description="distance from the border collision")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Left and right of the border x = 0."""

        def image(tau: float, sigma: float, delta: float) -> Mapping[str, Any]:
            return {"x": tau * x.x + x.y + self.mu, "y": -sigma * x.x + x.z, "z": delta * x.x}

        return {
            "L": (x.x < 0, image(self.tau_L, self.sigma_L, self.delta_L)),
            "R": (True, image(self.tau_R, self.sigma_R, self.delta_R)),
        }


class Lozi(PiecewiseMap):
    """x' = 1 - a |x| + y, y' = b x: the border-collision form with the traces a and -a, the determinants -b and mu = 1.

    R. Lozi, J. Phys. Colloq. 39 (1978) C5-9; the attractor is strange for b > 0, a sqrt(2) > b + 2, b < (a^2 - 1)/(2 a + 1) and
    2 a + b < 4: M. Misiurewicz, Ann. N. Y. Acad. Sci. 357 (1980) 348.
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates(("x", "y"))

    a: float = Field(1.7, description="slope on either side")
    b: float = Field(0.5, description="minus the determinant")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Left and right of the border x = 0."""
        image = {"y": self.b * x.x}
        return {"L": (x.x < 0, {"x": 1 + self.a * x.x + x.y, **image}), "R": (True, {"x": 1 - self.a * x.x + x.y, **image})}


class UnitTent(PiecewiseMap):
    """x' = x/a for x < a (L), (1 - x)/(1 - a) for x >= a (R): the skew tent map of [0, 1] onto itself.

    Each point has two preimages. The density is uniform, so that the exponent is -a ln a - (1 - a) ln(1 - a).
    """

    dimensionless: ClassVar[bool] = True
    coordinates = Coordinates(("x",))

    a: float = Field(0.5, gt=0, lt=1, description="place of the tip")

    def pieces(self, x: SimpleNamespace) -> Pieces:
        """Left and right of the tip."""
        return {"L": (x.x < self.a, {"x": x.x / self.a}), "R": (True, {"x": (1 - x.x) / (1 - self.a)})}


def normal_form(n: int) -> type[PiecewiseMap]:
    """The class of the normal form in n dimensions, x1, ..., xn.

    On either side xk' = -dk x1 + x(k+1), with mu added to the first and nothing to the last, where dk is the coefficient of
    lambda^(n-k) in the characteristic polynomial of the derivative: fields d1_L, ..., dn_L for x1 < 0, d1_R, ..., dn_R for
    x1 >= 0, and mu. M. di Bernardo, M. I. Feigin, S. J. Hogan, M. E. Homer, Chaos Solitons Fractals 10 (1999) 1881.

    Raises:
        SystemDefinitionError: n is not a whole number of one or more.
    """
    if not (isinstance(n, int) and n >= 1):
        raise SystemDefinitionError(f"the normal form in {n} dimensions; expected: a whole number of one or more")
    name = f"NormalForm{n}"
    if name not in globals():
        globals()[name] = _normal_form(name, n)
    found: type[PiecewiseMap] = globals()[name]
    return found


def _normal_form(name: str, n: int) -> type[PiecewiseMap]:
    sides = {side: [f"d{k}_{side}" for k in range(1, n + 1)] for side in "LR"}
    names = tuple(f"x{k}" for k in range(1, n + 1))

    def pieces(self: Any, x: SimpleNamespace) -> Pieces:
        first, *others = (getattr(x, each) for each in names)

        def image(side: str) -> Mapping[str, Any]:
            added = [*others, 0]
            added[0] += self.mu
            rows = zip(names, sides[side], added, strict=True)
            return {each: -getattr(self, d) * first + more for each, d, more in rows}

        return {"L": (first < 0, image("L")), "R": (True, image("R"))}

    fields = {
        each: Field(description=f"coefficient {k} of the characteristic polynomial for x1 {'<' if side == 'L' else '>='} 0")
        for side in "LR"
        for k, each in enumerate(sides[side], 1)
    } | {"mu": Field(1.0, description="distance from the border collision")}
    text = f"The normal form of a border collision in {n} dimensions; see `normal_form`."
    about = {"__module__": __name__, "__doc__": text, "__annotations__": dict.fromkeys(fields, float), "dimensionless": True}
    own = {**about, **fields, "coordinates": Coordinates(names), "pieces": pieces}
    return type(name, (PiecewiseMap,), own)


def __getattr__(name: str) -> Any:
    """The class `NormalFormN` of n dimensions, as other processes ask for it."""
    if name.startswith("NormalForm") and name[10:].isdigit():
        return normal_form(int(name[10:]))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
