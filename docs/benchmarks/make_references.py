"""Make the references of the benchmark, nsmaps/bench/references.npz, with 40 correct digits before they are rounded to double.

Run by hand, `python docs/benchmarks/make_references.py`; it takes a few minutes. The 10,000 starts are solved here in 50-digit
arithmetic: between two zeros of the acceleration, known in closed form, the velocity is monotone and has at most one zero;
between two zeros of the velocity the displacement is monotone and meets a wall at most once. Nothing is shared with nsmaps
but the starts. The hard cases are copied from tests/data/hard_returns.json.
"""

import json
import multiprocessing
from collections.abc import Callable, Iterator
from math import pi
from pathlib import Path

import mpmath as mp
import numpy as np

from nsmaps.bench.task import GRID, Pair, grid, physical

TILT = {"pi/3": pi / 3, "pi/6": pi / 6}
ROOT = Path(__file__).parents[2]
OUT = ROOT / "nsmaps" / "bench" / "references.npz"
mp.mp.dps = 50
TINY = mp.mpf(10) ** -44


def root(f: Callable[[mp.mpf], tuple[mp.mpf, mp.mpf]], a: mp.mpf, b: mp.mpf) -> mp.mpf:
    """The zero between a and b of a function that returns its value and slope, and has opposite signs at a and b."""
    rising = f(b)[0] > 0
    x = (a + b) / 2
    while True:
        value, slope = f(x)
        if (value > 0) == rising:
            b = x
        else:
            a = x
        new = x - value / slope if slope else a
        if not a < new < b:
            new = (a + b) / 2
        if abs(new - x) < TINY:
            return new
        x = new


class Flight:
    """The flight that leaves a wall at phase phi with velocity w, in displacement from that wall."""

    def __init__(self, pair: Pair, phi: mp.mpf, w: mp.mpf) -> None:
        self.g, self.phi, self.w = mp.mpf(pair.g_bar), phi, w
        self.cos, self.sin = mp.cos_sin(phi)

    def place(self, s: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        """Displacement and velocity."""
        cos, sin = mp.cos_sin(self.phi + mp.pi * s)
        drift = self.w - self.sin / mp.pi
        return drift * s + self.g * s * s / 2 - (cos - self.cos) / mp.pi**2, drift + self.g * s + sin / mp.pi

    def velocity(self, s: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        """Velocity and acceleration."""
        return self.place(s)[1], self.g + mp.cos(self.phi + mp.pi * s)

    def accelerations(self) -> Iterator[mp.mpf]:
        """The zeros of the acceleration after the start, in order."""
        angle = mp.acos(-self.g)
        turn = 0
        while True:
            for zero in (angle, 2 * mp.pi - angle):
                s = (zero + 2 * mp.pi * turn - self.phi) / mp.pi
                if s > 0:
                    yield s
            turn += 1

    def velocities(self) -> Iterator[mp.mpf]:
        """The ends of pieces on which the displacement is monotone."""
        a = mp.mpf(0)
        for b in self.accelerations():
            if (self.place(a)[1] > 0) != (self.place(b)[1] > 0):
                yield root(self.velocity, a, b)
            yield b
            a = b

    def impact(self, low: mp.mpf, high: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        """Time and velocity of the first impact on a wall at displacement low or high."""
        a = mp.mpf(0)
        for b in self.velocities():
            place = self.place(b)[0]
            for wall, met in ((low, place <= low), (high, place >= high)):
                if met:
                    s = root(lambda x, wall=wall: (self.place(x)[0] - wall, self.place(x)[1]), a, b)
                    return s, self.place(s)[1]
            a = b
        raise AssertionError("unreachable")


def first_return(start: tuple[float, float]) -> tuple[float, float, int]:
    """Impact speed and phase of the first return to B, and the number of impacts on T on the way."""
    pair = GRID
    d, r = mp.mpf(pair.d), mp.mpf(pair.r)
    phi, w, tops = mp.mpf(start[1]), -r * mp.mpf(start[0]), 0
    low, high = -d, mp.mpf(0)
    while True:
        s, velocity = Flight(pair, phi, w).impact(low, high)
        phi = mp.fmod(phi + mp.pi * s, 2 * mp.pi)
        if velocity > 0:
            return float(velocity), float(phi), tops
        tops += 1
        w, low, high = -r * velocity, mp.mpf(0), d


def hard() -> np.ndarray:
    """The hard cases: columns d, r, g_bar, v, phi, v', phi', impacts on T."""
    rows = json.loads((ROOT / "tests" / "data" / "hard_returns.json").read_text())["rows"]
    return np.array(
        [
            (
                *(q["d"], q["r"], physical(q["d"], q["r"], TILT[q["beta"]]).g_bar, q["v"], q["phi"]),
                *(float(q["v1"]), float(q["phi1"]), q["word"].count("T")),
            )
            for q in rows
        ]
    )


if __name__ == "__main__":
    with multiprocessing.Pool() as pool:
        rows = np.array(pool.map(first_return, [tuple(map(float, start)) for start in grid()], chunksize=50))
    np.savez_compressed(OUT, image=rows[:, :2], tops=rows[:, 2].astype(np.int8), hard=hard())
    print(f"{OUT}: {OUT.stat().st_size} bytes, {np.bincount(rows[:, 2].astype(int))} returns by impacts on T")
