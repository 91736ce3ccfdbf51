"""The section `proof`: a proof to be searched for by `nsmaps prove`; a run of the study skips it."""

from typing import TYPE_CHECKING, ClassVar

from pydantic import BaseModel, Field

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.reading.values import SPEC, Bounds
from nsmaps.study.sections.base import Analysis

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Study


class CycleStart(BaseModel):
    """A state near a cycle that is to be proved to exist."""

    model_config = SPEC
    start: dict[str, Number]
    period: int = Field(1, ge=1)  #: in returns


class ClosedSet(BaseModel):
    """A closed set of cells around the attractor of an orbit; see `nsmaps.proof.closed.Around` and `nsmaps.proof.maps.prove`."""

    model_config = SPEC
    depth: int = Field(4, ge=0, le=12)  #: how often its cells are divided
    skip: int = Field(2000, ge=0)  #: impacts of the orbit, until it is on the attractor; returns of a map by formulas
    sample: int = Field(1_000_000, ge=1)  #: after them, whose cells the closed set is compared with
    box: Bounds | None = None  #: of a map by formulas, that is divided into cells
    cells: int | dict[str, int] = 64  #: of a map by formulas, along each coordinate, or by coordinate
    parts: int = Field(4, ge=1, le=64)  #: of each of these cells along each coordinate, whose images are enclosed one by one


class ProofSection(Analysis):
    """A stable cycle to which orbits are to be proved to converge, or a closed set; see `nsmaps.proof.prove`."""

    key: ClassVar[str] = "proof"

    model_config = SPEC
    start: dict[str, Number]
    closed_set: ClosedSet | None = None
    period: int = Field(1, ge=1)  #: of the cycle, in returns
    top: Number | None = Field(None, gt=0)
    side: int = Field(128, ge=32)
    depth: int = Field(4, ge=0, le=12)
    cuts: int = Field(0, ge=0, le=12)
    periods: int = Field(4, ge=1)
    radii: dict[str, Number] = Field(default_factory=dict)
    cycles: list[CycleStart] = Field(default_factory=list)

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


OF_FLIGHTS = {"top", "side", "depth", "cuts", "periods", "radii"}  #: keys about cells of phase and speed
