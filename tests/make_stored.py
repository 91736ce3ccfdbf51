"""Writes the stored runs of tests/data again, from their own studies: for a new FORMAT only, older folders stay as they are.

python tests/make_stored.py FROM, where FROM is the folder of an older format
"""

import sys
from pathlib import Path

import numpy as np

import nsmaps
from nsmaps.study.store.archive import FORMAT

DATA = Path(__file__).parent / "data"


def main(older: Path) -> None:
    """Run every study of an older folder, and compress its arrays."""
    for study in sorted(older.glob("*/study.yaml")):
        folder = DATA / f"run-format-{FORMAT}" / study.parent.name
        nsmaps.run(study, out=folder)
        arrays = dict(np.load(folder / "arrays.npz", allow_pickle=False))
        np.savez_compressed(folder / "arrays.npz", allow_pickle=False, **arrays)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
