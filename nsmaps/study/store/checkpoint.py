"""The finished steps of an unfinished run: one file per step in the run's folder, until the result is written."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nsmaps.errors import NsmapsError
from nsmaps.files.npz import packed, read_arrays
from nsmaps.files.storage import replace_file
from nsmaps.study.result import StudyResult
from nsmaps.study.store.run_folder import PARTS
from nsmaps.study.store.serialize import Arrays, decode, encode, modules_of

STEP = "step"  #: the key of an array with the JSON text of the step


def keep_step(result: StudyResult, name: str, changes: dict[str, Any], folder: Path) -> None:
    """Write the fields that a step has changed into the run's folder, if they can be read back."""
    if not set(changes) <= set(result.study.stored_parts()):
        return
    arrays: Arrays = {}
    objects = {field: encode(value, field, arrays) for field, value in changes.items()}
    text = json.dumps({"of": _identity(result), "seconds": result.timings[name], "objects": objects})
    (folder / PARTS).mkdir(parents=True, exist_ok=True)
    replace_file(_file(folder, name), packed({**arrays, STEP: np.array(text)}))


def with_steps(result: StudyResult, names: list[str], folder: Path) -> StudyResult:
    """The result with the finished steps in the run's folder, except for those whose files are damaged.

    Raises:
        NsmapsError: they are steps of another study, or of other versions.
    """
    for name in names:
        arrays = read_arrays(_file(folder, name))
        if arrays is not None and name not in result.timings:
            step = json.loads(str(arrays.pop(STEP)))
            if step["of"] != _identity(result):
                raise NsmapsError(
                    f"{folder} contains steps of a run of another study, or of other versions, than {result.study.name!r} now; "
                    "expected: the same study, system and versions, or a run from the beginning"
                )
            trusted = modules_of(result.study)
            changes = {field: decode(value, arrays, trusted) for field, value in step["objects"].items()}
            result = replace(result.with_parts(changes), timings={**result.timings, name: step["seconds"]})
    return result


def _file(folder: Path, name: str) -> Path:
    return folder / PARTS / f"{name}.npz"


def _identity(result: StudyResult) -> str:
    """The study and the versions of a step, as text."""
    return json.dumps([result.study.model_dump(mode="json", by_alias=True, exclude_defaults=True), result.versions])
