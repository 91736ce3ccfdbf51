"""The section `proof`: a proof to be searched for by `nsmaps prove`; a run of the study skips it."""

from typing import TYPE_CHECKING

from pydantic import BaseModel, Field

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.reading.values import SPEC
from nsmaps.study.sections.base import Section

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Study


class CycleStart(BaseModel):
    """A state near a cycle that is to be proved to exist."""

    model_config = SPEC
    start: dict[str, Number]
    period: int = Field(1, ge=1)  #: in returns


class ClosedSet(BaseModel):
    """A closed set of cells around the attractor of an orbit; see `nsmaps.proof.closed.Around`."""

    model_config = SPEC
    depth: int = Field(4, ge=0, le=12)  #: how often its cells are divided
    skip: int = Field(2000, ge=0)  #: impacts of the orbit, until it is on the attractor
    sample: int = Field(1_000_000, ge=1)  #: after them, whose cells the closed set is compared with


class ProofSection(BaseModel):
    """A stable cycle to which orbits are to be proved to converge, or a closed set; see `nsmaps.proof.prove`."""

    model_config = SPEC
    start: dict[str, Number]
    closed_set: ClosedSet | None = None
    period: int = Field(1, ge=1)  #: of the cycle, in returns
    top: Number = Field(gt=0)
    side: int = Field(128, ge=32)
    depth: int = Field(4, ge=0, le=12)
    cuts: int = Field(0, ge=0, le=12)
    periods: int = Field(4, ge=1)
    radii: dict[str, Number] = {}
    cycles: list[CycleStart] = []


def check_proof(binding: "Binding", key: str) -> None:
    """Raise StudyError at the key of a section unless proofs may be made of the system's class."""
    from nsmaps.proof.formula import provable

    try:
        provable(binding.system)
    except ProofError as error:
        raise binding.study.source.error((key,), str(error)) from None


def _bind(spec: ProofSection, binding: "Binding") -> Floats:
    """The start, shape (n,)."""
    check_proof(binding, "proof")
    for i, cycle in enumerate(spec.cycles):
        binding.start(("proof", "cycles", i, "start"), cycle.start)
    return binding.start(("proof", "start"), spec.start)


def _describe(spec: ProofSection, study: "Study") -> str:
    return f"by nsmaps prove: {spec.side << spec.depth} cells along speeds up to {spec.top:g} and phases"


PROOF = Section[ProofSection](key="proof", type=ProofSection | None, bind=_bind, describe=_describe)
