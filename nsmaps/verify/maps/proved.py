"""What a certificate of a map given by formulas claims, proved: cycles, a horseshoe, a forward invariant set of cells."""

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.maps.closed import Invariant, cells_of, invariant
from nsmaps.verify.maps.cycles import Cycle, all_verified
from nsmaps.verify.maps.formula import PiecewiseFormulas, in_words, map_of
from nsmaps.verify.maps.horseshoe import Chaos, chaos_of, horseshoe_of
from nsmaps.verify.maps.horseshoe import in_words as chaos_in_words

MOST = 12  #: cycles that are listed


class VerifiedMap(NamedTuple):
    """What was proved of a certificate of a map."""

    map: PiecewiseFormulas
    cycles: tuple[Cycle, ...]  #: all different
    chaos: Chaos | None
    closed: Invariant | None
    seconds: tuple[float, float, float]  #: for cycles and horseshoe, for a trap, which there is none, and for cells


def verified_map(
    system: Mapping[str, Any],
    cycles: Sequence[Any],
    horseshoe: Mapping[str, Any],
    grid: Mapping[str, Any],
    codes: NDArray[np.uint16],
    progress: Callable[[int, int], Any],
) -> VerifiedMap:
    """What the parts of a certificate claim, proved; any exception where that fails."""
    begun = perf_counter()
    return_map = map_of(system)
    known = all_verified(return_map, cycles, progress)
    chaos = chaos_of(return_map, horseshoe_of(horseshoe, return_map), progress) if horseshoe else None
    middle = perf_counter()
    closed = invariant(return_map, cells_of(grid, return_map), codes, progress) if grid else None
    if not (known or chaos or closed):
        raise ValueError("a certificate of a map claims cycles, a horseshoe or a set of cells; expected: one of them")
    return VerifiedMap(return_map, known, chaos, closed, (middle - begun, 0.0, perf_counter() - middle))


def statement_of_map(found: VerifiedMap, system: Mapping[str, Any]) -> str:
    """The theorem in words, with the map that it is about."""
    chaos = [chaos_in_words(found.map, found.chaos)] if found.chaos else []
    return "\n".join([in_words(system), *_of_cycles(found), *chaos, *_of_cells(found)])


def _of_cycles(found: VerifiedMap) -> list[str]:
    """Cycles, the first of them one by one."""
    if not found.cycles:
        return []
    kinds = [cycle.kind for cycle in found.cycles]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("stable", "unstable", "open"))
    number = f"{len(found.cycles)} different cycles exist, each" if len(found.cycles) > 1 else "a cycle exists,"
    lines = [f"Proved: {number} the only one of its pieces within the stated radii: {counts}."]
    for cycle in found.cycles[:MOST]:
        word = "".join(found.map.letters[k] for k in cycle.pieces)
        state = ", ".join(f"{name} {x}" for name, x in zip(found.map.coordinates, cycle.states[0], strict=True))
        turns = "".join(
            f", {turn} turns of {name}"
            for name, turn, angle in zip(found.map.coordinates, cycle.turns, found.map.angles, strict=True)
            if angle
        )
        numbers = f": multipliers {', '.join(map(str, cycle.multipliers))}" if cycle.multipliers else ""
        lines.append(f"  {word}, {state}{turns}, {cycle.kind}{numbers}")
    return lines + ([f"  and {len(found.cycles) - MOST} more"] if len(found.cycles) > MOST else [])


def _of_cells(found: VerifiedMap) -> list[str]:
    """What follows of a set of cells."""
    if found.closed is None:
        return []
    cells, names = found.closed.cells, found.map.coordinates
    sides = zip(names, cells.low, cells.high, cells.counts, found.map.angles, strict=True)
    grid = " x ".join(
        f"{count} of {name} on the whole circle" if angle else f"{count} of {name} in [{low!r}, {high!r}]"
        for name, low, high, count, angle in sides
    )
    return [
        f"Proved: orbits that start in one of {found.closed.size} cells, of {grid}, never leave these cells: they are a "
        "forward invariant set, in which each state has an image."
    ]
