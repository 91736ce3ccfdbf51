"""Exit times of regions and arrival times in a closed set, in returns, bounded by box images."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.cells.grid import Cells, Targets, counted, joined, targets_of
from nsmaps.cells.morse import MOST_CELLS, ForwardInvariantSet
from nsmaps.coordinates import BoxLike
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.enclosures.box_images import Boxed, box_map, name_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages, BoxMap
from nsmaps.progress import Progress, beat, shows
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.conditions.region import Region
from nsmaps.results import NONE, RETURNS, Result, array

COARSE = "no cell lies wholly in the closed set: smaller cells are needed to show that anything arrives"
HEADS = "region", "area", "left", "within", "stays", "arrives", "within", "periodic"  #: of the texts of a row
NEVER = -1  #: steps of a cell where no number is shown


@dataclass(frozen=True, slots=True)
class TransientRow:
    """The results for one region; shares are of its area."""

    region: str
    area: float  #: share of the window
    left: float  #: is left within `left_steps` returns, whatever the state
    left_steps: int | None  #: None if no cell is
    stays: int  #: cells of which that is not shown
    arrives: float  #: is in the target after `arrives_steps` returns at the latest; NaN without a target
    arrives_steps: int | None  #: None if no cell is
    periodic: int  #: periodic points found in cells of which it is not shown that they are left
    points: tuple[tuple[float, ...], ...]  #: these points

    def texts(self) -> tuple[str, ...]:
        """The fields of the row as text, in order; a dash where there is no value."""
        left, arrives = (f"{share:.2%}" if share == share else "-" for share in (self.left, self.arrives))
        returns = ["-" if steps is None else f"{steps}" for steps in (self.left_steps, self.arrives_steps)]
        area, stays, periodic = f"{self.area:.2%}", f"{self.stays} cells", f"{self.periodic} points"
        return self.region, area, left, returns[0], stays, arrives, returns[1], periodic


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ExitTimes(Result):
    """The number of returns after which all states of each cell of a window have left its region, or are in a closed set."""

    picture: ClassVar[str] = "nsmaps.figures.cells.exit_times"

    of: str  #: the map for which this holds
    cells: Cells
    regions: tuple[str, ...]
    region: Ints = field(metadata=array("cell", "number of the region of the centre; -1: outside of all", NONE))
    left: Ints = field(metadata=array("cell", "returns after which every state has left the region once; -1: not shown", RETURNS))
    arrived: Ints | None = field(
        metadata=array("cell", "returns after which every state is in the target, and stays; -1: not shown", RETURNS)
    )
    cycles: tuple[PeriodicOrbit, ...]  #: some known ones

    def summary(self) -> str:
        """The numbers that matter."""
        inside = self.region >= 0
        left = float((self.left[inside] >= 0).mean()) if inside.any() else 0.0
        return (
            f"{int(inside.sum())} cells in {', '.join(self.regions)}; {100 * left:.4g} % are left by all orbits of the {self.of}"
        )

    @property
    def points(self) -> Floats:
        """The states of the known cycles, shape (P, n)."""
        return np.concatenate([np.empty((0, len(self.cells.shape))), *(cycle.states for cycle in self.cycles)])

    @property
    def boxes(self) -> Floats:
        """The cells of regions of which it is not shown that they are left, shape (M, n, 2)."""
        return self.cells.boxes(np.flatnonzero((self.region >= 0) & (self.left == NEVER)))

    @property
    def rows(self) -> tuple[TransientRow, ...]:
        """One row a region, and one of all together."""
        names = dict(enumerate(self.regions))
        masks = [(name, self.region == k) for k, name in names.items()]
        return tuple(self._row(name, mask) for name, mask in [*masks, ("all", self.region >= 0)] if mask.any())

    def _row(self, name: str, mask: Bools) -> TransientRow:
        stays = mask & (self.left == NEVER)
        arrived = np.full(mask.sum(), NEVER) if self.arrived is None else self.arrived[mask]
        numbers = self.cells.numbers_of(self.points)
        points = self.points[(numbers >= 0) & stays[numbers]]
        return TransientRow(
            region=name,
            area=float(mask.mean()),
            left=1 - float(stays.sum() / mask.sum()),
            left_steps=_largest(self.left[mask]),
            stays=int(stays.sum()),
            arrives=float("nan") if self.arrived is None else float((arrived >= 0).mean()),
            arrives_steps=_largest(arrived),
            periodic=len(points),
            points=tuple(map(tuple, points.tolist())),
        )

    def table(self) -> str:
        """The rows as text, and below them the periodic points found in cells that stay."""
        lines = [row.texts() for row in self.rows]
        widths = [max(map(len, column)) for column in zip(HEADS, *lines, strict=True)]
        text = [
            "  ".join(
                cell.rjust(width) if k else cell.ljust(width) for k, (cell, width) in enumerate(zip(line, widths, strict=True))
            )
            for line in (HEADS, *lines)
        ]
        return "\n".join([*text, *self.notes()])

    def notes(self) -> list[str]:
        """The periodic points found in cells that stay, and what the cells are too coarse for."""
        held = [f"stays in {row.region}: periodic point ({_listed(point)})" for row in self.rows[:-1] for point in row.points]
        none = self.arrived is not None and not (self.arrived == 0).any()
        return [*held, *([COARSE] if none else [])]


def _largest(steps: Ints) -> int | None:
    largest = int(steps.max())
    return None if largest == NEVER else largest


def _listed(point: tuple[float, ...]) -> str:
    return ", ".join(f"{x:.12f}" for x in point)


@shows
def exit_times(
    system: Boxed,
    regions: CompositeMap | Mapping[str, Region],
    box: BoxLike,
    *,
    depth: int = 3,
    n_cells: int | Sequence[int] = 32,
    target: ForwardInvariantSet | None = None,
    cycles: Sequence[PeriodicOrbit] = (),
    of: str = "",
    progress: Progress | None = None,
) -> ExitTimes:
    """Exit times of the cells of each region and their arrival times in a target, in returns, for all states, by box images.

    A region is here the union of the cells, of the last level, whose centre lies in it, and in no region before it. A cell is
    left within k returns if each of its states has an image outside of the region among the first k; it may come back later.
    A cell has arrived within k returns if the k-th image of each state lies in the target, and so all later ones. Where an
    image does not exist (rests) or is not known, nothing is shown. Cells of which either is not shown yet are halved.

    What is not shown need not be false: cells that stay contain all invariant sets (saddles and their stable sets) and what the
    enclosure does not separate from them.

    Args:
        system: the one that all this is true of: an exact system, a PolyMap or a CompositeMap, or any map with `image_boxes`.
        regions: the pieces of a composite map, or regions by name; of those that hold a state the first counts.
        box: a box: a mapping of names to (low, high), a `Box`, or shape (n, 2).
        depth, n_cells: as for `morse_sets`.
        target: a closed set of cells of the same map, `forward_invariant`, from `forward_invariant_set`.
        cycles: known cycles, whose states the table lists by region.
        progress: called after each level with the fraction that is done, if each takes twice as long as the last.
    """
    if depth < 0 or (target is not None and not target.forward_invariant):
        wrong = f"the depth is {depth}" if depth < 0 else f"the target is not closed under the map ({target and target.reason})"
        raise NsmapsError(f"{wrong}; expected: a depth of at least 0, and a target that is forward invariant")
    grids = [Cells.over(system.coordinates, box, n_cells)]
    for _ in range(depth):
        grids.append(grids[-1].halved())
    finest = grids[-1]
    if finest.size > 4 * MOST_CELLS:
        raise NsmapsError(f"{finest.size} cells at the last level; expected: {4 * MOST_CELLS}; take less depth or fewer cells")
    names, region = _regions(finest, regions)
    goals = [region != k for k in range(len(names))]
    if target is not None:
        goals.append(_cells_inside(finest, target))
    steps = _solved(box_map(system), grids, goals, [k < len(names) for k in range(len(goals))])
    left = np.full(finest.size, NEVER)
    for k in range(len(names)):
        left[region == k] = steps[k][region == k]
    arrived = None if target is None else steps[-1]
    return ExitTimes(of or name_of(system), finest, names, region, left, arrived, tuple(cycles))


def _regions(cells: Cells, regions: CompositeMap | Mapping[str, Region]) -> tuple[tuple[str, ...], Ints]:
    """The names of the regions, and the number of that of each cell's centre."""
    centres = cells.centres(np.arange(cells.size))
    if isinstance(regions, CompositeMap):
        return tuple(piece.name for piece in regions.pieces), regions.piece_of(centres)
    holds = [region.over(cells.coordinates).contains(centres) for region in regions.values()]
    return tuple(regions), np.select(holds, np.arange(len(holds)).tolist(), NEVER).astype(np.int64)


def _cells_inside(cells: Cells, target: ForwardInvariantSet) -> Bools:
    """Which cells lie wholly in the target."""
    boxes, every = cells.boxes(np.arange(cells.size)), np.ones(cells.size, bool)
    met = target.cells.targets(BoxImages(np.arange(cells.size), boxes, np.full(cells.size, ""), every, ~every))
    outside = np.ones(target.cells.size, bool)
    outside[target.numbers] = False
    return met.stays & ~_blocked(target.cells, outside, met)


def _blocked(cells: Cells, mask: Bools, found: Targets) -> Bools:
    """Which sources have an image that may lie in a cell of the mask."""
    meets = counted(cells, mask, found) > 0
    return np.bincount(found.source[meets], minlength=len(found.stays)) > 0


def _solved(return_map: BoxMap, grids: Sequence[Cells], goals: Sequence[Bools], outside: Sequence[bool]) -> NDArray[np.int64]:
    """After how many returns every state of each cell has been in each goal, shape (goals, size); -1 where not shown.

    Args:
        goals: cells of the last grid.
        outside: of each goal, whether what is out of the window is in it.
    """
    steps = np.full((len(goals), grids[0].size), NEVER)
    for level, cells in enumerate(grids):
        if level:
            steps = np.stack([_refined(row, grids[level - 1].shape) for row in steps])
        for row, goal in zip(steps, goals, strict=True):
            row[_coarse(goal, grids[-1].shape, cells.shape)] = 0
        numbers = np.flatnonzero((steps == NEVER).any(axis=0))
        if len(numbers):
            found = joined(list(targets_of(return_map, cells, numbers)))
            for row, beyond in zip(steps, outside, strict=True):
                _layers(cells, row, numbers, found, found.exists if beyond else found.stays)
        beat(2.0 ** (level + 1 - len(grids)), f"level {level} of {len(grids) - 1}")
    return steps


def _layers(cells: Cells, steps: Ints, numbers: Ints, found: Targets, sure: Bools) -> None:
    """Write into `steps`, which is of all cells, of how many returns the goal is for cells of some numbers, from 1 on."""
    waits, step = sure & (steps[numbers] == NEVER), 1
    while waits.any() and step <= steps.max() + 1:
        found = found.of(waits)
        arrives = waits & ~_blocked(cells, (steps == NEVER) | (steps >= step), found)
        steps[numbers[arrives]] = step
        waits &= ~arrives
        step += 1


def _refined(steps: Ints, shape: tuple[int, ...]) -> Ints:
    """The properties of cells, inherited by their halves."""
    steps = steps.reshape(shape)
    for k in range(len(shape)):
        steps = steps.repeat(2, axis=k)
    return steps.ravel()


def _coarse(mask: Bools, shape: tuple[int, ...], coarser: tuple[int, ...]) -> Bools:
    """Of which coarser cells all parts are in the mask."""
    pairs = zip(coarser, shape, strict=True)
    split = mask.reshape([size for few, many in pairs for size in (few, many // few)])
    return split.all(axis=tuple(range(1, split.ndim, 2))).ravel()
