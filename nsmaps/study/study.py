"""What a study's file may say: a frozen model whose keys are the sections, in which an unknown key is an error."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, cast

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, PrivateAttr, create_model

from nsmaps.errors import NsmapsError
from nsmaps.figures.catalogue import CATALOGUE, FigureName
from nsmaps.plugins import system_class
from nsmaps.reduced.conditions.condition import read_number
from nsmaps.study.reading.locations import Source
from nsmaps.study.reading.values import SPEC
from nsmaps.study.sections import SECTIONS

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem


def scalar(value: object) -> object:
    """A number, a text that reads as one (`pi/3`), a switch, or a word; which of them fits is for the system to say."""
    if isinstance(value, bool | int | float):
        return value
    if not isinstance(value, str):
        raise ValueError("a parameter is one number, switch or word")
    try:
        return read_number(value)
    except NsmapsError:
        return value


Parameter = Annotated[Any, AfterValidator(scalar)]


def _current(figure: object) -> object:
    """The name of a figure; an earlier name is an error that states the new one."""
    if isinstance(figure, str) and figure in _Head.was and figure not in CATALOGUE:
        raise ValueError(f"{figure!r} is now {_Head.was[figure]!r}")
    return figure


class _Head(BaseModel):
    """What a study says before its sections."""

    model_config = SPEC
    was: ClassVar = {section.was: section.key for section in SECTIONS if section.was}
    name: str = Field("study", max_length=500, pattern=r"^\w[\w .+=-]*(/\w[\w .+=-]*)*$")
    title: str = Field("", max_length=2000)
    system: str = Field(max_length=1000)
    parameters: dict[str, Parameter] = {}
    _source: Source = PrivateAttr(default=Source())

    def model_post_init(self, context: Any) -> None:
        """Keep where the study was read from, for the errors found later."""
        self._source = context if isinstance(context, Source) else Source(self.name)

    @property
    def source(self) -> Source:
        """Where the study was read from."""
        return self._source

    def system_object(self) -> "ImpactSystem":
        """The system with the study's parameters; errors as `system_class`, and pydantic's ValidationError, for its places."""
        return cast("ImpactSystem", system_class(self.system)(**self.parameters))

    def names(self, key: str) -> bool:
        """Whether the study names a section."""
        return bool(dict(self)[key])

    def once(self, key: str, names: Sequence[str]) -> None:
        """A StudyError at the first entry of a section whose name another has before it."""
        for number, name in enumerate(names):
            if name in names[:number]:
                text = f"the name {name!r} is given twice; expected: a name of its own for each"
                raise self.source.error((key, number, "name"), text)


class _Sections(_Head):
    """The sections of a study, as they are registered."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

        figures: tuple[FigureName, ...]
        require: tuple[Literal["covered", "tolerance"], ...]
        expected_failures: dict[str, str]


_FIELDS: dict[str, Any] = {section.key: (section.type, section.default) for section in SECTIONS} | {
    "figures": (tuple[Annotated[FigureName, BeforeValidator(_current)], ...], ()),
    "require": (tuple[Literal["covered", "tolerance"], ...], ()),
    "expected_failures": (dict[str, str], {}),  # what the failure of a verdict that is not required shows, by its name
}
_TEXT = """One study: a system by name, its parameters, and what is to be computed of it.

It holds the system's name, not the system, so that it can be written to a file and read again.
"""
if TYPE_CHECKING:
    Study = _Sections
else:
    Study = create_model("Study", __base__=_Head, __module__=__name__, __doc__=_TEXT, **_FIELDS)


def name_of(path: Path) -> str:
    """The name of a study that gives none: its file's stem, without characters that a folder cannot bear."""
    return re.sub(r"[^\w.+-]+", "_", path.stem).lstrip(".+-") or "study"
