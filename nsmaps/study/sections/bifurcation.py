"""The section `bifurcation`: what maps do in the long run over a parameter."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.along import Along
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.estimates import COPIES, RETURN, STORED, VALUE, Size
from nsmaps.study.reading.values import Range
from nsmaps.study.sections.base import Need, Section, Table, Verdict
from nsmaps.study.sections.composite import pieces_size, refit
from nsmaps.study.sections.motions import NONE, attractors, digits, motions, widest
from nsmaps.study.sections.surfaces import grid_size
from nsmaps.study.texts import each_text, returns_text

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
    from nsmaps.dynamics.returnmap import ReturnMap
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.study.binding import Binding, Plan
    from nsmaps.study.result import StudyResult
    from nsmaps.study.study import Study

ROWS = 12  #: intervals that a table lists, at most, of each map


class BifurcationSection(Range):
    """What maps do in the long run over a parameter: of the `exact` map, of the `composite` map refitted at each value."""

    was: ClassVar = {"of": "map", "follow": "direction", "transient": "discard"}
    start: dict[str, Number]
    discard: int = Field(2000, ge=0)
    returns: int = Field(60, ge=1)  #: kept, after those that are discarded
    direction: Literal["up", "down", "both"] | None = None
    map: tuple[Literal["exact", "composite"], ...] = ("exact",)

    @model_validator(mode="after")
    def _of_some(self) -> Self:
        if not self.map:
            raise ValueError("'map' names no map; expected: 'exact', 'composite' or both")
        return self

    @property
    def ways(self) -> int:
        """How often the values are gone through."""
        return 2 if self.direction == "both" else 1


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """What a run keeps of its bifurcation diagrams."""

    bifurcation: "dict[str, Bifurcation]" = field(default_factory=dict)  #: by map: exact, composite


def _needs(spec: BifurcationSection) -> Iterator[Need]:
    if "composite" in spec.map:
        yield ("bifurcation", "map"), "the bifurcation of the composite map", "composite"


def _check(spec: BifurcationSection, study: "Study") -> None:
    if study.partition and "composite" in spec.map:
        text = "a partition is made once, the pieces of a bifurcation at every value; expected: 'exact', or 'composite' pieces"
        raise study.source.error(("bifurcation", "map"), text)


def _bind(spec: BifurcationSection, binding: "Binding") -> Floats:
    binding.some_values(("bifurcation",), spec)
    return binding.start(("bifurcation", "start"), spec.start)


@dataclass(frozen=True, slots=True, eq=False)
class _Refitted:
    """The composite map over a parameter, its pieces made at each value: a `map_of` whose parts can be kept."""

    plan: "Plan"
    system_at: Along

    def __call__(self, value: float) -> "CompositeMap":
        return refit(self.plan, self.system_at(value))[0]


def _compute(spec: BifurcationSection, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The attractors over a parameter, of the exact map and of the composite map, whose pieces are made at each value."""
    from nsmaps.dynamics.diagrams.bifurcation import bifurcation

    values, start = np.linspace(spec.low, spec.high, spec.points), plan.bound["bifurcation"]
    how = spec.returns, spec.discard, spec.direction
    system_at = Along(plan.system, spec.parameter)
    maps: dict[str, tuple[Callable[[float], ReturnMap], int | None]] = {
        "exact": (system_at, None),
        "composite": (_Refitted(plan, system_at), 1),  # a part a value: to make the map takes longer than its returns
    }
    with plan.study.source.located(("bifurcation",)):
        made = {}
        for k, of in enumerate(spec.map):
            map_of, part = maps[of]
            jobs = replace(plan.portion(k, len(spec.map), of), part=part)
            made[of] = bifurcation(map_of, values, start, *how, jobs=jobs)
        return {"bifurcation": made}


def _describe(spec: BifurcationSection, study: "Study") -> str:
    returns = spec.points * spec.ways * (spec.discard + spec.returns) * len(spec.map)
    return f"{each_text(spec)} of {' and '.join(spec.map)}; {returns_text(returns)}"


def _size(spec: BifurcationSection, study: "Study", system: "ImpactSystem") -> Size:
    values = float(spec.points * spec.ways)
    one = Size(VALUE + RETURN * (spec.discard + 5 * spec.returns), COPIES * STORED * spec.returns)
    refitted = Size(seconds=grid_size(study).seconds + pieces_size(study).seconds)
    return one.times(values * len(spec.map)) + refitted.times(values if "composite" in spec.map else 0)


def _numbers(result: "StudyResult") -> dict[str, Any]:
    return {"bifurcation": {of: _diagram(made) for of, made in result.bifurcation.items()}} if result.bifurcation else {}


def _diagram(made: "Bifurcation") -> dict[str, Any]:
    """The intervals of one motion of the first orbit in the order of the values, how many orbits ended, what coexists."""
    spans, beside = attractors(made)
    found = {"attractors": spans, "coexisting": beside} if spans else {}
    return {"ended": int((~made.held).sum()), "motions": motions(made)} | found


def missing(name: str, of: str, count: int, all: str, reason: str) -> Verdict:
    """The verdict that fails of a sweep with values at which there is no map."""
    return Verdict(f"{name}: a map at every value", of, False, False, f"no: none at {count} of {all}, as {reason}")


def missing_values(name: str, of: str, reasons: tuple[str, ...]) -> Iterator[Verdict]:
    """The same from the reasons, one a value and empty where there is a map; none for a sweep without such."""
    told = [reason for reason in reasons if reason]
    if told:
        yield missing(name, of, len(told), f"{len(reasons)} values", told[0])


def _verdicts(result: "StudyResult") -> Iterator[Verdict]:
    for of, made in result.bifurcation.items():
        yield from missing_values(f"bifurcation {of}", f"{of} map", made.reasons)
    for of, made in result.bifurcation.items():
        yield from _ended(of, made)


def _ended(of: str, made: "Bifurcation") -> Iterator[Verdict]:
    """A verdict that fails where an orbit ends at a value, with how most of them do."""
    lost = ~made.held & np.array([[not reason] for reason in made.reasons])
    if lost.any():
        most = Outcome(int(np.bincount(made.outcome[lost]).argmax()))
        why = "A polynomial overflows." if of == "composite" and most == Outcome.escaped else most.advice
        text = f"no: one ends at {lost.any(axis=1).sum()} of {len(lost)} values, most often so: {why}"
        yield Verdict(f"bifurcation {of}: orbits go on at every value", f"{of} map", False, False, text)


def _tables(result: "StudyResult") -> Iterator[Table]:
    """Which motion each map has over which interval of the parameter: the widest intervals."""
    section = result.study.bifurcation
    if section is None or not result.bifurcation:
        return
    every = {label for made in result.bifurcation.values() for label in made.labels.ravel().tolist()}
    told = f"C: no period up to {section.returns // 2} returns: chaos, a longer period, or a transient that has not ended."
    notes = [told] if any(label.endswith("C") for label in every) else []
    listed: list[tuple[str, ...]] = []
    for of, made in result.bifurcation.items():
        rows, more, largest = widest(made, ROWS)
        listed += [(of, r["label"] or NONE, *digits([r["from"], r["to"]], made), str(r["values"])) for r in rows]
        each = f"{largest} values" if largest > 1 else "one value"
        notes += [f"Of the {of} map there are {more} more intervals, of at most {each}."] if more else []
    yield Table("Motions", ("map", "motion", f"{section.parameter} from", "to", "values"), tuple(listed), tuple(notes))


BIFURCATION = Section[BifurcationSection](
    key="bifurcation",
    type=BifurcationSection | None,
    stored=Stored,
    needs=_needs,
    check=_check,
    bind=_bind,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    verdicts=_verdicts,
    tables=_tables,
)
