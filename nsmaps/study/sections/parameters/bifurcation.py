"""The section `bifurcation_diagram`: attractors of maps over a parameter."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.dynamics.motion import kinds_explained
from nsmaps.exact.outcome import Outcome
from nsmaps.results import units_of
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import each_text, known, range_text, returns_text
from nsmaps.study.conclusions.titles import maps_along
from nsmaps.study.estimates import COPIES, RETURN, STORED, VALUE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import Range, Starts, Tolerance, Transient
from nsmaps.study.sections.base import Analysis, Finding, Need, Table, Verdict, verdict
from nsmaps.study.sections.maps.composite import pieces_size
from nsmaps.study.sections.maps.refits import map_along
from nsmaps.study.sections.maps.surfaces import grid_size
from nsmaps.study.sections.parameters.branches import BRANCHES
from nsmaps.study.sections.parameters.motions import NONE, attractors, diagram_finding, digits, motions, motions_of, widest

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border, Window
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

ROWS = 12  #: largest number of intervals in a table, per map

DIAGRAMS: "FigurePart[Mapping[str, BifurcationDiagram]]" = FigurePart(
    "bifurcation diagrams",
    ("bifurcation_diagram",),
    lambda result: {result.map_title(of): diagram for of, diagram in result.bifurcation_diagram.items()},
)


class BifurcationSection(Range, Analysis):
    """Attractors over a parameter, of the exact map, the composite map, its pieces, or the parametric map.

    The borders of the widest windows of each map are in a table and in `result.json`, with their precision and kind. Values
    that the system does not admit are reported; an error if none is admitted. A `partition` has a map at its own value alone.
    """

    key: ClassVar[str] = "bifurcation_diagram"
    results: ClassVar[Mapping[str, Any]] = {
        "bifurcation_diagram": {},  #: by map: exact, composite, parametric, a piece
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.bifurcation_diagram",
            "The states of the attractors against the parameter, with the names of the motions above.",
            "The attractors over the parameter; the darker a place, the more states lie there. The motions of each orbit that "
            "differ are named above, the first orbit's lowest, between ticks at their borders; a number is explained below. C is "
            "chaos, between windows at most of the values. A motion of the composite map has the name of the exact one with the "
            "same words and period in returns. Angles are cut where no state lies. Grey: no attractor. Lines, if any, are "
            "branches of cycles, dashed where unstable, with their events.",
            (DIAGRAMS, replace(BRANCHES, sections=(), optional=True), optional("lyapunov")),
        ),
    )

    starts: Starts = Field(description="the starts at each value; where values are followed, at the first of them")
    n_returns: int = Field(60, ge=1, description="returns that are kept after the transient")
    transient: Transient = 2000
    direction: Literal["up", "down", "both"] | None = Field(
        None,
        description="follow the last state at one value to the next, through growing or falling values or one orbit through each",
    )
    tolerance: Tolerance = 1e-6
    map: tuple[str, ...] = Field(
        ("exact",),
        description="`exact`, `composite`, `parametric` or pieces; `composite` and pieces are fitted again at every value",
    )

    @model_validator(mode="after")
    def _of_some(self) -> Self:
        if not self.map:
            raise ValueError("'map' names no map; expected: 'exact', 'composite', 'parametric' or pieces of the composite map")
        if len(set(self.map)) < len(self.map):
            raise ValueError(f"'map' names a map twice: {', '.join(self.map)}; expected: each map once")
        return self

    @property
    def ways(self) -> int:
        """The number of orbits through the values."""
        return len(self.starts) * (2 if self.direction == "both" else 1)

    def needs(self) -> Iterator[Need]:
        for name, key in (("composite", "composite"), ("parametric", "parametric_map")):
            if name in self.map:
                yield ("bifurcation_diagram", "map"), f"the bifurcation of the {name} map", key

    def check(self, study: "Study") -> None:
        loc = ("bifurcation_diagram", "map")
        if study.partition and set(self.map) - {"exact"}:
            text = (
                "a partition is of one value of the parameter; expected: 'exact', or 'composite' pieces, refitted at every value"
            )
            raise study.source.error(loc, text)
        for k, of in enumerate(self.map):
            study.source.known((*loc, k), of, maps_along(study), "map")
        if "parametric" in self.map and study.parametric_map and study.parametric_map.parameter != self.parameter:
            text = f"the parametric map is one over {study.parametric_map.parameter!r}, not over {self.parameter!r}"
            raise study.source.error(loc, f"{text}; expected: the same parameter in both")

    def bind(self, binding: "Binding") -> Floats:
        binding.some_values(("bifurcation_diagram",), self)
        return binding.starts(("bifurcation_diagram", "starts"), self.starts)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The attractors over a parameter, of each map."""
        from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram

        values, starts = np.linspace(self.low, self.high, self.points), plan.bound["bifurcation_diagram"]
        how = self.model_dump(include={"n_returns", "transient", "direction", "tolerance"}) | {"borders": True}
        diagrams = {}
        for k, of in enumerate(self.map):
            map_of = map_along(plan, result, of, self.parameter)
            part = None if of in ("exact", "parametric") else 1  # value: a fit takes longer than the returns
            parallel = replace(plan.portion(k, len(self.map), of), part=part)
            found = bifurcation_diagram(map_of, self.parameter, values, starts, **how, parallel=parallel)
            diagrams[of] = replace(found, units=units_of(plan.system))
        return {"bifurcation_diagram": diagrams}

    def describe(self, study: "Study") -> str:
        returns = self.points * self.ways * (self.transient + self.n_returns) * len(self.map)
        return f"{each_text(self)} of {' and '.join(self.map)}; {returns_text(returns)}"

    def size(self, study: "Study", system: "System") -> Size:
        values = float(self.points * self.ways)
        one = Size(VALUE + RETURN * (self.transient + 5 * self.n_returns), COPIES * STORED * self.n_returns)
        refitted = Size(seconds=grid_size(study).seconds + pieces_size(study).seconds)
        return one.times(values * len(self.map)) + refitted.times(values * len(set(self.map) - {"exact", "parametric"}))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        found = {of: _diagram(diagram) | _borders(diagram.windows) for of, diagram in result.bifurcation_diagram.items()}
        return {"bifurcation_diagram": found}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        for of, diagram in result.bifurcation_diagram.items():
            yield from missing_values(f"bifurcation_diagram {of}", result.map_title(of), diagram.reasons)
        for of, diagram in result.bifurcation_diagram.items():
            yield from _ended(of, result.map_title(of), diagram)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The windows of each map, the bifurcations between them, and where there is chaos."""
        for of, diagram in result.bifurcation_diagram.items():
            yield diagram_finding(diagram, result.map_title(of))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The motions of each map and their intervals of the parameter, the widest ones."""
        every = {label for diagram in result.bifurcation_diagram.values() for label in diagram.labels.ravel().tolist()}
        explained = kinds_explained(every)
        notes = [f"{explained}."] if explained else []
        listed: list[tuple[str, ...]] = []
        for of, diagram in result.bifurcation_diagram.items():
            rows, more, largest = widest(diagram, ROWS)
            listed += [(of, r["label"] or NONE, *digits([r["from"], r["to"]], diagram), str(r["values"])) for r in rows]
            each = f"{largest} values" if largest > 1 else "one value"
            notes += [f"Of the {result.map_title(of)} there are {more} more intervals, of at most {each}."] if more else []
        ends = (f"{self.parameter} from", "to")
        yield Table("Motions", ("map", "motion", *ends, "values"), tuple(listed), tuple(notes))
        windows = [(of, window) for of, diagram in result.bifurcation_diagram.items() for window in diagram.windows]
        found = [(of, _named(window), _spoken(window.low), _spoken(window.high)) for of, window in windows]
        if found:
            yield Table("Windows", ("map", "motion", *ends), tuple(found))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The range of the parameter, and the motions of the exact map."""
        exact = result.bifurcation_diagram.get("exact")
        seen = motions_of(exact) if exact is not None else ""
        ratio = ": n:m/pT has n impacts on the base wall and m on others in p periods of the forcing" if "/" in seen else ""
        return f"{at(result, (self.parameter,))}{range_text(self)}{f'; of the exact map {seen}' if seen else ''}{ratio}."


def _borders(found: "tuple[Window, ...]") -> dict[str, Any]:
    """The widest windows with their borders, with the precision and the kind of each."""
    return {"windows": [{"label": each.label, "low": _border(each.low), "high": _border(each.high)} for each in found]}


def _border(border: "Border") -> dict[str, Any]:
    known = not np.isnan(border.value)
    return {"value": border.value if known else None, "precision": border.precision if known else None, "kind": border.kind}


def _diagram(diagram: "BifurcationDiagram") -> dict[str, Any]:
    """The intervals of each motion of the first orbit, the number of orbits that ended, and coexisting attractors."""
    spans, beside = attractors(diagram)
    found = {"attractors": spans, "coexisting": beside} if spans else {}
    return {"ended": int((~diagram.held).sum()), "motions": motions(diagram)} | found


def missing(name: str, of: str, count: int, total: str, reason: str) -> Verdict:
    """The failed verdict on a sweep with values at which there is no map."""
    return verdict(f"{name}: a map at every value", of, False, f"none at {count} of {total}; {reason}")


def missing_values(name: str, of: str, reasons: tuple[str, ...]) -> Iterator[Verdict]:
    """The same from the reasons, one per value and empty where there is a map; no verdict if all are empty."""
    given = [reason for reason in reasons if reason]
    if given:
        yield missing(name, of, len(given), f"{len(reasons)} values", given[0])


def _ended(of: str, name: str, diagram: "BifurcationDiagram") -> Iterator[Verdict]:
    """The failed verdict on a sweep in which orbits ended, with the most frequent reason."""
    lost = ~diagram.held & np.array([[not reason] for reason in diagram.reasons])
    if lost.any():
        outcome = Outcome(int(np.bincount(diagram.outcome[lost]).argmax()))
        why = "A polynomial overflows." if of != "exact" and outcome == Outcome.escaped else outcome.advice
        text = f"an orbit ends at {lost.any(axis=1).sum()} of {len(lost)} values, most frequently: {why}"
        yield verdict(f"bifurcation_diagram {of}: orbit completes at every parameter value", name, False, text)


def _named(window: "Window") -> str:
    """The motion of a window, with its rotation number."""
    return f"{window.label}, rotation number {window.rotation}" if window.rotation else window.label


def _spoken(border: "Border") -> str:
    """The value of a border to the digits that are known, and its kind."""
    if np.isnan(border.value):
        return border.kind
    value = known(border.value, border.precision) if border.precision else f"{border.value:.12g}"
    return f"{value}, {border.kind}"
