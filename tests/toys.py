"""Small impact systems for the tests, with closed forms of every kind that a flight may take."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Literal

import sympy as sp
from pydantic import Field

from nsmaps.exact.system import ImpactSystem, Wall


class BouncingBall(ImpactSystem):
    """Ball on a table that moves as a sin t; the displacement is the gap, gravity is one."""

    a: float = Field(gt=0)
    r: float = Field(0.5, ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=0, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s = t - hit.t
        lift = hit.w + self.a * sp.cos(hit.t)
        return hit.z + lift * s - s**2 / 2 - self.a * (sp.sin(t) - sp.sin(hit.t))


class DraggedBall(BouncingBall):
    """The same in air, with a drag in proportion to the speed, bouncing the less the faster it is."""

    drag: float = Field(0.3, gt=0)

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s, k = t - hit.t, self.drag
        lift = hit.w + self.a * sp.cos(hit.t)
        return hit.z + (lift + 1 / k) * (1 - sp.exp(-k * s)) / k - s / k - self.a * (sp.sin(t) - sp.sin(hit.t))

    def rebound(self, speed: Any, wall: str) -> Any:
        return self.r * speed / (1 + speed / 5)


class Oscillator(ImpactSystem):
    """x'' + 2 zeta x' + x = cos(w t) with walls at +gap and -gap, by the closed form of its damping regime."""

    zeta: float = Field(gt=0)
    w: float = Field(gt=0)
    gap: float = Field(gt=0)
    r: float = Field(0.8, ge=0, le=1)
    damping: Literal["under", "over", "critical"] = "under"

    def walls(self) -> Mapping[str, Wall]:
        return {"R": Wall(at=self.gap, side=1), "L": Wall(at=-self.gap, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def forced(self, t: Any) -> Any:
        zeta = 1 if self.damping == "critical" else self.zeta
        scale = (1 - self.w**2) ** 2 + (2 * zeta * self.w) ** 2
        return ((1 - self.w**2) * sp.cos(self.w * t) + 2 * zeta * self.w * sp.sin(self.w * t)) / scale

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s = t - hit.t
        x = sp.Dummy()
        z0 = hit.z - self.forced(hit.t)
        w0 = hit.w - self.forced(x).diff(x).subs(x, hit.t)
        if self.damping == "under":
            k = sp.sqrt(1 - self.zeta**2)
            free = sp.exp(-self.zeta * s) * (z0 * sp.cos(k * s) + (w0 + self.zeta * z0) / k * sp.sin(k * s))
        elif self.damping == "critical":  # zeta = 1, whatever the field says
            free = sp.exp(-s) * (z0 + (w0 + z0) * s)
        else:
            k = sp.sqrt(self.zeta**2 - 1)
            slow, fast = -self.zeta + k, -self.zeta - k
            free = ((w0 - fast * z0) * sp.exp(slow * s) - (w0 - slow * z0) * sp.exp(fast * s)) / (2 * k)
        return free + self.forced(t)


class Table(ImpactSystem):
    """Ball between a floor and a ceiling in plain gravity, with a different restitution on each: parabolas."""

    height: float = Field(gt=0)
    floor: float = Field(0.9, ge=0, le=1)
    ceiling: float = Field(0.5, ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"F": Wall(at=0, side=-1), "C": Wall(at=self.height, side=1)}

    def period(self) -> Any:
        return 1

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s = t - hit.t
        return hit.z + hit.w * s - s**2 / 2

    def rebound(self, speed: Any, wall: str) -> Any:
        return speed * (self.floor if wall == "F" else self.ceiling)


class GearRattle(ImpactSystem):
    """A driven gear between the teeth of another: x'' + delta x' = 4 pi delta + e'' + delta e', e = eps cos 2 pi t, |x| <= 1."""

    eps: float = Field(gt=0)
    delta: float = Field(0.6, gt=0)
    r: float = Field(0.9, ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"D": Wall(at=1, side=1), "U": Wall(at=-1, side=-1)}

    def period(self) -> Any:
        return 1

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s, turn = t - hit.t, 2 * sp.pi
        rate = hit.w - 2 * turn + turn * self.eps * sp.sin(turn * hit.t)
        forced = 2 * turn * s + self.eps * (sp.cos(turn * t) - sp.cos(turn * hit.t))
        return hit.z + forced + rate * (1 - sp.exp(-self.delta * s)) / self.delta
