"""All cycles up to a period that a systematic search finds: cells that cannot be excluded, then Newton's method from them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.cells.closed_walks import on_closed_walks
from nsmaps.cells.grid import Cells, targets_of
from nsmaps.cells.morse import MOST_CELLS
from nsmaps.cells.pseudo_orbits import spliced
from nsmaps.cells.transition_graph import graph_of, recurrent
from nsmaps.coordinates import BoxLike, Coordinates
from nsmaps.dynamics.periodic import SAME, PeriodicOrbit, least_period, periodic_orbit
from nsmaps.enclosures.box_images import box_map, name_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.progress import Progress, beat, shows
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.results import NONE, Result, array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

MOST_WALKED = 20_000  #: cells among which closed walks are distinguished by their length
TRIES = 32  #: closed walks of each length from each cell, at random
MOST_STEPS = 30  #: of Newton's method
RESIDUAL = 1e-10  #: of cycles, of the sides of the window or in radians


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CycleSearch(Result):
    """The cycles found in a window, and the cells in which there may be more: all others hold no point of a cycle."""

    of: str
    period: int  #: the longest asked for
    cells: Cells
    numbers: Ints = field(metadata=array("cell", "numbers of the cells that cannot be excluded", NONE))
    may: Bools = field(metadata=array("cell period", "which periods they may hold, from 1 on", NONE))
    known: Bools = field(metadata=array("cell", "does a point found lie in the cell or next to it", NONE))
    cycles: tuple[PeriodicOrbit, ...]  #: by least period, then by state; converged, existing, in the window
    starts: int  #: of Newton's method

    def summary(self) -> str:
        """The numbers that matter."""
        periods = [each.period for each in self.cycles]
        listed = ", ".join(f"{periods.count(period)} of period {period}" for period in dict.fromkeys(periods)) or "no cycle"
        return f"cycles of the {self.of} up to period {self.period}: {listed}; {len(self.numbers)} cells not excluded"

    @property
    def boxes(self) -> Floats:
        """The cells that cannot be excluded, shape (M, n, 2)."""
        return self.cells.boxes(self.numbers)

    @property
    def coverage(self) -> str:
        """What the search covers, as a sentence."""
        held, open_ = len(self.numbers), int((~self.known).sum())
        return (
            f"{self.of}: no state of a cycle up to period {self.period} lies in the window outside of {held} of its "
            f"{self.cells.size} cells ({held / self.cells.size:.2g} of its area), by enclosure; {held - open_} of these hold "
            f"or adjoin a point of the {len(self.cycles)} cycles found, {open_} do not. "
            "That a cell holds one cycle only is not shown."
        )

    def table(self) -> str:
        """The cycles as text: period, the first state, multipliers, words."""
        lines = []
        for cycle in self.cycles:
            state = " ".join(f"{x:.12f}" for x in cycle.states[0])
            multipliers = ", ".join(f"{m.real:.5g}{f'{m.imag:+.5g}i' if m.imag else ''}" for m in cycle.multipliers)
            kind = {True: "stable", False: "unstable", None: "of unknown stability"}[cycle.stable]
            lines.append(f"{len(cycle.states)}  {state}  ({multipliers})  {kind}  {' '.join(cycle.words)}")
        return "\n".join(lines)


@shows
def find_cycles(
    system: ReturnMap | PolyMap,
    box: BoxLike,
    *,
    max_period: int = 1,
    depth: int = 6,
    n_cells: int | Sequence[int] = 8,
    of: str = "",
    progress: Progress | None = None,
) -> CycleSearch:
    """Search a window for all cycles up to a period: exclude cells by their images, then Newton's method from the others.

    A cell may hold a state of a cycle of period p only if a closed walk of p arcs passes it. Those that may are halved along
    every axis `depth` times. From the last ones closed walks of cells are the guesses of Newton's method in all states at once,
    then splices of the cycles found, until these lead to no other. Cycles that pass through states without image or out of
    the window are not looked for.

    Args:
        system: an exact system, a composite map or a PolyMap: with `first_return` with derivatives and `image_boxes`.
        box: a box: a mapping of names to (low, high), a `Box`, or shape (n, 2); angles on any turn.
        max_period: the longest period, in returns, at least 1; cycles of every period up to it are sought.
        depth: how many times the cells that cannot be excluded are halved along every axis, at least 0; more exclude more.
        n_cells: at first along each axis, one number or one for each.
        of: name of the map in the result; see `name_of`.
        progress: called after each level with the fraction that is done, if each takes twice as long as the last.

    Returns:
        The `cycles` found (converged `PeriodicOrbit`s, by least period, then by state), the cells that cannot be excluded
        (`boxes`, shape (M, n, 2); `may`, which periods each may hold; `known`, whether a point found lies in or next to it), and
        `coverage`, a sentence that says what the search covers. That no state of a cycle lies outside of these cells is enclosed;
        the cycles themselves are found by Newton's method to rounding, and are not enclosed.

    Raises:
        NsmapsError: the period, depth, window or number of cells is not valid; the limit of cells is exceeded.
    """
    if max_period < 1 or depth < 0:
        raise NsmapsError(f"max_period is {max_period} and depth is {depth}; expected: at least 1 and 0")
    of, boxed = of or name_of(system), box_map(system)
    returning = ReturnMap.require(boxed, "cycles")
    grid = Cells.over(system.coordinates, box, n_cells)
    numbers = np.arange(grid.size)
    may, walks = np.ones((grid.size, max_period), bool), tuple[Ints, ...]()
    for level in range(depth + 1):
        if level:
            grid, numbers = grid.halved(), grid.parts(numbers)
        if len(numbers) > MOST_CELLS:
            raise NsmapsError(f"level {level} has {len(numbers)} cells; expected: {MOST_CELLS}; take less depth")
        graph = graph_of(grid, numbers, targets_of(boxed, grid, numbers))
        numbers, may, walks = _not_excluded(graph, numbers, max_period, TRIES * (level == depth))
        beat(2.0 ** (level - depth), f"level {level} of {depth}, {len(numbers)} cells")
    guesses = [grid.centres(numbers[walk.ravel()]).reshape(*walk.shape, len(grid.shape)) for walk in walks]
    cycles, starts = _cycles(returning, grid, guesses, max_period)
    known = _beside(grid, numbers, np.concatenate([np.empty((0, len(grid.shape))), *(cycle.states for cycle in cycles)]))
    return CycleSearch(of, max_period, grid, numbers, may, known, cycles, starts)


def _not_excluded(graph: "csr_matrix", numbers: Ints, period: int, tries: int) -> tuple[Ints, Bools, tuple[Ints, ...]]:
    """The numbers on closed walks, of which lengths each, and walks of each length; of recurrent ones all, if they are many."""
    again = np.flatnonzero(recurrent(graph) >= 0)
    if len(again) > MOST_WALKED:
        return numbers[again], np.ones((len(again), period), bool), ()
    nodes = np.append(again, len(numbers))
    may, walks = on_closed_walks(graph[nodes][:, nodes], period, tries)
    kept = may.any(axis=1)
    place = np.cumsum(kept) - 1
    return numbers[again[kept]], may[kept], tuple(place[walk] for walk in walks)


def _cycles(return_map: ReturnMap, cells: Cells, guesses: Sequence[Floats], period: int) -> tuple[tuple[PeriodicOrbit, ...], int]:
    """The cycles to which Newton's method comes from guesses of shape (W, p, n), then from splices; and how many guesses."""
    found, starts = list[PeriodicOrbit](), 0
    while guesses:
        before, starts = len(found), starts + sum(len(guess) for guess in guesses)
        for guess in guesses:
            _add(return_map, cells, guess, found)
        points, sides = [cycle.states for cycle in found], np.ptp(cells.box, axis=1)
        guesses = spliced(return_map, np.concatenate(points), sides, period) if len(found) > before else []
    return tuple(sorted(found, key=lambda cycle: (len(cycle.states), *cycle.states[0]))), starts


def _add(return_map: ReturnMap, cells: Cells, guess: Floats, found: list[PeriodicOrbit]) -> None:
    """Add to the cycles found those to which Newton's method comes from guesses of shape (W, p, n), each once."""
    points = np.concatenate([np.empty((0, len(cells.shape))), *(cycle.states for cycle in found)])
    scale = np.where(cells.coordinates.angles, 1.0, np.ptp(cells.box, axis=1))
    solutions = _newton(return_map, guess, scale)
    _, firsts = np.unique(np.rint(solutions / scale / SAME), axis=0, return_index=True)
    for states in solutions[firsts]:
        states = states[: least_period(states, cells.coordinates, scale)]
        if cells.coordinates.near(points, states[0], SAME, scale).any() or (cells.numbers_of(states) < 0).any():
            continue
        cycle = periodic_orbit(return_map, states, len(states), tolerance=RESIDUAL, scale=scale)
        if cycle.converged and cycle.exists:
            found.append(cycle)
            points = np.concatenate([points, cycle.states])


def _newton(return_map: ReturnMap, x: Floats, scale: Floats) -> Floats:
    """The cycles, shape (C, p, n), to which full Newton steps in all states at once come from guesses (W, p, n)."""
    coordinates, done, (p, n) = Coordinates(return_map.coordinates), [x[:0]], x.shape[1:]
    for _ in range(MOST_STEPS):
        if not len(x):
            break
        returns = return_map.first_return(x.reshape(-1, n), derivative=True)
        assert returns.derivative is not None
        gaps = coordinates.difference(returns.image.reshape(x.shape), np.roll(x, -1, axis=1))
        with np.errstate(invalid="ignore"):
            worst = np.abs(gaps / scale).max(axis=(1, 2), initial=0.0)
        done.append(x[worst <= RESIDUAL])
        blocks = np.zeros((len(x), p, n, p, n))
        for k in range(p):
            blocks[:, k, :, k] += returns.derivative.reshape(-1, p, n, n)[:, k]
            blocks[:, k, :, (k + 1) % p] -= np.eye(n)
        jacobian = blocks.reshape(-1, p * n, p * n)
        goes = (worst > RESIDUAL) & np.isfinite(jacobian).all(axis=(1, 2))
        goes[goes] = np.linalg.slogdet(jacobian[goes])[0] != 0
        step = np.linalg.solve(jacobian[goes], -gaps[goes].reshape(-1, p * n, 1))
        x = x[goes] + step.reshape(-1, p, n)
    return np.concatenate(done)


def _beside(cells: Cells, numbers: Ints, points: Floats) -> Bools:
    """Which cells hold one of some points or have a neighbour that does."""
    near = np.zeros(len(numbers), bool)
    boxes = cells.boxes(numbers)
    middle, reach = boxes.mean(axis=2), 1.5 * np.ptp(boxes, axis=2)
    for point in points:
        near |= cells.coordinates.near(middle, point, 1 + 1e-12, reach)
    return near
