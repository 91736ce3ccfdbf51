"""The folder of a run: its study, and the files that commands wrote besides the results."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from nsmaps.errors import NsmapsError
from nsmaps.files.reading import odd_character
from nsmaps.files.storage import replace_file, unfinished

RECORD = "result.json"
RESULTS = ("study.yaml", "arrays.npz", RECORD)
PARTS = "parts"  #: the folder of finished steps inside, until the result is written
LISTED = "written.txt"  #: the paths of figures and exports of the results, one per line


READY = ".ready"  #: a folder inside with the complete files of a result, before they are moved
BEGIN = '{\n "format": '  #: the first characters of a record


def check_folder(folder: Path, study: str) -> None:
    """Raise NsmapsError for a folder that is not valid, of another study, or with files that no run wrote.

    Complete files of a program that was killed are moved to their places before.
    """
    if odd := odd_character(os.fspath(folder)):
        raise NsmapsError(f"the character {odd} in the name of a folder; expected: a name without control characters")
    there = next(path for path in (folder, *folder.parents, Path()) if os.path.lexists(path))
    if not (os.path.isdir(there) and os.access(there, os.W_OK)):
        raise NsmapsError(f"{there} is not a writable folder; expected: a writable folder, or the name of a new one")
    with writable(folder):
        move_ready(folder)
        with unfinished(folder):
            pass
    expected = "expected: a folder of this study, an empty folder, or a new one"
    if (folder / RECORD).is_file():
        found = study if _is_cut_off(folder / RECORD) else _study_of(folder / RECORD)
        if found is None:
            raise NsmapsError(f"{folder / RECORD} exists, and no run wrote it; {expected}")
        if found != study:
            raise NsmapsError(f"refusing to overwrite a run of {found!r} in {folder} with {study!r}; {expected}")
    elif (folder / "study.yaml").exists() and not (folder / "arrays.npz").exists():
        raise NsmapsError(f"{folder / 'study.yaml'} exists, and no run wrote it; refusing to overwrite it; {expected}")


def _study_of(record: Path) -> str | None:
    """The name of the study of a record."""
    try:
        data = json.loads(record.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return None
    name = data.get("study") if isinstance(data, dict) else None
    return name if isinstance(name, str) else None


def _is_cut_off(record: Path) -> bool:
    """True if a file is an incomplete record."""
    text = record.read_bytes().decode(errors="replace")
    return not text.strip("\0 \n") or (text.startswith(BEGIN) and _study_of(record) is None)


def replace_results(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Replace the files of a result, all or none, even if the program is stopped; figures of the earlier result are removed."""
    move_ready(folder)
    with unfinished(folder) as beside:
        for name, content in contents.items():
            replace_file(beside / name, content)
        beside.rename(folder / READY)
    move_ready(folder)


def move_ready(folder: Path) -> None:
    """Move the complete files of a result to their places, the record last, if there are any."""
    if not (folder / READY / RECORD).is_file():
        return
    clear(folder)
    for name in RESULTS:
        if (folder / READY / name).is_file():
            (folder / READY / name).replace(folder / name)
    (folder / READY).rmdir()


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Raise NsmapsError for an OSError inside, with how to resume where finished steps are stored."""
    try:
        yield
    except OSError as error:
        stored = any(folder.glob(f"{PARTS}/*"))
        raise NsmapsError(
            f"{folder} cannot be written to ({error.strerror or error}); expected: free space and write permission"
            f"{'. The finished steps are stored there: resume with --resume' if stored else ''}"
        ) from error


@contextmanager
def listed(folder: Path, part: Path) -> Iterator[Path]:
    """A folder to write into, whose files are moved to the folder `part` at the end, all or none.

    Files inside the run's folder are listed first, so that they are removed with the results.
    """
    with unfinished(part) as beside:
        yield beside
        names = sorted(path.name for path in beside.iterdir())
        root, place = folder.resolve(), part.resolve()
        inside = [(place / name).relative_to(root).as_posix() for name in names] if place.is_relative_to(root) else []
        if inside and (folder / RECORD).is_file():
            replace_file(folder / LISTED, "".join(f"{path}\n" for path in sorted({*files_of(folder), *inside})).encode())
        for name in names:
            (beside / name).replace(part / name)


def clear(folder: Path) -> None:
    """Remove the record, the report and the listed files of earlier results, and nothing else."""
    root = folder.resolve()
    for name in (RECORD, "report.html", *files_of(folder), LISTED):
        path = folder / name
        if os.path.lexists(path) and not os.path.isdir(path) and path.resolve().is_relative_to(root):
            path.unlink(missing_ok=True)
            if path.parent != folder:
                with suppress(OSError):  # missing, or with other files
                    path.parent.rmdir()


def files_of(folder: Path) -> list[str]:
    """The paths of the figures and exports in a run's folder."""
    path = folder / LISTED
    return path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else []
