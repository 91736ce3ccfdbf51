"""From a file to a study; errors state file, line, column, the expected values and a near match."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml.comments import CommentedMap

from nsmaps.errors import NsmapsError, StudyError, near_match
from nsmaps.errors.arguments import checked
from nsmaps.plugins import ANALYSIS, class_names, is_file, is_installed, study_files, study_names, system_names
from nsmaps.study.prepare import prepare
from nsmaps.study.reading.classes import functions, instances
from nsmaps.study.reading.locations import Loc, Source
from nsmaps.study.reading.overrides import changed
from nsmaps.study.reading.parsing import parsed, plain
from nsmaps.study.study import Study, analysis_of, name_of, study_with


@checked
def load_study(
    name: str | os.PathLike[str], parameters: Mapping[str, Any] | None = None, *, installed_only: bool = False
) -> Study:
    """The study of a YAML file, or one that an installed system ships, by its name: `vi_pair/fp`.

    A study with a class in a file, `mine.py:Class`, executes that file with your permissions.

    Args:
        parameters: values in place of the study's own, by name; the study is then named `vi_pair/fp-r=0.45`, and its title
            states the change.
        installed_only: refuse a study with a class of a file or module, so that only installed classes are executed.

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
    """Raise StudyError for a study with a class of a file or module, which would be executed."""
    for loc, name in study.classes().items():
        if not is_installed(name):
            what = "system" if loc == ("system",) else "function" if "quantifiers" in loc else "class"
            known = f"system, one of {', '.join(system_names()) or 'none'}" if what == "system" else f"{what}, by its name alone"
            place = "file" if is_file(name) else "module"
            raise study.source.error(
                loc, f"the {what} is the {place} {name!r}, which would be executed; expected: an installed {known}"
            )


def read_study(path: Path, name: str, installed_only: bool = False) -> Study:
    """The study of a file checked by its grammar only; `name` is the default name. Of code only its own analyses are executed."""
    source = Source(os.fspath(path), _parsed(path))
    data = plain(source.root)
    for key in [key for key, value in data.items() if value is None]:
        way_out = "its keys, as listed by `nsmaps schema`, or {} for the defaults of a section"
        raise source.error((key,), f"{key!r} is empty; expected: {way_out}", key=True)
    data.setdefault("name", name)
    if isinstance(data.get("system"), str):
        data["system"] = _found_from(path, data["system"])
    grammar = _grammar(data, path, source, installed_only)
    for _, instance in instances(data):
        instance["class"] = _found_from(path, instance["class"])
    for _, named in functions(data):
        named |= {key: _found_from(path, function) for key, function in named.items() if isinstance(function, str)}
    pieces = data.get("composite")
    for number, piece in enumerate(pieces if isinstance(pieces, list) else []):
        if isinstance(piece, dict) and isinstance(piece.get("polynomial"), str):
            piece["polynomial"] = _printed(path, piece["polynomial"], source, ("composite", number, "polynomial"))
    try:
        study = grammar.model_validate(data, context=source)
    except ValidationError as error:
        raise source.translate(error, (), grammar, {}) from error
    if installed_only:
        check_installed(study)
    return study


def _grammar(data: dict[str, Any], path: Path, source: Source, installed_only: bool) -> type[Study]:
    """The grammar of a study with the analyses of other packages and files that it names, which are imported or executed."""
    others, installed = {}, class_names(ANALYSIS)
    for key, section in data.items():
        name = section.get("analysis") if isinstance(section, dict) else None
        if key in Study.model_fields:
            continue
        if not isinstance(name, str) and key not in installed:
            if isinstance(section, dict) and not near_match(key, Study.model_fields):
                raise source.error((key,), _not_installed(key, installed), key=True)
            continue
        if isinstance(name, str):
            name = section["analysis"] = _found_from(path, name)
            if installed_only and not is_installed(name):
                text = (
                    f"the analysis is the class {name!r}, which would be executed; expected: an installed one, by its name alone"
                )
                raise source.error((key, "analysis"), text)
        with source.located((key, "analysis") if isinstance(name, str) else (key,)):
            others[key] = analysis_of(key, name if isinstance(name, str) else key)
    return study_with(others)


def _not_installed(key: str, installed: list[str]) -> str:
    """The message for a section of a name that neither nsmaps nor an installed package has."""
    expected = "a section that `nsmaps schema` lists, or the analysis of an installed package"
    return f"unknown section {key!r}{near_match(key, installed)}; expected: {expected}: {', '.join(installed) or 'none'}"


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


def _found_from(path: Path, name: str) -> str:
    """The name of a class, with the path of its file, relative to the study's folder first, as an absolute path."""
    if not is_file(name):
        return name
    file, _, attribute = name.rpartition(":")
    beside = path.parent / file
    return f"{(beside if os.path.isfile(beside) else Path(file)).resolve()}:{attribute}"


def files_beside(path: Path) -> list[str]:
    """The files that a study refers to, by their paths from its folder."""
    data = plain(_parsed(path))
    printed = [piece.get("polynomial") for piece in data.get("composite", [])]
    files = [text.partition("#")[0] for text in printed if isinstance(text, str)]
    code = [*(each["class"] for _, each in instances(data)), *(each for _, some in functions(data) for each in some.values())]
    return list(dict.fromkeys([*files, *(name.rpartition(":")[0] for name in code if is_file(name))]))


def shipped_file(name: str) -> Path:
    """The file of an installed study; raises StudyError with the names of its system's studies."""
    system, _, stem = name.rpartition("/")
    is_folder = os.path.isdir(name)
    try:
        files = study_files(system) if system and not name.endswith((".yaml", ".yml")) else {}
    except NsmapsError as error:
        if not is_folder:
            raise StudyError(f"no study {name!r}: {error}") from error
        files = {}
    if stem not in files:
        known = study_names()
        beside = [each for each in known if each.partition("/")[0] == name.partition("/")[0]]
        listed = f"one of {', '.join(beside)}" if beside else "an installed study, which `nsmaps systems` lists"
        what = f"{name} is a folder" if is_folder else f"no study {name!r}{near_match(name, known)}"
        raise StudyError(f"{what}; expected: the path of a YAML file, or {listed}")
    return files[stem]
