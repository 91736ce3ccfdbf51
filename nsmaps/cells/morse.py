"""Outer covers of the maximal invariant set of a map in a window, their recurrent components, and forward invariant sets."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints, Storable
from nsmaps.cells.grid import Cells, Targets, painted, targets_of
from nsmaps.cells.transition_graph import graph_of, invariant, order_of, recurrent
from nsmaps.coordinates import BoxLike, Coordinates
from nsmaps.enclosures.box_images import Boxed, box_map, name_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxMap
from nsmaps.interrupts import Interrupted
from nsmaps.progress import Progress, beat, shows
from nsmaps.results import NONE, Result, array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

MOST_CELLS = 4_000_000  #: of one level


@dataclass(frozen=True, slots=True)
class Level(Storable):
    """What one level of a subdivision cost and left."""

    shape: tuple[int, ...]  #: cells an axis
    cells: int  #: whose images were enclosed
    kept: int  #: that walks without end pass
    arcs: int
    components: int
    images_time: float  #: seconds
    graph_time: float  #: seconds


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MorseCover(Result):
    """Cells that contain all complete orbits in a window, and their recurrent components.

    Every periodic orbit, every chain-recurrent state of the map in the window lies in a cell of a component, and orbits pass
    from a component to another only as `edges` says. A component need not hold such an orbit: a cover excludes, it does
    not find.
    """

    picture: ClassVar[str] = "nsmaps.figures.cells.morse_sets"

    of: str  #: the map for which this holds, such as "exact map"
    cells: Cells  #: of the last level
    numbers: Ints = field(metadata=array("cell", "numbers of the cells kept", NONE))
    component: Ints = field(
        metadata=array("cell", "number of the component, the largest is 0; -1 of cells between components", NONE)
    )
    edges: Ints = field(metadata=array("edge ends", "from a component to another that may be reached from it", NONE))
    hulls: Floats = field(metadata=array("hull coordinate end", "hulls of the components"))
    stays: Bools = field(metadata=array("cell", "whether all images are known to be in the window", NONE))
    levels: tuple[Level, ...]
    finished: bool  #: whether the depth asked for was reached; it is not after an interruption

    def summary(self) -> str:
        """The cells kept and the components."""
        shape = " x ".join(map(str, self.cells.shape))
        return f"{len(self.numbers)} of {shape} cells in {len(self.hulls)} components, {self.of}"

    @property
    def coordinates(self) -> Coordinates:
        """Those of the cells."""
        return self.cells.coordinates

    @property
    def boxes(self) -> Floats:
        """The cells kept, shape (M, n, 2)."""
        return self.cells.boxes(self.numbers)

    @property
    def minimal(self) -> tuple[int, ...]:
        """The components from which no other may be reached: what attracts in the window is in one of them."""
        return tuple(k for k in range(len(self.hulls)) if k not in self.edges[:, 0])

    @property
    def share(self) -> float:
        """Of the window's area, that of the cells in components."""
        return float((self.component >= 0).sum() / self.cells.size)

    def contains(self, states: ArrayLike) -> Bools:
        """Which states (N, n) lie in a cell kept."""
        return np.isin(self.cells.numbers_of(states), self.numbers)


@shows
def morse_sets(
    system: Boxed,
    box: BoxLike,
    *,
    depth: int = 4,
    n_cells: int | Sequence[int] = 8,
    of: str = "",
    progress: Progress | None = None,
) -> MorseCover:
    """Cover the maximal invariant set of a map in a window by cells that are halved along every axis `depth` times.

    At each level all cells' images are enclosed in one batch, and an arc leads to every cell that they meet. Cells through
    which no infinite walk passes, forwards and backwards, contain no complete orbit in the window and are dropped. A cell whose
    images are not bounded has arcs to all cells. States that leave the window or have no image are followed no further.

    Args:
        system: an exact system, a PolyMap or a CompositeMap, or any map with `image_boxes`.
        box: a box: a mapping of names to (low, high), a `Box`, or shape (n, 2); an angle of a whole turn is a circle.
        n_cells: of the first level, an axis or each axis.
        of: name of the map in the result; see `name_of`.
        progress: called with the fraction done before each batch of images, if each level takes twice as long as the last.

    Raises:
        NsmapsError: the window, depth or number of cells is not valid; the limit of cells or arcs is exceeded.
        Interrupted: Ctrl-C after the first level; `result` is the cover by the cells of the last finished level.
    """
    if depth < 0:
        raise NsmapsError(f"the depth is {depth}; expected: at least 0")
    enclosing = box_map(system)
    stage, levels = _Stage.first(Cells.over(system.coordinates, box, n_cells)), list[Level]()
    try:
        for _ in range(depth + 1):
            stage, level = _next(enclosing, stage, len(levels), depth)
            levels.append(level)
            beat(2.0 ** (len(levels) - 1 - depth), f"level {len(levels) - 1} of {depth}, {len(stage.numbers)} cells")
    except KeyboardInterrupt as error:
        if not levels:
            raise
        raise Interrupted(_cover(stage, tuple(levels), of or name_of(system), False)) from error
    return _cover(stage, tuple(levels), of or name_of(system), True)


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """One level's cells, all of which were enclosed, with their graph."""

    cells: Cells
    numbers: Ints
    graph: "csr_matrix | None"
    component: Ints
    kept: Bools
    stays: Bools

    @classmethod
    def first(cls, cells: Cells) -> "_Stage":
        """Before the first level: all cells, and no graph."""
        every = np.ones(cells.size, bool)
        return cls(cells, np.arange(cells.size), None, np.zeros(cells.size, np.int64), every, every)


def _next(return_map: BoxMap, before: _Stage, number: int, depth: int) -> tuple[_Stage, Level]:
    cells, numbers = before.cells, before.numbers
    if before.graph is not None:
        cells, numbers = cells.halved(), cells.parts(numbers[before.kept])
    if len(numbers) > MOST_CELLS:
        raise NsmapsError(f"level {number} has {len(numbers)} cells; expected: {MOST_CELLS}; take less depth or a smaller window")
    start, images_time, stays = perf_counter(), 0.0, np.zeros(0, bool)

    def targets() -> Iterator[Targets]:
        """Those of each batch, so that too many arcs are refused before all images are enclosed."""
        nonlocal images_time, stays
        begun = perf_counter()
        for found in targets_of(return_map, cells, numbers):
            share = len(stays) / len(numbers)
            images_time, stays = images_time + perf_counter() - begun, np.append(stays, found.stays)
            whole = 2.0 ** (number - depth)
            beat(whole * (1 + share) / 2 if number else whole * share, f"level {number} of {depth}, {len(numbers)} cells")
            yield found
            begun = perf_counter()

    graph = graph_of(cells, numbers, targets())
    component = recurrent(graph)
    kept = invariant(graph, component)
    times = images_time, perf_counter() - start - images_time
    level = Level(cells.shape, len(numbers), int(kept.sum()), int(graph.nnz), int(component.max(initial=-1)) + 1, *times)
    return _Stage(cells, numbers, graph, component, kept, stays), level


def _cover(stage: _Stage, levels: tuple[Level, ...], of: str, finished: bool) -> MorseCover:
    assert stage.graph is not None
    cells, numbers, component, kept = stage.cells, stage.numbers, stage.component, stage.kept
    count = levels[-1].components
    hulls = np.array([cells.hull(numbers[component == k]) for k in range(count)]).reshape(count, len(cells.shape), 2)
    edges = order_of(stage.graph, component)
    return MorseCover(of, cells, numbers[kept], component[kept], edges, hulls, stage.stays[kept], levels, finished)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ForwardInvariantSet(Result):
    """Cells around a component that are forward invariant under the map if `forward_invariant`."""

    of: str
    cells: Cells
    numbers: Ints = field(metadata=array("cell", "numbers of the cells, ascending", NONE))
    added: int  #: cells in addition to those of the component
    forward_invariant: bool  #: True if the enclosed images of all cells lie in their union
    reason: str

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{len(self.numbers)} cells, {self.of}: {'forward invariant' if self.forward_invariant else self.reason}"

    @property
    def boxes(self) -> Floats:
        """Shape (M, n, 2)."""
        return self.cells.boxes(self.numbers)

    @property
    def hull(self) -> Floats:
        """Shape (n, 2)."""
        return self.cells.hull(self.numbers)

    def contains(self, states: ArrayLike) -> Bools:
        """Which states (N, n) lie in one of the cells."""
        return np.isin(self.cells.numbers_of(states), self.numbers)


@shows
def forward_invariant_box(system: Boxed, box: BoxLike, *, n_cells: int | Sequence[int] = 32, of: str = "") -> ForwardInvariantSet:
    """A box of states as a set of cells, such as the start box of a domain: forward invariant if every image is in it.

    Args:
        box: a box: a mapping of names to (low, high), a `Box`, or shape (n, 2).
        n_cells: into which it is divided, an axis or each axis: enclosures of smaller cells are sharper.
    """
    grid = Cells.over(system.coordinates, box, n_cells)
    out = sum(int((~found.stays).sum()) for found in targets_of(box_map(system), grid, np.arange(grid.size)))
    said = (
        f"{out} of {grid.size} cells have images that leave the box, are not bounded or may not exist"
        if out
        else "the images of all cells lie in it"
    )
    return ForwardInvariantSet(of or name_of(system), grid, np.arange(grid.size), 0, not out, f"{said}, by enclosure")


@shows
def forward_invariant_set(system: Boxed, cover: MorseCover, component: int = 0) -> ForwardInvariantSet:
    """The cells of a component, joined with all cells that their images meet until nothing is added: a forward invariant set.

    The set is not forward invariant if an image leaves the window, is not bounded, or may not exist; its cells are then those
    met so far.
    """
    if not 0 <= component < len(cover.hulls):
        known = f"from 0 to {len(cover.hulls) - 1}" if len(cover.hulls) else "another window, since the cover has no components"
        raise NsmapsError(f"component {component} of {len(cover.hulls)}; expected: {known}")
    enclosing, cells = box_map(system), cover.cells
    inside = np.zeros(cells.size, bool)
    fresh = cover.numbers[cover.component == component]
    own, reason = len(fresh), ""
    while len(fresh) and not reason:
        inside[fresh] = True
        met, seen = np.zeros(cells.size, bool), 0
        for found in targets_of(enclosing, cells, fresh):
            if not found.stays.all():
                (centre,) = cells.centres(fresh[seen + np.flatnonzero(~found.stays)[:1]]).tolist()
                place = ", ".join(f"{name} = {x:.6g}" for name, x in zip(cells.coordinates, centre, strict=True))
                reason = f"images of the cell around {place} leave the window, are not bounded or may not exist"
                break
            met, seen = met | painted(cells, found), seen + len(found.stays)
        fresh = np.flatnonzero(met & ~inside)
    numbers = np.flatnonzero(inside)
    forward_invariant = not reason
    said = f"the images of {len(numbers)} cells lie in their union, by enclosure"
    return ForwardInvariantSet(cover.of, cells, numbers, len(numbers) - own, forward_invariant, reason or said)
