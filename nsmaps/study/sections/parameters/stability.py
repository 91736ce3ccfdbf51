"""The section `stability`: attractors over two parameters."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.along import Along
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.texts import returns_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, STORED, VALUE, Size
from nsmaps.study.reading.values import SPEC, Range
from nsmaps.study.sections.base import Section, Verdict
from nsmaps.study.sections.fields import StabilityFields
from nsmaps.study.sections.parameters.bifurcation import missing
from nsmaps.study.sections.parameters.branches import Way
from nsmaps.study.sections.parameters.curves import CurveSection, check_curves, curves_of, missing_curves, plain_curves

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


class StabilitySection(BaseModel):
    """Attractors over two parameters, followed along the first for each value of the second."""

    model_config = SPEC
    was: ClassVar = {"along": "sweep", "transient": "discard", "longest": "max_period", "follow": "direction"}
    sweep: Range
    across: Range
    start: dict[str, Number]
    discard: int = Field(1000, ge=0)
    max_period: int = Field(16, ge=1)
    direction: Way = "down"
    curves: tuple[CurveSection, ...] = ()

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.sweep.parameter == self.across.parameter:
            raise ValueError(f"'sweep' and 'across' have the same parameter {self.sweep.parameter!r}; expected: two parameters")
        return self


def _bind(spec: StabilitySection, binding: "Binding") -> Floats:
    binding.some_values(("stability", "sweep"), spec.sweep)
    binding.some_values(("stability", "across"), spec.across)
    return binding.start(("stability", "start"), spec.start)


def _compute(spec: StabilitySection, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The stability diagram, and the curves of bifurcations."""
    from nsmaps.dynamics.diagrams.stability import stability_diagram

    spans = spec.sweep, spec.across
    along, across = (np.linspace(span.low, span.high, span.points) for span in spans)
    how: Any = {"max_period": spec.max_period, "discard": spec.discard, "direction": spec.direction}
    map_of = Along(plan.system, *(span.parameter for span in spans))
    with plan.study.source.located(("stability",)):
        jobs = plan.portion(0, 1 + len(spec.curves))
        diagram = stability_diagram(map_of, along, across, plan.bound["stability"], **how, jobs=jobs)
        return {"stability": diagram, "curves": curves_of(plan, result, spec.curves, map_of, (spec.across.low, spec.across.high))}


def _describe(spec: StabilitySection, study: "Study") -> str:
    values = " x ".join(f"{span.points} values of {span.parameter}" for span in (spec.sweep, spec.across))
    return f"{values}; {returns_text(spec.sweep.points * spec.across.points * (spec.discard + 2 * spec.max_period))}"


def _size(spec: StabilitySection, study: "Study", system: "System") -> Size:
    one = Size(VALUE + RETURN * (spec.discard + 10.0 * spec.max_period), COPIES * (STATE + STORED * spec.max_period))
    return one.times(float(spec.sweep.points) * spec.across.points)


def _numbers(result: "StudyResult") -> dict[str, Any]:
    """The fraction of the points that have each period, and the curves."""
    diagram = result.stability
    if diagram is None:
        return {}
    names = {0: "no period", -1: "no attractor"}
    shares = {names.get(period, str(period)): diagram.share(period) for period in np.unique(diagram.period).tolist()}
    return {"stability": {"shares": shares, "curves": plain_curves(result.curves)}}


def _verdicts(result: "StudyResult") -> Iterator[Verdict]:
    diagram = result.stability
    if diagram is not None and (diagram.outcome == Outcome.invalid).any() and any(diagram.reasons):
        none, why = int((diagram.outcome == Outcome.invalid).sum()), next(filter(None, diagram.reasons))
        yield missing("stability", result.system.map_name, none, f"{diagram.outcome.size} points", why)
    yield from missing_curves("stability", result.system.map_name, result.curves)


STABILITY = Section[StabilitySection](
    key="stability",
    type=StabilitySection | None,
    stored=StabilityFields,
    holds={
        "dynamics.diagrams.stability": ("EventCurve", "StabilityDiagram"),
        "dynamics.curves.curve": ("BifurcationCurve",),
        "dynamics.curves.special": ("SpecialPoint",),
    },
    check=lambda spec, study: check_curves("stability", spec.sweep, spec.curves, study),
    bind=_bind,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    verdicts=_verdicts,
)
