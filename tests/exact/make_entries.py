"""Make the linked forms of entries that a wheel contains: `python tests/exact/make_entries.py FOLDER`, some minutes.

They are used with the versions of numba, llvmlite, NumPy and Python, and on the platform, with which they were made.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import nsmaps
from nsmaps.exact.compiling import linked
from nsmaps.exact.modes.paths.tracks import events_from
from nsmaps.proof.closed import Around
from nsmaps.proof.prove import prove
from nsmaps.study.ahead import call_boxes, call_composite, call_noise

PAIR = {"d": 0.3, "r": 0.5, "M": 0.1245, "g": 9.8, "beta": 1.0471975511965976, "F": 5}
STATE, ROW, BENT = np.array([0.5, 1.0]), np.array([0.5, 0.1, -0.6, 1.0]), np.array([1.5, 0.5])


def pair() -> Any:
    """A system with walls."""
    return nsmaps.load_system("vi_pair", **PAIR)


def capsule() -> Any:
    """A system whose modes are affine."""
    return nsmaps.load_system("recoil_pair", eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, g_bar=0.2113)


def duffing() -> Any:
    """A system whose modes are not."""
    return nsmaps.load_study("duffing/diagram").system_object()


def returns(system: Any, start: Any) -> None:
    """First returns and trajectories."""
    system.first_return([start])
    system.trajectory(start, 4)


def impacts() -> None:
    """What systems with walls have beside returns and trajectories."""
    system = pair()
    system.itineraries([STATE])
    system.sensitivity([STATE], {"d": 1})
    system.grazing_curves({"v": (0.1, 0.9), "phi": (0.3, 0.5)}, 20)
    nsmaps.lyapunov(system, starts=[STATE], n_returns=32, transient=4)


def arrivals(system: Any, kernel: Any, state: Any) -> None:
    """First arrivals, and events from a state."""
    system.arrivals([state])
    next(events_from(kernel.definition, kernel.table, np.array(state), 0))


def observables(system: Any, start: Any, period: int, parameter: str) -> None:
    """Sums along orbits, and their derivatives."""
    nsmaps.observe(system, start, ["loss"], n_returns=2, n_batches=1)
    orbit = nsmaps.periodic_orbit(system, nsmaps.orbit(system, start, 300).final, period)
    nsmaps.observe(system, orbit, ["loss"], rates={parameter: 1.0})


def strips() -> None:
    """Maps of strips."""
    found = nsmaps.reduced.strip_map(pair(), [[0.8, 0.81], [0.4, 0.41]], 1e-2)
    found.first_return([[0.805, 0.405]], derivative=True)
    found.orbits([[0.805, 0.405]], 2)


def proofs() -> None:
    """The search for proofs."""
    shape = {"side": 64, "top": 1.0633, "max_periods": 2}
    prove(nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113275), [0.83, 0.36], depth=1, n_cuts=1, **shape)
    prove(nsmaps.load_system("vi_pair", d=0.26, g_bar=0.2113275), [0.7, 0.3], depth=0, around=Around(0, 500, 1000), **shape)


def calls() -> Iterator[Any]:
    """Everything that compiles an entry, the longest first."""
    yield lambda: observables(duffing(), BENT, 1, "f")
    yield lambda: observables(capsule(), ROW, 2, "d")
    yield lambda: arrivals(duffing(), duffing()._kernel(), [0.0, 0.1, 0.5])
    yield lambda: arrivals(capsule(), capsule()._kernel(), [0.0, 0.1, 0.2, 0.3, 1.0])
    yield lambda: returns(duffing(), BENT)
    yield lambda: returns(capsule(), ROW)
    yield lambda: returns(pair(), STATE)
    yield lambda: observables(pair(), STATE, 2, "d")
    for call in (call_composite, call_boxes, call_noise):
        yield lambda call=call: call(pair())
    for call in (call_boxes, call_noise):
        yield lambda call=call: call(capsule())
    yield impacts
    yield strips
    yield proofs


def main(folder: Path, begin: int, step: int) -> None:
    """Make every step-th call from one on; the first process has others make the rest."""
    linked.FOLDER, linked.written_to = folder / "none", folder
    command = [sys.executable, __file__, str(folder)]
    others = [subprocess.Popen([*command, str(k), str(step)]) for k in range(1, step)] if begin == 0 else []
    for k, call in enumerate(calls()):
        if k % step == begin:
            call()
    if any(other.wait() for other in others):
        sys.exit("another process has failed")


if __name__ == "__main__":
    where, *share = sys.argv[1:]
    if share:
        main(Path(where), *map(int, share))
    else:
        with TemporaryDirectory() as scratch:
            os.environ["NSMAPS_CACHE_DIR"] = scratch
            main(Path(where), 0, os.cpu_count() or 1)
        for path in sorted(Path(where).iterdir()):
            print(f"{path.stat().st_size / 1000:8.1f} kB  {path.name}")
