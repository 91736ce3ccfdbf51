"""Objects of user-defined classes in a study: the class by its name, and values of its fields."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from nsmaps.errors import StudyError
from nsmaps.files.complaints import bare, inside
from nsmaps.plugins import Kind, class_of
from nsmaps.reduced.conditions.condition import as_number
from nsmaps.study.reading.locations import Loc, Source

CLASS, OWN = "[class]", "[own]"  #: the forms of a value: an object of a class, or what nsmaps has for it
T = TypeVar("T")


class Instance(BaseModel):
    """An object of a class: its name, `disc`, `package.module:Disc` or `mine.py:Disc`, and beside it the values of its fields."""

    model_config = ConfigDict(frozen=True, extra="allow")
    of: str = Field(
        alias="class", max_length=1000, description="an installed class, package.module:Class, or path/to/mine.py:Class"
    )


def form_of(value: object) -> str:
    """Which form a value has; for a discriminator, so that errors refer to one form."""
    return CLASS if isinstance(value, Instance) or (isinstance(value, dict) and "class" in value) else OWN


#: a value that nsmaps has, or an object of a class
OrInstance = Annotated[Annotated[T, Tag(OWN)] | Annotated[Instance, Tag(CLASS)], Discriminator(form_of)]
Condition = OrInstance[str]  #: a region by its condition, or of a class


def created(source: Source, loc: Loc, spec: Instance, kind: Kind, **given: Any) -> Any:
    """The object of a class of a kind, with further fields that a study does not write.

    Numbers may be expressions, such as `pi/3`. Raises StudyError at the class, key or value that is wrong.
    """
    with source.located((*loc, "class")):
        cls = class_of(kind, spec.of)
    names = [name for name in cls.model_fields if name not in given]
    values = {}
    for name, value in (spec.model_extra or {}).items():
        source.known((*loc, name), name, names, f"field of {cls.__name__}", key=True)
        with source.located((*loc, name)):
            values[name] = _evaluated(value, cls.model_fields[name].annotation)
    with calling(source, loc, cls.__name__), source.located(loc, cls):
        return cls(**values, **given)


@contextmanager
def calling(source: Source, loc: Loc, what: str) -> Iterator[None]:
    """Any error of code of a class becomes a StudyError at its place."""
    try:
        with source.located(loc):
            yield
    except StudyError:
        raise
    except Exception as error:
        raise source.error(loc, f"{what} raises {type(error).__name__}: {error}") from error


def _evaluated(value: Any, annotation: Any) -> Any:
    """A value in which the text of every number is evaluated."""
    if isinstance(value, dict):
        return {key: _evaluated(each, inside(annotation, str(key))) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_evaluated(each, inside(annotation, k)) for k, each in enumerate(value)]
    return as_number(value) if isinstance(value, str) and bare(annotation) is float else value


def functions(data: Mapping[str, Any]) -> Iterator[tuple[Loc, dict[str, Any]]]:
    """The quantifiers of each section in the plain data of a study, by name, with their place."""
    for key, section in data.items():
        if isinstance(section, dict) and isinstance(section.get("quantifiers"), dict):
            yield (key, "quantifiers"), section["quantifiers"]


def instances(data: Any, loc: Loc = ()) -> Iterator[tuple[Loc, dict[str, Any]]]:
    """Every object of a class in the plain data of a study, with its place."""
    if isinstance(data, dict) and isinstance(data.get("class"), str):
        yield loc, data
    if isinstance(data, dict | list | tuple):
        for step, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from instances(value, (*loc, step))
