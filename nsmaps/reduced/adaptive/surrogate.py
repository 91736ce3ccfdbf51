"""A planar return map to any tolerance: polynomials in strips between edges of the exact map, which itself answers elsewhere."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, Ints, brief
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, as_box, as_states
from nsmaps.errors import FitError
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.progress import Progress, Work, working
from nsmaps.reduced.adaptive.slabs import Slab, clear_phase, slabs
from nsmaps.reduced.adaptive.tree import Node, cell_area, grow, roots_of, terms
from nsmaps.results import NONE, Result, array

if TYPE_CHECKING:
    from nsmaps.exact.systems.flow import FlowSystem
    from nsmaps.exact.systems.parameters import System
    from nsmaps.reduced.adaptive.kernel import Tables

#: total degrees that are tried, by the tolerance down to which they are the best choice
DEGREES = ((3e-3, (2, 3, 4, 6)), (3e-4, (3, 4, 6, 8)), (3e-5, (4, 6, 8, 10)), (3e-7, (6, 8, 10, 14)), (0.0, (8, 10, 14, 18)))
LEAST_TOLERANCE = 1e-10
Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StripReport(Result):
    """The contents and the cost of a map of strips."""

    tolerance: float  #: for speed, and for phase in radians, at the points that decided; see `held_out` for others
    slabs: int
    cells: int
    leaves: int
    coefficients: int
    degrees: dict[int, int]  #: leaves by total degree
    exact_share: float  #: share of the box's area that is left to the exact map, to a few digits
    returns: int  #: exact returns used for the fits
    seconds: dict[str, float]  #: of construction, by part
    stopped: bool = False  #: True if `max_seconds` ended it before everything was within the tolerance

    def summary(self) -> str:
        """The numbers that matter."""
        cells = f"{self.leaves} cells in {self.slabs} slabs, {self.coefficients} coefficients"
        return f"{cells}, tolerance {self.tolerance:g}, exact on {100 * self.exact_share:.3g} %"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Strips(Result):
    """The data of a map of strips; with the exact map of its system it is a `StripMap`."""

    bounds: Floats = field(metadata=array("component end", "speeds and phases (radians) covered"))
    slabs: tuple[Slab, ...]
    report: StripReport
    words: Ints = field(metadata=array("leaf number", "the code of the word and the `Outcome` of each leaf", NONE))
    tables: "Tables" = field(metadata=array("...", "from which it is evaluated; see `Tables`"))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StripMap(ReturnMap):
    """A ReturnMap over a box of states: polynomials between the exact map's edges, and the exact map where they cannot be.

    States outside the box are `uncovered`.
    """

    __repr__ = brief

    system: "FlowSystem"
    strips: Strips

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates."""
        return self.system.coordinates

    @property
    def walls(self) -> tuple[str, ...]:
        """The letters of the walls, the base wall first."""
        return self.system.letters

    def leaf_of(self, states: ArrayLike) -> Ints:
        """The number of the leaf of each state (N, 2): -1 where the exact map answers, -2 outside the box; shape (N,)."""
        return self._evaluated(as_states(states, self.coordinates))[3]

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The first returns of states (N, 2); those in no leaf, such as next to an edge, are the exact map's own."""
        from nsmaps.reduced.adaptive.kernel import EXACT, finish
        from nsmaps.reduced.adaptive.slopes import slopes

        start = as_states(states, self.coordinates)
        n = len(start)
        phi, speed, advance, leaf = self._evaluated(start)
        image, turns, codes = np.empty((n, 2)), np.empty((n, 2), np.int32), np.empty(n, np.int64)
        outcome, time = np.empty(n, np.int8), np.empty(n)
        rate = self.system.phase_rate()
        finish(start, phi, speed, advance, leaf, self.strips.words, rate, image, turns, codes, outcome, time)
        slope = np.full((n, 2, 2), np.nan) if derivative else None
        if slope is not None:
            slopes(self.strips.tables, start[:, 0], phi, leaf, slope)
            slope[:, 1, 1] += 1
        returns = Returns(self.coordinates, self.walls, start, image, turns, codes, outcome, time, derivative=slope, fitted=True)
        exact_rows = np.flatnonzero(leaf == EXACT)
        if len(exact_rows):
            _put(returns, exact_rows, self.system.first_return(start[exact_rows], derivative=derivative))
        return returns

    def orbits(self, states: ArrayLike, n_returns: int, derivative: bool = False) -> Returns:
        """The first returns of each of M states, shape (M, 2): `n_returns` M rows, the first return of every state first."""
        returns = self._orbits(as_states(states, self.coordinates), n_returns)
        return (
            replace(returns, derivative=self.first_return(returns.start, derivative=True).derivative) if derivative else returns
        )

    def _orbits(self, start: Floats, n: int) -> Returns:
        """The first n returns in a compiled loop, interrupted only by returns that the exact map computes."""
        from nsmaps.reduced.adaptive.kernel import chain

        m, strips, rate = len(start), self.strips, self.system.phase_rate()
        states, turns = np.empty((m, n + 1, 2)), np.empty((m, n, 2), np.int32)
        codes, outcome, time = np.empty((m, n), np.int64), np.empty((m, n), np.int8), np.empty((m, n))
        states[:, 0] = start
        for k in range(m):
            own, at = (states[k], turns[k], codes[k], outcome[k], time[k]), 0
            while (at := chain(strips.tables, strips.bounds[1], strips.words, rate, at, *own)) < n:
                exact = self.system.first_return(states[k, at : at + 1])
                states[k, at + 1], turns[k, at], codes[k, at] = exact.image[0], exact.turns[0], exact.codes[0]
                outcome[k, at], time[k, at] = exact.outcome[0], exact.time[0]
                at += 1
        rows = _by_return(states[:, :-1]), _by_return(states[:, 1:]), _by_return(turns), _by_return(codes), _by_return(outcome)
        return Returns(self.coordinates, self.walls, *rows, _by_return(time), fitted=True)

    def _evaluated(self, start: Floats) -> tuple[Floats, Floats, Floats, Ints]:
        """Phases in the box's turn, speeds and advances of the phase after the return, and leaves, each (N,)."""
        from nsmaps.reduced.adaptive.kernel import evaluate, turned_into

        v, phi, speed, advance = (np.empty(len(start)) for _ in range(4))
        leaf = np.empty(len(start), np.int64)
        turned_into(self.strips.bounds[1], start, v, phi)
        evaluate(self.strips.tables, v, phi, speed, advance, leaf)
        return phi, speed, advance, leaf


def _by_return(rows: NDArray[Number]) -> NDArray[Number]:
    """Rows of n returns of each of M states, shape (M, n, ...), as (n M, ...): the first return of every state first."""
    return np.swapaxes(rows, 0, 1).reshape(-1, *rows.shape[2:])


def _put(returns: Returns, rows: Ints, given: Returns) -> None:
    """Write returns into some rows of others."""
    for name in ("image", "turns", "codes", "outcome", "time", "derivative"):
        if getattr(returns, name) is not None:
            getattr(returns, name)[rows] = getattr(given, name)


@checked
def strip_map(
    system: "System",
    box: BoxLike,
    tolerance: float,
    *,
    max_seconds: float = inf,
    progress: Progress | None = None,
) -> StripMap:
    """The map of strips of a system over a box of speeds and phases, to a tolerance.

    It takes seconds over a box with few edges, and many minutes where there are many, as over speeds so large that a flight spans
    many periods of the forcing: on a terminal a line shows how far it is.

    Args:
        box: as of `as_box`. Its speeds are above zero: at zero the ball does not leave the wall, and the map is not smooth. A
            whole turn of phases is taken as a circle, cut where that is best.
        tolerance: of the speed, and of the phase in radians, over the whole box but within 1e-11 of an edge.
        progress: called before each round of fits with the fraction of the known leaves that is done, and with 1 at the end.
        max_seconds: time after which no round begins, and after half of which no search for edges begins: the exact map answers
            on the unfinished part, whose share is `report.exact_share`; `report.stopped` is then True.

    Raises:
        StateError: an invalid box.
        FitError: speeds that are not above zero, a tolerance below rounding, or coordinates other than a speed and a phase.
    """
    from nsmaps.exact.systems.flow import FlowSystem

    system = FlowSystem.require(system, "a map of strips")
    if system.coordinates.angles.tolist() != [False, True]:
        raise FitError(f"the coordinates are {system.coordinates}; expected: an impact speed and a phase")
    speeds, phases = as_box(box, system.coordinates, whole_turn=True).tolist()
    if not LEAST_TOLERANCE <= tolerance < np.inf:
        raise FitError(f"the tolerance is {tolerance!r}; expected: at least {LEAST_TOLERANCE:g}")
    if not speeds[0] > 0:
        raise FitError(f"speeds from {speeds[0]!r} to {speeds[1]!r}; expected: all above zero")
    with working("strip map", progress, max_seconds) as work:
        return _strip_map(system, (speeds[0], speeds[1]), (phases[0], phases[1]), tolerance, work)


def _strip_map(
    system: "FlowSystem",
    speeds: tuple[float, float],
    phases: tuple[float, float],
    tolerance: float,
    work: Work,
) -> StripMap:
    from nsmaps.reduced.adaptive.layout import build_tables

    begun = perf_counter()
    if phases[1] - phases[0] >= TWO_PI * (1 - 1e-12):
        cut = clear_phase(system, speeds)
        cut -= TWO_PI * (cut > np.pi)
        phases = cut, cut + TWO_PI
    bands, found = slabs(system, speeds, phases, replace(work, max_seconds=work.max_seconds / 2))
    cut_at = perf_counter()
    box = np.array([speeds, phases], float)
    trees = roots_of(bands, box[:, 1] - box[:, 0])
    degrees = next(each for least, each in DEGREES if tolerance >= least)
    roots = [leaf for cells in trees for cell in cells for leaf in cell]
    returns, fitted = grow(system, bands, roots, tolerance, degrees, work)
    leaves = [leaf for root in roots for leaf in _ends(root)]
    report = _report(tolerance, box, bands, leaves, returns, {"edges": cut_at - begun, "fits": perf_counter() - cut_at})
    cells = [(bands[leaf.slab], leaf.cell) for leaf in leaves if leaf.degree >= 0]
    words = np.array([(band.words[cell], band.outcomes[cell]) for band, cell in cells], np.int64).reshape(-1, 2)
    report = replace(report, stopped=not (found and fitted))
    return StripMap(system, Strips(box, tuple(bands), report, words, build_tables(box, bands, trees)))


def _report(
    tolerance: float, box: Floats, bands: Sequence[Slab], leaves: Sequence[Node], returns: int, seconds: dict[str, float]
) -> StripReport:
    fitted = [leaf for leaf in leaves if leaf.degree >= 0]
    degrees = [leaf.degree for leaf in fitted]
    grown = {(leaf.slab, leaf.cell) for leaf in leaves}
    cells = [(k, cell) for k, band in enumerate(bands) for cell in range(len(band.words))]
    left = sum(cell_area(bands[k], cell) for k, cell in cells if (k, cell) not in grown)
    left += float((box[0, 1] - box[0, 0] - sum(band.high - band.low for band in bands)) * np.ptp(box[1]))
    return StripReport(
        tolerance=tolerance,
        slabs=len(bands),
        cells=len(cells),
        leaves=len(fitted),
        coefficients=sum(2 * len(terms(degree)) for degree in degrees),
        degrees={degree: degrees.count(degree) for degree in sorted(set(degrees))},
        exact_share=max(left / float(np.prod(np.ptp(box, axis=1))), 0.0) + sum(leaf.area for leaf in leaves if leaf.degree < 0),
        returns=returns,
        seconds=seconds,
    )


def _ends(leaf: Node) -> Iterator[Node]:
    """The undivided leaves under a leaf, in order."""
    if leaf.children is None:
        yield leaf
    else:
        for child in leaf.children[1:]:
            yield from _ends(child)
