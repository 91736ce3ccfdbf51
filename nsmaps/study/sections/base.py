"""What a section of a study is: everything that is asked of it, in one record."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from nsmaps.study.estimates import Size
from nsmaps.study.reading.locations import Loc

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.study.binding import Binding, Plan
    from nsmaps.study.result import StudyResult
    from nsmaps.study.study import Study

S = TypeVar("S")
Need = tuple[Loc, str, str]  #: where a need arises, what has it, the section that it is for


@dataclass(frozen=True, slots=True)
class Verdict:
    """One claim about one map, whether it holds, and the numbers it rests on."""

    name: str  #: such as "domain fitted: trapped"
    of: str  #: the map it speaks of, such as "fitted map R1" or "exact map"
    holds: bool
    required: bool
    text: str
    shows: str = ""  #: of one that fails as its study expects: what that shows


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text under heads, and the lines below them, for the end of a run on a terminal."""

    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Nothing:
    """What a section keeps that computes nothing, or nothing of its own."""


def _none(*given: object) -> Iterator[Any]:
    """Neither needs, nor verdicts, nor tables."""
    return iter(())


@dataclass(frozen=True, kw_only=True)
class Section(Generic[S]):
    """One key of a study: what a file may say there, and what a run makes of it.

    Whatever is given `spec` is called only for studies that name the section; what is given a result must itself look whether
    that holds something of the section.
    """

    key: str
    type: Any  #: of `spec`, as an annotation that pydantic reads
    was: str = ""  #: the key by which earlier studies name it
    default: Any = None  #: `spec` of a study that does not name the section
    step: str = ""  #: the name of its step in a run, if that is not the key
    stored: type = Nothing  #: a dataclass whose fields a result has, each with its default
    again: Callable[["StudyResult"], dict[str, Any]] | None = None  #: makes what no file keeps, from what is kept
    stands_for: Callable[[S], tuple[str, ...]] = lambda spec: ()  #: keys of the sections that it makes unnecessary
    needs: Callable[[S], Iterator[Need]] = _none
    check: Callable[[S, "Study"], None] = lambda spec, study: None  #: a StudyError for a name that refers to nothing
    bind: Callable[[S, "Binding"], Any] = lambda spec, binding: None  #: objects for a system, or a StudyError; computes nothing
    compute: "Callable[[S, Plan, StudyResult], dict[str, Any]] | None" = None  #: parts of a result from those before them
    describe: Callable[[S, "Study"], str] = lambda spec, study: ""  #: what a run would compute, in a few words
    size: "Callable[[S, Study, ImpactSystem], Size] | None" = None  #: None where it cannot be estimated
    numbers: Callable[["StudyResult"], dict[str, Any]] = lambda result: {}  #: for result.json, by heading
    verdicts: Callable[["StudyResult"], Iterator[Verdict]] = _none
    tables: Callable[["StudyResult"], Iterator[Table]] = _none

    @property
    def name(self) -> str:
        """The name of its step."""
        return self.step or self.key
