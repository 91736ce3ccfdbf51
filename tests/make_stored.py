"""Writes the stored runs in tests/data again, from their studies: python tests/make_stored.py [NAME...]."""

import sys
from pathlib import Path

import numpy as np

import nsmaps
from nsmaps.study.reading.reader import read_study
from nsmaps.study.store.archive import FORMAT

STORED = Path(__file__).parent / "data" / f"run-format-{FORMAT}"


def main(names: list[str]) -> None:
    """Run the studies of these folders, or of all, and compress their arrays."""
    for folder in sorted(STORED.iterdir()):
        if not names or folder.name in names:
            study = read_study(folder / "study.yaml", folder.name)
            for file in folder.iterdir():
                file.unlink()
            nsmaps.run_study(study, out=folder)
            arrays = dict(np.load(folder / "arrays.npz", allow_pickle=False))
            np.savez_compressed(folder / "arrays.npz", allow_pickle=False, **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
