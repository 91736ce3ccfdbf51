"""A pressure relief valve that strikes its seat."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class ReliefValve(HybridSystem):
    """Lift x of the disc, its speed v and the pressure p: x'' = -kappa x' - (x + delta) + p, p' = beta (q - x sqrt(p)).

    At the seat, x = 0, v becomes -r v. Dimensionless, after Hős and Champneys (Physica D 241 (2012) 2068).
    """

    dimensionless: ClassVar[bool] = True

    kappa: float = Field(1.25, ge=0, description="damping of the disc")
    delta: float = Field(10, ge=0, description="precompression of the spring")
    beta: float = Field(20, gt=0, description="stiffness of the fluid in the tank")
    r: float = Field(0.8, ge=0, le=1, description="restitution coefficient of the seat")
    q: float = Field(gt=0, description="inflow into the tank")

    contact: bool = False  #: whether impacts that accumulate close the valve; without it they are followed one by one

    states = ("x", "v", "p")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """The open valve."""
        from sympy import sqrt

        force = y.p - y.x - self.delta - self.kappa * y.v
        return {"open": {"x": y.v, "v": force, "p": self.beta * (self.q - y.x * sqrt(y.p))}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Impacts I on the seat."""
        return {"I": Guard("open", y.x, reset={"v": -self.r * y.v}, rests="closed" * self.contact)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before an impact: speed, negative, and pressure."""
        return PoincareSection("I", ("v", "p"))


class ReliefValveLift(ReliefValve):
    """The same valve from one maximum of its lift to the next, whether it strikes the seat between them or not."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """Impacts I on the seat, and maxima M of the lift."""
        return {**super().guards(t, y), "M": Guard("open", y.v)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """A maximum of the lift: lift and pressure."""
        return PoincareSection("M", ("x", "p"))
