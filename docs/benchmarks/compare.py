"""The developers' benchmark, `python docs/benchmarks/compare.py [FOLDER] [--ours]`: with C loops; writes bench.md, bench.png.

Install the peers beside nsmaps first (heyoka, diffrax, scikit-sundae), or they are skipped. It takes a few minutes. With `--ours`
they take no part, and it takes some seconds: the ratios between our own ways and the C loops alone.
"""

import sys
from pathlib import Path

from apart import Large, Single, TwoBatches
from cloop import CLoop

import nsmaps.bench


def main(folder: Path, ours_alone: bool) -> None:
    """Run everything, print the table, write it and the figure."""
    peers = [one for one in nsmaps.bench.programs() if one.family == "nsmaps" or not ours_alone]
    result = nsmaps.bench.run(
        [CLoop(), CLoop(tuned=True), Single(), Large(), TwoBatches(), *peers],
        progress=lambda share: print(f"{100 * share:.0f} %", file=sys.stderr),
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bench.md").write_text(result.table(), encoding="utf-8")
    nsmaps.bench.figure(result, folder / "bench.png")
    print(result.table())
    ours = "nsmaps one core"
    ratios = {
        "value with derivative / value, at most 1.15": result.ratio("nsmaps one core with derivative", ours),
        "single states / C loop plain, at most 0.9": result.ratio("nsmaps single states", "C loop plain"),
        "one core / two cores, one large batch, at least 1.7": result.ratio("nsmaps one core, large batch", "nsmaps two cores"),
        "one core / two batches apart, what this machine can": result.ratio(ours, "nsmaps two batches apart"),
        "one core / C loop plain, at most 0.5": result.ratio(ours, "C loop plain"),
        "one core / C loop tuned": result.ratio(ours, "C loop tuned"),
    }
    if "heyoka 2e-16" in [row.name for row in result.rows]:
        ratios["heyoka / one core, at least 20"] = result.ratio("heyoka 2e-16", ours)
    for what, ratio in ratios.items():
        print(f"{what}: {ratio:.3f}")


if __name__ == "__main__":
    folders = [text for text in sys.argv[1:] if text != "--ours"]
    main(Path(folders[0] if folders else "."), "--ours" in sys.argv)
