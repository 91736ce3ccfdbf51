"""The section `proof`: a proof to be searched for by `nsmaps prove`; a run of the study skips it."""

from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.reading.values import Bounds, Period, Section
from nsmaps.study.sections.base import Analysis

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Study


class CycleStart(Section):
    """A state near a cycle that is to be proved to exist."""

    start: dict[str, Number] = Field(description="a state near the cycle")
    period: Period = 1


class ClosedSet(Section):
    """A closed set of cells around the attractor of an orbit; see `nsmaps.proof.closed.Around` and `nsmaps.proof.maps.prove`."""

    depth: int = Field(4, ge=0, le=12, description="how often cells around the attractor are divided into four")
    transient: int = Field(
        2000, ge=0, description="impacts (returns of a map by formulas) of the orbit from `start` before it is on the attractor"
    )
    n_samples: int = Field(
        1_000_000, ge=1, description="impacts or returns after those, whose cells are counted beside those of the closed set"
    )
    box: Bounds | None = Field(
        None, description="states that are divided into cells, of an angle the whole circle; required for maps by formulas"
    )
    n_cells: int | dict[str, int] = Field(64, description="of a map by formulas: cells along each coordinate")
    n_parts: int = Field(
        4,
        ge=1,
        le=64,
        description="of a map by formulas: a power of two, the parts of each cell along each coordinate, enclosed one by one",
    )


class ProofSection(Analysis):
    """A proof of convergence to a stable cycle, or of arrival in a closed set, for `nsmaps prove`; a run skips it."""

    key: ClassVar[str] = "proof"

    start: dict[str, Number] = Field(
        description="a state near the stable cycle; with `closed_set` one whose orbit comes to the attractor"
    )
    closed_set: ClosedSet | None = Field(
        None, description="prove arrival in a closed set of cells in place of convergence to a cycle"
    )
    period: Period = 1
    top: Number | None = Field(
        None, gt=0, description="impact speed up to which states are considered, on each wall; required for systems with impacts"
    )
    side: int = Field(128, ge=32, description="a power of two: cells along phases and along speeds before any is divided")
    depth: int = Field(4, ge=0, le=12, description="how often cells that are left are divided into four")
    n_cuts: int = Field(
        0, ge=0, le=12, description="how often those still left are cut into two strips along the stable sets of saddles"
    )
    max_periods: int = Field(4, ge=1, description="periods of the forcing, the duration up to which flights are followed")
    radii: dict[str, Number] = Field(
        default_factory=dict,
        description="radii of parameters on which walls alone depend, linearly: the proof is for all values within",
    )
    cycles: list[CycleStart] = Field(default_factory=list, description="cycles that are to be proved to exist, stable or not")

    def bind(self, binding: "Binding") -> Floats:
        """The start, shape (n,)."""
        check_proof(binding, "proof")
        by_formulas = isinstance(binding.system, PiecewiseMap)
        if by_formulas and (given := sorted(OF_FLIGHTS & self.model_fields_set)):
            text = f"{given[0]!r} is of proofs about flights between impacts; expected: `closed_set` with a box, or cycles"
            raise binding.study.source.error(("proof", given[0]), text)
        if not by_formulas and self.top is None:
            raise binding.study.source.error(("proof",), "no 'top'; expected: the impact speed up to which states are considered")
        if self.closed_set is not None and by_formulas == (self.closed_set.box is None):
            text = (
                "a map by formulas needs the 'box' that is divided into cells"
                if by_formulas
                else "a 'box' is of maps by formulas"
            )
            raise binding.study.source.error(("proof", "closed_set"), f"{text}; expected: {'one' if by_formulas else 'none'}")
        if self.closed_set is not None and self.closed_set.box is not None:
            binding.box(("proof", "closed_set", "box"), self.closed_set.box)
        for i, cycle in enumerate(self.cycles):
            binding.start(("proof", "cycles", i, "start"), cycle.start)
        return binding.start(("proof", "start"), self.start)

    def describe(self, study: "Study") -> str:
        if self.top is not None:
            return f"by nsmaps prove: {self.side << self.depth} cells along speeds up to {self.top:g} and phases"
        return f"by nsmaps prove: {'a closed set of cells' if self.closed_set else 'a cycle'}"


def check_proof(binding: "Binding", key: str) -> None:
    """Raise StudyError at the key of a section unless proofs may be made of the system's class."""
    from nsmaps.proof.formula import provable

    try:
        provable(binding.system)
    except ProofError as error:
        raise binding.study.source.error((key,), str(error)) from None


OF_FLIGHTS = {"top", "side", "depth", "n_cuts", "max_periods", "radii"}  #: keys about cells of phase and speed
