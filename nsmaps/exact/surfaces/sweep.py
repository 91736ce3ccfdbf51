"""Return surfaces of families over a grid, and over values of a parameter: step i of the general algorithm."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from nsmaps.arrays import ArrayLike
from nsmaps.errors.arguments import checked
from nsmaps.exact.returns import Returns, arrays_of
from nsmaps.exact.surfaces.family import ReturnFamily, members
from nsmaps.exact.surfaces.surface import Grid, Surface, check_axes
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import SERIAL, Arrays, Parallel, divides
from nsmaps.results import units_of


@checked
def surfaces(system: System, grid: Grid, families: Sequence[ReturnFamily]) -> dict[str, Surface]:
    """The return surfaces of all families over one grid, from one batch of returns.

    Raises:
        NsmapsError: the grid's axes are not the system's coordinates, in their order.
    """
    check_axes(grid, system.coordinates)
    return surfaces_among(system, system.first_return(grid.states()), grid, families)


def surfaces_among(system: System, returns: Returns, grid: Grid, families: Iterable[ReturnFamily]) -> dict[str, Surface]:
    """The surfaces of all families among the first returns of a whole grid, in its order."""
    found = {family.name: members(system, returns, family) for family in families}
    units = units_of(system)
    return {name: Surface(name, grid, member, own, units) for name, (member, own) in found.items()}


@divides
def sweep(
    system: System,
    parameter: str,
    values: ArrayLike,
    grid: Grid,
    families: Sequence[ReturnFamily],
    *,
    parallel: Parallel = SERIAL,
) -> list[tuple[float, dict[str, Surface]]]:
    """The return surfaces for each value of one parameter, in the order of the values.

    Each value is a part of `parallel`, see `nsmaps.Parallel`. Errors as `surfaces`; on Ctrl-C Interrupted, whose `result` has
    the values that are finished.
    """
    check_axes(grid, system.coordinates)
    along = [system.at(**{parameter: float(value)}) for value in np.asarray(values, float)]
    cuts = parallel.cuts(len(along))

    def surfaces_of(parts: Mapping[int, Arrays]) -> list[tuple[float, dict[str, Surface]]]:
        places = [(number, k) for number, part in parts.items() for k in range(len(part["codes"]))]
        grids = {cuts[n].start + k: {name: arrays[k] for name, arrays in parts[n].items()} for n, k in places}
        rows = [(along[k], replace(along[k].first_return(grids[k]["start"][:0]), **grids[k])) for k in sorted(grids)]
        return [(getattr(each, parameter), surfaces_among(each, returns, grid, families)) for each, returns in rows]

    return surfaces_of(dict(enumerate(parallel.run(_returns_over, [(tuple(along[cut]), grid) for cut in cuts], surfaces_of))))


def _returns_over(systems: Sequence[System], grid: Grid) -> Arrays:
    """The arrays of the first returns of a whole grid, of each system a row."""
    first, *others = (arrays_of(system.first_return(grid.states())) for system in systems)
    return {name: np.stack([array, *(arrays[name] for arrays in others)]) for name, array in first.items()}
