"""One orbit of composite maps and of a map of strips in compiled loops: beside the exact map's, and asked return by return.

Run by hand, on a quiet machine: `python docs/benchmarks/orbits.py`. Times alternate in one run; medians, in us a return.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import nsmaps

MANY, FEW, ROUNDS, START = 200_000, 2_000, 7, (0.3, 1.0)


class OneByOne(nsmaps.exact.ReturnMap):
    """A map without its compiled loops."""

    def __init__(self, return_map: Any) -> None:
        self.coordinates, self.map = return_map.coordinates, return_map

    def first_return(self, states: Any, derivative: bool = False) -> Any:
        return self.map.first_return(states, derivative)


def timed(work: Callable[[Any, Any, int], object], return_map: Any, returns: int) -> float:
    """A return's time."""
    begun = time.perf_counter()
    work(return_map, START, returns)
    return (time.perf_counter() - begun) / returns * 1e6


def exponents(return_map: Any, start: Any, returns: int) -> object:
    """Lyapunov exponents without a transient."""
    return nsmaps.lyapunov(return_map, starts=start, n_returns=returns, transient=0)


def main() -> None:
    """Print a table."""
    print("| study | orbit | exact orbit | ratio | exponents | exact exponents | ratio | orbit, one by one |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|")
    for name in ("pd", "cd", "auto", "accurate"):
        made = nsmaps.run_study(f"vi_pair/{name}")
        return_map, exact = made.reduced, made.system
        parallel = [(work, of, MANY) for work in (nsmaps.orbit, exponents) for of in (return_map, exact)]
        parallel.append((nsmaps.orbit, OneByOne(return_map), FEW))
        for job in parallel:
            timed(*job)
        ours, theirs, grown, grows, slow = np.median([[timed(*job) for job in parallel] for _ in range(ROUNDS)], axis=0)
        row = f"{ours:.2f} | {theirs:.2f} | {ours / theirs:.2f} | {grown:.2f} | {grows:.2f} | {grown / grows:.2f} | {slow:.0f}"
        print(f"| {name} | {row} |", flush=True)


if __name__ == "__main__":
    main()
