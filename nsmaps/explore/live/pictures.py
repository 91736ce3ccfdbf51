"""What is drawn, as arrays: the density of a diagram, the words or basins of a plane, an orbit with what is known of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.arrivals import ENDED, UNRESOLVED
from nsmaps.dynamics.attractors.basins import basins
from nsmaps.dynamics.attractors.limit_set import LimitSet, limit_set
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.dynamics.orbit import Orbit, orbit
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.search import periodic_orbits
from nsmaps.errors import NsmapsError
from nsmaps.exact.events import ModeTrack
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.trajectory import track
from nsmaps.explore.live.scene import Scene
from nsmaps.parallel import Parallel
from nsmaps.progress import Progress

Way = Literal["up", "down"] | None
MOST = 9  #: areas of a plane that have a colour of their own; the last of them is of all others
RETURNS, DISCARDED = 300, 500  #: of an orbit, and before those of a diagram
FOLLOWED = 5120  #: returns of a slow orbit of the plane: as many as `limits` follows one before it says what it ends on
_TRACKED, _SHOWN = 12, 61  #: impacts or events of the motion that is drawn, states of the orbit of a map
_PERIODS = (1, 2, 3, 4)  #: in returns, of the cycles that are searched for
_GUESSES = 5  #: along either coordinate of the plane, from which they are searched for


@dataclass(frozen=True, slots=True, eq=False)
class Diagram:
    """A bifurcation diagram as counts of states in cells, rows from the lowest up."""

    counts: NDArray[np.int64]  #: shape (rows, columns)
    states: BifurcationDiagram

    @property
    def shade(self) -> Floats:
        """The logarithm of the counts of each column relative to its largest, in [0, 1], NaN where nothing is."""
        with np.errstate(divide="ignore", invalid="ignore"):
            largest = np.log1p(self.counts.max(axis=0, keepdims=True))
            return np.where(self.counts > 0, np.log1p(self.counts) / largest, np.nan)


def diagram(scene: Scene, columns: int, rows: int, progress: Progress | None = None, direction: Way = None) -> Diagram:
    """The attractors from the scene's start at as many values as there are columns, each in the middle of its column.

    With a direction attractors are followed through ascending or descending values, each from the last state before.
    """
    (low, high), (bottom, top) = scene.values, scene.heights
    half = (high - low) / columns / 2
    values = np.linspace(low + half, high - half, columns)
    found = bifurcation_diagram(
        scene.system,
        scene.parameter,
        values,
        scene.start,
        n_returns=RETURNS,
        transient=DISCARDED,
        direction=direction,
        parallel=Parallel(progress=progress),
    )
    heights = found.states[:, 0, :, list(scene.coordinates).index(scene.coordinate)]
    place = np.floor((heights - bottom) / (top - bottom) * rows)
    column, inside = np.broadcast_to(np.arange(columns)[:, None], place.shape), (place >= 0) & (place < rows)
    counts = np.zeros((rows, columns), np.int64)
    np.add.at(counts, (place[inside].astype(np.int64), column[inside]), 1)
    return Diagram(counts, found)


def nearest(shown: Diagram, scene: Scene, value: float, height: float) -> Floats:
    """The state of a diagram that is nearest to a point of it, shape (n,); the scene's start where its column is empty."""
    column = int(np.abs(shown.states.values - value).argmin())
    states = shown.states.states[column, 0]
    far = np.abs(states[:, list(scene.coordinates).index(scene.coordinate)] - height)
    return states[np.nanargmin(far)] if np.isfinite(far).any() else scene.start


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """The plane of states in areas, each cell with the number of its area, rows from the lowest up."""

    kind: str  #: what the areas are of
    of_words: bool  #: whether their names are words of returns
    areas: NDArray[np.int64]  #: shape (rows, columns), numbers of `names`
    names: tuple[str, ...]


def words(scene: Scene, points: int, progress: Progress | None = None) -> Plane:
    """The plane by the word of the first return, or by its outcome where there is no word."""
    returns = scene.system.first_return(scene.grid(points).states())
    ends = [Outcome(number).name for number in returns.outcome.tolist()]
    text = np.where(returns.words == "", ends, returns.words)
    return _areas("First returns by word", True, text.tolist(), points)


def reached(scene: Scene, points: int, progress: Progress | None = None) -> Plane:
    """The plane by the attractor that is reached: states that reach none in some hundred returns are followed further."""
    states = scene.grid(points).states()
    found = basins(scene.system, states, max_returns=RETURNS, parallel=Parallel(progress=progress))
    label, attractors, slow = found.label.copy(), found.attractors, np.flatnonzero(found.label == UNRESOLVED)
    if len(slow):
        more = basins(scene.system, states[slow], attractors=attractors or None, max_returns=FOLLOWED)
        label[slow], attractors = more.label, more.attractors
    names = {k: f"{one.label} ({k + 1})" for k, one in enumerate(attractors)}
    names |= {UNRESOLVED: f"none reached in {FOLLOWED} returns", ENDED: "ended"}
    return _areas("Attractors that are reached", False, [names[k] for k in label.tolist()], points)


def _areas(kind: str, of_words: bool, names: Sequence[str], points: int) -> Plane:
    """Names of the states of a grid, whose last coordinate varies fastest, as numbers in the order of their frequency."""
    kinds, number, count = np.unique(np.asarray(names), return_inverse=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    rank = np.minimum(np.argsort(order), MOST - 1)
    shown = [str(kinds[k]) for k in order[: MOST - 1]]
    if len(kinds) >= MOST:
        shown.append(str(kinds[order[-1]]) if len(kinds) == MOST else f"{len(kinds) - MOST + 1} more")
    return Plane(kind, of_words, rank[number].reshape(points, points).T, tuple(shown))


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The orbit of a start with its limit set, and the motion through its first impacts or events, of maps its first returns."""

    orbit: Orbit
    ends: LimitSet | None  #: None if the orbit ended
    time: Floats | None = None  #: shape (k,), NaN between flights, or numbers of returns; None if there is no motion
    curves: Mapping[str, Floats] = field(default_factory=dict)  #: by name, each of shape (k,)

    @property
    def text(self) -> str:
        """What the orbit ends on, with its multipliers or exponent."""
        if self.ends is None:
            returns = int(np.isfinite(self.orbit.states).all(axis=1).sum()) - 1
            return f"The orbit ended after {returns} returns: {Outcome(int(self.orbit.outcome[-1])).advice}"
        return f"The orbit ends on: {self.ends.text}"


def followed(scene: Scene) -> Followed:
    """The orbit of the start of a scene, and the motion through its first impacts or events, or its first returns."""
    found = orbit(scene.system, scene.start, RETURNS)
    ends = limit_set(scene.system, found)
    if not isinstance(scene.system, FlowSystem):
        first = found.states[:_SHOWN]
        return Followed(found, ends, np.arange(float(len(first))), dict(zip(scene.coordinates, first.T, strict=True)))
    try:
        motion = track(scene.system, scene.start, _TRACKED)
    except NsmapsError:
        return Followed(found, ends)
    if isinstance(motion, ModeTrack):
        curves = dict(zip(motion.names, np.moveaxis(motion.states, -1, 0), strict=True))
    else:
        curves = {"ball": motion.ball, **dict(zip(motion.impacts.walls, motion.walls, strict=True))}
    parted = {name: np.append(line, np.full((len(line), 1), np.nan), axis=1).ravel() for name, line in curves.items()}
    time = np.append(motion.time, np.full((len(motion.time), 1), np.nan), axis=1).ravel()
    return Followed(found, ends, time, parted)


Cycles = tuple[PeriodicOrbit, ...]


def cycles(scene: Scene) -> Cycles:
    """The periodic orbits of short periods, stable or not, that Newton's method finds from points of the plane."""
    starts = scene.grid(_GUESSES).states()
    return tuple(one for period in _PERIODS for one in periodic_orbits(scene.system, starts, period))


def by_stability(found: Cycles, n: int) -> dict[str, Floats]:
    """The states of cycles in n coordinates, stable and unstable ones separated, each of shape (k, n)."""
    none = [np.zeros((0, n))]
    return {
        kind: np.concatenate(none + [one.states for one in found if one.stable is stable])
        for kind, stable in (("stable", True), ("unstable", False))
    }


def cycle_text(one: PeriodicOrbit) -> str:
    """A cycle on one line: its motion, stability, first state and multipliers."""
    state = ", ".join(f"{name} = {value:.6g}" for name, value in zip(one.returns.coordinates, one.states[0], strict=True))
    multipliers = ", ".join(f"{value.real:.4g}" + (f"{value.imag:+.4g}i" if value.imag else "") for value in one.multipliers)
    return f"{one.label}, {'stable' if one.stable else 'unstable'}, at {state}; multipliers {multipliers}"
