"""The folder of a run: study.yaml (as resolved), result.json (numbers, verdicts, versions) and arrays.npz.

Figures are redrawn from the arrays as they were computed, never from a second run. Every file appears whole or not at
all, result.json last.
"""

import json
import os
import platform
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap

from nsmaps.errors import NsmapsError, StudyError
from nsmaps.parallel import packed
from nsmaps.plugins import entry_of, is_file, owner_of
from nsmaps.reading import json_of, text_of
from nsmaps.storage import replace_file
from nsmaps.study.estimates import GIGABYTE
from nsmaps.study.limits import memory_limit
from nsmaps.study.reading.reader import read_study
from nsmaps.study.result import KEPT, StudyResult
from nsmaps.study.sections import SECTIONS
from nsmaps.study.sections.base import Verdict
from nsmaps.study.store.renewed import renewed
from nsmaps.study.store.run_folder import RECORD, replace_results, settle
from nsmaps.study.store.serialize import Arrays, decode, encode
from nsmaps.study.study import Study
from nsmaps.study.summary import numbers

FORMAT = 3
LARGEST = 2**30  #: bytes of a record
PACKAGES = ("nsmaps", "numpy", "scipy", "sympy", "matplotlib", "pydantic", "numba", "ruamel.yaml", "typer")


class BrokenRun(NsmapsError):
    """A file of a run is missing or cut off."""


def versions() -> dict[str, str]:
    """The versions of Python, of nsmaps and of what it is built on, without importing any of them."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def versions_of(system: str) -> dict[str, str]:
    """The versions, and the package that gives a system, or the system's file."""
    given_by = system if is_file(system) else owner_of(entry_of(system))
    return {**versions(), "system": given_by}


def resolved(study: Study) -> str:
    """The study as YAML with every number worked out; it reads back as the same study."""
    text = StringIO()
    yaml = YAML()
    yaml.default_flow_style = None
    yaml.width = 120
    told = study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    if study.expected_failures:  # texts for keys, which ruamel breaks between lines in flow style, as no reader takes them
        told["expected_failures"] = CommentedMap(study.expected_failures)
        told["expected_failures"].fa.set_block_style()
    yaml.dump(told, text)
    return text.getvalue()


def write(result: StudyResult, folder: Path) -> None:
    """Write a result's files to a folder, which is made if it is not there; what was drawn of an earlier result goes."""
    arrays: Arrays = {}
    objects = {name: encode(getattr(result, name), name, arrays) for name in KEPT}
    study = resolved(result.study).encode()
    record = json.dumps(_record(result) | {"study_sha256": _digest(study), "objects": objects}, indent=1).encode()
    replace_results(folder, {"study.yaml": study, "arrays.npz": packed(arrays), RECORD: record})


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()


def amend(result: StudyResult, folder: Path) -> None:
    """Write what was found of a result afterwards to its folder too: timings, and what could not be drawn of it."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    found = {"timings": result.timings, "undrawn": result.undrawn}
    replace_file(folder / RECORD, json.dumps(record | found, indent=1).encode())


def _record(result: StudyResult) -> dict[str, Any]:
    """What result.json says to a reader."""
    return {
        "format": FORMAT,
        "study": result.study.name,
        "title": result.study.title,
        "finished": result.finished,
        "holds": result.holds,
        "verdicts": [asdict(verdict) for verdict in result.verdicts],
        "system": {"name": result.study.system, "parameters": result.system.parameters},
        "numbers": numbers(result),
        "timings": result.timings,
        "undrawn": result.undrawn,
        "versions": result.versions,
    }


def read_result(folder: str | os.PathLike[str], *, installed_only: bool = False) -> StudyResult:
    """The result of a run from its folder; its second iterate is expanded again from the coefficients kept.

    A run of a system in a file runs that file; with `installed_only` it is refused.

    Raises NsmapsError when the folder holds no finished result, one of another format, or another study than the run wrote there.
    """
    place = Path(folder)
    with suppress(OSError):  # it may be read only
        settle(place)
    if not (place / "result.json").is_file():
        raise NsmapsError(f"{place} holds no result.json; expected: a folder that `nsmaps run` wrote")
    with _whole(place / "result.json"):
        record = json_of(text_of(place / "result.json", LARGEST))
    _check_format(place, record)
    with _whole(place / "study.yaml"):
        if record.get("study_sha256") not in (None, _digest((place / "study.yaml").read_bytes())):  # None: of before it was kept
            raise ValueError("it is not as the run wrote it")
        study = read_study(place / "study.yaml", str(record.get("study")), installed_only, lambda data: renewed(data, Study))
    with _whole(place / "arrays.npz"):
        loaded = _loaded(place / "arrays.npz")
    try:
        return _again(_result(study, _Record.model_validate(record), loaded))
    except NsmapsError:
        raise
    except Exception as error:  # a record that no run wrote can be wrong in every way
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise NsmapsError(f"{place} is of format {FORMAT}, but not as this nsmaps reads it: {why}; {_writer(record)}") from error


class _Record(BaseModel):
    """What result.json must say to be read; what it says to a reader besides is left alone."""

    verdicts: tuple[Verdict, ...]
    timings: dict[str, float]
    versions: dict[str, str]
    finished: bool
    undrawn: dict[str, str] = {}
    objects: dict[str, Any]


def _result(study: Study, record: _Record, arrays: Arrays) -> StudyResult:
    """The result of a record and its arrays."""
    kept: dict[str, Any] = {Study.was.get(name, name): decode(value, arrays) for name, value in record.objects.items()}
    told = {name: getattr(record, name) for name in _Record.model_fields if name != "objects"}
    return StudyResult(study, study.system_object(), **told, **kept)


def _again(result: StudyResult) -> StudyResult:
    """The result with what no file keeps, made again from what is kept."""
    for section in SECTIONS:
        if section.again and section.name in result.timings:
            result = replace(result, **section.again(result))
    return result


def _loaded(file: Path) -> Arrays:
    """The arrays of a file, of which none is pickled, and which are no larger than the memory that a run may need."""
    with zipfile.ZipFile(file) as packed:
        size, most = sum(part.file_size for part in packed.infolist()) / GIGABYTE, memory_limit()
    if size > most:
        raise NsmapsError(f"{size:.3g} GB of arrays; expected: at most {most:.3g}, or what NSMAPS_MAX_MEMORY tells")
    with np.load(file, allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}


@contextmanager
def _whole(file: Path) -> Iterator[None]:
    """A file of a run that is missing or cut off is an error that says what to do."""
    try:
        yield
    except StudyError:
        raise
    except (OSError, EOFError, ValueError, RuntimeError, MemoryError, LookupError, zipfile.BadZipFile, zlib.error) as error:
        what = "is missing" if isinstance(error, FileNotFoundError) else f"cannot be read ({error})"
        raise BrokenRun(f"{file} {what}; expected: a folder as `nsmaps run` wrote it; run the study again") from error


def _check_format(place: Path, record: Any) -> None:
    """An error unless a record is of the format that is read here."""
    found = record.get("format") if isinstance(record, dict) else None
    if found != FORMAT:
        newer = isinstance(found, int) and found > FORMAT
        what = "a newer nsmaps reads it" if newer else "no nsmaps that was released wrote it; run the study again"
        raise NsmapsError(f"{place / 'result.json'} has format {found!r}; expected: {FORMAT}; {what}; {_writer(record)}")


def _writer(record: Any) -> str:
    """Which version wrote a record, as it says."""
    versions = record.get("versions") if isinstance(record, dict) else None
    return f"written by nsmaps {versions.get('nsmaps') if isinstance(versions, dict) else 'of an unknown version'}"
