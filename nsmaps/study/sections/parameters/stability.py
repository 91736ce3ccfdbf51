"""The section `stability`: attractors over two parameters."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import range_text, returns_text, shares_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, STORED, VALUE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import SPEC, Range
from nsmaps.study.sections.base import Analysis, Finding, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing
from nsmaps.study.sections.parameters.branches import Way
from nsmaps.study.sections.parameters.curves import (
    CurveSection,
    check_curves,
    curves_of,
    missing_curves,
    plain_curves,
    plane_finding,
)

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


class StabilitySection(Analysis):
    """Attractors over two parameters, followed along the first for each value of the second."""

    key: ClassVar[str] = "stability"
    results: ClassVar[Mapping[str, Any]] = {
        "stability": None,
        "curves": {},  #: by event and branch
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.stability",
            "The plane of two parameters coloured by the motion that attracts, with bifurcation curves.",
            "The motion to which one orbit converges at each point of two parameters, and bifurcation curves of branches. "
            "Another initial state may converge to another motion.",
            (FigurePart("a stability diagram", ("stability",)), optional("curves")),
        ),
    )

    model_config = SPEC
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

    def check(self, study: "Study") -> None:
        check_curves("stability", self.sweep, self.curves, study)

    def bind(self, binding: "Binding") -> Floats:
        binding.some_values(("stability", "sweep"), self.sweep)
        binding.some_values(("stability", "across"), self.across)
        return binding.start(("stability", "start"), self.start)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The stability diagram, and the curves of bifurcations."""
        from nsmaps.dynamics.diagrams.stability import stability_diagram

        spans = self.sweep, self.across
        plane = {span.parameter: np.linspace(span.low, span.high, span.points) for span in spans}
        how: Any = {"max_period": self.max_period, "transient": self.discard, "direction": self.direction}
        with plan.study.source.located(("stability",)):
            parallel = plan.portion(0, 1 + len(self.curves))
            diagram = stability_diagram(plan.system, plane, plan.bound["stability"], **how, parallel=parallel)
            return {
                "stability": diagram,
                "curves": curves_of(plan, result, self.curves, self.across),
            }

    def describe(self, study: "Study") -> str:
        values = " x ".join(f"{span.points} values of {span.parameter}" for span in (self.sweep, self.across))
        return f"{values}; {returns_text(self.sweep.points * self.across.points * (self.discard + 2 * self.max_period))}"

    def size(self, study: "Study", system: "System") -> Size:
        one = Size(VALUE + RETURN * (self.discard + 10.0 * self.max_period), COPIES * (STATE + STORED * self.max_period))
        return one.times(float(self.sweep.points) * self.across.points)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The fraction of the points that have each period, and the curves."""
        diagram = result.stability
        if diagram is None:
            return {}
        names = {0: "no period", -1: "no attractor"}
        shares = {names.get(period, str(period)): diagram.share(period) for period in np.unique(diagram.period).tolist()}
        return {"stability": {"shares": shares, "curves": plain_curves(result.curves)}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of each motion, and the bifurcation curves."""
        if (diagram := result.stability) is not None:
            names, counts = np.unique(diagram.labels, return_counts=True)
            shares = dict(zip(names.tolist(), (counts / diagram.labels.size).tolist(), strict=True))
            yield plane_finding(result.system.map_name, (self.sweep, self.across), shares, result.curves)

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        diagram = result.stability
        if diagram is not None and (diagram.outcome == Outcome.invalid).any() and any(diagram.reasons):
            none, why = int((diagram.outcome == Outcome.invalid).sum()), next(filter(None, diagram.reasons))
            yield missing("stability", result.system.map_name, none, f"{diagram.outcome.size} points", why)
        yield from missing_curves("stability", result.system.map_name, result.curves)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The ranges of both parameters, and the share of each motion."""
        found = result.stability
        if found is None:
            return ""
        labels = found.labels.ravel().tolist()
        shares = {label or "none": labels.count(label) / len(labels) for label in dict.fromkeys(labels)}
        over = f"{range_text(self.sweep)}, {range_text(self.across)}"
        return f"{at(result, (self.sweep.parameter, self.across.parameter))}{over}; motions {shares_text(shares)}."
