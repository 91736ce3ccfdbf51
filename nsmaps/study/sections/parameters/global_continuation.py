"""The section `global_continuation`: attractors of the exact map over a parameter, and their stability against kicks."""

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Box
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import count_of, percent, plain, range_text, span_text, values_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, VALUE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Bounds, MaxPeriod, MaxReturns, Range, Seed, Tolerance
from nsmaps.study.sections.base import Finding, Quantified, Quantifiers, Table, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing_values

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

NAMED = 3  #: motions of one attractor that are named
ROWS = 12  #: largest number of attractors, and of births and deaths, in a table


class GlobalContinuationSection(Range, Quantified):
    """Attractors over a parameter: shares of basins, distances to the boundary, return times.

    A distance is an upper estimate.
    """

    key: ClassVar[str] = "global_continuation"
    quantified: ClassVar[str] = "nsmaps.dynamics.attractors.continued:GlobalContinuation"
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "longrun.global_continuation",
            "Shares of basins as stacked bands over a parameter, above distances to the boundary and return times of the "
            "attractors.",
            "Attractors along the parameter, matched from value to value: the share of the random starts that each reaches; "
            "the smallest kick found that leads elsewhere, an upper estimate of the distance to the boundary (an arrow: none "
            "up to one); the mean return time after a kick, with two standard errors. Kicks are in shares of the region's "
            "sides.",
            (FigurePart("attractors along a parameter", ("global_continuation",)),),
        ),
    )

    box: Bounds = Field(description="where the starts are drawn; its sides are the units of kicks and distances")
    n_samples: int = Field(1000, ge=1, description="random starts, the same at all values")
    max_returns: MaxReturns = 1000
    tolerance: Tolerance = 1e-6
    max_period: MaxPeriod = 32
    step: Number = Field(
        0.1, gt=0, description="largest Hausdorff distance of an attractor from its continuation at the next value"
    )
    kick: Number = Field(0.01, gt=0, description="size of the kicks after which return times are measured")
    n_kicks: int = Field(100, ge=1, description="number of kicks")
    n_directions: int = Field(16, ge=1, description="directions in which the boundary is sought")
    n_states: int = Field(8, ge=1, description="states of an attractor from which the boundary is sought")
    quantifiers: Quantifiers = Field(default_factory=dict)
    rng: Seed = 0

    def bind(self, binding: "Binding") -> Box:
        self.functions(binding.study)
        binding.some_values(("global_continuation",), self)
        return binding.box(("global_continuation", "box"), self.box)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        from nsmaps.dynamics.attractors.global_continuation import global_continuation

        values = np.linspace(self.low, self.high, self.points)
        how = self.model_dump(exclude={*Range.model_fields, "box"}) | {"quantifiers": self.functions(plan.study)}
        where = plan.system, self.parameter, values, plan.bound["global_continuation"]
        return {"global_continuation": global_continuation(*where, **how, parallel=plan.parallel)}

    def describe(self, study: "Study") -> str:
        return f"{range_text(self)}, {self.n_samples} starts each, up to {self.max_returns} returns"

    def size(self, study: "Study", system: "System") -> Size:
        """At most all starts and 100 more for all returns."""
        return Size(VALUE + RETURN * self.max_returns * (self.n_samples + 100), COPIES * STATE).times(self.points)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """Every quantity of each attractor at each value, and the births and deaths."""
        found = result.global_continuation
        names = "share", "share_error", "distance", "return_time", "return_error", "returned", "unresolved", "ended"
        rows = {name: plain(getattr(found, name)) for name in names}
        about = {"values": found.values.tolist(), "labels": found.labels.tolist(), **rows}
        about |= {"quantifiers": {name: plain(values) for name, values in found.quantifiers.items()}} if found.quantifiers else {}
        changes = [
            {"attractor": c.attractor, "kind": c.kind, "label": c.label, "between": [c.low, c.high]} for c in found.changes
        ]
        return {"global_continuation": about | {"scale": found.scale.tolist(), "changes": changes}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        yield from missing_values("global_continuation", result.system.map_name, result.global_continuation.reasons)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The number of attractors, the greatest share of each, and the births and deaths on the way up."""
        found = result.global_continuation
        kinds: dict[str, list[float]] = {}
        for change in found.changes:
            kinds.setdefault(change.kind, []).append((change.low + change.high) / 2)
        changes = [f"{kind} near {self.parameter} = {values_text(values)}" for kind, values in kinds.items()]
        several = int((found.found.sum(axis=1) > 1).sum())
        text = f"{count_of(found.share.shape[1], 'attractor')} for {self.parameter} from {self.low:g} to {self.high:g}"
        text += f", several of them at {several} of {len(found.values)} values" if several else ""
        numbers = []
        for k, share in enumerate(np.where(found.found, found.share, 0.0).max(axis=0).tolist()):
            names = dict.fromkeys(found.labels[found.found[:, k], k].tolist())
            numbers.append((percent(share), f"of the starts reach {', '.join(islice(names, NAMED))}, at most"))
        yield Finding(result.system.map_name, "; ".join([text, *changes]), tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The attractors with the ranges of their quantities, and the births and deaths."""
        found = result.global_continuation
        count, rows = found.share.shape[1], []
        for number in range(count):
            there = found.found[:, number]
            names = " ".join(dict.fromkeys(found.labels[there, number].tolist()))
            span = f"{found.values[there].min():.9g}", f"{found.values[there].max():.9g}"
            ranges = [span_text(x[there, number]) for x in (100 * found.share, found.distance, found.return_time)]
            rows.append((str(number), names if len(names) <= 24 else "several", *span, *ranges))
        notes = [f"There are {count - ROWS} more attractors."] if count > ROWS else []
        where = "distance: the smallest kick found that leads elsewhere, an upper estimate, in shares of the region's sides"
        notes.append(f"share: of the random starts; {where}; returns: after a kick of {self.kick:g}.")
        heads = "attractor", "motions", f"{self.parameter} from", "to", "share (%)", "distance", "returns"
        yield Table("Attractors along the parameter", heads, tuple(rows[:ROWS]), tuple(notes))
        changes = [(str(c.attractor), c.label, c.kind, f"{c.low:.9g}", f"{c.high:.9g}") for c in found.changes]
        if changes:
            more = (f"There are {len(changes) - ROWS} more.",) if len(changes) > ROWS else ()
            between = "attractor", "motion", "change", f"{self.parameter} from", "to"
            yield Table("Births and deaths on the way up", between, tuple(changes[:ROWS]), more)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The range of the parameter, the starts, and the numbers of attractors, births and deaths."""
        found = result.global_continuation
        kinds = [change.kind for change in found.changes]
        text = f"attractors {found.share.shape[1]}, births {kinds.count('birth')}, deaths {kinds.count('death')}"
        return f"{at(result, (self.parameter,))}{range_text(self)}, {found.samples:,} random starts each; {text}."
