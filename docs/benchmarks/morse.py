"""Boxes in one batch beside CMGDB with a plain Python map called once a box: `python docs/benchmarks/morse.py`, extra `morse`.

The same window, the same cells, in turn in one process; the ratio of times is what counts. CMGDB's boxes are those of its
default, the hull of the images of a box's corners, which encloses nothing; ours are enclosures.
"""

from collections.abc import Callable
from math import cos, pi, sin
from time import perf_counter

import CMGDB
import numpy as np
from nsmaps_vi_pair import VIPair
from scipy.optimize import brentq

from nsmaps.cells.morse import morse_sets

WINDOW = np.array([[0.55, 1], [0.05, 1.25]])
DEPTH = 7  #: 2^7 cells an axis
TURNS = 3


def written(d: float, g: float, r: float, x: list[float]) -> list[float]:
    """The first return as one writes it in Python: steps of a hundredth of a period, Brent's method past a wall."""
    (w, t), z = (-r * x[0], x[1] / pi), d / 2
    for _ in range(20):
        drift, wave = w - sin(pi * t) / pi, cos(pi * t)

        def gap(s: float, z: float = z, t: float = t, drift: float = drift, wave: float = wave) -> float:
            return z + drift * s + g * s * s / 2 - (cos(pi * (t + s)) - wave) / pi**2

        s, wall = 0.002, 0.0
        while not wall:
            s += 0.02
            wall = d / 2 if gap(s) > d / 2 else -d / 2 if gap(s) < -d / 2 else 0.0
        s = brentq(lambda s, wall=wall: gap(s) - wall, s - 0.02, s, xtol=1e-13)
        u = drift + g * s + sin(pi * (t + s)) / pi
        t, z, w = t + s, wall, -r * u
        if wall > 0:
            break
    return [abs(u), pi * t % (2 * pi)]


def python(system: VIPair) -> None:
    """The Morse graph by a plain Python map of one state."""

    def corners(rect: list[float]) -> list[float]:
        return CMGDB.BoxMap(lambda x: written(system.d, system.g_bar, system.r, x), rect)

    low, high = WINDOW.T.tolist()
    CMGDB.ComputeMorseGraph(CMGDB.Model(2 * DEPTH, 2 * DEPTH, 2 * DEPTH, 10**6, low, high, corners))


def compiled(system: VIPair) -> None:
    """The same with the exact return by the compiled kernel, called from Python."""

    def corners(rect: list[float]) -> list[float]:
        return CMGDB.BoxMap(lambda x: system.first_return([x]).image[0].tolist(), rect)

    low, high = WINDOW.T.tolist()
    CMGDB.ComputeMorseGraph(CMGDB.Model(2 * DEPTH, 2 * DEPTH, 2 * DEPTH, 10**6, low, high, corners))


def one_by_one(system: VIPair) -> None:
    """The Morse graph by the enclosure, called from Python once a box."""

    def hull(rect: list[float]) -> list[float]:
        found = system.image_boxes([[rect[0::2], rect[1::2]]]).hulls()[0]
        return np.nan_to_num(found - [[0], [2 * pi * np.round(found[1, 0] / (2 * pi))]], posinf=9, neginf=-9).T.ravel().tolist()

    low, high = WINDOW.T.tolist()
    CMGDB.ComputeMorseGraph(CMGDB.Model(2 * DEPTH, 2 * DEPTH, 2 * DEPTH, 10**6, low, high, hull))


def enclosed(system: VIPair) -> None:
    """The same cells all at once by one batch of enclosures."""
    morse_sets(system, WINDOW, depth=0, n_cells=2**DEPTH)


def halved(system: VIPair) -> None:
    """The same cells at the last of five levels."""
    morse_sets(system, WINDOW, depth=4, n_cells=2 ** (DEPTH - 4))


def main() -> None:
    """Print the least times of every way, and how many times faster the enclosures are."""
    system = VIPair(d=0.30, r=0.5, M=0.1245, g=9.8, beta=pi / 3, F=5)
    ways: tuple[Callable[[VIPair], None], ...] = (python, compiled, one_by_one, enclosed, halved)
    morse_sets(system, WINDOW, depth=0, n_cells=4)  # compiled before the race
    states = np.random.default_rng(0).uniform(*WINDOW.T, (300, 2))
    own = np.array([written(system.d, system.g_bar, system.r, x) for x in states.tolist()])
    print(
        "returns that the plain map has right:", int((np.abs(own - system.first_return(states).image) < 1e-9).all(axis=1).sum())
    )
    times = {way.__name__: np.inf for way in ways}
    for _ in range(TURNS):
        for way in ways:
            start = perf_counter()
            way(system)
            times[way.__name__] = min(times[way.__name__], perf_counter() - start)
    for name, time in times.items():
        print(f"{name:10s} {time:8.3f} s   {times['python'] / time:6.1f} x")


if __name__ == "__main__":
    main()
