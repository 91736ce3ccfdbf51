"""The keys of a study's file other than its sections."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, PrivateAttr

from nsmaps.errors import NsmapsError
from nsmaps.plugins import system_class
from nsmaps.reduced.conditions.condition import read_number
from nsmaps.study.reading.classes import functions, instances
from nsmaps.study.reading.locations import Loc, Source
from nsmaps.study.reading.values import Section

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


class Head(Section):
    """The keys of a study other than its sections, which for type checkers are attributes of any kind."""

    name: str = Field(
        "study",
        max_length=500,
        pattern=r"^\w[\w .+=-]*(/\w[\w .+=-]*)*$",
        description="letters, digits, spaces, `.`, `+`, `-`, `=`, `_`; `/` makes folders; by default the file's stem",
    )
    title: str = Field("", max_length=2000, description="heading of the report")
    system: str = Field(
        max_length=1000,
        description="an installed system, or `path/to/mine.py:Class`, a file that is executed, sought beside the study first",
    )
    parameters: dict[str, Parameter] = Field(
        {}, description="the system's parameters, or quantities from which it derives them; `nsmaps systems` lists both"
    )
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
        """The names of all classes and functions of the study, that of the system first, by place."""
        found: dict[Loc, str] = {("system",): self.system}
        named = [key for key in self.others() if self.names(key)]
        found |= {(key, "analysis"): getattr(getattr(self, key), "analysis", key) for key in named}
        data = self.model_dump(by_alias=True)
        found |= {(*loc, name): each for loc, some in functions(data) for name, each in some.items()}
        return found | {(*loc, "class"): each["class"] for loc, each in instances(data)}

    def names(self, key: str) -> bool:
        """True if the study names a section."""
        return bool(self.__dict__[key])

    def once(self, key: str, names: Sequence[str]) -> None:
        """Raise StudyError at the first entry of a section whose name occurs before."""
        for number, name in enumerate(names):
            if name in names[:number]:
                text = f"the name {name!r} is given twice; expected: different names"
                raise self.source.error((key, number, "name"), text)

    if TYPE_CHECKING:  #: those of `Study`, which stands above the analyses

        def __getattr__(self, name: str) -> Any: ...

        figures: tuple[str, ...]
        require: tuple[str, ...]
        expected_failures: dict[str, str]
