"""The accurate variant of the general algorithm: a map of strips over a grid's box, validated at held-out states."""

from dataclasses import dataclass
from typing import ClassVar

from nsmaps.exact.surfaces.surface import Grid
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import Progress
from nsmaps.reduced.adaptive.surrogate import StripMap, Strips, strip_map
from nsmaps.reduced.adaptive.validate import HeldOut, held_out
from nsmaps.results import Result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AccurateResult(Result):
    """A map of strips with its errors at held-out states."""

    picture: ClassVar[str] = "nsmaps.figures.composite.strips"

    strips: Strips
    uniform: HeldOut  #: at states drawn uniformly over the box
    beside: HeldOut  #: at states drawn increasingly close to edges, down to 1e-11 radians

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{self.strips.report}; largest error held out {self.uniform.largest:.2g}, beside edges {self.beside.largest:.2g}"

    @property
    def met(self) -> bool:
        """True if no held-out state misses the tolerance or has another word."""
        return not any(errors.over or errors.wrong_words for errors in (self.uniform, self.beside))

    def map(self, system: System) -> StripMap:
        """The map, in which the system itself answers where the strips do not."""
        return StripMap(FlowSystem.require(system, "a map of strips"), self.strips)


def accurate(system: System, grid: Grid, tolerance: float, *, progress: Progress | None = None) -> AccurateResult:
    """The map of strips of a system over a grid's box; `progress` as in `strip_map`.

    Raises:
        StateError, FitError: as `strip_map`.
    """
    strips = strip_map(system, {name: (axis.low, axis.high) for name, axis in grid.axes.items()}, tolerance, progress=progress)
    return AccurateResult(strips.strips, *held_out(strips))
