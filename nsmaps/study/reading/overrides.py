"""A study with changed parameters, which its name and title state."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from nsmaps.errors import StudyError, check_known
from nsmaps.exact.systems.parameters import with_parameters
from nsmaps.files.complaints import accepted_keys
from nsmaps.plugins import system_class
from nsmaps.study.reading.head import scalar
from nsmaps.study.study import Study


def assignments(texts: Sequence[str]) -> dict[str, str]:
    """Parameters by name from texts such as `r=0.45`. Raises StudyError for another text, or a name that is given twice."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise StudyError(f"{text!r} is not an assignment; expected: NAME=VALUE, such as r=0.45 or beta=pi/3")
        if name in found:
            raise StudyError(f"the parameter {name!r} is set twice; expected: each once")
        found[name] = value
    return found


def changed(study: Study, parameters: Mapping[str, Any]) -> Study:
    """The study with some parameters set, as `vi_pair/pd-r=0.45`.

    Raises:
        StudyError: an unknown parameter, or a value that is not valid.
    """
    try:
        cls = system_class(study.system)
        known = accepted_keys(cls, ())
        for name in parameters:
            check_known("unknown parameter", name, known, StudyError)
        values = {name: scalar(value) for name, value in parameters.items()}
        with_parameters(cls, {**study.parameters, **values})
    except ValueError as error:
        raise StudyError(f"{study.name} with {_listed(parameters)}: {error}") from error
    others = {name: (study.parameters.get(name), value) for name, value in values.items() if value != study.parameters.get(name)}
    before = [_in_place(value, own) for own, value in others.values()]
    lines = ", ".join(f"{name} = {text}" for name, text in zip(others, before, strict=True))
    changed_study = study.model_copy(
        update={
            "name": "-".join([study.name, *(f"{name}={_plain(value)}" for name, value in values.items())]),
            "title": f"{study.title}; with {lines}" if study.title and lines else study.title,
            "parameters": {**study.parameters, **values},
        }
    )
    changed_study._source = replace(study.source, changed=others)
    return changed_study


def _listed(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _in_place(value: Any, own: Any) -> str:
    """A value and that of the study, to six digits or as many as distinguish them."""
    if own is None:
        return _text(value, 6)
    pairs = [(_text(value, digits), _text(own, digits)) for digits in (6, 15)]
    return "{} instead of {}".format(*(pairs[0] if len(set(pairs[0])) > 1 else pairs[1]))


def _text(value: Any, digits: int = 15) -> str:
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _plain(value: Any) -> str:
    """A value as part of a folder's name."""
    return re.sub(r"[^\w.+-]+", "_", _text(value))
