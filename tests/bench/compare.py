"""The developers' benchmark: `python tests/bench/compare.py [FOLDER]` adds the C loops and writes bench.md and bench.png there.

Install the peers beside nsmaps first (heyoka, diffrax, scikit-sundae), or they are skipped. It takes a few minutes.
"""

import sys
from pathlib import Path

from cloop import CLoop

import nsmaps.bench


def main(folder: Path) -> None:
    """Run everything, print the table, write it and the figure."""
    result = nsmaps.bench.run(
        [CLoop(), CLoop(tuned=True), *nsmaps.bench.programs()],
        progress=lambda what, done, total: print(f"{what} {done}/{total}", file=sys.stderr),
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bench.md").write_text(result.table(), encoding="utf-8")
    nsmaps.bench.figure(result, folder / "bench.png")
    print(result.table())
    ours = "nsmaps one core"
    ratios = {
        "value with derivative / value": result.ratio("nsmaps one core with derivative", ours),
        "one core / two cores": result.ratio(ours, "nsmaps two cores"),
        "nsmaps / C loop plain": result.ratio(ours, "C loop plain"),
        "nsmaps / C loop tuned": result.ratio(ours, "C loop tuned"),
    }
    if "heyoka 2e-16" in [row.name for row in result.rows]:
        ratios["heyoka / nsmaps"] = result.ratio("heyoka 2e-16", ours)
    for what, ratio in ratios.items():
        print(f"{what}: {ratio:.3f}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
