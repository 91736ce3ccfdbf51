"""A row of the catalogue of figures: what a figure shows, and what it needs of a result."""

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nsmaps.errors import NsmapsError
from nsmaps.figures.need import Need

if TYPE_CHECKING:
    from nsmaps.figures.page import Sheet
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult


@dataclass(frozen=True, slots=True)
class Row:
    """One figure: where it is drawn, what it shows in words, and what it needs of a result."""

    module: str  #: below `nsmaps.figures`, such as `composite.cobweb`; its function `sheets` gives what is drawn
    alt: str  #: a sentence in place of the picture
    caption: str  #: sentences below the picture
    needs: tuple[Need[Any], ...] = ()
    of_parts: bool = False  #: whether its `sheets` takes the parts of the result that it needs, not the result of the study
    of_other: bool = False  #: whether it is that of an analysis of another package or file, whose result draws itself
    animated: bool = False  #: whether `nsmaps animate` has it, too
    by_domain: bool = False  #: whether it has a sheet for every domain

    @property
    def name(self) -> str:
        """The name of the figure, which is that of its module."""
        return self.module.rpartition(".")[2]

    @property
    def sections(self) -> tuple[str, ...]:
        """The sections that a study must name for its result to have what the figure shows."""
        return tuple(dict.fromkeys(section for need in self.needs for section in need.sections))

    def sheets(self, result: "StudyResult", first: bool = False) -> "tuple[Sheet, ...]":
        """The sheets of the figure, or that of the first domain; NsmapsError if the result lacks what it shows."""
        parts = [need.of(result, self.name) for need in self.needs]
        if self.of_other:
            from nsmaps.figures.page import Sheet

            return (Sheet(self.name, (parts[0].plot,), 1),)
        drawn: tuple[Sheet, ...] = import_module(f"nsmaps.figures.{self.module}").sheets(*(parts if self.of_parts else (result,)))
        return drawn[:1] if first and self.by_domain else drawn

    def has_data(self, result: "StudyResult") -> bool:
        """Whether a result has what the figure shows."""
        try:
            return all(need.of(result, self.name) is not None or need.optional for need in self.needs)
        except NsmapsError:
            return False

    def check(self, study: "Study") -> None:
        """NsmapsError if a study names the sections of the figure and yet does not ask for what it shows."""
        for need in self.needs:
            need.check(study, self.name)
