"""The general algorithm (section 4.1, steps 0 to vii): from a system and a tolerance to a composite map."""

from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.surface import Grid, check_axes
from nsmaps.progress import Progress, working
from nsmaps.reduced.partition.result import PartitionResult
from nsmaps.reduced.partition.spec import Partition

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System
    from nsmaps.reduced.adaptive.accurate import AccurateResult


@checked
def partition(
    system: "System", grid: Grid, spec: Partition, *, progress: Progress | None = None
) -> "PartitionResult | AccurateResult":
    """The map of a system over a grid's box that meets a tolerance: in closed form with a log of its construction, or accurate.

    Closed forms have any number of coordinates, by curves and polynomials in all of them; samples of a cell have 2^(n - 2)
    times as many states as in the plane. The accurate kind is for two coordinates.

    The partition takes user-defined regions, fits and families: see `Partition`.

    Args:
        progress: called with the fraction of `max_pieces` that is made, or of the known leaves that is done; at the end with 1.

    Raises:
        NsmapsError: the grid's axes are not the system's coordinates, or these are not two for the accurate kind.
    """
    from nsmaps.reduced.adaptive.accurate import accurate
    from nsmaps.reduced.partition.finalize import finalize
    from nsmaps.reduced.partition.refine import Refinement

    check_axes(grid, ReturnMap.require(system, "a partition").coordinates)
    if spec.kind == "accurate" and len(system.coordinates) != 2:
        given = system.coordinates
        raise NsmapsError(f"the system has the coordinates {given}; expected: two, as the accurate kind divides a plane")
    for fit in spec.orders.values():
        for name in system.coordinates:
            fit.exponents(system.coordinates, name)  # which refuses names that are not coordinates
    with working("partition", progress) as work:
        if spec.kind == "accurate":
            return accurate(system, grid, spec.tolerance, progress=work.reached)
        return finalize(system, grid, spec, Refinement(system, grid, spec).run())
