"""The section `exit_times`: returns of the exact map until orbits leave the regions of the composite map."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from nsmaps.cells.times import HEADS
from nsmaps.errors import NsmapsError
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import finite, percent
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.sections.base import Finding, Table
from nsmaps.study.sections.sets.window import WindowSection

if TYPE_CHECKING:
    from nsmaps.cells.times import ExitTimes, TransientRow
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.study.sections.base import Plan, StudyResult


class ExitTimesSection(WindowSection):
    """The share of each region of the composite map that is left within a number of returns; needs `composite`.

    The forward invariant set of `morse_sets`, if there is one, is the target of arrivals. Periodic points in cells that are not
    shown to be left are listed.
    """

    key: ClassVar[str] = "exit_times"
    needed: ClassVar[tuple[str, ...]] = ("composite",)
    results: ClassVar[Mapping[str, Any]] = {
        "cycles": None,  #: of the window of the transient regions
        "exit_times": None,
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "cells.exit_times",
            "The cells of the regions coloured by the number of returns after which they have been left.",
            "The number of returns after which all states of a cell have left its region, by enclosure, with the cells for "
            "which this is not shown and the periodic points found there.",
            (FigurePart("exit times", ("exit_times",), planar=True),),
        ),
    )

    max_period: int | None = Field(
        None, ge=1, le=12, description="largest period of the cycles of the exact map that are sought in the window"
    )

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The exit times of the regions of the composite map, and the cycles up to a period."""
        from nsmaps.cells.periodic_points import find_cycles
        from nsmaps.cells.times import exit_times

        window = plan.bound["exit_times"].array
        closed = result.forward_invariant_set
        target = closed if closed is not None and closed.forward_invariant else None
        how: Any = {"depth": self.depth, "n_cells": self.n_cells}
        composite = composite_of(result)
        first, then = (plan.portion(half, 2).progress for half in (0, 1))
        found = None
        if self.max_period:
            found = find_cycles(plan.system, window, max_period=self.max_period, **how, progress=first)
        cycles = found.cycles if found else ()
        times = exit_times(plan.system, composite, window, **how, target=target, cycles=cycles, progress=then)
        return {"cycles": found, "exit_times": times}

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        sections: dict[str, Any] = {}
        if result.cycles is not None:
            states = [[finite(state) for state in cycle.states] for cycle in result.cycles.cycles]
            sections["cycles"] = {"coverage": result.cycles.coverage, "states": states}
        if result.exit_times is not None:
            sections["exit_times"] = row_numbers(result.exit_times)
        return sections

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of the regions that all their orbits leave."""
        if (found := result.exit_times) is not None and (found.region >= 0).any():
            yield exits_finding(found, found.of, found.rows[-1])

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The remaining share of each region, and the coverage of the search for cycles."""
        if result.exit_times is not None:
            yield exits_table(f"Exit times of the regions of the {result.exit_times.of}, by enclosure", result.exit_times)
        if result.cycles is not None:
            yield Table("", (), (), (result.cycles.coverage,))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The number of cells, and after how many returns they have been left."""
        found = result.exit_times
        if found is None or not (found.region >= 0).any():
            return ""
        inside = found.region >= 0
        left = float((found.left[inside] >= 0).mean())
        shape = " x ".join(map(str, found.cells.shape))
        return (
            f"{at(result)}{shape} cells; of those in a region {100 * left:.4g} % are left by all their orbits of the {found.of}."
        )


def composite_of(result: "StudyResult") -> "CompositeMap":
    """The composite map of a result. NsmapsError for a map of strips."""
    if result.composite is None:
        raise NsmapsError("a map of strips has no regions; expected: a 'composite' map, or a 'partition' of closed forms")
    return result.composite


def exits_finding(found: "ExitTimes", of: str, whole: "TransientRow") -> Finding:
    """The share of the cells of regions that all orbits leave, and that come to the closed set, if there is one."""
    text = f"{percent(whole.left)} of the cells in regions are left by all their orbits"
    text += f", and {percent(whole.arrives)} arrive in the closed set" if found.arrived is not None else ""
    numbers = [(percent(whole.left), f"of the cells are left within {whole.left_steps} returns")]
    if found.arrived is not None:
        numbers.append((percent(whole.arrives), "of the cells are shown to arrive in the closed set"))
    return Finding(of, f"{text} (enclosed)", tuple(numbers))


def exits_table(title: str, found: "ExitTimes") -> Table:
    """The shares of each region that are left and that arrive, and the periodic points found in the others."""
    explained = "within: returns; stays: cells of which not all orbits are shown to leave; periodic: points found in these."
    return Table(title, HEADS, tuple(row.texts() for row in found.rows), (explained, *found.notes()))


def row_numbers(times: "ExitTimes") -> list[dict[str, Any]]:
    """The rows of a table of exit times, with None for what is not finite."""
    rows = map(asdict, times.rows)
    return [{name: finite([value])[0] if isinstance(value, float) else value for name, value in row.items()} for row in rows]
