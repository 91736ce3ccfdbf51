"""The folder of a run: whose it is, and what commands wrote into it beside the results."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from nsmaps.errors import NsmapsError
from nsmaps.reading import odd_character
from nsmaps.storage import replace_file, unfinished

RECORD = "result.json"
RESULTS = ("study.yaml", "arrays.npz", RECORD)
LISTED = "written.txt"  #: the paths of what was drawn and exported from the results, a line each


READY = ".ready"  #: a folder inside with files of a result that are whole, and are moved to their places
BEGIN = '{\n "format": '  #: how a record begins


def check_folder(folder: Path, study: str) -> None:
    """Refuse a folder that cannot be, that holds a run of another study, or files of a run's names that no run wrote.

    What a program that was killed had ready is moved to its place before.
    """
    if odd := odd_character(os.fspath(folder)):
        raise NsmapsError(f"the character {odd} in the name of a folder; expected: a name without control characters")
    there = next(path for path in (folder, *folder.parents, Path()) if os.path.lexists(path))
    if not (os.path.isdir(there) and os.access(there, os.W_OK)):
        raise NsmapsError(f"{there} is no folder that can be written to; expected: one that can, or the name of one to be made")
    with writable(folder):
        settle(folder)
        with unfinished(folder):
            pass
    accepted = "expected: a folder of this study's own, or one that is empty or not there"
    if (folder / RECORD).is_file():
        found = study if _is_cut_off(folder / RECORD) else _study_of(folder / RECORD)
        if found is None:
            raise NsmapsError(f"{folder / RECORD} is there, and no run wrote it; {accepted}")
        if found != study:
            raise NsmapsError(f"{folder} holds a run of {found!r}, and would become one of {study!r}; {accepted}")
    elif (folder / "study.yaml").exists() and not (folder / "arrays.npz").exists():
        raise NsmapsError(f"{folder / 'study.yaml'} is there, and no run wrote it; the run's own would replace it; {accepted}")


def _study_of(record: Path) -> str | None:
    """The name of the study that a record is of, as it says."""
    try:
        data = json.loads(record.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return None
    name = data.get("study") if isinstance(data, dict) else None
    return name if isinstance(name, str) else None


def _is_cut_off(record: Path) -> bool:
    """Whether a file is what a broken disk left of a record."""
    text = record.read_bytes().decode(errors="replace")
    return not text.strip("\0 \n") or (text.startswith(BEGIN) and _study_of(record) is None)


def replace_results(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Replace the files of a result, all or none, whatever stops the program; what was drawn of the earlier result goes."""
    settle(folder)
    with unfinished(folder) as beside:
        for name, content in contents.items():
            replace_file(beside / name, content)
        beside.rename(folder / READY)
    settle(folder)


def settle(folder: Path) -> None:
    """Move files of a result that are ready to their places, the record last, if there are any."""
    if not (folder / READY / RECORD).is_file():
        return
    clear(folder)
    for name in RESULTS:
        if (folder / READY / name).is_file():
            (folder / READY / name).replace(folder / name)
    (folder / READY).rmdir()


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Where a run's folder cannot be written the error says what is kept and how to go on."""
    try:
        yield
    except OSError as error:
        raise NsmapsError(
            f"{folder} cannot be written to ({error.strerror or error}); expected: room on the disk, and the right to write. "
            "What was finished before is kept there: go on with --resume"
        ) from error


@contextmanager
def listed(folder: Path, part: Path) -> Iterator[Path]:
    """A folder to write into, whose files are moved to the folder `part` at the end, whole or not at all.

    Those that are then inside the run's folder are listed, and before they are there: so they go with the results they are of.
    """
    with unfinished(part) as beside:
        yield beside
        made = sorted(path.name for path in beside.iterdir())
        root, place = folder.resolve(), part.resolve()
        inside = [(place / name).relative_to(root).as_posix() for name in made] if place.is_relative_to(root) else []
        if inside and (folder / RECORD).is_file():
            replace_file(folder / LISTED, "".join(f"{path}\n" for path in sorted({*files_of(folder), *inside})).encode())
        for name in made:
            (beside / name).replace(part / name)


def clear(folder: Path) -> None:
    """Remove what speaks of earlier results: the record, the report, and what is listed; nothing else."""
    root = folder.resolve()
    for name in (RECORD, "report.html", *files_of(folder), LISTED):
        path = folder / name
        if os.path.lexists(path) and not os.path.isdir(path) and path.resolve().is_relative_to(root):
            path.unlink(missing_ok=True)
            if path.parent != folder:
                with suppress(OSError):  # not there, or with something else in it
                    path.parent.rmdir()


def files_of(folder: Path) -> list[str]:
    """The paths in a run's folder of what was drawn and exported from its results."""
    path = folder / LISTED
    return path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else []
