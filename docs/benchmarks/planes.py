"""Charts of the pair over d and r: beside the bare compiled map, two dask workers beside one, and beside pynamicalsys.

Run by hand, on a quiet machine: `python docs/benchmarks/planes.py [PIXELS [RETURNS]]`, the numbers along each side and of each
pixel, 1000 and 10000 unless given; dask and pynamicalsys take a tenth of the pixels of a side. The bare map returns as often at a
sample of the pixels.
"""

import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from distributed import Client, LocalCluster
from numba import njit
from pynamicalsys import DiscreteDynamicalSystem

import nsmaps
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.flight.layout import FLIGHT_SIZE, TOP
from nsmaps.exact.engine.observers import first_return

SYSTEM = nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113275192854541)
START, PERIODS, SAMPLE, ROUNDS = [0.8, 0.3], 32, 2000, 3
SIZE = len(SYSTEM._kernel().table)


def axes(pixels: int) -> dict[str, np.ndarray]:
    """The values of both parameters."""
    return {"d": np.linspace(0.2, 0.4, pixels), "r": np.linspace(0.3, 0.7, pixels)}


def plane(pixels: int, returns: int, parallel: nsmaps.Parallel | None = None) -> nsmaps.dynamics.ParameterPlane:
    """Ours, with words, motions, exponents and outcomes."""
    kept = 2 * PERIODS
    return nsmaps.parameter_plane(
        SYSTEM,
        axes(pixels),
        START,
        n_returns=kept,
        transient=returns - kept,
        max_period=PERIODS,
        parallel=parallel or nsmaps.Parallel(),
    )


@njit
def bare(p: np.ndarray, size: int, v: float, phi: float, returns: int) -> float:
    """Returns alone, of which nothing is kept."""
    flow = Flow(p[:size], p[size:])
    for _ in range(returns):
        _, v, phi, _, _, _, _ = first_return(flow, v, phi, 1e-12, False)
    return v


def table(d: float, r: float) -> np.ndarray:
    """The numbers of a system, with room for the coefficients of a flight."""
    numbers = SYSTEM.at(d=d, r=r)._kernel().table
    return np.concatenate([numbers, np.zeros(int(numbers[FLIGHT_SIZE]))])


@njit
def mapping(u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The map as pynamicalsys takes it; its parameter is the place of the upper wall."""
    out = np.empty(2)
    p[TOP + 1] = -p[TOP]
    size = len(p) - int(p[FLIGHT_SIZE])
    _, out[0], out[1], _, _, _, _ = first_return(Flow(p[:size], p[size:]), u[0], u[1], 1e-12, False)
    return out


def by_pynamicalsys(pixels: int, returns: int) -> None:
    """A diagram of d for each r, of which the last returns are kept: one coordinate, no words, no exponent."""
    along, across = axes(pixels).values()
    peer = DiscreteDynamicalSystem(mapping=mapping, system_dimension=2, number_of_parameters=len(table(0.3, 0.5)))
    for r in across:
        others = np.delete(table(0.3, r), TOP)
        times = {"total_time": returns, "transient_time": returns - 2 * PERIODS}
        peer.bifurcation_diagram(START, TOP, along / 2, parameters=others, **times)


def seconds(run: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Of one run."""
    begun = clock()
    run()
    return clock() - begun


def beside_the_map(pixels: int, returns: int) -> None:
    """The plane's processor time, and that of the bare map from a sample of its pixels."""
    rng = np.random.default_rng(1)
    along, across = axes(pixels).values()
    tables = [table(rng.choice(along), rng.choice(across)) for _ in range(SAMPLE)]
    plane(4, returns), bare(tables[0], SIZE, *START, 1)

    def loop() -> None:
        for p in tables:
            bare(p, SIZE, *START, returns)

    before = seconds(loop, time.process_time)
    made: list[nsmaps.dynamics.ParameterPlane] = []
    ours = seconds(lambda: made.append(plane(pixels, returns)), time.process_time)
    theirs = (before + seconds(loop, time.process_time)) / 2 * pixels**2 / SAMPLE
    done = made[0]
    print(f"{pixels} x {pixels} pixels of {returns} returns: {ours:.0f} s of processor time, {ours / theirs:.2f} of the bare map")
    print(
        f"returns computed {done.n_returns / (returns * pixels**2):.3f} of all; without a period {np.mean(done.period == 0):.3f}"
    )
    print(f"a return computed, beside a bare one {ours / theirs * returns * pixels**2 / done.n_returns:.2f}", flush=True)


def on_workers(pixels: int, returns: int) -> None:
    """The same plane on one dask worker and on two, in turn."""
    clusters = [LocalCluster(n_workers=k, threads_per_worker=1, dashboard_address=None, processes=True) for k in (1, 2)]
    clients = [Client(cluster) for cluster in clusters]
    runs = [partial(plane, pixels, returns, nsmaps.Parallel(client.get_executor(pure=False))) for client in clients]
    for run in runs:
        run()
    ratios = [seconds(runs[0]) / seconds(runs[1]) for _ in range(ROUNDS)]
    print("two dask workers, times as fast as one:", *(f"{ratio:.2f}" for ratio in ratios), flush=True)
    for client, cluster in zip(clients, clusters, strict=True):
        client.close()
        cluster.close()


def beside_pynamicalsys(pixels: int, returns: int) -> None:
    """Both in turn."""
    by_pynamicalsys(2, returns)
    ratios = [seconds(lambda: plane(pixels, returns)) / seconds(lambda: by_pynamicalsys(pixels, returns)) for _ in range(ROUNDS)]
    print(f"{pixels} x {pixels}, of pynamicalsys:", *(f"{ratio:.2f}" for ratio in ratios), flush=True)


if __name__ == "__main__":
    side, length = (*map(int, sys.argv[1:]), *(1000, 10_000)[len(sys.argv) - 1 :])
    beside_pynamicalsys(side // 10, length)
    on_workers(side // 10, length)
    beside_the_map(side, length)
