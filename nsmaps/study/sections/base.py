"""The definition of a section of a study: all of its functions in one record."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from nsmaps.study.estimates import Size
from nsmaps.study.reading.locations import Loc
from nsmaps.study.sections.kept import Verdict as Verdict

if TYPE_CHECKING:  #: also for the modules of sections
    from nsmaps.exact.systems.parameters import System as System
    from nsmaps.study.binding import Binding as Binding
    from nsmaps.study.binding import Plan as Plan
    from nsmaps.study.reading.head import Head
    from nsmaps.study.sections.kept import Run

    Study = Head
    StudyResult = Run

S = TypeVar("S")
Need = tuple[Loc, str, str]  #: the place and the part of a study that needs a section, and that section


class Requiring(Protocol):
    """A study, or a section of it, with the claims that it requires."""

    @property
    def require(self) -> tuple[str, ...]: ...


def claimed(spec: Requiring, claim: str, name: str, of: str, holds: object, text: str) -> Verdict:
    """The verdict on a claim that `require` of a section, or of the study, may name; its text begins with yes or no."""
    return Verdict(name, of, bool(holds), claim in spec.require, text)


@dataclass(frozen=True, slots=True)
class Table:
    """A table of text with notes below it, printed at the end of a run."""

    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Nothing:
    """The fields of a section without results."""


def _none(*given: object) -> Iterator[Any]:
    """No needs, verdicts or tables."""
    return iter(())


@dataclass(frozen=True, kw_only=True)
class Section(Generic[S]):
    """One key of a study: its grammar, and the functions of a run.

    Functions of `spec` are called only for studies that name the section. Functions of a result are called for all results, and
    return nothing if the result has no fields of the section.
    """

    key: str
    type: Any  #: of `spec`, as an annotation that pydantic reads
    was: str = ""  #: the key of the section in earlier studies
    default: Any = None  #: `spec` in a study that does not name the section
    step: str = ""  #: the name of its step in a run, if not the key
    stored: type = Nothing  #: a dataclass whose fields a result has, each with its default
    holds: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  #: classes of stored results, by module below `nsmaps`
    again: Callable[["StudyResult"], dict[str, Any]] | None = None  #: recomputes fields that are not stored
    stands_for: Callable[[S], tuple[str, ...]] = lambda spec: ()  #: keys of the sections that it replaces
    claims: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  #: of the study's `require`: the sections that each needs
    needs: Callable[[S], Iterator[Need]] = _none
    check: Callable[[S, "Study"], None] = lambda spec, study: None  #: raises StudyError for undefined names
    bind: Callable[[S, "Binding"], Any] = lambda spec, binding: (
        None
    )  #: objects for a system, without computation; may raise StudyError
    calls: Callable[[S], tuple[str, ...]] = lambda spec: ()  #: of `ahead.CALLS`, what its step has compiled
    compute: "Callable[[S, Plan, StudyResult], dict[str, Any]] | None" = None  #: fields of a result from those of earlier steps
    describe: Callable[[S, "Study"], str] = lambda spec, study: ""  #: a short description of the computation
    size: "Callable[[S, Study, System], Size] | None" = None  #: None where it cannot be estimated
    numbers: Callable[["StudyResult"], dict[str, Any]] = lambda result: {}  #: for result.json, by heading
    verdicts: Callable[["StudyResult"], Iterator[Verdict]] = _none
    tables: Callable[["StudyResult"], Iterator[Table]] = _none

    @property
    def name(self) -> str:
        """The name of its step."""
        return self.step or self.key
