"""An analysis of a study: its settings, which are a section of the file, what it computes from them, and what it says of that."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Protocol, TypeVar

from pydantic import ConfigDict, Field, RootModel

from nsmaps.dynamics.attractors.quantifiers import quantifiers_of
from nsmaps.plugins import QUANTIFIER, class_of
from nsmaps.study.estimates import Size
from nsmaps.study.pictures.figure import StudyFigure
from nsmaps.study.reading.locations import Loc
from nsmaps.study.reading.values import Section
from nsmaps.study.result import Verdict as Verdict

if TYPE_CHECKING:  #: also for the modules of sections
    from nsmaps.arrays import Storable
    from nsmaps.exact.systems.parameters import System as System
    from nsmaps.study.ahead import Call
    from nsmaps.study.binding import Binding as Binding
    from nsmaps.study.binding import Plan as Plan
    from nsmaps.study.reading.head import Head
    from nsmaps.study.result import StudyResult as StudyResult

    Study = Head

E = TypeVar("E")
V = TypeVar("V")
Need = tuple[Loc, str, str]  #: the place and the part of a study that needs a section, and that section


class Requiring(Protocol):
    """A study, or a section of it, with the claims that it requires."""

    @property
    def require(self) -> tuple[str, ...]: ...


def verdict(name: str, of: str, holds: object, text: str, required: bool = False) -> Verdict:
    """The verdict on a claim about a map, whose text then begins with yes or no."""
    return Verdict(name, of, bool(holds), required, f"{'yes' if holds else 'no'}: {text}")


def claimed(spec: Requiring, claim: str, name: str, of: str, holds: object, text: str) -> Verdict:
    """The same on a claim that `require` of a section, or of the study, may name."""
    return verdict(name, of, holds, text, claim in spec.require)


@dataclass(frozen=True, slots=True)
class Table:
    """A table of text with notes below it, printed at the end of a run."""

    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Finding:
    """A result of an analysis in words: a clause without a full stop, and the numbers on which it rests."""

    of: str  #: the map of which it is true, such as "exact map"
    text: str
    numbers: tuple[tuple[str, str], ...] = ()  #: each as text, with its meaning


class Steps:
    """What an analysis is to a run; all but `compute` have defaults that do nothing."""

    key: ClassVar[str] = ""  #: of its section in a study; of a class from elsewhere the key that the study gives it
    needed: ClassVar[tuple[str, ...]] = ()  #: keys of the sections that it always needs
    step_name: ClassVar[str] = ""  #: the name of its step in a run, if not the key
    #: the parts of a study's result that it computes, each with its value without it; by default one, by the key, and None
    results: ClassVar[Mapping[str, Any]] = {}
    stored: ClassVar[bool] = True  #: False: `recompute` is called when a run is read
    figures: ClassVar[tuple[StudyFigure, ...]] = ()  #: that show them; one of another package is drawn by its result without any
    claims: ClassVar[Mapping[str, tuple[str, ...]]] = {}  #: of the study's `require`: the sections that each needs

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.key and cls.computes() and not cls.results:
            cls.results = {cls.key: None}

    @classmethod
    def name_of_step(cls) -> str:
        """The name of its step in a run."""
        return cls.step_name or cls.key

    @classmethod
    def computes(cls) -> bool:
        """Whether it has a step of its own in a run."""
        return cls.compute is not Steps.compute

    def replaces(self) -> tuple[str, ...]:
        """Keys of the sections whose results it computes."""
        return ()

    def needs(self) -> Iterator[Need]:
        """The sections that it needs, each with the place and the words of what needs it."""
        yield from (((self.key,), repr(self.key), key) for key in self.needed)

    def calls(self) -> "tuple[Call, ...]":
        """Functions of the system whose code its step needs, which another process compiles while the run begins."""
        return ()

    def check(self, study: "Study") -> None:
        """Raises StudyError for names that the study does not define."""

    def bind(self, binding: "Binding") -> Any:
        """Objects for a system, made before anything is computed, which `compute` finds in `plan.bound`; may raise StudyError."""

    def compute(self, plan: "Plan", result: "StudyResult") -> "Mapping[str, Any] | Storable":
        """The result of the analysis from those of earlier steps, or the parts of which it consists, by name."""
        raise NotImplementedError

    def recompute(self, result: "StudyResult") -> Mapping[str, Any]:
        """The parts that are not stored, from those that are."""
        raise NotImplementedError

    def describe(self, study: "Study") -> str:
        """A short description of the computation."""
        return ""

    def size(self, study: "Study", system: "System") -> Size | None:
        """An estimate of time and memory; None where there is none."""
        return None

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """Numbers for result.json, by heading."""
        return {}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """Claims about what was computed, with their numbers."""
        return iter(())

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """Its main results in words, for the headline of a run, each with its main numbers first."""
        return iter(())

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """Tables that are printed at the end of a run."""
        return iter(())

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The numbers that the caption of one of its figures begins with, of one sheet where `part` names it; may be empty."""
        return ""


def concluding(result: "StudyResult") -> Iterator[Steps]:
    """The analyses of which a part was computed, by themselves or by another one; they alone have something to say."""
    for key in result.study.kinds():
        analysis = getattr(result.study, key)
        if analysis is not None and any(_is_there(result.parts.get(name)) for name in analysis.results):
            yield analysis


def _is_there(part: Any) -> bool:
    """Whether a part was computed: none of a list or a mapping is empty."""
    return part is not None and not (isinstance(part, tuple | list | Mapping) and not part)


class Analysis(Steps, Section):
    """The settings of one analysis of a study, a frozen model whose fields are the keys of its section, and its methods in a run.

    A class of a package is named by an entry point of the group `nsmaps.analyses`, whose name is then the key of the section; one
    of a file by `analysis: mine.py:Class` in a section with a name of your own.
    """


Quantifiers = Annotated[
    dict[str, Annotated[str, Field(max_length=1000)]],
    Field(description="numbers of each attractor: {name: `mine.py:function`}, functions of its states and the map"),
]


class Quantified(Analysis):
    """An analysis of attractors, of which a study may name quantifiers, functions by name, in its field `quantifiers`."""

    quantified: ClassVar[str]  #: module and class of the result that has them
    if TYPE_CHECKING:
        quantifiers: Quantifiers

    def functions(self, study: "Study") -> dict[str, Any]:
        """The functions of the quantifiers by name.

        Raises StudyError at a name that the result has already, or one to which no function belongs.
        """
        found = {}
        for name, function in self.quantifiers.items():
            with study.source.located((self.key, "quantifiers", name)):
                module, result = self.quantified.split(":")
                found[name] = class_of(QUANTIFIER, function)
                quantifiers_of({name: found[name]}, getattr(import_module(module), result))
        return found


class Entries(Steps, RootModel[tuple[E, ...]], Generic[E]):
    """An analysis whose section is a list, empty in a study without it."""

    model_config = ConfigDict(frozen=True)
    root: tuple[E, ...] = ()

    def __iter__(self) -> Iterator[E]:  # type: ignore[override]  # of a model: its fields
        return iter(self.root)

    def __len__(self) -> int:
        return len(self.root)

    def __getitem__(self, number: int) -> E:
        return self.root[number]


class Named(Steps, RootModel[dict[str, V]], Mapping[str, V], Generic[V]):
    """An analysis whose section is a mapping of names that the study chooses, empty in a study without it."""

    model_config = ConfigDict(frozen=True)
    root: dict[str, V] = {}

    def __iter__(self) -> Iterator[str]:  # type: ignore[override]  # of a model: its fields
        return iter(self.root)

    def __len__(self) -> int:
        return len(self.root)

    def __getitem__(self, name: str) -> V:
        return self.root[name]
