"""The vibro-impact pair, eq. relvar and eq. eq_impact, in the dimensionless variables of the paper."""

from collections.abc import Mapping
from math import pi, sin
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall

DERIVED = {
    "d": ("s", "M", "omega", "F"),
    "g_bar": ("M", "g", "beta", "F"),
}
POSITIVE = {"M", "F", "s", "omega"}
PHYSICAL = {
    "M": "capsule mass, kg (with others, instead of d or g_bar)",
    "F": "amplitude of the forcing, N",
    "g": "gravity, m/s^2",
    "beta": "tilt of the capsule, rad",
    "s": "length of the capsule, m",
    "omega": "angular frequency of the forcing, rad/s",
}


class VIPair(ImpactSystem):
    """Ball in a capsule that is shaken by cos(pi t + psi), tilted by beta; Z is the capsule's place relative to the ball's.

    The bottom membrane B is met at Z = d/2 with growing Z, the top T at Z = -d/2. The map returns to the membrane `base`: to B by
    words such as BTB, to T by TT and TBT. As the force cos(pi t) changes its sign after half a period, -Z(t - 1) is a motion with
    -g_bar, B and T exchanged: P(v, phi) on T is P(v, phi + pi) on B for -g_bar, its phase less pi. Give d and g_bar, or either of
    them by the physical quantities of eq. eq_impact: d = s M omega^2/(F pi^2), g_bar = M g sin(beta)/F, with capsule mass M (kg),
    forcing F (N), gravity g (m/s^2), tilt beta (rad), capsule length s (m) and angular frequency omega (rad/s).
    """

    dimensionless: ClassVar[bool] = True
    instead: ClassVar[Mapping[str, str]] = PHYSICAL

    d: float = Field(gt=0, description="dimensionless length of the capsule")
    r: float = Field(0.5, ge=0, le=1, description="restitution coefficient")
    g_bar: float = Field(description="dimensionless gravity along the capsule")
    base: Literal["B", "T"] = Field(default="B", description="membrane to which the map returns")

    def walls(self) -> Mapping[str, Wall]:
        """The membrane to which the map returns, and the other one."""
        bottom, top = ("B", Wall(at=self.d / 2, side=1)), ("T", Wall(at=-self.d / 2, side=-1))
        return dict((bottom, top) if self.base == "B" else (top, bottom))

    def period(self) -> Any:
        """Of the forcing cos(pi t)."""
        return 2

    def capsule(self, t: Any) -> Any:
        """The place X* of the capsule's middle, in sympy: F2 of eq. relvar, whose second derivative is the force F of unit norm.

        Here F = cos(pi t). A subclass with another force of period 2 defines this anew, and nothing else.
        """
        from sympy import cos, pi

        return -cos(pi * t) / pi**2

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        """Eq. relvar, with the place of the capsule as F2 and its rate as F1."""
        from sympy import Dummy

        at, s = Dummy(), t - hit.t
        drift = hit.w - self.capsule(at).diff(at).subs(at, hit.t)
        return hit.z + drift * s + self.g_bar * s**2 / 2 + self.capsule(t) - self.capsule(hit.t)

    def absolute(self, t: Any, displacement: Any) -> Any:
        """Place along the capsule, upwards: Z = X - x with the capsule's middle X, of a force without a mean about zero."""
        from sympy import Dummy, lambdify

        at = Dummy()
        return self._once("capsule", lambda: lambdify(at, self.capsule(at)))(t) - displacement

    @model_validator(mode="before")
    @classmethod
    def _from_physical(cls, data: Any) -> Any:
        """Replace physical quantities by the dimensionless parameters that they define."""
        if not isinstance(data, dict):
            return data
        given = {name: data[name] for name in data if name in PHYSICAL}
        others = {name: value for name, value in data.items() if name not in PHYSICAL}
        if not given:
            return others
        for name, value in given.items():
            if not isinstance(value, (int, float)) or not abs(value) < float("inf") or (name in POSITIVE and value <= 0):
                raise ValueError(f"{name} is {value!r}; expected: a {'positive ' if name in POSITIVE else ''}number")
        used: set[str] = set()
        for target, needed in DERIVED.items():
            if target not in others and all(name in given for name in needed):
                others[target] = _dimensionless(target, given)
                used.update(needed)
        if unused := sorted(set(given) - used):
            raise ValueError(
                f"{', '.join(unused)} given but not used: d follows from s, M, omega, F and g_bar from M, g, beta, F, "
                "each all together and not beside d or g_bar itself"
            )
        return others


def _dimensionless(name: str, q: dict[str, float]) -> float:
    """d or g_bar of eq. eq_impact from the physical quantities."""
    if name == "d":
        return q["s"] * q["M"] * q["omega"] ** 2 / (q["F"] * pi**2)
    return q["M"] * q["g"] * sin(q["beta"]) / q["F"]
