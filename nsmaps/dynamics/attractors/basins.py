"""Basins of attraction: the attractor of each start of a grid, the returns until it is reached, and the boundaries of basins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.continuation.bisection import bisect_change
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates, as_states
from nsmaps.dynamics.attractors.arrivals import ENDED, UNRESOLVED, Ends, follow
from nsmaps.dynamics.attractors.attractor import Attractor, find_attractors
from nsmaps.dynamics.attractors.quantifiers import Function, quantified, quantifier_array, quantifiers_of
from nsmaps.dynamics.scale import scale_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import OUTCOMES
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.surface import Grid, check_axes
from nsmaps.interrupts import Interrupted
from nsmaps.parallel import SERIAL, Arrays, Parallel, divides
from nsmaps.progress import shows
from nsmaps.results import NONE, RETURNS, Result, array, array_property, shares_text, units_of

SAMPLE = 100  #: starts of each round of the search for attractors
CHUNK = 5000  #: starts in a part
ROUNDS = 10  #: of the search for attractors among the starts that reached none
ROUND = 0.1  #: share of the work that a round is assumed to leave to later ones, for `progress`


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Basins(WithCoordinates, Result):
    """The attractors that the orbits of N starts of n coordinates reach."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.basins"

    coordinates: Coordinates
    grid: Grid | None  #: of the starts, in its order; None for other starts
    start: Floats = field(metadata=array("state coordinate", "starts; angles in radians"))
    attractors: tuple[Attractor, ...]  #: in descending order of the size of their basins, unless they were given
    label: NDArray[np.int32] = field(
        metadata=array("state", "index of the attractor; -1: none was reached; -2: the orbit ended", NONE)
    )
    arrival: NDArray[np.int32] = field(metadata=array("state", "returns until arrival, or returns computed without one", RETURNS))
    outcome: NDArray[np.int8] = field(metadata=array("state", OUTCOMES, NONE))
    stuck: NDArray[np.bool_] = field(metadata=array("state", "whether the orbit came to rest on the base wall", NONE))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name
    quantifiers: Mapping[str, Floats] = field(default_factory=dict, metadata=quantifier_array("attractor"))

    def summary(self) -> str:
        """The attractors with the shares of their basins."""
        names = [*(each.label for each in self.attractors), "none reached", "ended"]
        return f"{len(self.label)} starts: {shares_text(names, self.fractions)}"

    @array_property("kind", "shares of the starts that reach each attractor, that reach none, and that end", NONE)
    def fractions(self) -> Floats:
        """The fraction of the starts that reach each attractor, that reach none, and that end, shape (A + 2,)."""
        kinds = [*range(len(self.attractors)), UNRESOLVED, ENDED]
        with np.errstate(invalid="ignore"):
            return np.array([(self.label == kind).sum() for kind in kinds]) / np.float64(len(self.label))

    @array_property("kind", "standard errors of the shares, for random starts", NONE)
    def fraction_error(self) -> Floats:
        """The standard error of each fraction, for starts drawn at random: sqrt(f (1 - f)/N); an overestimate for a grid."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt(self.fractions * (1 - self.fractions) / len(self.label)))

    def edges(self) -> tuple[Floats, NDArray[np.int32]]:
        """Neighbours on the grid with different labels: their states (E, 2, n) and labels (E, 2).

        Starts that reached no attractor have no edges. If the grid covers a circle, its first and last angles are neighbours, and
        the second state of such an edge is on the next turn.
        """
        if self.grid is None:
            raise NsmapsError("the starts are not a grid, so they have no neighbours; expected: basins of a Grid")
        label, states = self.label.reshape(self.grid.shape), self.start.reshape(*self.grid.shape, -1)
        pairs, labels, circle = [], [], self.coordinates.angles
        for i, axis in enumerate(self.grid.axes.values()):
            if axis.points == 1:
                continue
            turn = np.zeros(len(self.coordinates))
            if circle[i] and axis.high - axis.low < 2 * np.pi <= axis.high - axis.low + 1.5 * axis.step:
                turn[i] = 2 * np.pi
            here, there = (np.moveaxis(x, i, 0) for x in (states, np.roll(states, -1, axis=i)))
            a, b = (np.moveaxis(x, i, 0) for x in (label, np.roll(label, -1, axis=i)))
            there = there.copy()
            there[-1] += turn
            differ = (a != b) & (a != UNRESOLVED) & (b != UNRESOLVED)
            differ[-1] &= turn.any()
            pairs.append(np.stack([here[differ], there[differ]], axis=1))
            labels.append(np.stack([a[differ], b[differ]], axis=1))
        return np.concatenate(pairs), np.concatenate(labels)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BasinBoundary(WithCoordinates, Result):
    """Points between basins, each found on an edge of a grid: E points of n coordinates."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.basins"

    coordinates: Coordinates
    attractors: tuple[Attractor, ...]
    points: Floats = field(metadata=array("edge coordinate", "points between basins; angles in [0, 2 pi)"))
    sides: NDArray[np.int32] = field(metadata=array("edge side", "labels of the starts on either side, as in `Basins`", NONE))
    tolerance: float  #: length of the part of the edge that contains the change of basin, as in `basin_boundary`
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{len(self.points)} points between basins of {len(self.attractors)} attractors, each to {self.tolerance:.1g}"

    def distance(self, attractor: int) -> float:
        """The least distance of the states of an attractor from the boundary points of its basin; inf without such points.

        Euclidean in the coordinates' units, angles the shorter way round. The points lie on the lines of the grid, so the true
        distance is smaller by up to about the grid's spacing.
        """
        if not 0 <= attractor < len(self.attractors):
            raise NsmapsError(f"there is no attractor {attractor}; expected: 0 to {len(self.attractors) - 1}")
        own = self.points[(self.sides == attractor).any(axis=1)]
        if not len(own):
            return float("inf")
        return float(self.attractors[attractor].tree.query(own)[0].min())


@divides
def basins(
    system: ReturnMap,
    starts: Grid | ArrayLike,
    *,
    attractors: Sequence[Attractor] | None = None,
    max_returns: int = 1000,
    tolerance: float = 1e-6,
    max_period: int = 32,
    quantifiers: Mapping[str, Function] | None = None,
    parallel: Parallel = SERIAL,
) -> Basins:
    """Which attractor each start comes to, and after how many returns.

    An orbit arrives at a periodic attractor with its first state that differs from one of the attractor's by at most `tolerance`
    in each coordinate, of an angle in radians, of others relative to the extent of the motions on the attractors (`scale_of`). It
    arrives at an attractor without period with the first of 50 successive states within its reach (`Attractor`). One that has
    arrived nowhere belongs to the cycle to which it comes nearer and nearer in the second half of its returns, if there is one,
    as beside a period doubling; its `arrival` is then the number of returns computed. Unless they are given, attractors are found
    from a sample of the starts, then from samples of the starts that reached none, until there is no new one: an attractor whose
    basin contains no start is not found.

    Args:
        starts: a Grid over the map's coordinates, or states of shape (N, n), phases in radians.
        attractors: the only ones considered, such as those of another call.
        max_returns: largest number computed for an orbit, and the length of the transient when attractors are searched for.
        max_period: longest period tested, in returns.
        quantifiers: functions by name, each of the states of an attractor, shape (K, n), one period or a sample of a motion
            without a period, and of the map; each returns a number, or an array of one shape for all attractors.
        parallel: see `nsmaps.Parallel`; a part is 5000 starts of a round. Attractors are searched for in this process.

    Raises:
        StateError, NsmapsError: the starts do not have the map's coordinates, another argument is not valid, or a quantifier
            raises or returns something else.
        Interrupted: Ctrl-C; in `result` the other starts have reached none, in as many returns as `arrival` states. None if no
            attractor was found.
    """
    if max_returns < 1 or max_period < 1 or not tolerance > 0:
        text = f"{max_returns} returns, max_period {max_period}, tolerance {tolerance}"
        raise NsmapsError(f"{text}; expected: at least 1 return, max_period at least 1, a tolerance above 0")
    coordinates = Coordinates(ReturnMap.require(system, "basins").coordinates)
    if isinstance(starts, Grid):
        check_axes(starts, coordinates)
    named = quantifiers_of(quantifiers, Basins)
    grid, states = (starts, starts.states()) if isinstance(starts, Grid) else (None, starts)
    start = as_states(states, coordinates)
    known, ends = list(attractors or ()), follow(system, start, (), 0)

    def result() -> Basins:
        order = np.argsort([-(ends.label == k).sum() for k in range(len(known) if attractors is None else 0)], kind="stable")
        renamed = np.append(np.argsort(order), [ENDED, UNRESOLVED])[ends.label].astype(np.int32)
        found, label = (known, ends.label) if attractors is not None else ([known[k] for k in order], renamed)
        values = quantified(named, (len(found),), (((k,), each.states, system) for k, each in enumerate(found)))
        return Basins(coordinates, grid, start, tuple(found), label, *ends[1:], units_of(system), values)

    try:
        if attractors:
            _arrive(system, start, np.arange(len(start)), known, max_returns, parallel.share(0.0, 1.0, "given"), ends)
        else:
            _search(system, start, known, (max_returns, tolerance, max_period), parallel, ends)
    except KeyboardInterrupt as stopped:
        raise Interrupted.of(stopped, result() if known else None) from None
    return result()


def _search(
    return_map: ReturnMap, start: Floats, known: list[Attractor], how: tuple[int, float, int], parallel: Parallel, ends: Ends
) -> None:
    """Add attractors to those known, from samples of the starts that reached none, and write which starts reach them."""
    for number in range(ROUNDS):
        open_ = np.flatnonzero(ends.label == UNRESOLVED)
        sample = start[open_[np.unique(np.linspace(0, len(open_) - 1, min(SAMPLE, len(open_))).astype(int))]]
        found = find_attractors(return_map, sample, *how, known)
        if not found and known:
            break
        known += found
        portion = parallel.share(1 - ROUND**number, 1 - ROUND ** (number + 1), f"round-{number}")
        _arrive(return_map, start, open_, known, how[0], portion, ends)
        if not found:
            break


def _arrive(
    return_map: ReturnMap,
    start: Floats,
    which: Ints,
    attractors: Sequence[Attractor],
    returns: int,
    parallel: Parallel,
    ends: Ends,
) -> None:
    """Write the ends of some starts: at once, or in parts that are computed by an executor or stored in a folder.

    After Ctrl-C those that are known then are written.
    """
    cuts = parallel.cuts(len(which), CHUNK)

    def gathered(parts: Mapping[int, Arrays]) -> Ends:
        some = ends.of(which)
        for k, part in parts.items():
            some.write(cuts[k], Ends(**part))
        return some

    try:
        if parallel.divided and attractors and cuts:
            parts = [(return_map, start[which[cut]], tuple(attractors), returns) for cut in cuts]
            found = gathered(dict(enumerate(parallel.run(_followed, parts, gathered))))
        else:
            found = follow(return_map, start[which], attractors, returns, parallel.progress)
    except Interrupted as stopped:
        ends.write(which, stopped.result or ())
        raise
    ends.write(which, found)


def _followed(return_map: ReturnMap, start: Floats, attractors: Sequence[Attractor], returns: int) -> Arrays:
    """The arrays of `follow` by name."""
    return follow(return_map, start, attractors, returns)._asdict()


@shows
def basin_boundary(system: ReturnMap, basins: Basins, *, max_returns: int = 1000, tolerance: float = 1e-6) -> BasinBoundary:
    """Points between basins, by bisection along the edges of their grid.

    On an edge that crosses several basins one change of basin is found, where the basin of its first end ends or begins.

    Args:
        tolerance: length to which each edge is bisected in every coordinate, of an angle in radians, of others relative to their
            extent on the edges and the motions from them; at least the rounding error.
        max_returns: as in `basins`.

    Raises:
        NsmapsError: the tolerance is not positive, or the starts are not a grid.
    """
    if not tolerance > 0:
        raise NsmapsError(f"the tolerance is {tolerance}; expected: a positive length")
    ends, sides = basins.edges()
    tolerance, scale = max(tolerance, 4 * float(np.spacing(TWO_PI))), scale_of(system, ends)

    def label(states: Floats) -> NDArray[np.int32]:
        return follow(system, states, basins.attractors, max_returns)[0]

    low, high, beyond = bisect_change(label, ends[:, 0], ends[:, 1], sides[:, 0], sides[:, 1], tolerance * scale)
    middle = basins.coordinates.wrap((low + high) / 2)
    sides = np.column_stack([sides[:, 0], beyond])
    return BasinBoundary(basins.coordinates, basins.attractors, middle, sides, tolerance, basins.units)
