"""Writes stored runs into tests/data, of further studies in this FORMAT or of all studies in a new one; older folders stay.

python tests/make_stored.py STUDY..., such as new.yaml or tests/data/run-format-3/*/study.yaml
"""

import sys
from pathlib import Path

import numpy as np

import nsmaps
from nsmaps.study.reading.reader import read_study
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.store.renewed import renewed
from nsmaps.study.study import Study

DATA = Path(__file__).parent / "data"


def main(studies: list[str]) -> None:
    """Run every study, which may have former keys, and compress its arrays."""
    for file in studies:
        study = read_study(Path(file), Path(file).stem, translate=lambda data: renewed(data, Study))
        folder = DATA / f"run-format-{FORMAT}" / study.name
        if folder.exists():
            raise SystemExit(f"{folder} is there; stored runs of a format are not written again")
        nsmaps.run(study, out=folder)
        arrays = dict(np.load(folder / "arrays.npz", allow_pickle=False))
        np.savez_compressed(folder / "arrays.npz", allow_pickle=False, **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
