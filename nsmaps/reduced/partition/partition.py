"""The general algorithm (section 4.1, steps 0 to vii): from a system with two coordinates and a tolerance to a composite map."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.progress import Progress, working
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.conditions.condition import Number

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.reduced.adaptive.accurate import AccurateResult

Role = Literal["attracting", "transient"]


class Partition(BaseModel):
    """The specification of the reduced map of a planar system; the tolerance is the only choice that must be made."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    tolerance: Number = Field(gt=0, description="largest error of an image where the map attracts, in each coordinate")
    kind: Literal["closed_form", "accurate"] = Field(
        default="closed_form", description="few pieces in closed form, or the tolerance everywhere"
    )
    max_pieces: int = Field(default=40, ge=2, description="at which refinement ends")
    max_order: int = Field(default=5, ge=0, le=20, description="highest degree in each coordinate")
    separable: bool = Field(default=True, description="true if transient pieces may be separable (remark separable)")
    everywhere: bool = Field(default=False, description="true if the tolerance applies to transient pieces too")
    delta: Number = Field(default=1.2, gt=1, description="nearness to the diagonals, eq. r1uniond")
    slope: Number = Field(default=2.0, gt=0, description="upper bound on abs(dx'_i/dx_i) near the diagonals")
    attracting: tuple[dict[str, tuple[Number, Number]], ...] = Field(
        default=(), description="attracting boxes in place of those of step iii"
    )

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        others = sorted(self.model_fields_set - {"tolerance", "kind"})
        if self.kind == "accurate" and others:
            raise ValueError(f"{', '.join(map(repr, others))}: of closed forms only; expected beside kind accurate: 'tolerance'")
        return self


@dataclass(frozen=True, slots=True)
class LogRow:
    """One region of one iteration, R_{n.m}, and the decision on it."""

    name: str  #: R n.m: region n as defined in iteration m
    role: str  #: `attracting`, `transient`, or `outside` of the grid
    word: str  #: the most frequent word of its returns; "" if none has an image
    where: str  #: the region as a condition
    share: float  #: of the grid's box
    order: str  #: the order of polynomial that was chosen
    terms: int  #: coefficients of all outputs
    r2: tuple[float, ...]  #: of each output, on the data of the fit
    sse: tuple[float, ...]
    max_error: tuple[float, ...]  #: of each output, at held-out states of any word
    missed: float  #: share of the held-out states with a larger error than demanded
    demanded: tuple[float, ...]  #: error of each output
    states: int  #: held out
    met: bool
    became: str  #: `accepted`, `split ...`, `tightened ...`, `given up ...` or `left ...`, and why


@dataclass(frozen=True, slots=True, eq=False)
class PartitionResult:
    """The composite map of the algorithm, the log of its iterations, and its remaining errors."""

    spec: Partition
    composite: CompositeMap
    log: tuple[LogRow, ...]
    attracting: tuple[str, ...]  #: names of the attracting pieces, which must be accurate
    unmet: tuple[str, ...]  #: names of the pieces that miss their demand
    max_error: float  #: largest error at held-out states in attracting pieces; NaN if there are none
    points: int  #: number of those held-out states
    covered: float  #: share of random states of the grid's box that lie in a piece
    uncovered: dict[str, float]  #: shares of those that lie in none, by the outcome of their exact return
    right_next: float  #: share of random states whose image lies in the same piece as their exact image
    arrives: tuple[float, float]  #: share of random starts whose orbits end in attracting pieces: exact, composite map

    @property
    def met(self) -> bool:
        """True if there are attracting pieces, and none of them misses the tolerance in construction or at new states."""
        return self.max_error <= self.spec.tolerance and not set(self.attracting) & set(self.unmet)

    @property
    def reason(self) -> str:
        """The result, or the reason why the tolerance is not met, as a sentence."""
        tolerance = f"tolerance {self.spec.tolerance:g}"
        if not self.attracting:
            return f"no region of the grid attracts, by the diagonals and by the ends of orbits; {tolerance}"
        missing = [name for name in self.attracting if name in self.unmet]
        short = f"; {', '.join(missing)} given up" if missing else ""
        many = f"{len(self.attracting)} attracting piece{'s' * (len(self.attracting) != 1)}"
        return f"largest error {self.max_error:.2g} at {self.points} held-out states of {many}, {tolerance}{short}"

    @property
    def attracting_map(self) -> CompositeMap:
        """The attracting pieces alone."""
        return replace(self.composite, pieces=tuple(p for p in self.composite.pieces if p.name in self.attracting))

    def table(self) -> list[LogRow]:
        """The rows of the pieces that were made."""
        return [row for row in self.log if row.became.startswith(("accepted", "given up"))]


def partition(
    system: "ImpactSystem", grid: Grid, spec: Partition, *, progress: Progress | None = None
) -> "PartitionResult | AccurateResult":
    """The map of a planar system over a grid's box that meets a tolerance: in closed form with a log of its construction, or
    accurate.

    Args:
        progress: called with the fraction of `max_pieces` that is made, or of the known leaves that is done; at the end with 1.

    Raises:
        NsmapsError: the grid's axes are not the system's coordinates, or these are not two: the algorithm divides a plane.
    """
    from nsmaps.reduced.adaptive.accurate import accurate
    from nsmaps.reduced.partition.finalize import finalize
    from nsmaps.reduced.partition.refine import Refinement

    if tuple(grid.axes) != system.coordinates:
        raise NsmapsError(f"the grid has axes {', '.join(grid.axes)}; expected: {', '.join(system.coordinates)}, in this order")
    if len(system.coordinates) != 2:
        names = ", ".join(system.coordinates)
        raise NsmapsError(f"the system has the coordinates {names}; expected: two, since the algorithm divides a plane by curves")
    with working("partition", progress) as work:
        if spec.kind == "accurate":
            return accurate(system, grid, spec.tolerance, progress=work.reached)
        return finalize(system, grid, spec, Refinement(system, grid, spec).run())
