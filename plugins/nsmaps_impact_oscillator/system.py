"""The linear oscillator with one wall, by the closed form of its flight in each regime of damping."""

from collections.abc import Mapping
from math import hypot
from types import SimpleNamespace
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class ImpactOscillator(ImpactSystem):
    """Oscillator x'' + 2 zeta x' + x = A cos(w t) below a wall at x = wall, where growing x is stopped: x' becomes -r x'.

    Time is in units of 1/omega_0 with the natural frequency omega_0, the place in any length l. The wall is at the distance
    wall > 0 from the oscillator at rest; at wall = 0 it touches it, at wall < 0 the spring presses the oscillator on it.
    The form x'' + b x' + x = -1 + A cos(w t) with its wall at zero is zeta = b/2, wall = 1.

    For wall > 0 the steady motion grazes at the amplitude A = wall sqrt((1 - w^2)^2 + (2 zeta w)^2); below it orbits near it
    do not reach the wall, and their return is `escaped`. Beyond it the return map has a term in the square root of the
    distance from the graze: A. B. Nordmark, J. Sound Vib. 145 (1991) 279; S. W. Shaw, P. J. Holmes, J. Sound Vib. 90 (1983) 129.
    """

    units: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("A", "wall", "displacement"), "ℓ"),
        **dict.fromkeys(("v", "velocity"), "ω₀ℓ"),
        "time": "1/ω₀",
    }

    zeta: float = Field(ge=0, description="damping ratio, half of the coefficient b of x'")
    w: float = Field(gt=0, description="angular frequency of the forcing over the natural one")
    A: float = Field(gt=0, description="amplitude of the forcing")
    wall: float = Field(description="place of the wall; the spring's force vanishes at zero")
    r: float = Field(0.9, ge=0, le=1, description="restitution coefficient")
    damping: Literal["under", "critical", "over"] = Field(
        "under", description="zeta < 1, zeta = 1 or zeta > 1: under, critical, over"
    )

    def walls(self) -> Mapping[str, Wall]:
        """The one wall."""
        return {"B": Wall(at=self.wall, side=1)}

    def period(self) -> Any:
        """Of the forcing."""
        from sympy import pi

        return 2 * pi / self.w

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        """The steady motion, and a free one that takes it to the place and velocity after the impact."""
        from sympy import Dummy

        x = Dummy()
        steady = self._steady(x)
        z, w = hit.z - steady.subs(x, hit.t), hit.w - steady.diff(x).subs(x, hit.t)
        return steady.subs(x, t) + self._free(t - hit.t, z, w)

    def grazing_amplitude(self) -> float:
        """The amplitude A of the forcing at which the steady motion, of amplitude A/sqrt((1 - w^2)^2 + (2 zeta w)^2), grazes.

        Zero or negative where the wall is at the spring's rest or presses on it: there is no steady motion without impacts.
        """
        return self.wall * hypot(1 - self.w**2, 2 * self.zeta * self.w)

    def _steady(self, t: Any) -> Any:
        """The motion that is left when no impact comes."""
        from sympy import cos, sin

        zeta = 1 if self.damping == "critical" else self.zeta
        spring, damper = 1 - self.w**2, 2 * zeta * self.w
        return self.A * (spring * cos(self.w * t) + damper * sin(self.w * t)) / (spring**2 + damper**2)

    def _free(self, s: Any, z: Any, w: Any) -> Any:
        """The motion without forcing, from the place z with the velocity w."""
        from sympy import cos, exp, sin, sinh, sqrt

        if self.damping == "critical":
            return exp(-s) * (z + (w + z) * s)
        if self.damping == "under":
            k = sqrt(1 - self.zeta**2)
            return exp(-self.zeta * s) * (z * cos(k * s) + (w + self.zeta * z) * sin(k * s) / k)
        k = sqrt(self.zeta**2 - 1)
        slow = -1 / (self.zeta + k)  # which is -zeta + k
        return z * exp(slow * s) + (w - slow * z) * exp(-self.zeta * s) * sinh(k * s) / k

    @model_validator(mode="after")
    def _of_its_regime(self) -> Self:
        regime = "under" if self.zeta < 1 else "over" if self.zeta > 1 else "critical"
        if self.damping != regime:
            raise ValueError(
                f"zeta = {self.zeta!r} is not {self.damping!r} damping; expected: damping: {regime}, or another zeta"
            )
        if self.zeta == 0 and self.w == 1:
            raise ValueError("zeta = 0 with w = 1 is resonance, where no motion is steady; expected: another w, or damping")
        return self
