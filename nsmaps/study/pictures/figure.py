"""A figure of a study: what it shows in words, and the parts of the result that it needs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from nsmaps.figures.page import Sheet
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class FigurePart(Generic[T]):
    """A part of a result that a figure shows, and what a study says to have it computed."""

    what: str  #: the part in words, such as "return surfaces"
    sections: tuple[str, ...]  #: the sections of a study from which it is computed
    part: "Callable[[StudyResult], T | None] | None" = None  #: may raise NsmapsError; default: the last section
    entry: str = ""  #: what a study must say, where that is more than to name the sections
    asked: "Callable[[Study], bool]" = lambda study: True  #: whether a study which names the sections says that, too
    optional: bool = False  #: whether a figure is drawn without it, too
    planar: bool = False  #: whether it is shown in a plane of states, so that the system must have two coordinates

    def of(self, result: "StudyResult", figure: str) -> T:
        """The part of a result; NsmapsError, which names the figure, where none can be shown and it is not optional."""
        try:
            part = self.part(result) if self.part is not None else part_named(self.sections[-1], result)
        except NsmapsError as error:
            raise NsmapsError(f"the figure {figure!r} has nothing to show: {error}") from error
        if self.optional:
            return part  # type: ignore[return-value]  # which the figure expects
        if not part:
            raise NsmapsError(
                f"the figure {figure!r} shows {self.what}, which the result lacks; name {self.wanted} in the study, "
                f"resume a run that was stopped (--resume), or leave {figure!r} out of its figures"
            )
        if self.planar:
            _check_plane(result.system.coordinates, figure)
        return part

    def check(self, study: "Study", figure: str) -> None:
        """NsmapsError if a study names the sections and yet does not ask for the part."""
        if not self.asked(study):
            raise NsmapsError(f"the figure {figure!r} shows {self.what}; expected in the study: {self.wanted}")

    @property
    def wanted(self) -> str:
        """What a study must say."""
        return self.entry or " and ".join(map(repr, self.sections))


def part_named(name: str, result: "StudyResult") -> Any:
    """The part of a result of this name, None if it was not computed."""
    return result.parts.get(name, getattr(result, name, None))


def optional(name: str) -> FigurePart[Any]:
    """A part of the result without which a figure is drawn, too."""
    return FigurePart(name, (), partial(part_named, name), optional=True)


def _check_plane(coordinates: Sequence[str], figure: str) -> None:
    """An error unless there are two coordinates."""
    if len(coordinates) != 2:
        raise NsmapsError(
            f"the figure {figure!r} is a picture of a plane and the system has {len(coordinates)} coordinates "
            f"({', '.join(coordinates)}); expected: 2, or envelopes and domain_size, which take any number"
        )


@dataclass(frozen=True, slots=True)
class StudyFigure:
    """One figure: where it is drawn, what it shows in words, and what it needs of a result."""

    module: str  #: below `nsmaps.figures`, such as `composite.cobweb`; its function `sheets` takes what it needs
    alt: str  #: a sentence in place of the picture
    caption: str  #: sentences below the picture, after those with numbers of the analysis
    needs: tuple[FigurePart[Any], ...] = ()
    draws_itself: bool = False  #: whether the result is drawn by its `plot`, not by a module
    animated: bool = False  #: whether `nsmaps animate` has it, too
    by_domain: bool = False  #: whether it has a sheet for every domain
    called: str = ""  #: its name, if not that of its module
    seen: "Callable[[StudyResult], StudyResult]" = lambda result: result  #: the result in which its parts have their usual names

    @property
    def name(self) -> str:
        """The name of the figure, which is that of its module unless it is called otherwise."""
        return self.called or self.module.rpartition(".")[2]

    @property
    def sections(self) -> tuple[str, ...]:
        """The sections that a study must name for its result to have what the figure shows."""
        return tuple(dict.fromkeys(section for need in self.needs for section in need.sections))

    def parts(self, result: "StudyResult") -> list[Any]:
        """What it shows of a result, in the order of its needs; NsmapsError if the result lacks something."""
        seen = self.seen(result)
        return [need.of(seen, self.name) for need in self.needs]

    def sheets(self, result: "StudyResult", first: bool = False) -> "tuple[Sheet, ...]":
        """The sheets of the figure, or that of the first domain; NsmapsError if the result lacks what it shows."""
        parts = self.parts(result)
        if self.draws_itself:
            from nsmaps.figures.page import Sheet

            return (Sheet(self.name, (parts[0].plot,), 1),)
        drawn: tuple[Sheet, ...] = import_module(f"nsmaps.figures.{self.module}").sheets(*parts)
        if self.called:
            usual = self.module.rpartition(".")[2]
            drawn = tuple(replace(sheet, name=sheet.name.replace(usual, self.called, 1)) for sheet in drawn)
        return drawn[:1] if first and self.by_domain else drawn

    def has_data(self, result: "StudyResult") -> bool:
        """Whether a result has what the figure shows."""
        try:
            seen = self.seen(result)
            return all(need.of(seen, self.name) is not None or need.optional for need in self.needs)
        except NsmapsError:
            return False

    def check(self, study: "Study") -> None:
        """NsmapsError if a study names the sections of the figure and yet does not ask for what it shows."""
        for need in self.needs:
            need.check(study, self.name)
