"""The grammar of a study's file: a frozen model whose keys are the sections; an unknown key is an error."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import create_model

from nsmaps.figures.catalogue import FigureName
from nsmaps.study.reading.head import Head
from nsmaps.study.sections.registry import SECTIONS

if TYPE_CHECKING:
    Claim = str
else:
    Claim = Literal[tuple(claim for section in SECTIONS for claim in section.claims)]


class _Head(Head):
    """The keys of a study other than its sections, and what its sections were called."""

    was: ClassVar[dict[str, str]] = {section.was: section.key for section in SECTIONS if section.was}


_FIELDS: dict[str, Any] = {section.key: (section.type, section.default) for section in SECTIONS} | {
    "figures": (tuple[FigureName, ...], ()),
    "require": (tuple[Claim, ...], ()),
    "expected_failures": (dict[str, str], {}),  # by the name of a verdict that is not required: the meaning of its failure
}
_TEXT = """One study: a system by name, its parameters, and the sections that are to be computed.

It holds the system's name, not the system, so that it can be written to a file and read again.
"""
if TYPE_CHECKING:
    Study = Head
else:
    Study = create_model("Study", __base__=_Head, __module__=__name__, __doc__=_TEXT, **_FIELDS)


def name_of(path: Path) -> str:
    """The name of a study without the key `name`: its file's stem, without characters that are not valid in a folder's name."""
    return re.sub(r"[^\w.+-]+", "_", path.stem).lstrip(".+-") or "study"
