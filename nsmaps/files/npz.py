"""Arrays by name as npz files."""

import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLE, DENSE = 4096, 0.8  #: numbers of an array that are tried, and the share of their bytes beyond which all stay as they are


def packed(arrays: Mapping[str, NDArray[Any]], method: int = zipfile.ZIP_STORED) -> bytes:
    """Arrays as the content of an npz file, without Python objects; compressed at the least level, as floats gain no more.

    Arrays of floats that hardly shrink, as images, are stored as they are.
    """
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", method, compresslevel=1) as archive:
        for name, array in arrays.items():
            part = np.asanyarray(array).ravel()[:SAMPLE].tobytes() if method != zipfile.ZIP_STORED else b""
            archive.compression = method if len(zlib.compress(part, 1)) < DENSE * len(part) else zipfile.ZIP_STORED
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)
    return stream.getvalue()


def read_arrays(file: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays of an npz file; None where it is not there, or not whole."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return dict(arrays)
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error):
        return None
