"""The section `slices`: first returns along one coordinate, at fixed values of the others."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from nsmaps.exact.surfaces.slice import slice_along
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.estimates import COPIES, RETURN, STATE, Size, states
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.locations import Loc
from nsmaps.study.reading.values import Section, Span
from nsmaps.study.sections.base import Entries

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

Cut = tuple[str, Axis, dict[str, float]]  #: the coordinate that varies, its values, and the values of the others


class SliceSection(Section):
    """First returns along one coordinate, at fixed values of the others."""

    at: dict[str, Number] = Field(description="values at which all other coordinates are held")
    axis: dict[str, Span] = Field(min_length=1, max_length=1, description="the coordinate that runs, and its values")


class Slices(Entries[SliceSection]):
    """First returns along one coordinate while the others are held."""

    key: ClassVar[str] = "slices"
    results: ClassVar[Mapping[str, Any]] = {
        "slices": (),  #: first returns along one coordinate
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "returns.slices",
            "Images against one coordinate of the initial state while the other is held, coloured by word.",
            "First returns along one coordinate by word; the other coordinate is held at the value above. In its phase plane "
            "all stand over one value. Gaps are jumps of the map.",
            (FigurePart("first returns along one coordinate", ("slices",)),),
        ),
    )

    def bind(self, binding: "Binding") -> tuple[Cut, ...]:
        return tuple(_cut(("slices", number), section, binding) for number, section in enumerate(self))

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Cuts through the surfaces of step i."""
        return {"slices": tuple(slice_along(plan.system, *cut) for cut in plan.bound["slices"])}

    def describe(self, study: "Study") -> str:
        return f"{len(self)} of the exact map"

    def size(self, study: "Study", system: "System") -> Size:
        points = sum(states(section.axis) for section in self)
        return Size(RETURN * points, COPIES * STATE * points)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The values at which coordinates are held."""
        lines = [f"{len(each.returns):,} states along {each.along} with {_held(each.at)}" for each in result.slices]
        return f"{at(result)}{'; '.join(lines)}." if lines else ""


def _held(at: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in at.items())


def _cut(loc: Loc, section: SliceSection, binding: "Binding") -> Cut:
    """The cut; raises StudyError unless every coordinate either varies or has a value."""
    ((along, span),) = binding.some_coordinates((*loc, "axis"), section.axis).items()
    binding.some_coordinates((*loc, "at"), section.at)
    coordinates = binding.system.coordinates
    if {along, *section.at} != set(coordinates) or along in section.at:
        others = ", ".join(name for name in coordinates if name != along)
        raise binding.study.source.error((*loc, "at"), f"{along!r} varies along the slice; expected in 'at': all of {others}")
    return along, binding.axis((*loc, "axis", along), span), dict(section.at)
