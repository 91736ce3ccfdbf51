"""The keys of a study from the classes of its analyses: as tables, and as a JSON Schema with the analyses of other packages."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from inspect import cleandoc
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, RootModel
from pydantic.fields import FieldInfo

from nsmaps.errors import check_known
from nsmaps.plugins import ANALYSIS, class_names, class_of
from nsmaps.study.reading.classes import Instance

KINDS: dict[Any, str] = {float: "number", int: "whole number", str: "text", bool: "true or false", Any: "value"}
SPAN = {"parameter", "from", "to", "points"}  #: the keys of models that have no table of their own
MOST_WORDS = 8  #: of a key that has one of some words, so that they are listed


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a section."""

    name: str
    kind: str  #: of its values, such as "whole number >= 1"
    default: str
    meaning: str

    def __str__(self) -> str:
        return f"{self.meaning} ({self.kind}; {self.default if self.default == 'required' else f'default: {self.default}'})"


@dataclass(frozen=True, slots=True)
class KeyTable:
    """The keys of the study as a whole, or of one of its sections."""

    of: str  #: the key of the section, empty for the study
    entry: bool  #: whether it is an entry of a list or of a mapping under this key
    model: type[BaseModel]
    text: str
    keys: tuple[Key, ...]

    def __str__(self) -> str:
        """The table as lines of text."""
        first, *more = (" ".join(part.split()) for part in self.text.split("\n\n"))
        about = "\n\n".join([f"{self.of or 'study'}: {first}", *more])
        return "\n".join([about, *(f"  {key.name}: {key}" for key in self.keys)])


def key_tables(study: type[BaseModel]) -> dict[str, KeyTable]:
    """The tables of keys by the key of the section, that of the study first; a class that several keys have stands once."""
    places: dict[type[BaseModel], tuple[str, bool]] = {study: ("", False)}
    pending = [study]
    while pending:
        model = pending.pop(0)
        for name, field in model.model_fields.items():
            for inner, entry in _sections(field.annotation, False):
                if inner not in places:
                    pending.append(inner)
                if inner not in places or (places[inner][1] and not entry and places[inner][0] != name):
                    places[inner] = (field.alias or name, entry)
    sections = {model: of for model, (of, _) in places.items()}
    return {of: KeyTable(of, entry, model, _text(model), tuple(_keys(model, sections))) for model, (of, entry) in places.items()}


def table_of(section: str) -> KeyTable:
    """The table of keys of a section of studies, installed or of nsmaps; `study` is that of a study.

    NsmapsError for a key without a table.
    """
    from nsmaps.study.study import Study

    tables = {table.of or "study": table for table in key_tables(Study).values()}
    if section in class_names(ANALYSIS):
        return replace(key_tables(class_of(ANALYSIS, section))[""], of=section)
    check_known("no section", section, tables)
    return tables[section]


def with_installed(text: str) -> str:
    """The schema that nsmaps ships, with a property for each installed analysis of another package."""
    names = class_names(ANALYSIS)
    if not names:
        return text
    schema = json.loads(text)
    for name in names:
        own = class_of(ANALYSIS, name).model_json_schema(by_alias=True)
        schema["$defs"] |= own.pop("$defs", {})
        schema["properties"][name] = own
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def _text(model: type[BaseModel]) -> str:
    """The docstring of a class without its examples."""
    return cleandoc(model.__doc__ or "").partition("\n\n>>>")[0]


def _keys(model: type[BaseModel], sections: dict[type[BaseModel], str]) -> Iterator[Key]:
    """The keys of a model, `sections` being those with tables of their own."""
    for name, field in model.model_fields.items():
        described = (_text(inner).partition("\n\n")[0].replace("\n", " ") for inner in _models(field.annotation))
        meaning = field.description or next(described, "").rstrip(".")
        yield Key(field.alias or name, _kind(field.annotation, field.metadata, sections), _default(field), meaning)


def _default(field: FieldInfo) -> str:
    """The default of a key as it would be written."""
    if field.is_required():
        return "required"
    value = field.default
    if field.default_factory is not None or value is None or isinstance(value, RootModel) or value in ("", (), {}):
        return "none"
    if isinstance(value, tuple):
        return f"[{', '.join(map(str, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models within an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _sections(annotation: Any, entry: bool) -> Iterator[tuple[type[BaseModel], bool]]:
    """The models within an annotation that have tables, each with whether it is an entry of a list or of a mapping."""
    if isinstance(annotation, type) and issubclass(annotation, RootModel):
        yield from _sections(annotation.model_fields["root"].annotation, entry)
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel) and not _is_inline(annotation):
        yield annotation, entry
    for part in get_args(annotation):
        yield from _sections(part, entry or get_origin(annotation) in (tuple, list, dict))


def _is_inline(model: type[BaseModel]) -> bool:
    """Whether a model has no table: a range of values, or an object of a class, whose keys are those of the class."""
    return model is Instance or {field.alias or name for name, field in model.model_fields.items()} <= SPAN


def _kind(annotation: Any, limits: Iterable[Any], sections: dict[type[BaseModel], str]) -> str:
    """The values of a type within limits, as YAML writes them."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind(parts[0], [*limits, *parts[1:]], sections)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(_kind(part, limits, sections) for part in parts if part is not NoneType))
    if origin is Literal:
        words = [f"`{word}`" for word in parts]
        return ", ".join([*words[:-2], " or ".join(words[-2:])]) if len(parts) <= MOST_WORDS else "name"
    if origin is dict:
        return f"{{name: {_kind(parts[1], (), sections)}}}"
    if origin in (tuple, list):
        several = origin is list or parts[-1] is ...
        return f"[{', '.join([_kind(part, (), sections) for part in parts if part is not ...] + ['...'] * several)}]"
    if isinstance(annotation, type) and issubclass(annotation, RootModel):
        return _kind(annotation.model_fields["root"].annotation, (), sections)
    if annotation is Instance:
        return "object of a class"
    if annotation in sections:
        return f"section `{sections[annotation]}`"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return f"{{{', '.join(field.alias or name for name, field in annotation.model_fields.items())}}}"
    return KINDS.get(annotation, "value") + _range(limits)


def _range(limits: Iterable[Any]) -> str:
    """Limits of a number in words."""
    every = [bound for limit in limits for bound in (limit.metadata if isinstance(limit, FieldInfo) else [limit])]
    low = next((bound for bound in every if isinstance(bound, Ge | Gt)), None)
    high = next((bound for bound in every if isinstance(bound, Le | Lt)), None)
    if isinstance(low, Ge) and isinstance(high, Le):
        return f" {low.ge} to {high.le}"
    lower = "" if low is None else f" >= {low.ge}" if isinstance(low, Ge) else f" > {low.gt}"
    upper = "" if high is None else f" <= {high.le}" if isinstance(high, Le) else f" < {high.lt}"
    return lower + ("," if lower and upper else "") + upper
