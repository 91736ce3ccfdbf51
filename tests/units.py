"""Three impact systems with all their units, and the same systems in other units of time and length."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import sympy as sp
from pydantic import Field

from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class Ball(ImpactSystem):
    """Ball in gravity g on a table that moves as a sin(w t)."""

    g: float = Field(gt=0)
    a: float = Field(gt=0)
    w: float = Field(gt=0)
    r: float = Field(ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=0, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s = t - hit.t
        lift = hit.w + self.a * self.w * sp.cos(self.w * hit.t)
        return hit.z + lift * s - self.g * s**2 / 2 - self.a * (sp.sin(self.w * t) - sp.sin(self.w * hit.t))


class Capsule(ImpactSystem):
    """Ball in a capsule of the length d, whose acceleration relative to it is g + f cos(w t): the vibro-impact pair."""

    d: float = Field(gt=0)
    g: float
    f: float = Field(gt=0)
    w: float = Field(gt=0)
    r: float = Field(ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=self.d / 2, side=1), "T": Wall(at=-self.d / 2, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s, now, then = t - hit.t, self.w * t, self.w * hit.t
        drift = hit.w - self.f / self.w * sp.sin(then)
        return hit.z + drift * s + self.g * s**2 / 2 - self.f / self.w**2 * (sp.cos(now) - sp.cos(then))


class Oscillator(ImpactSystem):
    """x'' + 2 zeta k x' + k^2 x = a cos(w t) below a wall."""

    zeta: float = Field(gt=0, lt=1)
    k: float = Field(gt=0)
    w: float = Field(gt=0)
    a: float = Field(gt=0)
    wall: float
    r: float = Field(ge=0, le=1)

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=self.wall, side=1)}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        spring, damper = self.k**2 - self.w**2, 2 * self.zeta * self.k * self.w
        c, d = self.a * spring / (spring**2 + damper**2), self.a * damper / (spring**2 + damper**2)

        def steady(t: Any) -> tuple[Any, Any]:
            cos, sin = sp.cos(self.w * t), sp.sin(self.w * t)
            return c * cos + d * sin, self.w * (d * cos - c * sin)

        s, bent, damped = t - hit.t, self.k * sp.sqrt(1 - self.zeta**2), self.zeta * self.k
        z, w = hit.z - steady(hit.t)[0], hit.w - steady(hit.t)[1]
        free = sp.exp(-damped * s) * (z * sp.cos(bent * s) + (w + damped * z) / bent * sp.sin(bent * s))
        return steady(t)[0] + free


POWERS = {  #: of length and of time in each parameter
    Ball: {"g": (1, -2), "a": (1, 0), "w": (0, -1), "r": (0, 0)},
    Capsule: {"d": (1, 0), "g": (1, -2), "f": (1, -2), "w": (0, -1), "r": (0, 0)},
    Oscillator: {"zeta": (0, 0), "k": (0, -1), "w": (0, -1), "a": (1, -2), "wall": (1, 0), "r": (0, 0)},
}
UNITS = [(1.0, 1e-4), (1.0, 1e-3), (1.0, 1e4), (1e-4, 1.0), (1e-3, 1.0), (1e4, 1.0), (7.3, 7.3), (1e-4, 1e4), (1e4, 1e-3)]


@dataclass(frozen=True)
class Units:
    """How many of the new units a unit of length and of time is."""

    length: float
    time: float

    def of(self, system: ImpactSystem) -> ImpactSystem:
        """The same system with its numbers in the new units."""
        changes = {name: self.parameter(system, name, value) for name, value in system.parameters.items()}
        return system.at(**changes)

    def parameter(self, system: ImpactSystem, name: str, value: float) -> float:
        length, time = POWERS[type(system)][name]
        return value * self.length**length * self.time**time

    def states(self, states: Any) -> Any:
        """The same states (N, 2), or box, one row a state, with speeds in the new units."""
        return np.asarray(states, float) * [self.length / self.time, 1.0]
