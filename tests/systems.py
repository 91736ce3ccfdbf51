"""Example systems of the tests: impact systems with closed forms of every kind that a flight may take, a ball in modes,
and maps.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Literal

import sympy as sp
from pydantic import Field

from nsmaps import Guard, HybridSystem, PiecewiseMap, PoincareSection, SlidingSurface
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


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


class Cam(ImpactSystem):
    """A follower m y'' = -P - k y - c y' above a cam at a cos wt + b cos 2wt; the displacement is the gap."""

    w: float
    r: float = 0.4
    k: float = 100.0
    c: float = 0.5
    preload: float = 40.0
    a: float = 0.01
    b: float = 0.002

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=0, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def profile(self, t: Any) -> Any:
        return self.a * sp.cos(self.w * t) + self.b * sp.cos(2 * self.w * t)

    def displacement(self, t: Any, hit: Any) -> Any:
        s, x, damping = t - hit.t, sp.Dummy(), self.c / 2
        rate = sp.sqrt(self.k - damping**2)
        y = hit.z + self.profile(hit.t) + self.preload / self.k
        v = hit.w + self.profile(x).diff(x).subs(x, hit.t)
        free = sp.exp(-damping * s) * (y * sp.cos(rate * s) + (v + damping * y) / rate * sp.sin(rate * s))
        return free - self.preload / self.k - self.profile(t)


class Textbook(ImpactSystem):
    """x'' + 2 zeta x' + x = A cos(w t) above a wall, by hyperbolic functions, by circular ones or by two exponentials."""

    zeta: float
    w: float = 1.0
    A: float = 4.0
    wall: float = 0.1
    r: float = 0.8
    by: str = "cosh"

    def walls(self):
        return {"B": Wall(at=self.wall, side=-1)}

    def period(self):
        return 2 * sp.pi / self.w

    def steady(self, t):
        spring, damper = 1 - self.w**2, 2 * self.zeta * self.w
        return self.A * (spring * sp.cos(self.w * t) + damper * sp.sin(self.w * t)) / (spring**2 + damper**2)

    def displacement(self, t, hit):
        s, x, zeta = t - hit.t, sp.Dummy(), self.zeta
        z, w = hit.z - self.steady(hit.t), hit.w - self.steady(x).diff(x).subs(x, hit.t)
        if self.by == "cos":
            k = sp.sqrt(1 - zeta**2)
            return self.steady(t) + sp.exp(-zeta * s) * (z * sp.cos(k * s) + (w + zeta * z) / k * sp.sin(k * s))
        k = sp.sqrt(zeta**2 - 1)
        if self.by == "cosh":
            return self.steady(t) + sp.exp(-zeta * s) * (z * sp.cosh(k * s) + (w + zeta * z) / k * sp.sinh(k * s))
        slow, fast = -zeta + k, -zeta - k
        return self.steady(t) + ((w - fast * z) * sp.exp(slow * s) - (w - slow * z) * sp.exp(fast * s)) / (2 * k)


class Dragged(ImpactSystem):
    """x'' = -1 - c x' + a sin t above a floor."""

    c: float
    a: float
    r: float = 0.8

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        def carried(t):
            return -t / self.c - self.a * (sp.sin(t) + self.c * sp.cos(t)) / (1 + self.c**2)

        x = sp.Dummy()
        w = hit.w - carried(x).diff(x).subs(x, hit.t)
        return hit.z + carried(t) - carried(hit.t) + w * (1 - sp.exp(-self.c * (t - hit.t))) / self.c


class Saddle(ImpactSystem):
    """x'' = k^2 (x - tilt) + sin(4 t), between walls at 0 and 1: what grows and what decays of a flight may cancel."""

    k: float
    tilt: float = 0.5
    r: float = 0.7
    horizon = 2.0

    def walls(self):
        return {"F": Wall(at=0, side=-1), "C": Wall(at=1, side=1)}

    def period(self):
        return sp.pi / 2

    def displacement(self, t, hit):
        def steady(t):
            return self.tilt - sp.sin(4 * t) / (16 + self.k**2)

        s, x = t - hit.t, sp.Dummy()
        z, w = hit.z - steady(hit.t), hit.w - steady(x).diff(x).subs(x, hit.t)
        return steady(t) + z * sp.cosh(self.k * s) + w / self.k * sp.sinh(self.k * s)


class BallInModes(HybridSystem):
    """The bouncing ball, whose states are relative to the table."""

    Gamma: float = 1.2
    r: float = 0.4

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1 + self.Gamma * sp.sin(t)}}

    def guards(self, t, y):
        return {"B": Guard("flight", y.x, reset={"v": -self.r * y.v}, rests="table")}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


class Coulomb(HybridSystem):
    """Mass x'' + 2 zeta x' + x = F + A cos(w t) on a belt of speed vb, F = -mu (1 + load x) sgn(x' - vb)."""

    zeta: float = 0.02
    vb: float = 0.5
    mu: float = 0.6
    A: float = 0.3
    w: float = 1.3
    load: float = 0.0

    states = ("x", "u")

    def period(self):
        return 2 * sp.pi / self.w

    def force(self, t, y):
        return self.A * sp.cos(self.w * t) - 2 * self.zeta * y.u - y.x

    def modes(self, t, y):
        force, friction = self.force(t, y), self.mu * (1 + self.load * y.x)
        return {"slower": {"x": y.u, "u": force + friction}, "faster": {"x": y.u, "u": force - friction}}

    def guards(self, t, y):
        return {"stick": SlidingSurface("faster", "slower", y.u - self.vb, letters={"stick": "K", "faster": "P", "slower": "M"})}

    def section(self, t, y):
        return PoincareSection(("stick to slower", "stick to faster"), ("x", "phi"))


class Lozi(PiecewiseMap):
    """x' = 1 + y - a |x|, y' = b x, in its two affine pieces."""

    a: float = 1.7
    b: float = 0.5
    coordinates = ("x", "y")

    def pieces(self, x):
        return {
            "L": (x.x <= 0, {"x": 1 + self.a * x.x + x.y, "y": self.b * x.x}),
            "R": (True, {"x": 1 - self.a * x.x + x.y, "y": self.b * x.x}),
        }


class Logistic(PiecewiseMap):
    """x' = r x (1 - x)."""

    r: float = 3.83
    coordinates = ("x",)

    def pieces(self, x):
        return {"A": (True, {"x": self.r * x.x * (1 - x.x)})}
