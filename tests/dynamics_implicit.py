"""The vibro-impact pair's orbits as implicit equations in mpmath: flights written out, no march, no return map.

A chain of flights from wall to wall, its times among the unknowns; eq. relvar and eq. eq_impact in 40 digits.
"""

from collections.abc import Sequence
from typing import Any

import mpmath as mp

mp.mp.dps = 40
SIDE = {"B": mp.mpf(1) / 2, "T": -mp.mpf(1) / 2}  #: places of the walls, in units of d


def flight(t: Any, z: Any, w: Any, s: Any, g: Any) -> tuple[Any, Any]:
    """Place and velocity a time s after (t, z, w)."""
    (c, e), (cosine, sine) = mp.cos_sin(mp.pi * t), mp.cos_sin(mp.pi * (t + s))
    place = z + (w - e / mp.pi) * s + g * s**2 / 2 - (cosine - c) / mp.pi**2
    return place, w + (sine - e) / mp.pi + g * s


def gaps(walls: str, v: Any, phi: Any, times: Sequence[Any], d: Any, r: Any, g: Any, turns: int = 1) -> list[Any]:
    """What vanishes on a cycle that meets these walls in order, such as BTB: a gap a flight, then speed and phase."""
    t, w = phi / mp.pi, -r * v
    out = []
    for k, s in enumerate(times):
        place, w = flight(t, SIDE[walls[k]] * d, w, s, g)
        out.append(place - SIDE[walls[k + 1]] * d)
        t, w = t + s, -r * w
    return [*out, -w / r - v, mp.pi * t - phi - 2 * mp.pi * turns]


def multipliers_test(walls: str, x: Sequence[Any], d: Any, r: Any, g: Any, of: int) -> Any:
    """det(M - of) by the implicit function theorem, derivatives by differences in 40 digits."""
    n, h = len(walls) - 1, mp.mpf(10) ** -14
    x = [mp.mpf(value) for value in x]

    def full(x: Sequence[Any]) -> Any:
        return mp.matrix(gaps(walls, x[0], x[1], x[2:], d, r, g))

    columns = []
    for k in range(n + 2):
        up, down = list(x), list(x)
        up[k] += h
        down[k] -= h
        columns.append((full(up) - full(down)) / (2 * h))
    j = mp.matrix(n + 2, n + 2)
    for k, column in enumerate(columns):
        for i in range(n + 2):
            j[i, k] = column[i]
    j[n, 0] += 1 - of  # the end's rows are M x - x; of them M x - of x is asked for
    j[n + 1, 1] += 1 - of
    scale = 1
    for i in range(n):
        scale *= j[i, i + 2]
    return mp.det(j) / scale


def solve(equations: Any, guess: Sequence[float]) -> list[Any]:
    """Newton's method in 40 digits, until what derivatives by differences leave of them."""
    return list(mp.findroot(equations, [mp.mpf(x) for x in guess], tol=1e-24))
