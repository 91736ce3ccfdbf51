"""The folder of compiled code: what is kept there is known to be whole when it is read, and is made again where it is not."""

import os
import warnings
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from nsmaps.storage import replace_file, sweep

SEAL = 32  #: bytes of a digest, with which every file begins


def cache_folder() -> Path:
    """Where compiled code is kept: NSMAPS_CACHE_DIR, else `nsmaps` in the user's cache folder. It need not be there."""
    if named := os.environ.get("NSMAPS_CACHE_DIR"):
        return Path(named)
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "nsmaps"


def kept(name: str) -> bytes | None:
    """What is kept under a name; None where nothing is, or where it is not whole."""
    try:
        content = (_folder() / name).read_bytes()
    except OSError:
        return None
    return content[SEAL:] if sha256(content[SEAL:]).digest() == content[:SEAL] else None


def keep(name: str, content: bytes) -> None:
    """Keep something under a name, whole or not at all; that it cannot be written is said once and no error."""
    try:
        _folder().mkdir(parents=True, exist_ok=True)
        replace_file(_folder() / name, sha256(content).digest() + content, sync=False)
    except OSError as error:
        _warn(str(_folder()), error.strerror or str(error))


@lru_cache(maxsize=1)
def _folder() -> Path:
    """The folder, asked for once in a process, and cleared of what programs that were killed left unfinished."""
    sweep(folder := cache_folder())
    return folder


@lru_cache(maxsize=1)
def _warn(folder: str, why: str) -> None:
    warnings.warn(
        f"compiled code cannot be kept in {folder} ({why}), and will be compiled again by the next program; expected: a folder "
        "that can be written to with some 50 MB left, which the environment variable NSMAPS_CACHE_DIR names",
        RuntimeWarning,
        stacklevel=2,
    )
