"""The run behind the figure of exit times: regions of `vi_pair/fp` under the exact map, with a box as the target of arrivals.

A study can name a target only by its section `morse`.
"""

from math import pi
from pathlib import Path

import nsmaps
from nsmaps.cells.morse import forward_invariant_box
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.times import exit_times
from nsmaps.study.store.archive import write

WINDOW = {"v": (0.02, 1.07), "phi": (0.0, 2 * pi)}
BOX = {"v": (0.7, 1.0), "phi": (0.2, 1.14)}
KEPT = {"name", "title", "system", "parameters", "grid", "families", "diagonal", "composite"}


def compute(folder: Path) -> None:
    """Write the run, whose cells are 512 along each axis."""
    study = nsmaps.load_study("vi_pair/fp")
    result = nsmaps.run_study(type(study).model_validate({key: getattr(study, key) for key in KEPT}))
    found = find_cycles(result.system, WINDOW, max_period=1, depth=4, n_cells=32)
    target = forward_invariant_box(result.system, BOX)
    times = exit_times(result.system, result.composite, WINDOW, depth=4, target=target, cycles=found.cycles)
    write(result.with_parts({"exit_times": times}), folder)
