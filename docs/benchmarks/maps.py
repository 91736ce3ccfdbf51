"""Maps given by formulas beside loops written by hand in numba, in one, two and three coordinates, with derivatives and without.

Run by hand, on a quiet machine: `python docs/benchmarks/maps.py`. Times alternate in one run; medians of processor time, in ns a
return. A loop by hand writes the fields of `Returns` that such a map has: images, letters, outcomes, times and derivatives.
`loop` is the compiled loop of the map in the same memory each time, as a multiple of that by hand; `call` is the public call, of
batches in threads on all cores, as a multiple of the loop by hand with new memory.
"""

import math
import time
from typing import Any

import numpy as np
from numba import njit

from nsmaps import Angle, PiecewiseMap
from nsmaps.exact.kernel import return_rows

RETURNS, ROUNDS = 200_000, 15


class One(PiecewiseMap):
    """A circle map with a plateau."""

    tau: float = 1.9
    b: float = 0.7
    coordinates = (Angle("phi"),)

    def pieces(self, x: Any) -> Any:
        import sympy as sp

        return {"F": (x.phi > 6, {"phi": self.tau}), "S": (True, {"phi": x.phi + self.tau - self.b * sp.sin(x.phi)})}


class Two(PiecewiseMap):
    """The normal form of a border collision."""

    a: float = 0.9
    c: float = -1.7
    d: float = 0.4
    coordinates = ("x", "y")

    def pieces(self, x: Any) -> Any:
        return {
            "L": (x.x <= 0, {"x": self.a * x.x + x.y + 1, "y": -self.d * x.x}),
            "R": (True, {"x": self.c * x.x + x.y + 1, "y": -self.d * x.x}),
        }


class Three(PiecewiseMap):
    """The same in three coordinates, with a product."""

    a: float = 0.9
    c: float = -1.2
    d: float = 0.3
    coordinates = ("x", "y", "z")

    def pieces(self, x: Any) -> Any:
        rest = {"y": -self.d * x.x + x.z, "z": 0.1 * x.x + 0.05 * x.y * x.z}
        return {
            "L": (x.x <= 0, {"x": self.a * x.x + x.y + 1, **rest}),
            "R": (True, {"x": self.c * x.x + x.y + 1, **rest}),
        }


@njit(error_model="numpy")
def one(p, start, image, codes, outcome, time, slopes, derivative):
    tau, b = p
    for m in range(len(start)):
        x = start[m, 0]
        for i in range(len(image)):
            if x > 6.0:
                if derivative:
                    slopes[i, m, 0, 0] = 0.0
                x, codes[i, m] = tau, 1
            else:
                if derivative:
                    slopes[i, m, 0, 0] = 1.0 - b * math.cos(x)
                x, codes[i, m] = x + tau - b * math.sin(x), 2
            x = x % (2.0 * math.pi)
            image[i, m, 0], outcome[i, m], time[i, m] = x, 0, 1.0


@njit(error_model="numpy")
def two(p, start, image, codes, outcome, time, slopes, derivative):
    a, c, d = p
    for m in range(len(start)):
        x, y = start[m, 0], start[m, 1]
        for i in range(len(image)):
            s = a if x <= 0.0 else c
            codes[i, m] = 1 if x <= 0.0 else 2
            x, y = s * x + y + 1.0, -d * x
            image[i, m, 0], image[i, m, 1], outcome[i, m], time[i, m] = x, y, 0, 1.0
            if derivative:
                slopes[i, m, 0, 0], slopes[i, m, 0, 1], slopes[i, m, 1, 0], slopes[i, m, 1, 1] = s, 1.0, -d, 0.0


@njit(error_model="numpy")
def three(p, start, image, codes, outcome, time, slopes, derivative):
    a, c, d = p
    for m in range(len(start)):
        x, y, z = start[m, 0], start[m, 1], start[m, 2]
        for i in range(len(image)):
            s = a if x <= 0.0 else c
            codes[i, m] = 1 if x <= 0.0 else 2
            if derivative:
                g = slopes[i, m]
                g[0, 0], g[0, 1], g[0, 2], g[1, 0], g[1, 1], g[1, 2] = s, 1.0, 0.0, -d, 0.0, 1.0
                g[2, 0], g[2, 1], g[2, 2] = 0.1, 0.05 * z, 0.05 * y
            x, y, z = s * x + y + 1.0, -d * x + z, 0.1 * x + 0.05 * y * z
            image[i, m, 0], image[i, m, 1], image[i, m, 2], outcome[i, m], time[i, m] = x, y, z, 0, 1.0


def memory(n: int, m: int, dim: int, derivative: bool) -> list[Any]:
    """What a loop by hand writes."""
    shapes = [((n, m, dim), float), ((n, m), np.int64), ((n, m), np.int8), ((n, m), float)]
    return [np.empty(*each) for each in [*shapes, ((n, m, dim, dim if derivative else 0), float)]]


def parallel(return_map: PiecewiseMap, loop: Any, n: int, m: int, derivative: bool) -> list[Any]:
    """The loop by hand and the compiled loop of the map, in the same memory each time and in new memory, for n returns."""
    dim, rng = len(return_map.coordinates), np.random.default_rng(0)
    start, compiled = rng.uniform(0, 0.1, (m, dim)), return_map._kernel()
    by = compiled.formulas.variables if derivative else ()
    values, theirs = np.array(list(return_map.parameters.values())), memory(n, m, dim, derivative)
    (_, *fields) = rows = return_rows(start, n, len(by))
    return [
        lambda: loop(values, start, *theirs, derivative),
        lambda: compiled.loop(by)(start, rows.images, *fields),
        lambda: loop(values, start, *memory(n, m, dim, derivative), derivative),
        (lambda: return_map.orbits(start, n, derivative)) if m == 1 else (lambda: return_map.first_return(start, derivative)),
    ]


def ratios(return_map: PiecewiseMap, loop: Any, n: int, m: int, derivative: bool, rounds: int = ROUNDS) -> tuple[float, ...]:
    """The time of the loop by hand, in ns a return, and those of the compiled loop and of the call as multiples of it."""
    each = parallel(return_map, loop, n, m, derivative)

    def timed(job: Any) -> float:
        begun = time.process_time()
        job()
        return time.process_time() - begun

    for job in each:
        job()
    hand, ours, fresh, call = np.median([[timed(job) for job in each] for _ in range(rounds)], axis=0)
    return hand / n / m * 1e9, ours / hand, call / fresh


def main() -> None:
    """Print a table."""
    print("| coordinates | returns | derivative | by hand, ns | loop | call |")
    print("|---|---|---|--:|--:|--:|")
    for return_map, loop in ((One(), one), (Two(), two), (Three(), three)):
        for what, n, m in (("orbit", RETURNS, 1), ("batch", 1, RETURNS)):
            for derivative in (False, True):
                hand, ours, call = ratios(return_map, loop, n, m, derivative)
                n_coordinates = len(return_map.coordinates)
                row = f"{n_coordinates} | {what} | {'yes' if derivative else 'no'} | {hand:.1f} | {ours:.2f} | {call:.2f}"
                print(f"| {row} |", flush=True)


if __name__ == "__main__":
    main()
