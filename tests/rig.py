"""A rig that shares nothing with the engine: a ball in a shaken capsule, by scipy, with the faults of sensors."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Rig:
    """Impacts of the vibro-impact pair x'' = cos(phase) + g, |x| <= d/2, restitution r, on its wall B at +d/2 and T at -d/2."""

    d: float = 0.35
    r: float = 0.5
    g: float = 0.2113
    drift: float = 0.0  #: relative change of the frequency over the record

    def impacts(self, count: int, speed: float, phase: float, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times, walls and speeds of the first impacts, the first on B at time zero."""

        def angle(t: float) -> float:
            return np.pi * t * (1 + self.drift * t / (2 * length)) + phase

        def rates(t: float, y: np.ndarray) -> list[float]:
            return [y[1], np.cos(angle(t)) + self.g]

        def base(t: float, y: np.ndarray) -> float:
            return self.d / 2 - y[0]

        def top(t: float, y: np.ndarray) -> float:
            return self.d / 2 + y[0]

        base.terminal = top.terminal = True  # type: ignore[attr-defined]
        base.direction = top.direction = -1  # type: ignore[attr-defined]
        t, times, walls, speeds, y = 0.0, [0.0], ["B"], [speed], [self.d / 2, -self.r * speed]
        while len(times) < count:
            found = solve_ivp(rates, (t, t + 20), y, "DOP853", events=(base, top), rtol=1e-10, atol=1e-12)
            t = float(found.t[-1])
            v = float(found.y[1, -1])
            wall = "B" if len(found.t_events[0]) else "T"
            times.append(t)
            walls.append(wall)
            speeds.append(abs(v))
            y = [self.d / 2 if wall == "B" else -self.d / 2, -self.r * v]
        return np.array(times), np.array(walls), np.array(speeds)


def sensed(
    times: np.ndarray, walls: np.ndarray, rng: np.random.Generator, jitter: float, clock: float
) -> tuple[np.ndarray, np.ndarray]:
    """What a contact sensor gives: jitter, a clock of finite resolution, every ninth contact missed, one contact that bounces."""
    there = np.arange(len(times)) % 9 != 5
    found, letters = (times + jitter * rng.standard_normal(len(times)))[there], walls[there]
    found, letters = np.insert(found, 12, found[11] + 0.06), np.insert(letters, 12, letters[11])
    return np.round(found / clock) * clock, letters
