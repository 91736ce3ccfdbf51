"""PNG files of drawn pages: rows unfiltered, which lines, text and areas of one colour compress best and fastest."""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_LEVEL = 3  #: of compression; beyond it a file takes twice the time for a tenth of its size
_INCH = 0.0254  #: metres


def write_png(path: Path, pixels: NDArray[np.uint8], dpi: float) -> None:
    """Write pixels, shape (height, width, 4) as red, green, blue and opacity, with the dots per inch at which they were drawn."""
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # each begins with the number of its filter, none
    rows[:, 1:] = pixels.reshape(height, -1)
    metre = round(dpi / _INCH)
    parts = {
        b"IHDR": struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0),
        b"pHYs": struct.pack(">IIB", metre, metre, 1),
        b"IDAT": zlib.compress(rows.data, _LEVEL),
        b"IEND": b"",
    }
    chunks = [_chunk(kind, data) for kind, data in parts.items()]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))
