"""Speed against error of reduced maps: `python docs/benchmarks/surrogates.py [FOLDER]` (some minutes).

Both variants of the general algorithm over the same box, for three values of d, with the exact map as the last row. The figure is
drawn from docs/benchmarks/surrogates.txt, by `python docs/gallery/make.py surrogates`.
"""

import sys
from math import pi
from pathlib import Path

import numpy as np

from nsmaps import Axis, Grid, Partition, load_system, partition
from nsmaps.reduced.adaptive.accurate import accurate
from nsmaps.reduced.validation.speed import speeds

GRID = Grid(axes={"v": Axis(low=0.01, high=1.0, points=300), "phi": Axis(low=0.0, high=pi, points=300)})
BOX = np.array([(axis.low, axis.high) for axis in GRID.axes.values()])
EXACT = 5e-13  #: largest error of the exact map, of the table that compare.py makes against 50 digits
HEAD = "| d | map | tolerance | pieces | coefficients | ns a state | largest error |"


def strips(d, system, tolerance):
    """A row of the accurate face, and the time of the exact map."""
    made = accurate(system, GRID, tolerance)
    report, speed = made.strips.report, speeds(system, made.map(system), BOX)
    largest = max(made.uniform.largest, made.beside.largest)
    row = f"| {d} | accurate | {tolerance:g} | {report.leaves} | {report.coefficients} | {speed.composite:.0f} | {largest:.2g} |"
    return row, speed.exact


def closed(d, system, tolerance):
    """A row of the closed-form face: its errors are those of the attracting pieces."""
    made = partition(system, GRID, Partition(tolerance=tolerance))
    speed = speeds(system, made.composite, BOX)
    terms = sum(row.terms for row in made.table())
    return f"| {d} | closed form | {tolerance:g} | {len(made.table())} | {terms} | {speed.composite:.0f} | {made.max_error:.2g} |"


def main(folder: Path) -> None:
    """The table, printed and written."""
    rows = [HEAD, "|---|---|---:|---:|---:|---:|---:|"]
    for d in (0.35, 0.30, 0.26):
        system = load_system("vi_pair", d=d, r=0.5, M=0.1245, g=9.8, beta=pi / 3, F=5)
        for tolerance in (1e-1, 1e-2, 1e-3, 1e-4):
            rows.append(closed(d, system, tolerance))
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8):
            row, exact = strips(d, system, tolerance)
            rows.append(row)
        rows.append(f"| {d} | exact | | | | {exact:.0f} | {EXACT} |")
        print("\n".join(rows[-10:]), flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "surrogates.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
