"""What pydantic complains of, in nsmaps' words: what, the value, what is accepted, a near match."""

import re
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from nsmaps.errors import near_match

MOST = 20  #: complaints that are told of one file


@dataclass(frozen=True, slots=True)
class Told:
    """One complaint: where it is, what it says, and whether it is about the key rather than its value."""

    loc: tuple[str | int, ...]
    text: str
    at_key: bool = False
    cause: object = None  #: the exception that a validator raised, if one did


def explained(error: ValidationError, model: type[BaseModel] | None) -> list[Told]:
    """Pydantic's first complaints, without those that a key is missing where it is there misspelt."""
    problems = error.errors()[:MOST]
    misspelt = [problem["loc"] for problem in problems if problem["type"] == "extra_forbidden"]
    return [explain(problem, model) for problem in problems if not _there_misspelt(problem, misspelt)]


def _there_misspelt(problem: ErrorDetails, misspelt: list[tuple[str | int, ...]]) -> bool:
    *section, name = problem["loc"] or ("",)
    beside = [str(key) for *there, key in misspelt if there == section]
    return problem["type"] == "missing" and any(near_match(key, [str(name)]) for key in beside)


def explain(problem: ErrorDetails, model: type[BaseModel] | None) -> Told:
    """One complaint of pydantic about `model` as a sentence."""
    loc = tuple(step for step in problem["loc"] if "[" not in str(step))  # no "[key]", nor the forms of a union
    name, what = str(loc[-1]) if loc else "study", _what(model, loc[:-1])
    kind, value = problem["type"], problem["input"]
    if kind == "extra_forbidden":
        known = accepted_keys(model, loc[:-1])
        return Told(loc, f"unknown {what} {name!r}; accepted: {', '.join(known)}{near_match(name, known)}", at_key=True)
    if kind == "missing":
        return Told(loc[:-1], f"the {what} {name!r} is missing")
    if kind in ("value_error", "assertion_error"):
        cause = problem["ctx"]["error"]
        return Told(loc, str(cause), cause=cause)
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", problem["ctx"]["expected"])
        return Told(loc, f"unknown word {value!r}; accepted: {', '.join(known)}{near_match(str(value), known)}")
    accepted = problem["msg"].removeprefix("Input should be ").removeprefix("a valid ")
    return Told(loc, f"{name} is {_brief(value)}; accepted: {accepted}")


def refused(error: ValidationError, model: type[BaseModel]) -> str:
    """What a call of a model with wrong parameters is told: every complaint, with the model's name."""
    return f"{model.__name__}: {'; '.join(told.text for told in explained(error, model))}"


def accepted_keys(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> list[str]:
    """The keys that the section at `loc` of a model may have, as a file spells them."""
    here = _section(model, loc)
    fields = [field.alias or name for name, field in here.model_fields.items()] if _is_model(here) else []
    return [*fields, *getattr(here, "instead", {})]


def _section(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> Any:
    """The annotation of the section at `loc` of a model."""
    here: Any = model
    for step in loc:
        here = _inside(here, step)
    return _bare(here)


def _what(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> str:
    """What the section at `loc` has: the parameters of a system, or keys."""
    return "key" if getattr(_section(model, loc), "instead", None) is None else "parameter"


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _bare(annotation: Any) -> Any:
    """The annotation without Annotated and without `| None`."""
    while get_origin(annotation) in (Annotated, Union, UnionType):
        annotation = next(part for part in get_args(annotation) if part is not type(None))
    return annotation


def _inside(annotation: Any, step: str | int) -> Any:
    """The annotation of the field, value or item that one step of a location leads to."""
    bare = _bare(annotation)
    if _is_model(bare):
        fields = {field.alias or name: field.annotation for name, field in bare.model_fields.items()}
        return fields.get(str(step))
    parts = () if get_origin(bare) is Literal else get_args(bare)
    return parts[-1 if get_origin(bare) is dict else 0] if parts else None


def _brief(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
