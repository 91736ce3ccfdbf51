"""The section `stability`: attractors over two parameters."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.along import Along
from nsmaps.progress import beat
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.texts import plain, returns_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, STORED, VALUE, Size
from nsmaps.study.reading.values import SPEC, Range
from nsmaps.study.sections.base import Section, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing
from nsmaps.study.sections.parameters.branches import Way, cycle_of, mapped

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.stability import EventCurve, StabilityDiagram
    from nsmaps.study.sections.base import Binding, ImpactSystem, Plan, Study, StudyResult


Crossed = Literal["period doubling", "fold", "branch point", "Neimark-Sacker", "grazing", "border collision"]


class CurveSection(BaseModel):
    """The curve of the first event of a kind on a branch, over the second parameter."""

    model_config = SPEC
    branch: str
    event: Crossed


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


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """The fields of a result for stability diagram."""

    stability: "StabilityDiagram | None" = None
    curves: "dict[str, EventCurve]" = field(default_factory=dict)  #: of events, by branch and event


def check_curves(key: str, sweep: Range, curves: tuple[CurveSection, ...], study: "Study") -> None:
    """Raise StudyError at the first curve of a section without a branch along the first parameter, or given twice."""
    name = sweep.parameter
    expected = [branch.name for branch in study.branches if branch.parameter == name]
    for number, curve in enumerate(curves):
        loc = (key, "curves", number)
        study.source.known((*loc, "branch"), curve.branch, expected, f"branch in {name!r}")
        if curve in curves[:number]:
            text = f"the curve of {curve.branch!r} and {curve.event!r} is given twice; expected: each once"
            raise study.source.error(loc, text)


def _bind(spec: StabilitySection, binding: "Binding") -> Floats:
    binding.some_values(("stability", "sweep"), spec.sweep)
    binding.some_values(("stability", "across"), spec.across)
    return binding.start(("stability", "start"), spec.start)


def _compute(spec: StabilitySection, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The stability diagram, and the curves of events."""
    from nsmaps.dynamics.diagrams.stability import stability_diagram

    spans = spec.sweep, spec.across
    along, across = (np.linspace(span.low, span.high, span.points) for span in spans)
    count = 1 + len(spec.curves)
    how: Any = {"max_period": spec.max_period, "discard": spec.discard, "direction": spec.direction}
    map_of = Along(plan.system, *(span.parameter for span in spans))
    curves = {}
    with plan.study.source.located(("stability",)):
        diagram = stability_diagram(map_of, along, across, plan.bound["stability"], **how, jobs=plan.portion(0, count))
        for number, each in enumerate(spec.curves, 1):
            curves[f"{each.event} of {each.branch}"] = curve_of(plan, result, each, map_of, across)
            beat((number + 1) / count)
    return {"stability": diagram, "curves": curves}


def curve_of(plan: "Plan", result: "StudyResult", curve: CurveSection, map_of: Along, across: Floats) -> "EventCurve":
    """An event of a branch over the second parameter: continued to both ends from the value nearest to the study's own."""
    from nsmaps.dynamics.diagrams.stability import EventCurve, event_curve

    number = [section.name for section in plan.study.branches].index(curve.branch)
    section = plan.study.branches[number]
    orbit, value = cycle_of(plan, number), section.value(plan.system.parameters)
    known = zip(section.ways, result.branches[curve.branch], strict=False)
    way = next((way for way, branch in known if branch.of_kind(curve.event)), section.ways[0])
    assert map_of.second is not None
    own = int(np.abs(across - plan.system.parameters[map_of.second]).argmin())
    ends = across[:own][::-1], across[own:]
    of = mapped(section, map_of)
    down, up = (event_curve(of, orbit, value, end, curve.event, section.bounds, way, section.step) for end in ends)
    values, precision = (np.concatenate([getattr(down, name)[::-1], getattr(up, name)]) for name in ("values", "precision"))
    return EventCurve(curve.event, values, across, precision, down.reasons[::-1] + up.reasons)


def _describe(spec: StabilitySection, study: "Study") -> str:
    values = " x ".join(f"{span.points} values of {span.parameter}" for span in (spec.sweep, spec.across))
    return f"{values}; {returns_text(spec.sweep.points * spec.across.points * (spec.discard + 2 * spec.max_period))}"


def _size(spec: StabilitySection, study: "Study", system: "ImpactSystem") -> Size:
    one = Size(VALUE + RETURN * (spec.discard + 10.0 * spec.max_period), COPIES * (STATE + STORED * spec.max_period))
    return one.times(float(spec.sweep.points) * spec.across.points)


def _numbers(result: "StudyResult") -> dict[str, Any]:
    """The fraction of the points that have each period, and the curves."""
    diagram = result.stability
    if diagram is None:
        return {}
    names = {0: "no period found", -1: "no attractor"}
    shares = {names.get(period, str(period)): diagram.share(period) for period in np.unique(diagram.period).tolist()}
    return {"stability": {"shares": shares, "curves": plain_curves(result.curves)}}


def plain_curves(curves: "dict[str, EventCurve]") -> dict[str, Any]:
    """Curves of events for JSON."""
    return {
        name: {"across": curve.across.tolist(), "values": plain(curve.values), "precision": plain(curve.precision)}
        for name, curve in curves.items()
    }


def _verdicts(result: "StudyResult") -> Iterator[Verdict]:
    diagram = result.stability
    if diagram is not None and (diagram.outcome == Outcome.invalid).any() and any(diagram.reasons):
        none, why = int((diagram.outcome == Outcome.invalid).sum()), next(filter(None, diagram.reasons))
        yield missing("stability", result.system.map_name, none, f"{diagram.outcome.size} points", why)


STABILITY = Section[StabilitySection](
    key="stability",
    type=StabilitySection | None,
    stored=Stored,
    holds={"dynamics.diagrams.stability": ("EventCurve", "StabilityDiagram")},
    check=lambda spec, study: check_curves("stability", spec.sweep, spec.curves, study),
    bind=_bind,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    verdicts=_verdicts,
)
