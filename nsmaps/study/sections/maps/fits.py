"""The polynomial of a piece: its keys in a study's file, and its errors."""

import math
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Discriminator, Field, Tag, model_validator

from nsmaps.plugins import FIT
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.fit.polyfit import Degree, PolyFit, PolynomialFit, SeparableFit
from nsmaps.study.conclusions.texts import finite
from nsmaps.study.estimates import COPIES, Size
from nsmaps.study.reading.classes import Instance, OrInstance, calling, created
from nsmaps.study.reading.locations import Loc
from nsmaps.study.reading.values import Section, one_of

if TYPE_CHECKING:
    from nsmaps.reduced.fit.polymap import FitReport
    from nsmaps.study.binding import Binding


def _kind_of_degrees(value: object) -> str:
    by_output = isinstance(value, dict) and any(isinstance(degree, dict) for degree in value.values())
    return "[by output]" if by_output else "[same]"


Degrees = Annotated[
    Annotated[dict[str, Degree], Tag("[same]")] | Annotated[dict[str, dict[str, Degree]], Tag("[by output]")],
    Discriminator(_kind_of_degrees),
]  #: degree by coordinate, or that for each output; one form is chosen by its content, so that errors refer to it


class FitSection(Section):
    """A polynomial fit: `full` (eq. cubic2dv) or `separable` (remark separable), with degrees from 0 to 40 by coordinate."""

    full: Degrees | None = Field(
        None, description="each coordinate at most its degree, 0 if not named, in total at most the largest; also by output"
    )
    separable: dict[str, Degree] | None = Field(
        None, description="degrees of each coordinate's image as a polynomial in itself alone"
    )
    lines: dict[str, Number] | None = Field(
        None, description="with `separable`: fit on the grid line where the other coordinates are nearest to these values"
    )
    absolute: tuple[str, ...] = Field((), description="take the absolute value of these images")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        one_of({"full": self.full, "separable": self.separable}, "a fit")
        if self.lines is not None and self.separable is None:
            raise ValueError("'lines' chooses the curves of a separable fit; expected: beside 'separable' only")
        return self


Fit = OrInstance[FitSection]


def bind_fit(loc: Loc, section: FitSection | Instance, binding: "Binding") -> PolyFit:
    """The fit that a section describes, whose names must be coordinates of the system."""
    source = binding.study.source
    if isinstance(section, Instance):
        fit: PolyFit = created(source, loc, section, FIT)
        for name in binding.system.coordinates:
            with calling(source, loc, f"{type(fit).__name__}.exponents"):
                fit.exponents(binding.system.coordinates, name)  # which refuses names that are not coordinates
        return fit
    for key in ("separable", "lines"):
        if getattr(section, key) is not None:
            binding.every_coordinate((*loc, key), getattr(section, key))
    for number, name in enumerate(section.absolute):
        source.known((*loc, "absolute", number), name, binding.system.coordinates, "coordinate")
    if section.full is not None:
        by_output = any(isinstance(degree, dict) for degree in section.full.values())
        (binding.every_coordinate if by_output else binding.some_coordinates)((*loc, "full"), section.full)
        with source.located(loc, FitSection, degrees="full"):
            return PolynomialFit(degrees=section.full, absolute=section.absolute)
    with source.located(loc, FitSection, degrees="separable"):
        return SeparableFit(degrees=section.separable or {}, lines=section.lines, absolute=section.absolute)


def fit_size(fit: FitSection | Instance, states: float) -> Size:
    """The size of a dense least-squares problem of so many states."""
    full = fit.full if isinstance(fit, FitSection) else None
    degrees = [d for each in (full or {}).values() for d in ([each] if isinstance(each, int) else each.values())]
    terms = math.prod(float(degree + 1) for degree in degrees[:2]) if degrees else 50.0
    return Size(1e-9 * states * terms * terms, 8.0 * COPIES * states * terms)


def report_numbers(report: "FitReport") -> dict[str, Any]:
    """The errors of a fit, one per output."""
    kept = ("r2", "sse", "max_error", "condition", "points", "terms", "left_out", "loss")
    return {name: finite(getattr(report, name)) for name in kept} | {"warnings": list(report.warnings)}
