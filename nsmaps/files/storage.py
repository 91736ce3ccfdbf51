"""Files and folders that appear whole or not at all, whatever stops the program or the disk while they are written; names."""

import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time

UNFINISHED = ".unfinished-"  #: begins the name of what is being written, beside its place
HOUR = 3600  #: seconds after which what is unfinished is taken for that of a program that was killed


def replace_file(path: Path, content: bytes, sync: bool = True) -> None:
    """Write a file beside its place, with `sync` down to the disk, and move it there at once.

    Raises OSError, which names the file, where that cannot be done; what was there is left as it was.
    """
    beside = None
    try:
        handle, beside = tempfile.mkstemp(dir=path.parent, prefix=UNFINISHED)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            if sync:
                file.flush()
                os.fsync(file.fileno())
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    except BaseException as error:
        if beside is not None:
            with suppress(OSError):
                os.unlink(beside)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise


@contextmanager
def unfinished(folder: Path) -> Iterator[Path]:
    """A folder within another, for files to be written and then moved into that; gone at the end.

    The other is made if it is not there, with its parents, and goes again if nothing is moved into it.
    """
    missing = missing_of(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sweep(folder)
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=UNFINISHED, ignore_cleanup_errors=True) as beside:
            yield Path(beside)
    finally:
        remove_empty(missing)


def missing_of(folder: Path) -> list[Path]:
    """Which of a folder and its parents are not there, the innermost first."""
    return [path for path in (folder, *folder.parents) if not path.exists()]


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove folders, the innermost first, up to one that has something in it."""
    with suppress(OSError):
        for folder in folders:
            folder.rmdir()


def sweep(folder: Path) -> None:
    """Remove from a folder what programs that were killed left unfinished: of an hour ago, for others may be at work."""
    for path in folder.glob(f"{UNFINISHED}*"):
        with suppress(OSError):
            if time() - path.stat().st_mtime > HOUR:
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def file_part(part: str) -> str:
    """The name of a part of a result, such as a domain, as file names have it.

    >>> file_part("exact from R1+")
    'exact-from-R1+'
    """
    return re.sub(r"[^\w.+]+", "-", part)
