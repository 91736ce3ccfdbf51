"""From a file to a study; errors state file, line, column, the expected values and a near match."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml.comments import CommentedMap

from nsmaps.errors import NsmapsError, StudyError, near_match
from nsmaps.plugins import is_file, study_files, study_names, system_names
from nsmaps.study.binding import prepare
from nsmaps.study.reading.locations import Loc, Source
from nsmaps.study.reading.overrides import changed
from nsmaps.study.reading.parsing import parsed, plain
from nsmaps.study.study import Study, name_of


def load_study(
    name: str | os.PathLike[str], parameters: Mapping[str, Any] | None = None, *, installed_only: bool = False
) -> Study:
    """The study of a YAML file, or one that an installed system ships, by its name: `vi_pair/fp`.

    A study whose system is a class in a file, `mine.py:Class`, executes that file with your permissions.

    Args:
        parameters: values in place of the study's own, by name; the study is then named `vi_pair/fp-r=0.45`, and its title
            states the change.
        installed_only: refuse a study whose system is a file, so that only installed packages are executed.

    Raises:
        StudyError: the study cannot be run; one line per complaint.
    """
    return made_ready(found_study(name, installed_only), parameters)


def found_study(name: str | os.PathLike[str], installed_only: bool = False) -> Study:
    """The study of a file or of this name, checked by its grammar only: its system is not imported or executed."""
    path, asked = Path(name), os.fspath(name)
    return read_study(path, name_of(path), installed_only) if path.is_file() else read_study(shipped_file(asked), asked)


def made_ready(study: Study, parameters: Mapping[str, Any] | None = None) -> Study:
    """The study with changed parameters, checked against its system, which is imported or executed for this."""
    if parameters:
        study = changed(study, parameters)
    prepare(study)
    return study


def check_installed(study: Study) -> None:
    """Raise StudyError for a study whose system is a file, which would be executed."""
    if is_file(study.system):
        known = ", ".join(system_names()) or "none is"
        text = f"the system is the file {study.system!r}, which would be executed; expected: an installed system, one of {known}"
        raise study.source.error(("system",), text)


def read_study(path: Path, name: str, installed_only: bool = False, translate: Callable[[Any], Any] = lambda data: data) -> Study:
    """The study of a file checked by its grammar only; `name` is the default name. No code is executed.

    `translate` replaces former keys by current ones, in plain data.
    """
    source = Source(os.fspath(path), _parsed(path))
    data = translate(plain(source.root))
    data.setdefault("name", name)
    if isinstance(data.get("system"), str):
        data["system"] = _found_from(path, data["system"])
    pieces = data.get("composite")
    for number, piece in enumerate(pieces if isinstance(pieces, list) else []):
        if isinstance(piece, dict) and isinstance(piece.get("polynomial"), str):
            piece["polynomial"] = _printed(path, piece["polynomial"], source, ("composite", number, "polynomial"))
    try:
        study = Study.model_validate(data, context=source)
    except ValidationError as error:
        raise source.translate(error, (), Study, {}) from error
    if installed_only:
        check_installed(study)
    return study


def _printed(path: Path, text: str, source: Source, loc: Loc) -> Any:
    """The value of a key in a file beside the study: `file#key`."""
    name, _, key = text.partition("#")
    file, folder = path.parent / name, path.parent.resolve()
    if os.path.isabs(name) or ".." in Path(name).parts or not file.resolve().is_relative_to(folder):
        raise source.error(
            loc, f"the file {name!r} is not in the study's folder; expected: one that is there or below, as file#key"
        )
    if not (name and os.path.isfile(file)):
        raise source.error(loc, f"no file {text!r} beside the study; expected: a mapping, or file#key, in YAML or JSON")
    maps = plain(_parsed(file))
    return maps[source.known(loc, key, [name for name, value in maps.items() if isinstance(value, dict)], "polynomial")]


def _parsed(path: Path) -> CommentedMap:
    """The file as ruamel's tree, with the line and column of every key."""
    root = parsed(path)
    if not isinstance(root, CommentedMap):
        raise StudyError(f"{path}:1:1: a study is a mapping of sections; expected: {', '.join(Study.model_fields)}")
    return root


def _found_from(path: Path, system: str) -> str:
    """Replace the path of a system in a file, relative to the study's folder first, by the absolute path."""
    if not is_file(system):
        return system
    file, _, attribute = system.rpartition(":")
    beside = path.parent / file
    return f"{(beside if os.path.isfile(beside) else Path(file)).resolve()}:{attribute}"


def files_beside(path: Path) -> list[str]:
    """The files that a study refers to, by their paths from its folder."""
    pieces = plain(_parsed(path)).get("composite", [])
    printed = [piece.get("polynomial") for piece in pieces]
    return list(dict.fromkeys(text.partition("#")[0] for text in printed if isinstance(text, str)))


def shipped_file(name: str) -> Path:
    """The file of an installed study; raises StudyError with the names of all installed studies."""
    system, _, stem = name.rpartition("/")
    try:
        files = study_files(system) if system and not name.endswith((".yaml", ".yml")) else {}
    except NsmapsError as error:
        raise StudyError(f"no study {name!r}: {error}") from error
    if stem not in files:
        known = study_names()
        raise StudyError(
            f"no study {name!r}; expected: the path of a YAML file, or one of {', '.join(known) or 'none installed'}"
            f"{near_match(name, known)}"
        )
    return files[stem]
