"""The motion of z'' = -b z' - k z + g + F cos(w t) + S sin(w t) between impacts, in mpmath by roots; no code of nsmaps."""

from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp

SAMPLES, PERIODS = 900, 3  #: times a period, and periods, at which a flight is looked at for its first impact


class Equation(NamedTuple):
    """Numbers of mpmath; walls are pairs of a place and a side."""

    b: Any
    k: Any
    g: Any
    cosine: Any
    sine: Any
    frequency: Any
    walls: tuple[tuple[Any, int], ...]
    r: Any


def free(b: Any, k: Any, s: Any) -> tuple[Any, Any, Any]:
    """a, a' and the integral of a, where a'' = -b a' - k a, a(0) = 0, a'(0) = 1: divided differences of exp, in more digits."""
    if b == 0 and k == 0:
        return s, mp.mpf(1), s * s / 2
    with mp.workdps(3 * mp.mp.dps):
        half = mp.sqrt(mp.mpc(b * b / 4 - k)) or mp.mpf(10) ** (-mp.mp.dps // 3)  # for equal roots, some next to them
        fast, slow = -b / 2 - half, -b / 2 + half
        rise = [mp.exp(x * s) for x in (fast, slow)]
        area = [mp.expm1(x * s) / x if x else s for x in (fast, slow)]
        gap = slow - fast
        return mp.re((rise[1] - rise[0]) / gap), mp.re((slow * rise[1] - fast * rise[0]) / gap), mp.re((area[1] - area[0]) / gap)


def flight(equation: Equation, wall: int, phase: Any, speed: Any, s: Any) -> tuple[Any, Any]:
    """Place and velocity a time after an impact."""
    (at, side), w, b, k = equation.walls[wall], equation.frequency, equation.b, equation.k
    force = mp.mpc(equation.cosine, -equation.sine) / mp.mpc(k - w * w, b * w)
    start, end = force * mp.expj(phase), force * mp.expj(phase + w * s)
    a, rate, area = free(b, k, s)
    x, y = at - mp.re(start), -side * equation.r * speed - mp.re(1j * w * start)
    z = mp.re(end) + equation.g * area + x * (rate + b * a) + y * a
    return z, mp.re(1j * w * end) + equation.g * a - x * k * a + y * rate


def seen(equation: Equation, wall: int, phase: Any, speed: Any) -> tuple[int, float] | None:
    """Wall and phase of the first impact, by an integration in doubles; None if there is none within `PERIODS`."""
    b, k, g, cosine, sine, w = (float(x) for x in equation[:6])
    (at, side), period = equation.walls[wall], 2 * np.pi / w
    times = np.linspace(0, PERIODS * period, PERIODS * SAMPLES + 1)[1:]

    def rates(t: float, y: Any) -> list[float]:
        angle = float(phase) + w * t
        return [y[1], g + cosine * np.cos(angle) + sine * np.sin(angle) - k * y[0] - b * y[1]]

    start = [float(at), float(-side * equation.r * speed)]
    z = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-12).y[0]
    beyond = [(face * (z - float(place)) > 0) for place, face in equation.walls]
    hits = [(int(np.argmax(each)), i) for i, each in enumerate(beyond) if each.any()]
    return (min(hits)[1], float(phase) + w * times[min(hits)[0]]) if hits else None


def landed(equation: Equation, wall: int, phase: Any, speed: Any, hit: int, near: Any) -> tuple[Any, Any]:
    """Phase and speed of the impact on a wall near a phase."""
    (at, side), w = equation.walls[hit], equation.frequency
    s = (near - phase) / w
    for _ in range(12):
        z, v = flight(equation, wall, phase, speed, s)
        s -= (z - at) / v
    return phase + w * s, side * flight(equation, wall, phase, speed, s)[1]
