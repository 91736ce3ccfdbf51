"""The section `auxiliary_map`: the full auxiliary map of eq. auxM, its generic orbit, and the exit times of its regions."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from nsmaps.errors import NsmapsError
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.texts import finite
from nsmaps.study.conclusions.titles import pieces_with_a_map
from nsmaps.study.estimates import Size, cover_size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import Bounds, CellsPerAxis, Depth
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict, verdict
from nsmaps.study.sections.maps.composite import COMPOSITE
from nsmaps.study.sections.maps.surfaces import GRID
from nsmaps.study.sections.sets.exit_times import composite_of, exits_finding, exits_table, row_numbers

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

OF = "full auxiliary map"


class AuxiliaryMapSection(Analysis):
    """The full auxiliary map (eq. auxM): auxiliary maps in the box A_1 of a domain and over some pieces.

    Elsewhere it is the composite map; needs `composite` and `domains`. Its orbits include all orbits of the composite map. A
    run gives the exit times of all regions, and the share that arrives in A_1 if that is forward invariant.
    """

    key: ClassVar[str] = "auxiliary_map"
    needed: ClassVar[tuple[str, ...]] = ("composite", "domains")
    results: ClassVar[Mapping[str, Any]] = {
        "auxiliary_map": None,
        "auxiliary_exits": None,  #: of its regions, and arrival in A_1
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "domains.auxiliary_map",
            "Upper and lower auxiliary maps in two regions, the curves of the other pieces, and a cobweb through them.",
            "The full auxiliary map: in A_1 and over the regions of the pieces that the study names, every coordinate is led "
            "on by its upper and lower auxiliary map alternately, elsewhere by the composite map. Pieces are lines where the "
            "image depends on one coordinate alone, else the range of its values over the other.",
            (FigurePart("the full auxiliary map", ("auxiliary_map",)), COMPOSITE, GRID, optional("orbits")),
        ),
    )

    domain: str = Field(description="a domain of the composite map or of one of its pieces, whose box is A_1")
    update: int = Field(1, ge=1, description="N of A_1^(N), the box on which this update was made; 1 is the start box")
    pieces: dict[str, Bounds] = Field(
        default_factory=dict, description="pieces replaced over all of their region, each with a box that holds it"
    )
    box: Bounds = Field(description="window of the exit times")
    depth: Depth = 3
    n_cells: CellsPerAxis = 32
    start: dict[str, Number] = Field(description="start of the orbit whose cobwebs the figure shows")
    n_returns: int = Field(400, ge=1, description="returns of this orbit")

    def check(self, study: "Study") -> None:
        pieces = pieces_with_a_map(study)
        reduced = [domain.name for domain in study.domains if domain.map in (*pieces, "composite")]
        study.source.known(("auxiliary_map", "domain"), self.domain, reduced, "domain of the composite map or of a piece")
        for name in self.pieces:
            study.source.known(("auxiliary_map", "pieces", name), name, pieces, "piece")

    def bind(self, binding: "Binding") -> dict[str, Any]:
        """The window, the start, and the boxes of the pieces."""
        where = ("auxiliary_map",)
        boxes = {name: binding.box((*where, "pieces", name), box).array for name, box in self.pieces.items()}
        window = binding.box((*where, "box"), self.box).array
        return {"window": window, "start": binding.start((*where, "start"), self.start), "pieces": boxes}

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The curves, the generic orbit, and the exit times under the full auxiliary map."""
        from nsmaps.auxiliary.full_map import AuxiliaryRegion, FullAuxiliaryMap, auxiliary_orbit
        from nsmaps.cells.morse import forward_invariant_box
        from nsmaps.cells.times import exit_times

        bound, updates = plan.bound["auxiliary_map"], result.domains[self.domain].updates
        return_map = composite_of(result)
        if self.update > len(updates):
            raise NsmapsError(f"update is {self.update}, and domain {self.domain!r} has {len(updates)}; expected: one of these")
        step = updates[self.update - 1]
        pieces = [(return_map.piece(name), box) for name, box in bound["pieces"].items()]
        regions = [(piece, AuxiliaryRegion.of_piece(piece, box, return_map.coordinates)) for piece, box in pieces]
        orbit = auxiliary_orbit(
            return_map, AuxiliaryRegion("A1", step.box, step.envelopes), regions, bound["start"], self.n_returns
        )
        full = FullAuxiliaryMap(return_map, step.box[None], tuple(pieces))
        target = forward_invariant_box(full, step.box, n_cells=self.n_cells)
        goal = target if target.forward_invariant else None
        how: Any = {"depth": self.depth, "n_cells": self.n_cells, "of": OF, "progress": plan.parallel.progress}
        times = exit_times(full, return_map, bound["window"], **how, target=goal)
        return {"auxiliary_map": orbit, "auxiliary_exits": times}

    def describe(self, study: "Study") -> str:
        where = ", ".join([f"A_1^({self.update}) of the domain {self.domain}", *self.pieces])
        return f"in {where}; {self.n_cells} cells an axis, halved {self.depth} times"

    def size(self, study: "Study", system: "System") -> Size:
        return cover_size(self.n_cells, len(system.coordinates), self.depth)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        orbit = result.auxiliary_map
        exits = row_numbers(result.auxiliary_exits)
        boxes = {region.name: [finite(side) for side in region.box] for region in orbit.regions}
        return {"auxiliary_map": {"boxes": boxes, "ends": [finite(state) for state in orbit.states[-2:]], "exit_times": exits}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """Whether all regions but that of A_1 are left, as is shown by enclosure."""
        times, orbit = result.auxiliary_exits, result.auxiliary_map
        own = result.composite.pieces[int(result.composite.piece_of(orbit.regions[0].box.mean(axis=1)[None])[0])].name
        rows = [row for row in times.rows[:-1] if row.region != own]
        left, stay = [row for row in rows if not row.stays], [row for row in rows if row.stays]
        parts = [f"{100 * (1 - row.left):.3g} % of {row.region}" for row in stay]
        texts = [f"not shown for {' and '.join(parts)}"] if stay else []
        if left:
            steps = max(row.left_steps or 0 for row in left)
            texts.append(f"every state of {', '.join(row.region for row in left)} leaves its region within {steps} returns")
        if times.arrived is not None:
            texts.append(f"{100 * times.rows[-1].arrives:.3g} % of the window is shown to arrive in A_1")
        yield verdict("auxiliary map: other regions are left", OF, not stay, f"{'; '.join(texts)} (enclosed)")

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of the window that is shown to arrive in A_1."""
        yield exits_finding(result.auxiliary_exits, OF, result.auxiliary_exits.rows[-1])

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The shares of each region that are left, and that arrive in A_1."""
        yield exits_table("Exit times under the full auxiliary map, by enclosure", result.auxiliary_exits)
