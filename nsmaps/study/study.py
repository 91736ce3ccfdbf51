"""The grammar of a study's file: a frozen model whose keys are the sections; an unknown key is an error."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BaseModel, Field, PrivateAttr, create_model

from nsmaps.errors import NsmapsError
from nsmaps.figures.catalogue import FigureName
from nsmaps.plugins import system_class
from nsmaps.reduced.conditions.condition import read_number
from nsmaps.study.reading.classes import instances
from nsmaps.study.reading.locations import Loc, Source
from nsmaps.study.reading.values import SPEC
from nsmaps.study.sections import SECTIONS

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System


def scalar(value: object) -> object:
    """A number, an expression of one (`pi/3`), a switch, or a word; the system determines which of these is valid."""
    if isinstance(value, bool | int | float):
        return value
    if not isinstance(value, str):
        raise ValueError("not a number, switch or word")
    try:
        return read_number(value)
    except NsmapsError:
        return value


Parameter = Annotated[Any, AfterValidator(scalar)]


class _Head(BaseModel):
    """The keys of a study other than its sections."""

    model_config = SPEC
    was: ClassVar = {section.was: section.key for section in SECTIONS if section.was}
    name: str = Field("study", max_length=500, pattern=r"^\w[\w .+=-]*(/\w[\w .+=-]*)*$")
    title: str = Field("", max_length=2000)
    system: str = Field(max_length=1000)
    parameters: dict[str, Parameter] = {}
    _source: Source = PrivateAttr(default=Source())

    def model_post_init(self, context: Any) -> None:
        """Store the source of the study, for errors that are found later."""
        self._source = context if isinstance(context, Source) else Source(self.name)

    @property
    def source(self) -> Source:
        """The source from which the study was read."""
        return self._source

    def system_object(self) -> "System":
        """The system with the study's parameters; raises as `system_class`, and ValidationError for parameters."""
        return system_class(self.system)(**self.parameters)

    def classes(self) -> dict[Loc, str]:
        """The names of all classes of the study: that of the system, and those of its regions, fits and families, by place."""
        return {("system",): self.system} | {
            (*loc, "class"): each["class"] for loc, each in instances(self.model_dump(by_alias=True))
        }

    def names(self, key: str) -> bool:
        """True if the study names a section."""
        return bool(self.__dict__[key])

    def once(self, key: str, names: Sequence[str]) -> None:
        """Raise StudyError at the first entry of a section whose name occurs before."""
        for number, name in enumerate(names):
            if name in names[:number]:
                text = f"the name {name!r} is given twice; expected: different names"
                raise self.source.error((key, number, "name"), text)


if TYPE_CHECKING:
    Claim = str
else:
    Claim = Literal[tuple(claim for section in SECTIONS for claim in section.claims)]


class _Sections(_Head):
    """The sections of a study, as they are registered."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

        figures: tuple[FigureName, ...]
        require: tuple[Claim, ...]
        expected_failures: dict[str, str]


_FIELDS: dict[str, Any] = {section.key: (section.type, section.default) for section in SECTIONS} | {
    "figures": (tuple[FigureName, ...], ()),
    "require": (tuple[Claim, ...], ()),
    "expected_failures": (dict[str, str], {}),  # by the name of a verdict that is not required: the meaning of its failure
}
_TEXT = """One study: a system by name, its parameters, and the sections that are to be computed.

It holds the system's name, not the system, so that it can be written to a file and read again.
"""
if TYPE_CHECKING:
    Study = _Sections
else:
    Study = create_model("Study", __base__=_Head, __module__=__name__, __doc__=_TEXT, **_FIELDS)


def name_of(path: Path) -> str:
    """The name of a study without the key `name`: its file's stem, without characters that are not valid in a folder's name."""
    return re.sub(r"[^\w.+-]+", "_", path.stem).lstrip(".+-") or "study"
