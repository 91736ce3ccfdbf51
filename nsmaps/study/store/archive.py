"""The folder of a run: study.yaml (as resolved), result.json (numbers, verdicts, versions) and arrays.npz.

Figures are drawn from the stored arrays. Every file is replaced as a whole, result.json last.
"""

import json
import os
import platform
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from functools import cache
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
from nsmaps.errors.arguments import checked
from nsmaps.files.npz import packed
from nsmaps.files.reading import json_of, text_of
from nsmaps.files.storage import replace_file
from nsmaps.plugins import is_file, is_installed, owners_of
from nsmaps.study.conclusions.summary import numbers
from nsmaps.study.estimates import GIGABYTE
from nsmaps.study.limits import memory_limit
from nsmaps.study.reading.head import Head as Study
from nsmaps.study.reading.reader import read_study
from nsmaps.study.result import StudyResult, Verdict
from nsmaps.study.store.run_folder import RECORD, move_ready, replace_results
from nsmaps.study.store.serialize import Arrays, decode, encode, modules_of

FORMAT = 4
LARGEST = 2**30  #: largest number of bytes of a record
PACKAGES = ("nsmaps", "numpy", "scipy", "sympy", "matplotlib", "pydantic", "numba", "ruamel.yaml", "typer")


class BrokenRunError(NsmapsError):
    """A file of a run is missing or incomplete."""


@cache
def versions() -> Mapping[str, str]:
    """The versions of Python, of nsmaps and of its dependencies, without importing them.

    They are read when a process first asks for them: what it has imported stays what it was.
    """
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def versions_of(study: Study) -> dict[str, str]:
    """The versions, the package or the file that defines the system, the packages of other classes, and digests of all files."""
    names = study.classes()
    system = names.pop(("system",))
    installed = {name: owners for name in names.values() if (owners := owners_of(name))}
    files = sorted({name.rpartition(":")[0] for name in (system, *names.values()) if is_file(name)})
    digests = {file: f"sha256 {sha256(Path(file).read_bytes()).hexdigest()[:16]}" for file in files}
    return {**versions(), "system": owners_of(system) if is_installed(system) else system, **installed, **digests}


def resolved(study: Study) -> str:
    """The study as YAML with all expressions evaluated; reading it yields the same study."""
    text = StringIO()
    yaml = YAML()
    yaml.default_flow_style = None
    yaml.width = 120
    content = study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    if study.expected_failures:  # in flow style ruamel breaks long keys, which cannot be read back
        content["expected_failures"] = CommentedMap(study.expected_failures)
        content["expected_failures"].fa.set_block_style()
    yaml.dump(content, text)
    return text.getvalue()


def write(result: StudyResult, folder: Path) -> None:
    """Write a result's files to a folder, which is created if needed; figures of an earlier result are removed."""
    arrays: Arrays = {}
    objects = {name: encode(result[name], name, arrays) for name in result.study.stored_parts() if name in result}
    study = resolved(result.study).encode()
    record = json.dumps(_record(result) | {"study_sha256": _digest(study), "objects": objects}, indent=1).encode()
    replace_results(folder, {"study.yaml": study, "arrays.npz": packed(arrays, zipfile.ZIP_DEFLATED), RECORD: record})


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()


def amend(result: StudyResult, folder: Path) -> None:
    """Update the record of a result in its folder: timings, and figures that could not be drawn."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    found = {"timings": result.timings, "undrawn": result.undrawn}
    replace_file(folder / RECORD, json.dumps(record | found, indent=1).encode())


def _record(result: StudyResult) -> dict[str, Any]:
    """The summary in result.json."""
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


@checked
def read_result(folder: str | os.PathLike[str], *, installed_only: bool = False) -> StudyResult:
    """The result of a run from its folder; its second iterate is recomputed from the stored coefficients.

    A system in a file is executed; with `installed_only` it is refused.

    Raises:
        NsmapsError: the folder has no result, a result in another format, or a study that was changed after the run.
    """
    place = Path(folder)
    with suppress(OSError):  # the folder may be read-only
        move_ready(place)
    if not (place / "result.json").is_file():
        raise NsmapsError(f"{place} contains no result.json; expected: a folder written by `nsmaps run`")
    with _whole(place / "result.json"):
        record = json_of(text_of(place / "result.json", LARGEST))
    _check_format(place, record)
    with _whole(place / "study.yaml"):
        if record.get("study_sha256") != _digest((place / "study.yaml").read_bytes()):
            raise ValueError("it is not as the run wrote it")
        study = read_study(place / "study.yaml", str(record.get("study")), installed_only)
    with _whole(place / "arrays.npz"):
        loaded = _loaded(place / "arrays.npz")
    try:
        return _again(_result(study, _Record.model_validate(record), loaded))
    except NsmapsError:
        raise
    except Exception as error:  # a record that was not written by a run can have any error
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise NsmapsError(f"{place} is of format {FORMAT}, but not as this nsmaps reads it: {why}; {_writer(record)}") from error


class _Record(BaseModel):
    """The required keys of result.json; other keys are ignored."""

    verdicts: tuple[Verdict, ...]
    timings: dict[str, float]
    versions: dict[str, str]
    finished: bool
    undrawn: dict[str, str] = {}
    objects: dict[str, Any]


def _result(study: Study, record: _Record, arrays: Arrays) -> StudyResult:
    """The result of a record and its arrays."""
    trusted = modules_of(study)
    parts = {name: decode(value, arrays, trusted) for name, value in record.objects.items()}
    content = {name: getattr(record, name) for name in _Record.model_fields if name != "objects"}
    return StudyResult(study, study.system_object(), parts, **content)


def _again(result: StudyResult) -> StudyResult:
    """The result with the fields that are not stored, recomputed from those that are."""
    for analysis in result.study.analyses().values():
        if not analysis.stored and analysis.name_of_step() in result.timings:
            result = result.with_parts(analysis.recompute(result))
    return result


def _loaded(file: Path) -> Arrays:
    """The arrays of a file; raises unless they are plain and smaller than the limit of memory."""
    with zipfile.ZipFile(file) as packed:
        size, limit = sum(part.file_size for part in packed.infolist()) / GIGABYTE, memory_limit()
    if size > limit:
        raise NsmapsError(f"{size:.3g} GB of arrays; expected: at most {limit:.3g}, or the value of NSMAPS_MAX_MEMORY")
    with np.load(file, allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}


@contextmanager
def _whole(file: Path) -> Iterator[None]:
    """Raise BrokenRunError for a file of a run that is missing or incomplete."""
    try:
        yield
    except StudyError:
        raise
    except (OSError, EOFError, ValueError, RuntimeError, MemoryError, LookupError, zipfile.BadZipFile, zlib.error) as error:
        what = "is missing" if isinstance(error, FileNotFoundError) else f"cannot be read ({error})"
        raise BrokenRunError(f"{file} {what}; expected: a folder written by `nsmaps run`; run the study again") from error


def _check_format(place: Path, record: Any) -> None:
    """Raise NsmapsError unless a record has a format that this version reads."""
    found = record.get("format") if isinstance(record, dict) else None
    if found != FORMAT:
        newer = isinstance(found, int) and found > FORMAT
        what = "a newer nsmaps reads it" if newer else "no released version of nsmaps wrote it; run the study again"
        raise NsmapsError(f"{place / 'result.json'} has format {found!r}; expected: {FORMAT}; {what}; {_writer(record)}")


def _writer(record: Any) -> str:
    """The version that wrote a record, according to the record."""
    versions = record.get("versions") if isinstance(record, dict) else None
    return f"written by nsmaps {versions.get('nsmaps') if isinstance(versions, dict) else 'of an unknown version'}"
