"""Basins of attraction: where each start of a grid ends up, after how many returns, and what lies between the basins."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.continuation.bisection import bisect_change
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates, as_states
from nsmaps.dynamics.attractors.attractor import Attractor, find_attractors
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.surfaces.surface import Grid, check_axes
from nsmaps.parallel import SERIAL, Arrays, Jobs, concatenated, divides
from nsmaps.progress import Progress, shows

UNRESOLVED, ENDED = -1, -2
SAMPLE = 100  #: starts that are followed to find attractors, at a time
CHUNK = 5000  #: starts in a part
ROUNDS = 10  #: of looking for attractors among the starts that came to none
ROUND = 0.1  #: what a round is assumed to leave to those after it, as `progress` reports it


class Ends(NamedTuple):
    """Where the orbits of some starts end up, as of `Basins`."""

    label: NDArray[np.int32]
    arrival: NDArray[np.int32]
    outcome: NDArray[np.int8]
    stuck: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Basins(WithCoordinates):
    """Where the orbits of N starts of n coordinates end up."""

    __repr__ = brief

    coordinates: Coordinates
    grid: Grid | None  #: whose states the starts are, in its order
    start: Floats  #: shape (N, n)
    attractors: tuple[Attractor, ...]  #: the one that most starts come to first, unless they were given
    label: NDArray[np.int32]  #: shape (N,), number of the attractor; -1: came to none in time; -2: the orbit ended
    arrival: NDArray[np.int32]  #: shape (N,), returns to arrive; where it did not, returns that were made
    outcome: NDArray[np.int8]  #: shape (N,), values of `Outcome`: of the last return, or of that which ended the orbit
    stuck: NDArray[np.bool_]  #: shape (N,), whether it came to rest on the base wall on its way

    @property
    def fractions(self) -> Floats:
        """The share of the starts that come to each attractor, to none in time, and that end, shape (A + 2,); NaN of none."""
        kinds = [*range(len(self.attractors)), UNRESOLVED, ENDED]
        with np.errstate(invalid="ignore"):
            return np.array([(self.label == kind).sum() for kind in kinds]) / np.float64(len(self.label))

    @property
    def fraction_error(self) -> Floats:
        """The standard error of each fraction, as if the starts were drawn at random: sqrt(f (1 - f)/N); more than a grid's."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt(self.fractions * (1 - self.fractions) / len(self.label)))

    def edges(self) -> tuple[Floats, NDArray[np.int32]]:
        """Neighbours on the grid that come to different ends: their states (E, 2, n) and labels (E, 2).

        Starts that came to no end in time have no edges. Angles are neighbours around the circle where the grid goes round it,
        and then the second state is on the next turn.
        """
        if self.grid is None:
            raise NsmapsError("the starts are no grid and have no neighbours; expected: basins of a Grid")
        label, states = self.label.reshape(self.grid.shape), self.start.reshape(*self.grid.shape, -1)
        pairs, labels, circle = [], [], self.coordinates.angles
        for i, axis in enumerate(self.grid.axes.values()):
            if axis.points == 1:
                continue
            step, turn = (axis.high - axis.low) / (axis.points - 1), np.zeros(len(self.coordinates))
            if circle[i] and axis.high - axis.low < 2 * np.pi <= axis.high - axis.low + 1.5 * step:
                turn[i] = 2 * np.pi
            here, there = (np.moveaxis(x, i, 0) for x in (states, np.roll(states, -1, axis=i)))
            a, b = (np.moveaxis(x, i, 0) for x in (label, np.roll(label, -1, axis=i)))
            there = there.copy()
            there[-1] += turn
            apart = (a != b) & (a != UNRESOLVED) & (b != UNRESOLVED)
            apart[-1] &= turn.any()
            pairs.append(np.stack([here[apart], there[apart]], axis=1))
            labels.append(np.stack([a[apart], b[apart]], axis=1))
        return np.concatenate(pairs), np.concatenate(labels)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Boundary:
    """Points between basins, each found on an edge of a grid: E points of n coordinates."""

    __repr__ = brief

    attractors: tuple[Attractor, ...]
    points: Floats  #: shape (E, n), angles in [0, 2 pi)
    sides: NDArray[np.int32]  #: shape (E, 2), labels of the starts on either side, as of `Basins`
    tolerance: float  #: length of the piece of the edge that holds the change of basin, as of `boundary`

    def distance(self, attractor: int) -> float:
        """The least distance of the states of an attractor from the points at its basin's boundary; inf without such points.

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
    map: ReturnMap,
    grid: Grid | ArrayLike,
    attractors: Sequence[Attractor] | None = None,
    returns: int = 1000,
    tolerance: float = 1e-6,
    longest: int = 32,
    *,
    jobs: Jobs = SERIAL,
) -> Basins:
    """Which attractor each start comes to, and after how many returns.

    An orbit has arrived with the first state within `tolerance` of each coordinate of a state of a periodic attractor, in radians
    of an angle, else as a share of its largest magnitude among the starts and states that attractors are found from, or at the
    first of 50 successive states within the reach of one without period (`Attractor`). Unless they are given, attractors are
    found by following some starts, and again some of those that came to none, until none is new: one whose basin falls between
    the starts is not found.

    Args:
        grid: a Grid over the map's coordinates, or states of shape (N, n), phases in radians.
        attractors: the only ones that count, such as those of another run.
        returns: made before an orbit that has not arrived is given up, and to let go of transients when attractors are found.
        longest: period, in returns, of an attractor that is told from one without period.
        jobs: see `nsmaps.Jobs`; parts are 5000 starts, in each round of looking for attractors, which are found in this process.

    Raises:
        StateError, NsmapsError: the grid has not the map's coordinates; other arguments that are not accepted.
    """
    if returns < 1 or longest < 1 or not tolerance > 0:
        raise NsmapsError(f"{returns} returns, period up to {longest}, tolerance {tolerance}; expected: 1 or more, above 0")
    coordinates = Coordinates(map.coordinates)
    if isinstance(grid, Grid):
        check_axes(grid, coordinates)
    start = as_states(grid.states() if isinstance(grid, Grid) else grid, coordinates)
    known = list(attractors or ())
    given = jobs.share(0.0, 1.0, "given") if known else SERIAL
    label, arrival, outcome, stuck = _ends(map, start, known, returns if known else 0, given)
    for number in range(0 if attractors else ROUNDS):
        rest = np.flatnonzero(label == UNRESOLVED)
        sample = start[rest[np.unique(np.linspace(0, len(rest) - 1, min(SAMPLE, len(rest))).astype(int))]]
        found = find_attractors(map, sample, returns, tolerance, longest, known)
        if not found and known:
            break
        known += found
        round = jobs.share(1 - ROUND**number, 1 - ROUND ** (number + 1), f"round-{number}")
        label[rest], arrival[rest], outcome[rest], stuck[rest] = _ends(map, start[rest], known, returns, round)
        if not found:
            break
    if attractors is None:
        order = np.argsort([-(label == k).sum() for k in range(len(known))], kind="stable")
        known, label = [known[k] for k in order], np.append(np.argsort(order), [ENDED, UNRESOLVED])[label].astype(np.int32)
    over = grid if isinstance(grid, Grid) else None
    return Basins(coordinates, over, start, tuple(known), label, arrival, outcome, stuck)


def _ends(map: ReturnMap, start: Floats, attractors: Sequence[Attractor], returns: int, jobs: Jobs) -> Ends:
    """What `follow` finds: at once, or in parts in an executor or kept in a folder."""
    if not jobs.divided or not attractors:
        return follow(map, start, attractors, returns, jobs.progress)
    parts = [(map, start[cut], tuple(attractors), returns) for cut in jobs.cuts(len(start), CHUNK)]
    return Ends(**concatenated(jobs.run(_followed, parts))) if parts else follow(map, start, attractors, returns)


def _followed(map: ReturnMap, start: Floats, attractors: Sequence[Attractor], returns: int) -> Arrays:
    """What `follow` finds, by name."""
    return follow(map, start, attractors, returns)._asdict()


def follow(
    map: ReturnMap,
    start: Floats,
    attractors: Sequence[Attractor],
    returns: int,
    progress: Progress | None = None,
) -> Ends:
    """Label, arrival, outcome and stuck of each start, shape (N, n), as of `Basins`."""
    n = len(start)
    label, arrival = np.full(n, UNRESOLVED, np.int32), np.zeros(n, np.int32)
    outcome, stuck = np.full(n, Outcome.returned, np.int8), np.zeros(n, bool)
    streak, going, states = np.zeros((len(attractors), n), np.int32), np.arange(n), Coordinates(map.coordinates).wrap(start)
    for k in range(returns + 1):
        ended = ~np.isfinite(states).all(axis=1)
        label[going[ended]] = ENDED
        outcome[going[ended & (outcome[going] == Outcome.returned)]] = Outcome.invalid
        for number, attractor in enumerate(attractors):
            near = attractor.near(states)
            streak[number, going] = np.where(near, streak[number, going] + 1, 0)
            there = going[(streak[number, going] >= attractor.stay) & (label[going] == UNRESOLVED)]
            label[there], arrival[there] = number, k - attractor.stay + 1
        open_ = label[going] == UNRESOLVED
        going, states = going[open_], states[open_]
        if progress is not None:
            progress(max(k / max(returns, 1), 1 - len(going) / max(n, 1)))
        if not len(going) or k == returns:
            break
        made = map.first_return(states)
        outcome[going], arrival[going], states = made.outcome, k + made.valid, made.image
        stuck[going] |= made.outcome == Outcome.stuck
    return Ends(label, arrival, outcome, stuck)


@shows
def boundary(map: ReturnMap, made: Basins, tolerance: float = 1e-6, returns: int = 1000) -> Boundary:
    """Points between basins, by bisection along the edges of their grid.

    An edge that crosses several basins gives the end of that in which it begins, or where it first meets one such end.

    Args:
        tolerance: length to which each edge is halved in every coordinate, in radians of an angle, else as a share of its largest
            magnitude on the edges; or to rounding if that is more.
        returns: as of `basins`, for the states that are tried.
    """
    if not tolerance > 0:
        raise NsmapsError(f"the tolerance is {tolerance}; a positive length is accepted")
    ends, sides = made.edges()
    tolerance, scale = max(tolerance, 4 * float(np.spacing(TWO_PI))), made.coordinates.magnitudes(ends)

    def label(states: Floats) -> NDArray[np.int32]:
        return follow(map, states, made.attractors, returns)[0]

    low, high, beyond = bisect_change(label, ends[:, 0], ends[:, 1], sides[:, 0], sides[:, 1], tolerance * scale)
    middle = made.coordinates.wrap((low + high) / 2)
    return Boundary(made.attractors, middle, np.column_stack([sides[:, 0], beyond]), tolerance)
