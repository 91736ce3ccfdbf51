"""The section `exit_times`: returns of the exact map until orbits leave the regions of the composite map."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, Field

from nsmaps.errors import NsmapsError
from nsmaps.reduced.conditions.region import Box
from nsmaps.study.conclusions.texts import finite
from nsmaps.study.estimates import Size, cover_size
from nsmaps.study.reading.values import SPEC, Bounds
from nsmaps.study.sections.base import Need, Section, Table
from nsmaps.study.sections.fields import ExitTimesFields

if TYPE_CHECKING:
    from nsmaps.cells.exit_times import ExitTimes
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


class ExitTimesSection(BaseModel):
    """For each piece the share of its region that leaves it, and that reaches the closed set of `morse`, by number of returns."""

    model_config = SPEC
    box: Bounds
    depth: int = Field(3, ge=0, le=12)
    cells: int = Field(32, ge=1)
    period: int | None = Field(None, ge=1, le=12)  #: longest period of the cycles that are sought in the window


def _needs(spec: ExitTimesSection) -> Iterator[Need]:
    yield ("exit_times",), "'exit_times'", "composite"


def _bind(spec: ExitTimesSection, binding: "Binding") -> Box:
    from nsmaps.enclosures.box_images import box_map

    with binding.study.source.located(("exit_times",)):
        box_map(binding.system)
    return binding.box(("exit_times", "box"), spec.box)


def _compute(spec: ExitTimesSection, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The exit times of the regions of the composite map, and the cycles up to a period."""
    from nsmaps.cells.exit_times import exit_times
    from nsmaps.cells.periodic_points import find_cycles

    window = plan.bound["exit_times"].array
    target = result.trap if result.trap is not None and result.trap.forward_invariant else None
    how = spec.depth, spec.cells
    with plan.study.source.located(("exit_times",)):
        if result.composite is None:
            raise NsmapsError("a map of strips has no regions; expected: a 'composite' map, or a 'partition' of closed forms")
        first, then = (plan.portion(half, 2).progress for half in (0, 1))
        found = find_cycles(plan.system, window, spec.period, *how, progress=first) if spec.period else None
        cycles = found.cycles if found else ()
        times = exit_times(plan.system, result.composite, window, *how, target=target, cycles=cycles, progress=then)
    return {"cycles": found, "exit_times": times}


def _describe(spec: ExitTimesSection, study: "Study") -> str:
    return f"{spec.cells} cells an axis, halved {spec.depth} times"


def _size(spec: ExitTimesSection, study: "Study", system: "System") -> Size:
    return cover_size(spec.cells, len(system.coordinates), spec.depth)


def _numbers(result: "StudyResult") -> dict[str, Any]:
    sections: dict[str, Any] = {}
    if result.cycles is not None:
        states = [[finite(state) for state in cycle.states] for cycle in result.cycles.cycles]
        sections["cycles"] = {"coverage": result.cycles.coverage, "states": states}
    if result.exit_times is not None:
        sections["exit_times"] = row_numbers(result.exit_times)
    return sections


def row_numbers(times: "ExitTimes") -> list[dict[str, Any]]:
    """The rows of a table of exit times, with None for what is not finite."""
    rows = map(asdict, times.rows)
    return [{name: finite([value])[0] if isinstance(value, float) else value for name, value in row.items()} for row in rows]


def _tables(result: "StudyResult") -> Iterator[Table]:
    """The remaining share of each region, and the coverage of the search for cycles."""
    if result.exit_times is not None:
        title = f"Exit times of the regions of the {result.exit_times.of}, by enclosure"
        yield Table(title, (), (), (result.exit_times.table(),))
    if result.cycles is not None:
        yield Table("", (), (), (result.cycles.coverage,))


EXIT_TIMES = Section[ExitTimesSection](
    key="exit_times",
    was="transient",
    type=ExitTimesSection | None,
    stored=ExitTimesFields,
    holds={"cells.periodic_points": ("CycleSearch",), "cells.exit_times": ("ExitTimes",)},
    needs=_needs,
    bind=_bind,
    calls=lambda spec: ("boxes",),
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    tables=_tables,
)
