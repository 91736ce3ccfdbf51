"""The result of the general algorithm: the composite map, the log of its construction, and its errors."""

from dataclasses import dataclass, replace
from typing import ClassVar

from nsmaps.arrays import Storable
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.partition.spec import Partition
from nsmaps.results import Result


@dataclass(frozen=True, slots=True)
class LogRow(Storable):
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PartitionResult(Result):
    """The composite map of the algorithm, the log of its iterations, and its remaining errors."""

    picture: ClassVar[str] = "nsmaps.figures.composite.partition"

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
    arrives: tuple[
        float, float
    ]  #: share of random starts whose orbits end in attracting pieces, of the exact and of the composite map
    same_end: float = float("nan")  #: share of these whose orbits end on the attractor of the exact one; NaN in runs before

    def summary(self) -> str:
        """The numbers that matter."""
        found = f"{len(self.composite.pieces)} pieces, attracting: {', '.join(self.attracting) or 'none'}"
        errors = f"largest held-out error {self.max_error:.2g}, {100 * self.covered:.4g} % covered"
        return f"{found}; {errors}; missed: {', '.join(self.unmet) or 'none'}"

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
