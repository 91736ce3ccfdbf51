"""The section `horseshoe`: chaos to be proved by `nsmaps prove`; a run of the study skips it."""

from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from nsmaps.reduced.conditions.region import Box
from nsmaps.study.reading.values import Bounds, CellsPerAxis, Depth
from nsmaps.study.sections.base import Analysis
from nsmaps.study.sections.sets.proof import check_proof

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Study


class HorseshoeSection(Analysis):
    """Chaos in a window, to be proved by `nsmaps prove`; a run skips it."""

    key: ClassVar[str] = "horseshoe"

    box: Bounds = Field(description="window in which cycles are sought")
    max_period: int = Field(5, ge=1, description="largest period, in returns, of the cycles around which the horseshoe lies")
    n_returns: int = Field(
        1, ge=1, description="after which its sets cover each other; more where one return stretches by less than about three"
    )
    depth: Depth = 3
    n_cells: CellsPerAxis = 16

    def bind(self, binding: "Binding") -> Box:
        check_proof(binding, "horseshoe")
        return binding.box(("horseshoe", "box"), self.box)

    def describe(self, study: "Study") -> str:
        return f"by nsmaps prove: around the cycles of up to {self.max_period} returns"
