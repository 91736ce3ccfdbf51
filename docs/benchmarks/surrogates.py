"""Speed against error of maps put in the place of the exact one: `python docs/benchmarks/surrogates.py [FOLDER]` (some minutes).

Both faces of the general algorithm over the same box, for three values of d, with the exact map as the last row. The figure is
drawn from the table of docs/explanation/benchmarks.md, by `python docs/gallery/make.py surrogates`.
"""

import sys
from math import pi
from pathlib import Path
from time import perf_counter

import numpy as np

from nsmaps import Axis, Grid, Partition, load_system, partition
from nsmaps.reduced.adaptive.accurate import accurate
from nsmaps.reduced.validation.speed import speeds

GRID = Grid(axes={"v": Axis(low=0.01, high=1.0, points=300), "phi": Axis(low=0.0, high=pi, points=300)})
BOX = np.array([(axis.low, axis.high) for axis in GRID.axes.values()])
EXACT = 5e-13, 2e-15  #: largest and 99 % error of the exact map, of the table that compare.py makes against 50 digits
HEAD = "| d | map | tolerance | pieces | coefficients | build, s | ns a state | largest error | 99 % | left to the exact map |"


def strips(d, system, tolerance):
    """A row of the accurate face, and the time of the exact map."""
    begun = perf_counter()
    made = accurate(system, GRID, tolerance)
    seconds = perf_counter() - begun
    report, errors = made.strips.report, made.uniform
    speed = speeds(system, made.map(system), BOX)
    largest = max(errors.largest, made.beside.largest)
    row = f"| {d} | accurate | {tolerance:g} | {report.leaves} | {report.coefficients} | {seconds:.1f} | {speed.composite:.0f} | "
    return row + f"{largest:.2g} | {errors.high:.2g} | {report.exact_share:.1g} |", speed.exact


def closed(d, system, tolerance):
    """A row of the closed-form face: its errors are those of the attracting pieces."""
    begun = perf_counter()
    made = partition(system, GRID, Partition(tolerance=tolerance))
    seconds = perf_counter() - begun
    speed = speeds(system, made.composite, BOX)
    terms = sum(row.terms for row in made.table())
    row = f"| {d} | closed form | {tolerance:g} | {len(made.table())} | {terms} | {seconds:.1f} | {speed.composite:.0f} | "
    return row + f"{made.max_error:.2g} (attracting) | | 0 |"


def main(folder: Path) -> None:
    """The table, printed and written."""
    rows = [HEAD, "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    for d in (0.35, 0.30, 0.26):
        system = load_system("vi_pair", d=d, r=0.5, M=0.1245, g=9.8, beta=pi / 3, F=5)
        for tolerance in (1e-1, 1e-2, 1e-3, 1e-4):
            rows.append(closed(d, system, tolerance))
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8):
            row, exact = strips(d, system, tolerance)
            rows.append(row)
        rows.append(f"| {d} | exact | | | | | {exact:.0f} | {EXACT[0]} | {EXACT[1]} | |")
        print("\n".join(rows[-10:]), flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "surrogates.md").write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
