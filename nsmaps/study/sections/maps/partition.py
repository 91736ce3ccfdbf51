"""The section `partition`: the reduced map from a tolerance, by the general algorithm."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.figures.parts import section
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.partition.partition import partition
from nsmaps.reduced.partition.result import PartitionResult
from nsmaps.reduced.partition.spec import Partition, PartitionChoices
from nsmaps.reduced.validation.destinations import MISLED
from nsmaps.reduced.validation.speed import speeds
from nsmaps.study.ahead import call_composite
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import count_of, finite, percent
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.classes import Condition, Instance, OrInstance
from nsmaps.study.reading.values import ATTRACTING, Bounds, Name
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict, claimed, verdict
from nsmaps.study.sections.maps.composite import MAP, TITLE, judged
from nsmaps.study.sections.maps.fits import Fit, bind_fit
from nsmaps.study.sections.maps.surfaces import GRID

if TYPE_CHECKING:
    from nsmaps.reduced.adaptive.accurate import AccurateResult
    from nsmaps.reduced.fit.polymap import PolyMap
    from nsmaps.reduced.validation.speed import Speed
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult

Attracting = OrInstance[Bounds]
MET = "partition: tolerance met"


def _largest_errors(result: "StudyResult") -> Mapping[str, float]:
    """The largest errors of a partition by where they were found."""
    if result.accurate is not None:
        return {"over the box": result.accurate.uniform.largest, "beside edges": result.accurate.beside.largest}
    if result.partition is None:
        return {}
    transient = [max(row.max_error) for row in result.partition.table() if row.role == "transient"]
    return {"attracting pieces": result.partition.max_error, "transient pieces": max(transient, default=float("nan"))}


SECTIONS = ("grid", "partition")
PARTITION: "FigurePart[PartitionResult]" = FigurePart(
    "a partition into pieces in closed form",
    SECTIONS,
    entry="a 'partition' of kind closed_form",
    asked=lambda study: study.partition is None or study.partition.kind != "accurate",
)
ACCURATE: "FigurePart[AccurateResult]" = FigurePart(
    "strips between grazing curves",
    SECTIONS,
    lambda result: result.accurate,
    "a 'partition' of kind accurate",
    lambda study: study.partition is None or study.partition.kind == "accurate",
)
ERRORS: "FigurePart[Mapping[str, float]]" = FigurePart("errors", (), _largest_errors, optional=True)
TOLERANCE: "FigurePart[float]" = FigurePart(
    "a tolerance", (), lambda result: section(result.study.partition, "partition").tolerance
)
SPEED: "FigurePart[Speed]" = FigurePart("the speed of a reduced map", SECTIONS, lambda result: result.speed, "a 'partition'")


class PartitionSection(PartitionChoices, Analysis):
    """The composite map found from a tolerance, in place of `composite`; needs `grid`.

    It finds all words where no `families` are given. Pieces are named `R1`, `R2`, ..., resets `reset v below` and the like. A
    domain may take the map `composite`, `attracting` (the polynomials of the attracting pieces) or a piece's name.
    """

    key: ClassVar[str] = "partition"
    needed: ClassVar[tuple[str, ...]] = ("grid",)
    claims: ClassVar[Mapping[str, tuple[str, ...]]] = {"tolerance": ("partition",)}
    results: ClassVar[Mapping[str, Any]] = {
        "partition": None,  #: the result of the general algorithm
        "accurate": None,  #: the result of the kind `accurate`, without a composite map
        "speed": None,  #: of the reduced map, compared with the exact one
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "system.algorithm",
            "A flow chart of the general algorithm, from top to bottom: initialize, iterate, finalize.",
            "The general algorithm, steps 0 to vii. Each box names what is done, the section of a study, and the function.",
            (optional("partition"),),
        ),
        StudyFigure(
            "composite.partition",
            "The plane of states divided into attracting and transient regions.",
            "The regions found by the general algorithm, with the names and colours of the pieces of the composite map. "
            "Attracting regions have a thick frame.",
            (PARTITION, GRID, optional("orbits")),
        ),
        StudyFigure(
            "composite.strips",
            "Strips of the plane of states between grazing curves.",
            "The cells of the accurate map by the total degree of their polynomials, separated by white lines. Black curves "
            "are the edges of the exact map.",
            (ACCURATE, FigurePart("coordinates", (), lambda result: result.system.coordinates)),
        ),
        StudyFigure(
            "composite.speed_error",
            "The error of the reduced map against its processor time per state, beside the time of the exact map.",
            "Error against speed: the processor time for the return of one state, and the largest error at held-out states. A "
            "map to the right of the line is slower than the exact map.",
            (SPEED, ERRORS, TOLERANCE, TITLE),
        ),
    )

    attracting: tuple[Attracting, ...] = Field(
        (), description="boxes or regions where the map is taken as attracting; by default those found near the diagonals"
    )
    regions: tuple[Condition, ...] = Field(
        (), description="first cells: no piece lies in one and beside it; the first that holds a state counts"
    )
    orders: dict[Name, Fit] = Field(
        {},
        description="fits that are tried in turn, the simplest first, then a constant; by default polynomials up to `max_order`",
    )
    families: tuple[str, ...] = Field((), description="families of one return by which returns are sorted before their words")

    def replaces(self) -> tuple[str, ...]:
        return ("families",) if self.kind == "accurate" else ("families", "composite")

    def check(self, study: "Study") -> None:
        if study.composite:
            text = "'partition' determines the pieces of 'composite'; expected: one of the two"
            raise study.source.error(("partition",), text)
        for number, name in enumerate(self.families):
            study.source.known(("partition", "families", number), name, study.families, "family")

    def bind(self, binding: "Binding") -> Partition:
        boxes, regions = list[Region](), list[Region]()
        for k, given in enumerate(self.attracting):
            loc = ("partition", "attracting", k)
            boxes.append(binding.region(loc, given) if isinstance(given, Instance) else binding.box(loc, given))
        for k, condition in enumerate(self.regions):
            regions.append(binding.region(("partition", "regions", k), condition))
        orders = {name: bind_fit(("partition", "orders", name), fit, binding) for name, fit in self.orders.items()}
        sorts = [binding.family(name) for name in self.families]
        numbers = self.model_dump(exclude_unset=True, exclude={"attracting", "regions", "orders", "families"})
        objects: dict[str, Any] = {"attracting": boxes, "regions": regions, "orders": orders, "families": sorts}
        return Partition(**numbers, **{key: value for key, value in objects.items() if value})

    def calls(self) -> "tuple[Call, ...]":
        return (call_composite,)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Steps ii to vii of the general algorithm."""
        grid = plan.bound["grid"]
        box = np.array([(axis.low, axis.high) for axis in grid.axes.values()])
        found = partition(plan.system, grid, plan.bound["partition"], progress=plan.parallel.progress)
        if not isinstance(found, PartitionResult):
            return {"accurate": found, "speed": speeds(plan.system, found.map(plan.system), box)}
        speed = speeds(plan.system, found.composite, box)
        return {"partition": found, "composite": found.composite, "speed": speed, **judged(plan, result, found.composite)}

    def describe(self, study: "Study") -> str:
        return f"{self.kind}, tolerance {self.tolerance:g}"

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        sections: dict[str, Any] = {}
        if result.partition is not None:
            sections["partition"] = _reached(result.partition)
        if (strips := result.accurate) is not None:
            errors = {"uniform": asdict(strips.uniform), "beside": asdict(strips.beside)}
            sections["partition"] = {"met": strips.met, **errors, "report": asdict(strips.strips.report)}
        if result.speed is not None:
            sections["speed"] = asdict(result.speed) | {"faster": result.speed.faster}
        return sections

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The number of regions, and the largest error of the map over them."""
        if (found := result.partition) is not None:
            met = (
                f"within the tolerance {found.spec.tolerance:g}" if found.met else f"over the tolerance {found.spec.tolerance:g}"
            )
            largest = f"{np.max(found.max_error):.2g}"
            count = count_of(len(found.table()), "region")
            text = f"{count}, largest error in the attracting ones {largest}, {met} (held out)"
            numbers = [(largest, f"largest error of an image in the attracting regions, at {found.points:,} states held out")]
            numbers += [(percent(found.covered), "of the grid lies in a region")]
            if not math.isnan(found.same_end):
                numbers.append((percent(found.same_end), "of random orbits end on the attractor of the exact map"))
            yield Finding(MAP, text, tuple(numbers))
        if (strips := result.accurate) is not None:
            largest = f"{max(strips.uniform.largest, strips.beside.largest):.2g}"
            met = "within the tolerance" if strips.met else "over the tolerance at some states"
            share = strips.strips.report.exact_share
            numbers = [(largest, "largest error of an image at states held out")]
            numbers += [(percent(share), "of the area is left to the exact map")]
            yield Finding(MAP, f"largest error {largest}, {met} (held out)", tuple(numbers))

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        tolerance = partial(claimed, result.study, "tolerance")
        if (found := result.partition) is not None:
            yield tolerance(f"{MET} in the attracting regions", MAP, found.met, found.reason)
            yield verdict("partition: orbits arrive in the attracting regions", MAP, *_arrive(found))
            if not math.isnan(found.same_end):
                right = found.same_end >= 1 - MISLED
                text = f"{100 * found.same_end:.3g} % of random starts, of which {100 * (1 - MISLED):g} % must"
                yield verdict("partition: orbits end on the attractors of the exact map", MAP, right, text)
        if (strips := result.accurate) is not None:
            yield tolerance(f"{MET} everywhere (held out)", MAP, strips.met, _errors(strips))
        if (speed := result.speed) is not None:
            yield verdict("partition: clearly faster than the exact map", MAP, speed.faster, speed.text)

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The regions of the final partition."""
        if result.partition is None:
            return
        error = "largest error of " + ", ".join(f"{name}'" for name in result.system.coordinates)
        rows = []
        for row in result.partition.table():
            largest, share = " ".join(f"{value:.2g}" for value in row.max_error), f"{100 * row.share:.3g} %"
            rows.append((row.name, row.role, row.word, share, row.order, str(row.terms), largest, row.became.partition(":")[0]))
        yield Table("Partition", ("region", "role", "word", "share", "order", "terms", error, ""), tuple(rows))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The tolerance and the pieces, or the cells with their largest error, or the time beside that of the exact map."""
        if figure == "speed_error":
            return f"{at(result)}{result.speed.text}." if result.speed else ""
        if figure == "strips" and result.accurate is not None:
            report, largest = result.accurate.strips.report, max(_largest_errors(result).values())
            cells = f"{report.leaves:,} cells with {report.coefficients:,} coefficients"
            return f"{at(result)}{cells}; largest held-out error {largest:.2g}."
        found = result.partition
        if figure != "partition" or found is None:
            return ""
        error = f", largest error in them {found.max_error:.2g}" if math.isfinite(found.max_error) else ""
        pieces = f"{len(found.composite.pieces)} pieces, attracting: {', '.join(found.attracting) or 'none'}"
        return f"{at(result)}tolerance {found.spec.tolerance:g}; {pieces}{error}."


def is_of_partition(study: "Study", return_map: str) -> bool:
    """Whether the map of a domain is named as the pieces of a partition are, such as R1; it may not exist."""
    return study.partition is not None and (return_map == ATTRACTING or bool(re.fullmatch(r"R\d+", return_map)))


def attracting_of(found: PartitionResult) -> "PolyMap | CompositeMap":
    """The map of the attracting piece, or the composite map of several."""
    attracting = found.attracting_map
    return attracting.pieces[0].map if len(attracting.pieces) == 1 else attracting


def _reached(found: PartitionResult) -> dict[str, Any]:
    """The numbers of the general algorithm, and its log as a table."""
    rows = [asdict(row) | {key: finite(getattr(row, key)) for key in ("r2", "sse", "max_error")} for row in found.log]
    error, right_next = finite([found.max_error, found.right_next])
    return {
        "tolerance": found.spec.tolerance,
        "met": found.met,
        "attracting": list(found.attracting),
        "unmet": list(found.unmet),
        "max_error": error,
        "held_out": found.points,
        "covered": found.covered,
        "uncovered": found.uncovered,
        "right_next": right_next,
        "same_end": finite([found.same_end])[0],
        "arrives": dict(zip(("exact", "composite"), found.arrives, strict=True)),
        "log": rows,
    }


def _arrive(found: PartitionResult) -> tuple[bool, str]:
    exact, composite = found.arrives
    holds = bool(found.attracting) and composite >= exact
    shares = f"{100 * composite:.3g} % of random starts arrive there, under the exact map {100 * exact:.3g} %"
    return holds, shares


def _errors(found: "AccurateResult") -> str:
    where = zip(("over the box", "beside edges"), (found.uniform, found.beside), strict=True)
    errors = [
        f"{e.largest:.2g} at {e.points - e.by_exact_map} states {place} ({e.over or 'none'} over the tolerance)"
        for place, e in where
    ]
    share = f"the exact map is used on {found.strips.report.exact_share:.2g} of the area"
    return f"largest error {' and '.join(errors)}; {share}"
