"""The folder of compiled code.

Files are verified when they are read, and compiled again where they are damaged, by one process while others wait.
"""

import os
import sys
import warnings
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from time import monotonic, sleep
from typing import BinaryIO

from nsmaps.files.storage import replace_file, sweep

if sys.platform != "win32":
    import fcntl

SEAL = 32  #: bytes of the digest with which every file begins
PATIENCE, LOOK = 300.0, 0.05  #: seconds for which a process waits for another one, and between two looks


def cache_folder() -> Path:
    """The folder of compiled code: NSMAPS_CACHE_DIR, else `nsmaps` in the user's cache folder. It need not exist."""
    if named := os.environ.get("NSMAPS_CACHE_DIR"):
        return Path(named)
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "nsmaps"


def read(name: str) -> bytes | None:
    """The content stored under a name; None if there is none, or if it is damaged."""
    try:
        content = (_folder() / name).read_bytes()
    except OSError:
        return None
    return content[SEAL:] if sha256(content[SEAL:]).digest() == content[:SEAL] else None


def store(name: str, content: bytes) -> None:
    """Store content under a name as a whole; a failure is reported once as a warning and raises no error."""
    try:
        _folder().mkdir(parents=True, exist_ok=True)
        replace_file(_folder() / name, sha256(content).digest() + content, sync=False)
    except OSError as error:
        _warn(str(_folder()), error.strerror or str(error))


CLAIMED: dict[str, BinaryIO | None] = {}  #: by name; None where nothing can be locked


def claim(name: str) -> None:
    """Claim the computation of the content of a name, after other processes that have claimed it.

    A claim ends with `release`, or with the process. After 300 s, or where files cannot be locked, every process computes alone.
    """
    if name not in CLAIMED:
        CLAIMED[name] = None if sys.platform == "win32" else _lock(name)


def release(*names: str) -> None:
    """End the claims of names, or all."""
    for name in names or [*CLAIMED]:
        file = CLAIMED.pop(name, None)
        if file is not None:
            with suppress(OSError):
                os.unlink(file.name)
            file.close()


def _lock(name: str) -> BinaryIO | None:
    """A file that no other process has locked; None after 300 s, or if it cannot be."""
    with suppress(OSError):
        _folder().mkdir(parents=True, exist_ok=True)
        file, end = (_folder() / f"{name}.lock").open("ab"), monotonic() + PATIENCE
        while monotonic() <= end:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return file
            except BlockingIOError:
                sleep(LOOK)
        file.close()
    return None


@lru_cache(maxsize=1)
def _folder() -> Path:
    """The folder, created once in a process, and cleared of unfinished files of programs that were killed."""
    sweep(folder := cache_folder())
    return folder


@lru_cache(maxsize=1)
def _warn(folder: str, why: str) -> None:
    warnings.warn(
        f"compiled code cannot be kept in {folder} ({why}), and will be compiled again by the next program; expected: a folder "
        "with write permission and about 50 MB free, named by the environment variable NSMAPS_CACHE_DIR names",
        RuntimeWarning,
        stacklevel=2,
    )
