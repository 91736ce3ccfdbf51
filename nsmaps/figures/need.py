"""A part of a study's result that a figure shows, and the errors that say what a study must name to have it computed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Need(Generic[T]):
    """A part of a result that a figure shows, and what a study says to have it computed."""

    what: str  #: the part in words, such as "return surfaces"
    sections: tuple[str, ...]  #: the sections of a study from which it is computed
    part: "Callable[[StudyResult], T | None]"  #: raises NsmapsError where it is there and has nothing that can be shown
    entry: str = ""  #: what a study must say, where that is more than to name the sections
    asked: "Callable[[Study], bool]" = lambda study: True  #: whether a study which names the sections says that, too
    optional: bool = False  #: whether a figure is drawn without it, too
    planar: bool = False  #: whether it is shown in a plane of states, so that the system must have two coordinates

    def of(self, result: "StudyResult", figure: str) -> T:
        """The part of a result; NsmapsError, which names the figure, where none can be shown and it is not optional."""
        try:
            part = self.part(result)
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


def _check_plane(coordinates: Sequence[str], figure: str) -> None:
    """An error unless there are two coordinates."""
    if len(coordinates) != 2:
        raise NsmapsError(
            f"the figure {figure!r} is a picture of a plane and needs a system of 2 coordinates; this one has "
            f"{len(coordinates)} ({', '.join(coordinates)}); envelopes and domain_size take any number"
        )
