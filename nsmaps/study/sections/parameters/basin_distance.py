"""The section `basin_distance`: how far the motion of a record is from the boundary of its basin, at estimated parameters."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.estimates import RETURN, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Seed
from nsmaps.study.sections.base import Analysis, Finding

if TYPE_CHECKING:
    from nsmaps.estimation.margin import BasinDistance
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

SETTLED, LOOKED = 100, 20  #: returns until an attractor is known, and states along a direction, for an estimate of the time
FOUND: "FigurePart[BasinDistance]" = FigurePart("distances from a basin's boundary", ("basin_distance",))


class BasinDistanceSection(Analysis):
    """The distance of the motion of a record from the boundary of its basin, as by `nsmaps.estimation.basin_distance`."""

    key: ClassVar[str] = "basin_distance"
    needed: ClassVar[tuple[str, ...]] = ("estimate",)
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "estimation.margin",
            "The boundary of the basin in several directions from a motion, and the least distance at draws of the parameters.",
            "Points on the boundary of the basin in several directions from the motion of a record, and the least distance from "
            "it at draws of the estimated parameters.",
            (FOUND,),
        ),
    )

    record: int = Field(0, ge=0, description="number of the record, from 0 on")
    directions: tuple[tuple[Number, ...], ...] | None = Field(
        None, description="changes of the coordinates, one list each; random ones by default"
    )
    n_directions: int = Field(16, ge=1, description="number of random directions")
    reach: Number = Field(1.0, gt=0, description="farthest distance, in extents of the motion, radians of an angle")
    n_draws: int = Field(16, ge=0, description="draws of the estimated parameters")
    rng: Seed = 0

    def bind(self, binding: "Binding") -> None:
        from nsmaps.estimation.margin import unit_directions

        source, count = binding.study.source, len(binding.study.estimate.data)
        if self.record >= count:
            raise source.error(("basin_distance", "record"), f"there is no record {self.record}; expected: below {count}")
        with source.located(("basin_distance", "directions")):
            unit_directions(
                self.directions, self.n_directions, np.ones(len(binding.system.coordinates)), np.random.default_rng(self.rng)
            )

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The distances."""
        from nsmaps.estimation.margin import basin_distance

        flow = FlowSystem.require(plan.system, "a distance from a basin's boundary")
        return {"basin_distance": basin_distance(flow, result.estimate, **self.model_dump())}

    def describe(self, study: "Study") -> str:
        return f"{self._count()} directions, at the estimate and at {self.n_draws} draws"

    def size(self, study: "Study", system: "System") -> Size:
        return Size(RETURN * SETTLED * LOOKED * self._count() * (self.n_draws + 1))

    def _count(self) -> int:
        return self.n_directions if self.directions is None else len(self.directions)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        found = result.basin_distance
        distances = [float(one) if np.isfinite(one) else None for one in (found.distances.min(), *np.sort(found.least))]
        least, *drawn = distances
        return {"basin_distance": {"motion": found.label, "least": least, "least_of_draws": drawn, "share": found.share[0]}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        found = result.basin_distance
        least = float(found.distances.min())
        numbers = ((f"{least:.3g}", "least distance from the boundary, in extents"),) if np.isfinite(least) else ()
        yield Finding(result.system.map_name, f"the record ends on {found.summary()}", numbers)
