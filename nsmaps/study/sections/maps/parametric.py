"""The section `parametric_map`: the composite map as a function of a parameter."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from nsmaps.exact.surfaces.along import Along
from nsmaps.reduced.composite.parametric import ParametricMap, ParametricReport, chebyshev_nodes, parametric_map, report_on
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.validation.counterpart import CounterpartAlong
from nsmaps.study.conclusions.texts import finite, percent, point
from nsmaps.study.estimates import RETURN, Size
from nsmaps.study.reading.values import Ends, ParameterName, Points, Section, Transient
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict, claimed
from nsmaps.study.sections.maps.composite import pieces_size
from nsmaps.study.sections.maps.refits import refits
from nsmaps.study.sections.maps.surfaces import grid_size

if TYPE_CHECKING:
    from nsmaps.arrays import Floats
    from nsmaps.dynamics.diagrams.agreement import Agreement, Disagreement
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

TITLE = "parametric map"
FITTED = 0.6  #: share of the work that fits are assumed to take, for `progress`; the rest is that of attractors
NAMES = 3  #: of motions that a row of the table names
Degree = Annotated[int, Field(ge=0, le=20)]


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] <= ends[1]:
        raise ValueError(f"[{ends[0]:g}, {ends[1]:g}] is empty; expected: the lower end first")
    return ends


class CompareSection(Section):
    """The attractors of the parametric map compared with those of the exact map, from one start."""

    start: dict[str, Number] | None = Field(
        None, description="the start at every value; by default that of the first of `orbits`, else the middle of the grid"
    )
    points: Points = 46  #: equally spaced values
    transient: Transient = 2000
    n_returns: int = Field(400, ge=50, description="returns that are compared")
    tolerance: Number = Field(0.03, gt=0, le=1, description="largest distance of attractors that agree, in sides of the grid")
    apart_from: tuple[Annotated[tuple[Number, Number], AfterValidator(_rising)], ...] = Field(
        (), alias="except", description="intervals [low, high] of the parameter in which the map need not follow"
    )


class ParametricSection(Analysis):
    """The composite map with coefficients polynomial in a parameter, compared with the exact map; needs `composite`.

    The map is fitted at Chebyshev nodes of the parameter, and compared half-way between the nodes and at both ends with the one
    fitted there; its attractors are compared with those of the exact map.
    """

    key: ClassVar[str] = "parametric_map"
    needed: ClassVar[tuple[str, ...]] = ("composite",)
    results: ClassVar[Mapping[str, Any]] = {
        "parametric_map": None,
        "agreement": None,  #: of the attractors of the parametric map with those of the exact map
    }

    parameter: ParameterName
    bounds: Ends = Field(description="where the map is to hold; outside it is an error")
    degree: Degree = Field(4, description="degree in the parameter")
    degrees: dict[str, Degree | dict[str, Degree]] = Field(
        default_factory=dict, description="other degrees of some pieces, of all their images or of some"
    )
    n_nodes: int | None = Field(
        None,
        ge=1,
        le=100,
        description="values at which the pieces are fitted, more than the highest degree; by default twice that and one",
    )
    compare: CompareSection = Field(
        default_factory=lambda: CompareSection.model_validate({}), description="the comparison with the exact map"
    )
    require: tuple[Literal["follows"], ...] = Field((), description="`follows`: the attractors agree with those of the exact map")

    @model_validator(mode="after")
    def _enough(self) -> Self:
        if self.n_nodes is not None and self.n_nodes <= self.highest:
            raise ValueError(f"{self.n_nodes} nodes for degree {self.highest}; expected: more nodes than the degree")
        return self

    @property
    def highest(self) -> int:
        """The highest degree."""
        return max([self.degree, *(max([*of.values(), 0]) if isinstance(of, dict) else of for of in self.degrees.values())])

    @property
    def number_of_nodes(self) -> int:
        """The number of Chebyshev nodes."""
        return self.n_nodes or 2 * self.highest + 1

    def check(self, study: "Study") -> None:
        if self.require and not (self.compare.start or study.orbits or study.grid):
            text = (
                "'follows' compares orbits, of which none has a start; expected: 'start' in 'compare', or 'orbits', or a 'grid'"
            )
            raise study.source.error(("parametric_map", "require"), text)
        pieces = [piece.name for piece in study.composite]
        for name in self.degrees:
            study.source.known(("parametric_map", "degrees", name), name, pieces, "piece", key=True)

    def bind(self, binding: "Binding") -> "Floats | None":
        """The start of the comparison, if it is given."""
        binding.study.source.known(("parametric_map", "parameter"), self.parameter, binding.system.parameters, "parameter")
        for number, value in enumerate(self.bounds):
            binding.check_value(("parametric_map", "bounds", number), self.parameter, value, "")
        for name, of in self.degrees.items():
            binding.some_coordinates(("parametric_map", "degrees", name), of if isinstance(of, dict) else {})
        start = self.compare.start
        return None if start is None else binding.start(("parametric_map", "compare", "start"), start)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The parametric map from the maps at its nodes, compared with refits between them and with the exact map."""
        low, high = self.bounds
        nodes = chebyshev_nodes(self.bounds, self.number_of_nodes)
        at_nodes = {value: composite for value, composite, _ in refits(plan, self.parameter, nodes, 0.0, FITTED / 2)}
        return_map = parametric_map(at_nodes, self.parameter, self.bounds, self.degree, self.degrees)
        held = refits(plan, self.parameter, np.array([low, *(nodes[1:] + nodes[:-1]) / 2, high]), FITTED / 2, FITTED)
        reported = replace(return_map, report=report_on(return_map, held) if held[0][2] else None)
        return {"parametric_map": reported, "agreement": _compared(self, plan, return_map)}

    def describe(self, study: "Study") -> str:
        return f"degree {self.highest} in {self.parameter} from {self.bounds[0]:g} to {self.bounds[1]:g}"

    def size(self, study: "Study", system: "System") -> Size:
        pieces, compare = pieces_size(study), self.compare
        returns = 2.0 * compare.points * (compare.transient + compare.n_returns)
        fits = (grid_size(study) + Size(seconds=pieces.seconds)).times(2 * self.number_of_nodes + 1)
        return fits + Size(seconds=RETURN * returns, memory=pieces.memory)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The largest errors over all held-out values, one per output, by piece, and where the map departs from the exact one."""
        return_map, found = result.parametric_map, result.agreement
        report = return_map.report
        worst = {} if report is None else {key: getattr(report, key).max(axis=1) for key in ("refit", "error", "difference")}
        names = () if report is None else report.names
        pieces = {name: {key: finite(errors[k]) for key, errors in worst.items()} for k, name in enumerate(names)}
        ends = {
            "parameter": return_map.parameter,
            "from": return_map.low,
            "to": return_map.high,
            "condition": return_map.condition,
        }
        held = [] if report is None else report.values.tolist()
        where = (
            {} if found is None else {"compared": len(found.values), "disagreements": [asdict(d) for d in found.disagreements()]}
        )
        return {"parametric_map": ends | {"nodes": return_map.nodes.tolist(), "held_out": held, "pieces": pieces} | where}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """At how many values the attractors are those of the exact map."""
        if (found := result.agreement) is not None and len(found.values):
            alike, name = int(found.holds.sum()), found.parameter
            text = f"its attractors are those of the {result.system.map_name} at {alike} of {len(found.values)} values of {name}"
            numbers = [
                (
                    percent(alike / len(found.values)),
                    f"of the values of {name} have the attractors of the {result.system.map_name}",
                )
            ]
            if np.isfinite(found.distance[found.holds]).any():
                far = np.nanmax(found.distance[found.holds])
                numbers.append((f"{far:.2g}", "largest distance of these attractors, in sides of the grid"))
            yield Finding(TITLE, text, tuple(numbers))

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """Whether the attractors of the parametric map are those of the exact map at every value outside the stated intervals."""
        found = result.agreement
        if found is None:
            if self.require:
                text = f"the {result.system.map_name} has no attractor from the start at any value compared"
                yield claimed(self, "follows", "parametric_map: follows", TITLE, False, text)
            return
        stated = self.compare.apart_from
        inside = found.in_intervals(stated)
        wrong = list(found.disagreements(stated))
        holds = not wrong and not inside.all()
        which = "orbits" if found.starts is None else f"orbits from {point(result.system.coordinates, found.starts[0])}"
        outside = f" outside {' and '.join(f'[{a:g}, {b:g}]' for a, b in stated)}" if stated else ""
        low, high = self.bounds
        where = f"{(~inside).sum()} values of {self.parameter} from {low:g} to {high:g}{outside}"
        if holds:
            furthest = np.nanmax([*found.distance[~inside].ravel(), 0.0])
            text = f"at {where} {which} end on attractors of the same period, at most {furthest:.2g} apart in sides of the grid"
        elif wrong:
            count, first = sum(each.count for each in wrong), _spoken(self, result, wrong[0])
            text = f"at {count} of {where} {which} end on attractors that differ: {first}"
            text += f"; {len(wrong) - 1} more intervals" if len(wrong) > 1 else ""
        else:
            text = f"no value is compared{outside}"
        yield claimed(self, "follows", "parametric_map: follows", TITLE, holds, text)

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The errors of each piece, and where the attractors are not those of the exact map."""
        return_map, found = result.parametric_map, result.agreement
        if return_map.report is not None:
            yield _errors(return_map.report, return_map.coordinates.names, self.parameter)
        if found is not None and (rows := tuple(_row(each) for each in found.disagreements())):
            heads = (f"{self.parameter} from", "to", "values", result.system.map_name, TITLE, "distance")
            count = len(found.values)
            note = f"Of {count} values compared; distances in sides of the grid, of which {found.tolerance:g} is allowed."
            yield Table("Where the parametric map does not follow", heads, rows, (note,))


def _compared(spec: ParametricSection, plan: "Plan", return_map: ParametricMap) -> "Agreement | None":
    """The agreement of the attractors of a parametric map with the exact ones; None without a start or any exact attractor."""
    from nsmaps.dynamics.diagrams.agreement import agreement
    from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram

    values, compare, start = np.linspace(*spec.bounds, spec.compare.points), spec.compare, _start(plan)
    if start is None:
        return None
    how: Any = {"starts": start, "n_returns": compare.n_returns, "transient": compare.transient}
    half = (1 + FITTED) / 2
    exact_at = CounterpartAlong(Along(plan.system, spec.parameter), return_map.at)
    exact = bifurcation_diagram(exact_at, spec.parameter, values, **how, parallel=plan.parallel.share(FITTED, half, "exact"))
    ours = bifurcation_diagram(
        return_map.at, spec.parameter, values, **how, parallel=plan.parallel.share(half, 1.0, "parametric")
    )
    if not exact.held.any():
        return None
    return replace(agreement(exact, ours, compare.tolerance, _sides(plan, exact)), starts=start)


def _sides(plan: "Plan", exact: "BifurcationDiagram") -> "Floats":
    """The sides of the study's grid, or, of coordinates that it has at one value, the extents of all exact attractors."""
    from nsmaps.dynamics.attractors.distance import extents

    own = extents(exact.states[exact.held].reshape(-1, len(exact.coordinates)), exact.coordinates)
    sides = np.array([axis.high - axis.low for axis in plan.grid.axes.values()]) if plan.grid else own
    return np.where(sides > 0, sides, own)


def _start(plan: "Plan") -> "Floats | None":
    """The start of the comparison, shape (1, n), if there is one."""
    given = plan.bound["parametric_map"]
    if given is None and plan.bound.get("orbits"):
        given = plan.bound["orbits"][0]
    if given is None and plan.grid:
        given = np.mean([(axis.low, axis.high) for axis in plan.grid.axes.values()], axis=1)
    return None if given is None else np.atleast_2d(given)


def _spoken(section: ParametricSection, result: "StudyResult", where: "Disagreement") -> str:
    """An interval where both maps differ, in words."""
    at = f"from {where.low:.6g} to {where.high:.6g}" if where.count > 1 else f"at {where.low:.6g}"
    maps = f"{_named(where.exact)} of the {result.system.map_name}, {_named(where.labels)} of the {TITLE}"
    return f"{section.parameter} {at}, {maps}{_distance(where, ' at a distance of ')}"


def _named(motions: tuple[str, ...]) -> str:
    """The first motions of an interval."""
    return ", ".join([name or "none" for name in motions[:NAMES]] + ["..."] * (len(motions) > NAMES))


def _distance(where: "Disagreement", before: str = "") -> str:
    return "" if np.isnan(where.distance) else f"{before}{where.distance:.2g}"


def _row(where: "Disagreement") -> tuple[str, ...]:
    return f"{where.low:.6g}", f"{where.high:.6g}", str(where.count), _named(where.exact), _named(where.labels), _distance(where)


def _errors(report: ParametricReport, names: tuple[str, ...], parameter: str) -> Table:
    """The largest errors of each piece at the values held out."""
    worst = [getattr(report, key).max(axis=1) for key in ("refit", "error", "difference")]
    rows = [(p, x, *(f"{of[k, i]:.2g}" for of in worst)) for k, p in enumerate(report.names) for i, x in enumerate(names)]
    heads = ("piece", "image", "map fitted there", "parametric map", "between both")
    note = (
        f"Largest at {len(report.values)} values of {parameter} held out: at the data of the exact map there, and between both."
    )
    return Table("Errors of the parametric map", heads, tuple(rows), (note,))
