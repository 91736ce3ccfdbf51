"""The section `horseshoe`: chaos to be proved by `nsmaps prove`; a run of the study skips it."""

from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from nsmaps.reduced.conditions.region import Box
from nsmaps.study.reading.values import SPEC, Bounds
from nsmaps.study.sections.base import Analysis
from nsmaps.study.sections.sets.proof import check_proof

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Study


class HorseshoeSection(Analysis):
    """A window with cycles around whose saddles a horseshoe is to be proved; see `nsmaps.proof.horseshoe`."""

    key: ClassVar[str] = "horseshoe"

    model_config = SPEC
    box: Bounds
    max_period: int = Field(5, ge=1)  #: of the cycles, in returns
    n_returns: int = Field(1, ge=1)  #: after which a set covers others
    depth: int = Field(3, ge=0, le=12)
    n_cells: int = Field(16, ge=1)  #: per axis, on the first level

    def bind(self, binding: "Binding") -> Box:
        check_proof(binding, "horseshoe")
        return binding.box(("horseshoe", "box"), self.box)

    def describe(self, study: "Study") -> str:
        return f"by nsmaps prove: around the cycles of up to {self.max_period} returns"
