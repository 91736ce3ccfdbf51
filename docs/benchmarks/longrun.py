"""Bifurcation diagrams of the exact map: ours beside a bare numba loop and pynamicalsys, both iterating the same compiled map.

600 values of d, 2,000 returns forgotten and 100 kept at each, following the attractor up and down. Run by hand, on a
quiet machine: `python docs/benchmarks/longrun.py`; pynamicalsys is of the extra `peers`. Times alternate in one run; ratios
are medians.
"""

import time
from collections.abc import Callable

import numpy as np
from numba import njit
from pynamicalsys import DiscreteDynamicalSystem

import nsmaps
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.flight.layout import AT_PARAMETERS, BOTTOM, FLIGHT_SIZE, TOP
from nsmaps.exact.engine.observers import first_return

VALUES, TRANSIENT, RETURNS, ROUNDS = np.linspace(0.26, 0.35, 600), 2000, 100, 7
START = [0.8, 0.3]
SYSTEM = nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113275192854541)
TABLE = SYSTEM._kernel().table
SIZE = len(TABLE)
PARAMETERS = np.concatenate([TABLE, np.zeros(int(TABLE[FLIGHT_SIZE]))])  # with room for the coefficients of a flight
OTHERS = np.delete(PARAMETERS, TOP)


def check_table() -> None:
    """Of the numbers of a table only the walls, at d/2 and -d/2, follow from d, besides d itself, which no flight reads."""
    for d in VALUES:
        table = TABLE.copy()
        table[[TOP, BOTTOM, int(TABLE[AT_PARAMETERS]) + list(SYSTEM.parameters).index("d")]] = d / 2, -d / 2, d
        np.testing.assert_array_equal(table, SYSTEM.at(d=d)._kernel().table)


@njit
def bare(values: np.ndarray, p: np.ndarray, v: float, phi: float, transient: int, kept: np.ndarray) -> None:
    """What one would write by hand around the map: states alone."""
    flow = Flow(p[:SIZE], p[SIZE:])
    for k in range(len(values)):
        p[TOP], p[BOTTOM] = values[k] / 2, -values[k] / 2
        for i in range(-transient, kept.shape[1]):
            _, v, phi, _, _, _, _ = first_return(flow, v, phi, 1e-12, False)
            if i >= 0:
                kept[k, i, 0], kept[k, i, 1] = v, phi


@njit
def mapping(u: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The map as pynamicalsys takes it; its parameter is the place of the upper wall."""
    out = np.empty(2)
    p[BOTTOM] = -p[TOP]
    _, out[0], out[1], _, _, _, _ = first_return(Flow(p[:SIZE], p[SIZE:]), u[0], u[1], 1e-12, False)
    return out


def ours() -> np.ndarray:
    """Both ways, with words, turns and outcomes of every return kept, periods and motions found."""
    how = {"n_returns": RETURNS, "transient": TRANSIENT}
    up = nsmaps.bifurcation_diagram(SYSTEM, "d", VALUES, START, **how, direction="up")
    down = nsmaps.bifurcation_diagram(SYSTEM, "d", VALUES, up.states[-1, :, -1], **how, direction="down")
    return np.asarray(down.states[:, 0])


def by_hand() -> np.ndarray:
    """Both ways in the bare loop."""
    kept = np.empty((len(VALUES), RETURNS, 2))
    bare(VALUES, PARAMETERS.copy(), *START, TRANSIENT, kept)
    bare(VALUES[::-1].copy(), PARAMETERS.copy(), *kept[-1, -1], TRANSIENT, kept)
    return kept[::-1]


PEER = DiscreteDynamicalSystem(mapping=mapping, system_dimension=2, number_of_parameters=len(PARAMETERS))


def peer() -> np.ndarray:
    """Both ways by pynamicalsys, the speed alone."""
    how = {"total_time": TRANSIENT + RETURNS, "transient_time": TRANSIENT, "continuation": True, "return_last_state": True}
    last = PEER.bifurcation_diagram(START, TOP, VALUES / 2, parameters=OTHERS, **how)[2]
    return np.asarray(PEER.bifurcation_diagram(last, TOP, VALUES[::-1] / 2, parameters=OTHERS, **how)[1][::-1])


def timed(run: Callable[[], np.ndarray]) -> float:
    """Seconds of one run."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def main() -> None:
    """Check that all iterate the same map, then race."""
    check_table()
    a, b, c = ours(), by_hand(), peer()
    calm = np.ptp(a[:, ::2, 0], axis=1) < 1e-9  # the chaotic values differ by rounding
    print("values with a two-cycle or less:", int(calm.sum()), "; apart from the bare loop by", float(np.abs(a - b)[calm].max()))
    print("sorted speeds apart from pynamicalsys by", float(np.abs(np.sort(a[calm, :, 0]) - np.sort(c[calm])).max()))
    times = np.array([[timed(run) for run in (ours, by_hand, peer)] for _ in range(ROUNDS)])
    median = np.median(times, axis=0)
    print(f"seconds: nsmaps {median[0]:.3f}, bare numba {median[1]:.3f}, pynamicalsys {median[2]:.3f}")
    print(f"nsmaps / bare numba {np.median(times[:, 0] / times[:, 1]):.2f}")
    print(f"nsmaps / pynamicalsys {np.median(times[:, 0] / times[:, 2]):.2f}")


if __name__ == "__main__":
    main()
