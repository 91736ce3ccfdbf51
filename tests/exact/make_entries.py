"""Make the linked forms of entries that the package ships, after a change of the engine: `python tests/exact/make_entries.py`.

They are used with the versions of numba, llvmlite, NumPy and Python, and on the platform, with which they were made.
"""

import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numba.core.registry import cpu_target

import nsmaps
from nsmaps.exact.compiling import linked
from nsmaps.exact.modes.paths.tracks import events_from
from nsmaps.proof.closed import Around
from nsmaps.proof.prove import prove
from nsmaps.study.ahead import CALLS


def call_all() -> None:
    """Call everything that compiles an entry."""
    pair = nsmaps.load_system("vi_pair", d=0.3, r=0.5, M=0.1245, g=9.8, beta=1.0471975511965976, F=5)
    state = np.array([[0.5, 1.0]])
    pair.first_return(state)
    pair.itineraries(state)
    pair.trajectory(state[0], 4)
    pair.sensitivity(state, {"d": 1})
    pair.grazing_curves({"v": (0.1, 0.9), "phi": (0.3, 0.5)}, 20)
    capsule = nsmaps.load_system("recoil_pair", eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, g_bar=0.2113)
    row = np.array([[0.5, 0.1, -0.6, 1.0]])
    capsule.first_return(row)
    capsule.trajectory(row[0], 4)
    beyond = np.array([[0.0, 0.1, 0.2, 0.3, 1.0]])
    capsule.arrivals(beyond)
    next(events_from(capsule._kernel().definition, capsule._kernel().table, beyond[0], 0))
    for system, start in ((pair, state[0]), (capsule, row[0])):
        nsmaps.observe(system, start, 2, ["loss"], batches=1)
        nsmaps.observe_orbit(
            system, nsmaps.periodic_orbit(system, nsmaps.orbit(system, start, 300).final, 2), ["loss"], {"d": 1.0}
        )
    for call in CALLS.values():
        call(pair)
    strips = nsmaps.strip_map(pair, [[0.8, 0.81], [0.4, 0.41]], 1e-2)
    strips.first_return([[0.805, 0.405]], derivative=True)
    strips.orbits([[0.805, 0.405]], 2)
    nsmaps.lyapunov(pair, state, 32, 4)
    shape = {"side": 64, "top": 1.0633, "periods": 2}
    prove(nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113275), [0.83, 0.36], depth=1, cuts=1, **shape)
    prove(nsmaps.load_system("vi_pair", d=0.26, g_bar=0.2113275), [0.7, 0.3], depth=0, around=Around(0, 500, 1000), **shape)
    CALLS["boxes"](capsule)
    CALLS["noise"](capsule)
    duffing = nsmaps.load_study("duffing/diagram").system_object()
    bent, start = duffing._kernel().modes, np.array([1.5, 0.5])
    duffing.first_return([start])
    duffing.trajectory(start, 4)
    duffing.arrivals([[0.0, 0.1, 0.5]])
    next(events_from(bent.definition, bent.table, np.array([0.0, 0.1, 0.5]), 0))
    nsmaps.observe(duffing, start, 2, ["loss"], batches=1)
    nsmaps.observe_orbit(
        duffing, nsmaps.periodic_orbit(duffing, nsmaps.orbit(duffing, start, 300).final, 1), ["loss"], {"f": 1.0}
    )


if __name__ == "__main__":
    with TemporaryDirectory() as scratch:
        os.environ["NSMAPS_CACHE_DIR"] = scratch
        linked.FOLDER, linked.written_to = Path(scratch), linked.FOLDER
        shutil.rmtree(linked.written_to, ignore_errors=True)
        call_all()
    (linked.written_to / "versions.txt").write_text("\n".join(linked.versions(cpu_target.target_context.codegen())) + "\n")
    for path in sorted(linked.written_to.iterdir()):
        print(f"{path.stat().st_size / 1000:8.1f} kB  {path.name}")
