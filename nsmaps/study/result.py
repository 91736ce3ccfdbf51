"""The result of a study: the fields of all sections that are registered."""

from collections.abc import Iterator
from dataclasses import MISSING, field, fields, make_dataclass
from typing import TYPE_CHECKING, Any

from nsmaps.study.sections.kept import Run
from nsmaps.study.sections.registry import SECTIONS


def _fields() -> Iterator[tuple[str, Any, Any]]:
    """The fields that the sections add to a result: name, type, default."""
    for section in SECTIONS:
        for each in fields(section.stored):
            by_factory = each.default_factory is not MISSING
            yield each.name, each.type, field(default_factory=each.default_factory) if by_factory else field(default=each.default)


KEPT = tuple(each.name for section in SECTIONS if section.again is None for each in fields(section.stored))
_TEXT = "The results of all sections of a study; fields of sections that the study does not name are empty or None."
if TYPE_CHECKING:
    StudyResult = Run
else:
    options = {"frozen": True, "slots": True, "eq": False, "repr": False}
    StudyResult = make_dataclass("StudyResult", _fields(), bases=(Run,), namespace={"__doc__": _TEXT, "kept": KEPT}, **options)
    StudyResult.__module__ = __name__
