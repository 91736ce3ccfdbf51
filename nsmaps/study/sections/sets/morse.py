"""The section `morse_sets`: a cover of the invariant sets of the exact map in a window, by enclosure."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import count_of, intervals
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import CellsPerAxis, Depth
from nsmaps.study.sections.base import Finding, Verdict, claimed
from nsmaps.study.sections.sets.window import WindowSection

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.study.sections.base import Plan, StudyResult

EXACT_ORBITS: "FigurePart[Sequence[Orbit]]" = FigurePart(
    "orbits", (), lambda result: [pair.exact for pair in result.orbits], optional=True
)


class MorseSection(WindowSection):
    """Invariant sets of the exact map in a window, covered by cells through enclosures."""

    key: ClassVar[str] = "morse_sets"
    results: ClassVar[Mapping[str, Any]] = {
        "morse_sets": None,  #: of the invariant sets in the window, by enclosure of the exact map
        "forward_invariant_set": None,  #: the closed set around its first minimal component
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "cells.morse_sets",
            "The cells of the window coloured by recurrent component, with states of orbits.",
            "Cells that contain every orbit which stays in the window, by recurrent component (Morse set), and states of "
            "orbits. From a component without exit no other one can be reached.",
            (FigurePart("a cover by Morse sets", ("morse_sets",), planar=True), EXACT_ORBITS),
        ),
    )
    depth: Depth = 4
    n_cells: CellsPerAxis = 8
    require: tuple[Literal["forward_invariant"], ...] = Field(
        (), description="`forward_invariant`: the first minimal component has a closed set of cells around it"
    )

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """A cover of the invariant sets in a window, and the closed set around its first minimal component."""
        from nsmaps.cells.morse import forward_invariant_set, morse_sets

        how: Any = {"depth": self.depth, "n_cells": self.n_cells, "progress": plan.parallel.progress}
        cover = morse_sets(plan.system, plan.bound["morse_sets"].array, **how)
        closed = forward_invariant_set(plan.system, cover, cover.minimal[0]) if cover.minimal else None
        return {"morse_sets": cover, "forward_invariant_set": closed}

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The hulls of the components, the graph of transitions between them, and the minimal components."""
        cover = result.morse_sets
        cells = {"cells": list(cover.cells.shape), "kept": len(cover.numbers), "finished": cover.finished}
        edges, minimal = cover.edges.tolist(), list(cover.minimal)
        return {"morse_sets": cells | {"hulls": cover.hulls.tolist(), "edges": edges, "minimal": minimal}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The recurrent components, and the cells in which every orbit stays."""
        cover, held = result.morse_sets, result.forward_invariant_set
        count, total = len(cover.hulls), int(np.prod(cover.cells.shape))
        text = f"{count_of(count, 'recurrent component')} in {len(cover.numbers):,} of {total:,} cells of the window (enclosed)"
        numbers = [(f"{len(cover.numbers):,}", f"of {total:,} cells may hold an orbit that never leaves the window")]
        numbers += [(str(count), "recurrent components, outside of which no orbit returns near to itself")]
        if held is not None and held.forward_invariant:
            hull = intervals(held.cells.coordinates, held.hull)
            text += f"; every orbit from {len(held.numbers):,} cells within {hull} stays in them (enclosed)"
            numbers.append((f"{len(held.numbers):,}", "cells that no orbit leaves"))
        yield Finding(cover.of, text, tuple(numbers))

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        cover, held = result.morse_sets, result.forward_invariant_set
        text = "no orbit stays in the window"
        if held is not None:
            hull = f"their hull {intervals(cover.cells.coordinates, held.hull)} (enclosed)"
            text = f"{held.reason}; {hull}" if held.forward_invariant else held.reason
        holds = held is not None and held.forward_invariant
        yield claimed(self, "forward_invariant", "morse_sets: forward invariant", cover.of, holds, text)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The number of cells, and of recurrent components."""
        cover, closed = result.morse_sets, result.forward_invariant_set
        shape = " x ".join(map(str, cover.cells.shape))
        text = f"{at(result)}{len(cover.numbers):,} of {shape} cells kept, recurrent components: {len(cover.hulls)}"
        held = closed is not None and closed.forward_invariant
        stays = f"; every orbit of the {closed.of} from {len(closed.numbers):,} of the cells stays in them" if held else ""
        return f"{text}{stays}."
