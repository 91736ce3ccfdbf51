"""Former names: a study's key or word is answered by its new name, and a stored field is read into the new field.

`FORMER` is a list by hand, so that an entry which is removed from a `was` or added to one fails here.
"""

import inspect
import pkgutil
from collections.abc import Iterator
from dataclasses import fields
from importlib import import_module
from typing import Any, get_args

import pytest
from pydantic import BaseModel, ValidationError

import nsmaps
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.files.complaints import accepted_keys, bare, inside, refused
from nsmaps.reduced.fit.filter import NearDiagonal
from nsmaps.reduced.fit.polyfit import SeparableFit
from nsmaps.study.store.renewed import renewed
from nsmaps.study.store.serialize import FORMER as FORMER_CLASSES
from nsmaps.study.store.serialize import HOME, KIND, decode, stored_class
from nsmaps.study.study import Study

FORMER = {
    "Study": {"transient": "exit_times"},
    "FitSection": {"along": "lines"},
    "SliceSection": {"along": "axis"},
    "DiagonalSection": {"within": "region"},
    "BifurcationSection": {"of": "map", "follow": "direction", "transient": "discard"},
    "BranchSection": {"toward": "direction"},
    "StabilitySection": {"along": "sweep", "transient": "discard", "longest": "max_period", "follow": "direction"},
    "LyapunovSection": {"follow": "direction", "transient": "discard"},
    "BasinsSection": {"longest": "max_period"},
    "ImpactsSection": {"transient": "discard"},
    "NoiseSection": {"hold": "min_returns"},
    "DomainSection": {"trapped": "forward_invariant", "settled": "converged"},
    "MorseSection": {"trapped": "forward_invariant"},
    "AttractingDomain": {"trapped": "forward_invariant", "settled": "converged"},
    "Update": {"trapped": "forward_invariant"},
    "Trap": {"trapped": "forward_invariant"},
    "Residence": {"hold": "min_returns"},
    "ImpactDiagram": {"follow": "direction"},
    "HeldOut": {"most": "high"},
    "ParametricReport": {"apart": "difference"},
    "NearDiagonal": {"within": "region"},
    "ReturnFamily": {"most": "max_returns"},
    "SeparableFit": {"along": "lines"},
}
Steps = tuple[str | int, ...]


def models(annotation: Any, steps: Steps = ()) -> Iterator[tuple[Steps, type[BaseModel]]]:
    """The models of a study's file, each with the steps that lead to it: keys, names and numbers."""
    here = bare(annotation)
    if inspect.isclass(here) and issubclass(here, BaseModel):
        yield steps, here
        for name, field in here.model_fields.items():
            yield from models(field.annotation, (*steps, field.alias or name))
    elif get_args(here):
        step = "one" if getattr(here, "__origin__", here) is dict else 0
        yield from models(inside(here, step), (*steps, step))


#: every entry of a `was` of a study's models: the steps to the model, its class, the former name and the new one
ENTRIES = [(steps, model, old, new) for steps, model in models(Study) for old, new in getattr(model, "was", {}).items()]
STORED = [(name, old, new) for name in HOME for old, new in getattr(stored_class(name), "was", {}).items()]


def nested(steps: Steps, value: Any) -> Any:
    """The value at the end of steps."""
    for step in reversed(steps):
        value = [value] if isinstance(step, int) else {step: value}
    return value


def at(data: Any, steps: Steps) -> Any:
    """What is at the end of steps."""
    for step in steps:
        data = data[step]
    return data


def classes() -> Iterator[type]:
    """Every class of nsmaps that has former names of its own."""
    for found in pkgutil.walk_packages(nsmaps.__path__, "nsmaps."):
        if not found.name.startswith(("nsmaps.bench", "nsmaps.__main__")):
            yield from (
                each for each in vars(import_module(found.name)).values() if inspect.isclass(each) and vars(each).get("was")
            )


def test_former_names_are_those_listed_by_hand() -> None:
    found = {cls.__name__: cls.was for cls in classes() if cls.__name__ not in ("_Head", "Section")}
    assert {name: dict(was) for name, was in found.items()} == {n: was for n, was in FORMER.items() if n != "Study"}
    assert Study.was == FORMER["Study"]
    assert {model.__name__ for _, model, _, _ in ENTRIES} == {name for name in FORMER if name.endswith(("Section", "Study"))}
    assert FORMER_CLASSES == {"Transient": "ExitTimes"}


@pytest.mark.parametrize(("steps", "model", "old", "new"), ENTRIES)
def test_a_former_key_or_word_of_a_study_is_answered_by_the_new_one(
    steps: Steps, model: type[BaseModel], old: str, new: str
) -> None:
    is_key = new in accepted_keys(Study, steps)
    contents = [{old: {}}] if is_key else []
    contents += [{key: [old]} for key in ("require", "figures") if key in model.model_fields and (not is_key or key == "figures")]
    assert contents
    for content in contents:
        data = nested(steps, content)
        with pytest.raises(ValidationError) as raised:
            Study.model_validate({"system": "ball", **data})
        assert f"{old!r} is now {new!r}" in refused(raised.value, Study)
        (name, value), *_ = at(renewed(data, Study), steps).items()
        assert new in (name, *value)


@pytest.mark.parametrize(("name", "old", "new"), STORED)
def test_a_former_field_of_a_stored_object_is_read_into_the_new_one(name: str, old: str, new: str) -> None:
    cls = stored_class(name)
    kept = {"coordinates": {KIND: "Coordinates", "names": ["v"], "angles": []}, "delta": 1.2}
    names = list(cls.model_fields) if issubclass(cls, BaseModel) else [field.name for field in fields(cls)]
    data = {old if each == new else each: kept.get(each) for each in names}
    value = {KIND: "ConditionRegion", "text": "v > 0", "coordinates": kept["coordinates"]} if new == "region" else "former"
    assert getattr(decode({KIND: name, **data, old: value}, {}), new) == decode(value, {})


@pytest.mark.parametrize(
    ("model", "given"),
    [
        (WordFamily, {"name": "low", "words": ("BB",), "most": 2}),
        (SeparableFit, {"degrees": {"v": 1}, "along": {"v": 1}}),
        (NearDiagonal, {"delta": 1.2, "within": None}),
    ],
)
def test_a_former_argument_of_a_public_model_is_answered_by_the_new_one(model: type[BaseModel], given: dict[str, Any]) -> None:
    with pytest.raises(ValidationError) as raised:
        model(**given)
    (old,) = set(given) & set(model.was)
    assert f"{old!r} is now {model.was[old]!r}" in refused(raised.value, model)
