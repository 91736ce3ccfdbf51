"""The section `stability_diagram`: attractors over two parameters."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import range_text, returns_text, shares_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, STORED, VALUE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import MaxPeriod, Tolerance, Transient
from nsmaps.study.sections.base import Finding, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing
from nsmaps.study.sections.parameters.branches import Way
from nsmaps.study.sections.parameters.curves import (
    OverPlane,
    missing_curves,
    plain_curves,
    plane_finding,
)

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


class StabilitySection(OverPlane):
    """Motions of the exact map that attract over two parameters, followed along the first."""

    key: ClassVar[str] = "stability_diagram"
    results: ClassVar[Mapping[str, Any]] = {
        "stability_diagram": None,
        "stability_curves": {},  #: by event and branch
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.stability",
            "The plane of two parameters coloured by the motion that attracts, with bifurcation curves.",
            "The motion to which one orbit converges at each point of two parameters, and bifurcation curves of branches. "
            "Another initial state may converge to another motion.",
            (FigurePart("a stability diagram", ("stability_diagram",)), optional("stability_curves")),
        ),
    )

    start: dict[str, Number] = Field(description="the start of every row")
    max_period: MaxPeriod = 16
    transient: Transient = 1000
    direction: Way = Field("down", description="start each orbit of a row where the one before it ended")
    tolerance: Tolerance = 1e-6

    def bind(self, binding: "Binding") -> Floats:
        self.check_plane(binding)
        return binding.start(("stability_diagram", "start"), self.start)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The stability diagram, and the curves of bifurcations."""
        from nsmaps.dynamics.diagrams.stability import stability_diagram

        how = self.model_dump(include={"max_period", "transient", "direction", "tolerance"})
        with plan.study.source.located(("stability_diagram",)):
            parallel = plan.portion(0, 1 + len(self.bifurcation_curves))
            diagram = stability_diagram(plan.system, self.values, plan.bound["stability_diagram"], **how, parallel=parallel)
            curves = self.curves(plan, result)
        return {"stability_diagram": diagram, "stability_curves": curves}

    def describe(self, study: "Study") -> str:
        values = " x ".join(f"{axis.points} values of {axis.parameter}" for axis in self.axes)
        return f"{values}; {returns_text(self.pixels * (self.transient + 2 * self.max_period))}"

    def size(self, study: "Study", system: "System") -> Size:
        one = Size(VALUE + RETURN * (self.transient + 10.0 * self.max_period), COPIES * (STATE + STORED * self.max_period))
        return one.times(float(self.pixels))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The fraction of the points that have each period, and the curves."""
        diagram = result.stability_diagram
        if diagram is None:
            return {}
        names = {0: "no period", -1: "no attractor"}
        shares = {names.get(period, str(period)): diagram.share(period) for period in np.unique(diagram.period).tolist()}
        return {"stability_diagram": {"shares": shares, "curves": plain_curves(result.stability_curves)}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of each motion, and the bifurcation curves."""
        if (diagram := result.stability_diagram) is not None:
            names, counts = np.unique(diagram.labels, return_counts=True)
            shares = dict(zip(names.tolist(), (counts / diagram.labels.size).tolist(), strict=True))
            yield plane_finding(result.system.map_name, self.axes, shares, result.stability_curves)

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        diagram = result.stability_diagram
        if diagram is not None and (diagram.outcome == Outcome.invalid).any() and any(diagram.reasons):
            none, why = int((diagram.outcome == Outcome.invalid).sum()), next(filter(None, diagram.reasons))
            yield missing("stability_diagram", result.system.map_name, none, f"{diagram.outcome.size} points", why)
        yield from missing_curves("stability_diagram", result.system.map_name, result.stability_curves)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The ranges of both parameters, and the share of each motion."""
        found = result.stability_diagram
        if found is None:
            return ""
        labels = found.labels.ravel().tolist()
        shares = {label or "none": labels.count(label) / len(labels) for label in dict.fromkeys(labels)}
        return f"{at(result, tuple(self.plane))}{', '.join(map(range_text, self.axes))}; motions {shares_text(shares)}."
