"""The section `partition`: the reduced map from a tolerance, by the general algorithm."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Discriminator, Field, Tag

from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.partition.partition import partition
from nsmaps.reduced.partition.result import PartitionResult
from nsmaps.reduced.partition.spec import Partition, PartitionChoices
from nsmaps.reduced.validation.destinations import MISLED
from nsmaps.reduced.validation.speed import speeds
from nsmaps.study.conclusions.texts import finite, yes
from nsmaps.study.reading.classes import CLASS, OWN, Condition, Instance, form_of
from nsmaps.study.reading.values import ATTRACTING, Bounds, Name
from nsmaps.study.sections.base import Analysis, Need, Table, Verdict, claimed
from nsmaps.study.sections.maps.composite import MAP, judged
from nsmaps.study.sections.maps.fits import Fit, bind_fit

if TYPE_CHECKING:
    from nsmaps.reduced.adaptive.accurate import AccurateResult
    from nsmaps.reduced.fit.polymap import PolyMap
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult

Attracting = Annotated[Annotated[Bounds, Tag(OWN)] | Annotated[Instance, Tag(CLASS)], Discriminator(form_of)]
MET = "partition: tolerance met"


class PartitionSection(PartitionChoices, Analysis):
    """The choices of a partition in a study."""

    key: ClassVar[str] = "partition"
    claims: ClassVar[Mapping[str, tuple[str, ...]]] = {"tolerance": ("partition",)}
    results: ClassVar[Mapping[str, Any]] = {
        "partition": None,  #: the result of the general algorithm
        "accurate": None,  #: the result of the kind `accurate`, without a composite map
        "speed": None,  #: of the reduced map, compared with the exact one
    }

    attracting: tuple[Attracting, ...] = ()
    regions: tuple[Condition, ...] = ()
    orders: dict[Name, Fit] = Field({})
    families: tuple[str, ...] = ()

    def replaces(self) -> tuple[str, ...]:
        return ("families",) if self.kind == "accurate" else ("families", "composite")

    def needs(self) -> Iterator[Need]:
        yield ("partition",), "'partition'", "grid"

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
        with binding.study.source.located(("partition",)):
            return Partition(**numbers, **{key: value for key, value in objects.items() if value})

    def calls(self) -> tuple[str, ...]:
        return ("composite",)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Steps ii to vii of the general algorithm."""
        grid = plan.bound["grid"]
        with plan.study.source.located(("partition",)):
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

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        tolerance = partial(claimed, result.study, "tolerance")
        if (found := result.partition) is not None:
            yield tolerance(f"{MET} in the attracting regions", MAP, found.met, f"{yes(found.met)}: {found.reason}")
            yield Verdict("partition: orbits arrive in the attracting regions", MAP, *_arrive(found))
            if not math.isnan(found.same_end):
                right = found.same_end >= 1 - MISLED
                text = f"{yes(right)}: {100 * found.same_end:.3g} % of random starts, of which {100 * (1 - MISLED):g} % must"
                yield Verdict("partition: orbits end on the attractors of the exact map", MAP, right, False, text)
        if (strips := result.accurate) is not None:
            yield tolerance(f"{MET} everywhere (held out)", MAP, strips.met, _errors(strips))
        if (speed := result.speed) is not None:
            text = f"{yes(speed.faster)}: {speed.text}"
            yield Verdict("partition: clearly faster than the exact map", MAP, speed.faster, False, text)

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


def _arrive(found: PartitionResult) -> tuple[bool, bool, str]:
    exact, composite = found.arrives
    holds = bool(found.attracting) and composite >= exact
    shares = f"{100 * composite:.3g} % of random starts arrive there, under the exact map {100 * exact:.3g} %"
    return holds, False, f"{yes(holds)}: {shares}"


def _errors(found: "AccurateResult") -> str:
    where = zip(("over the box", "beside edges"), (found.uniform, found.beside), strict=True)
    errors = [
        f"{e.largest:.2g} at {e.points - e.by_exact_map} states {place} ({e.over or 'none'} over the tolerance)"
        for place, e in where
    ]
    share = f"the exact map is used on {found.strips.report.exact_share:.2g} of the area"
    return f"{yes(found.met)}: largest error {' and '.join(errors)}; {share}"
