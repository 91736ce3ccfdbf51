"""Errors of pydantic as sentences: the key, the value, what is expected, a near match."""

import re
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, RootModel, ValidationError
from pydantic_core import ErrorDetails

from nsmaps.errors import near_match

MOST = 20  #: errors that are reported of one file
KINDS = {
    "tuple_type": "a list, in brackets",
    "dict_type": "keys and values, in braces",
    "model_type": "keys and values, in braces",
    "int_type": "an integer",
    "int_parsing": "an integer",
    "int_from_float": "an integer",
    "float_type": "a number",
    "float_parsing": "a number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
}  #: what pydantic expects, by the kind of its error


@dataclass(frozen=True, slots=True)
class Complaint:
    """One complaint: where it is, what it says, and whether it is about the key rather than its value."""

    loc: tuple[str | int, ...]
    text: str
    at_key: bool = False
    cause: object = None  #: the exception that a validator raised, if one did


def explained(error: ValidationError, model: type[BaseModel] | None) -> list[Complaint]:
    """Pydantic's first complaints, without those that a key is missing where it is there misspelt."""
    problems = error.errors()[:MOST]
    misspelt = [problem["loc"] for problem in problems if problem["type"] == "extra_forbidden"]
    return [explain(problem, model) for problem in problems if not _there_misspelt(problem, misspelt)]


def _there_misspelt(problem: ErrorDetails, misspelt: list[tuple[str | int, ...]]) -> bool:
    *section, name = problem["loc"] or ("",)
    beside = [str(key) for *there, key in misspelt if there == section]
    return problem["type"] == "missing" and any(near_match(key, [str(name)]) for key in beside)


def explain(problem: ErrorDetails, model: type[BaseModel] | None) -> Complaint:
    """One complaint of pydantic about `model` as a sentence."""
    loc = tuple(step for step in problem["loc"] if "[" not in str(step))  # no "[key]", nor the forms of a union
    name, what = str(loc[-1]) if loc else "study", _what(model, loc[:-1])
    kind, value = problem["type"], problem["input"]
    if kind == "extra_forbidden":
        known = accepted_keys(model, loc[:-1])
        return Complaint(loc, f"unknown {what} {name!r}{near_match(name, known)}; expected: {', '.join(known)}", at_key=True)
    if kind == "missing" and loc and isinstance(loc[-1], int):
        entries = len(get_args(_section(model, loc[:-1]))) or "more"
        return Complaint(loc[:-1], f"{loc[-2]} is {_brief(value)}; expected: {entries} entries")
    if kind == "missing":
        meaning = _meaning(model, loc)
        return Complaint(loc[:-1], f"the {what} {name!r} is missing" + (f"; expected: {meaning}" if meaning else ""))
    if kind in ("value_error", "assertion_error"):
        cause = problem["ctx"]["error"]
        return Complaint(loc, str(cause), cause=cause)
    if kind == "literal_error":
        expected = problem["ctx"]["expected"]
        if known := re.findall(r"'([^']*)'", expected):
            return Complaint(loc, f"unknown word {value!r}{near_match(str(value), known)}; expected: {', '.join(known)}")
        return Complaint(loc, f"{name} is {_brief(value)}; expected: {expected}")
    accepted = KINDS.get(kind, problem["msg"].removeprefix("Input should be ").removeprefix("a valid "))
    if kind == "too_short":
        least = problem["ctx"]["min_length"]
        accepted = f"{least} {'entry' if least == 1 else 'entries'} or more"
    return Complaint(loc, f"{name} is {_brief(value)}; expected: {accepted}")


def refused(error: ValidationError, model: type[BaseModel]) -> str:
    """The message for a call of a model with wrong parameters: every complaint, with the model's name."""
    return f"{model.__name__}: {'; '.join(complaint.text for complaint in explained(error, model))}"


def accepted_keys(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> list[str]:
    """The keys that the section at `loc` of a model may have, as a file spells them."""
    here = _section(model, loc)
    fields = [field.alias or name for name, field in here.model_fields.items()] if _is_model(here) else []
    return [*fields, *getattr(here, "instead", {})]


def _section(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> Any:
    """The annotation of the section at `loc` of a model."""
    here: Any = model
    for step in loc:
        here = inside(here, step)
    return bare(here)


def _what(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> str:
    """What the section at `loc` has: the parameters of a system, or keys."""
    return "key" if getattr(_section(model, loc), "instead", None) is None else "parameter"


def _meaning(model: type[BaseModel] | None, loc: tuple[str | int, ...]) -> str:
    """The description of the key at `loc` of a model; empty where there is none."""
    here = _section(model, loc[:-1])
    fields = here.model_fields.items() if _is_model(here) else ()
    return next((field.description or "" for name, field in fields if str(loc[-1]) in (name, field.alias)), "")


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def bare(annotation: Any) -> Any:
    """The annotation without Annotated and without `| None`."""
    while get_origin(annotation) in (Annotated, Union, UnionType):
        annotation = next(part for part in get_args(annotation) if part is not type(None))
    return annotation


def inside(annotation: Any, step: str | int) -> Any:
    """The annotation of the field, value or item that one step of a location leads to."""
    here = bare(annotation)
    if _is_model(here) and issubclass(here, RootModel):
        return inside(here.model_fields["root"].annotation, step)
    if _is_model(here):
        fields = {field.alias or name: field.annotation for name, field in here.model_fields.items()}
        return fields.get(str(step))
    parts = () if get_origin(here) is Literal else get_args(here)
    return parts[-1 if get_origin(here) is dict else 0] if parts else None


def _brief(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
