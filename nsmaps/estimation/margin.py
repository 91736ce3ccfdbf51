"""How far the motion of a record is from the boundary of its basin, at the estimate and at draws of the parameters: sampled."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.continuation.bisection import bisect_change
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.basins import Basins, basins
from nsmaps.dynamics.scale import scale_of
from nsmaps.errors import NsmapsError
from nsmaps.estimation.result import Estimate
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.progress import beat, shows
from nsmaps.results import NONE, Result, array

LOOKS = 16  #: states that are looked at along a direction, before bisection
RETURNS = 500  #: within which an attractor must be reached
WIDTH = 1e-5  #: of the unit of each coordinate: to which a boundary is bisected


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BasinDistance(WithCoordinates, Result):
    """Distances of a motion from the boundary of its basin in D directions, and the least of them at N draws; all sampled."""

    picture: ClassVar[str] = "nsmaps.figures.estimation.margin"

    coordinates: Coordinates
    label: str  #: of the motion at the estimate, such as 1:1/T
    state: Floats = field(metadata=array("coordinate", "of the motion, from which distances count"))
    reach: float  #: farthest distance that was looked at
    unit: Floats = field(metadata=array("coordinate", "of distances: the extent of the motion, a radian of an angle", NONE))
    directions: Floats = field(metadata=array("direction coordinate", "of length 1 in these units", NONE))
    distances: Floats = field(
        metadata=array("direction", "to the boundary in these units; infinite without one within reach", NONE)
    )
    points: Floats = field(metadata=array("direction coordinate", "on the boundary, NaN without one"))
    draws: Floats = field(metadata=array("draw parameter", "parameters", NONE))
    labels: np.ndarray = field(metadata=array("draw", "the motion on which the record ends", NONE))
    least: Floats = field(metadata=array("draw", "the least distance over all directions; NaN of another motion", NONE))

    @property
    def share(self) -> tuple[float, float]:
        """The share of the draws with which the record ends on this motion, and its standard error."""
        count, share = len(self.labels), float(np.mean(self.labels == self.label)) if len(self.labels) else float("nan")
        return share, float(np.sqrt(share * (1 - share) / count)) if count else float("nan")

    def summary(self) -> str:
        """The numbers that matter."""
        share, error = self.share
        least = float(self.distances.min())
        nearest = f"boundary of its basin {f'at {least:.3g}' if np.isfinite(least) else f'beyond {self.reach:.3g}'} of its extent"
        text = f"{self.label}: {nearest} in {len(self.distances)} directions"
        known = self.least[np.isfinite(self.least)]
        if len(known):
            text += f"; {np.quantile(known, 0.05):.3g} to {np.quantile(known, 0.95):.3g} in 90 % of the draws"
        return f"{text}; this motion in {100 * share:.0f} +- {100 * error:.0f} % of {len(self.labels)} draws; sampled"


@shows
def basin_distance(
    system: FlowSystem,
    estimate: Estimate,
    *,
    record: int = 0,
    directions: ArrayLike | None = None,
    n_directions: int = 16,
    reach: float = 1.0,
    n_draws: int = 16,
    rng: int | np.random.Generator = 0,
) -> BasinDistance:
    """The distance of the motion on which a record ends from the boundary of its basin, at the estimate and at draws.

    Along each direction states at `LOOKS` distances are followed, and the first change of what they end on is bisected. A basin
    may be left and entered between two of them, and the boundary is nearer than the least distance in other directions, so that
    this is an upper bound on the radius of the ball that the basin holds (M. S. Soliman, J. M. T. Thompson, J. Sound Vib. 135
    (1989) 453).

    Args:
        system: that of the estimate.
        estimate: of `nsmaps.estimate`.
        record: number of the record.
        directions: changes of the coordinates, shape (D, c); random ones if omitted.
        n_directions: number of random ones.
        reach: farthest distance, in units of the extent of the motion, a radian of an angle.
        n_draws: of the parameters, by the covariance of the estimate.
        rng: random numbers.

    Raises:
        NsmapsError: the record ends on no attractor, a direction is zero, or an argument is out of range.
    """
    if not reach > 0 or n_draws < 0:
        raise NsmapsError(f"reach {reach}, n_draws {n_draws}; expected: a distance above zero, and at least 0 draws")
    random = np.random.default_rng(rng)
    state, best = estimate.last_state(record), system.at(**estimate.parameters)
    own = _motion(best, state)
    if own is None:
        raise NsmapsError(f"the motion of record {record} reaches no attractor in {RETURNS} returns; expected: another")
    coordinates, unit = Coordinates(best.coordinates), scale_of(best, own.states)
    ways = unit_directions(directions, n_directions, unit, random)
    distances = _distances(best, own, ways * unit, reach)
    draws, found = estimate.draws(n_draws, random), list[tuple[str, float]]()
    for k, row in enumerate(draws):
        there = system.at(**dict(zip(estimate.names, row.tolist(), strict=True)))
        found.append(_least_distance(there, state, str(own.label), ways * unit, reach))
        beat((k + 1) / len(draws))
    points = own.states[0] + np.where(np.isfinite(distances), distances, np.nan)[:, None] * ways * unit
    return BasinDistance(
        coordinates,
        str(own.label),
        own.states[0],
        reach,
        unit,
        ways,
        distances,
        coordinates.wrap(points),
        draws,
        np.array([label for label, _ in found], str),
        np.array([least for _, least in found], float),
    )


def _least_distance(system: FlowSystem, state: Floats, label: str, steps: Floats, reach: float) -> tuple[str, float]:
    """The motion that a state ends on, and the least distance from its boundary; NaN of another motion than that of a label."""
    motion = _motion(system, state)
    if motion is None or str(motion.label) != label:
        return ("none" if motion is None else str(motion.label)), np.nan
    return label, float(_distances(system, motion, steps, reach).min())


def unit_directions(directions: ArrayLike | None, count: int, unit: Floats, random: np.random.Generator) -> Floats:
    """Directions of length 1 in these units, shape (D, c): those given as changes of the coordinates, or so many random ones.

    NsmapsError for another shape, and for a direction that is zero.
    """
    size = len(unit)
    given = random.standard_normal((count, size)) if directions is None else np.asarray(directions, float)
    if given.ndim != 2 or given.shape[1] != size or not len(given) or not given.any(axis=1).all():
        raise NsmapsError(f"directions have shape {given.shape}; expected: (D, {size}), none of them zero")
    given = given if directions is None else given / unit
    return np.asarray(given / np.linalg.norm(given, axis=1, keepdims=True))


def _motion(system: FlowSystem, state: Floats) -> Attractor | None:
    """The attractor that a state reaches."""
    found = basins(system, state[None], max_returns=RETURNS).attractors
    return found[0] if found else None


def _distances(system: FlowSystem, own: Attractor, steps: Floats, reach: float) -> Floats:
    """The distances (D,) at which the basin ends along steps (D, c) of length 1; infinite where it does not within reach."""
    origin, coordinates = own.states[0], Coordinates(system.coordinates)

    def reached(distance: Floats, which: Ints) -> Basins:
        states = coordinates.wrap(origin + distance[:, None] * steps[which])
        return basins(system, states, attractors=[own], max_returns=RETURNS)

    def inside(found: Basins) -> Bools:
        return np.asarray(found.label == 0)

    grid, all_ = reach * np.arange(1, LOOKS + 1) / LOOKS, np.arange(len(steps))
    seen = reached(np.tile(grid, len(steps)), np.repeat(all_, LOOKS))
    out = ~inside(seen).reshape(-1, LOOKS)
    no_start = (seen.outcome == Outcome.invalid).reshape(-1, LOOKS)  # such as a negative impact speed: no boundary of a basin
    first = np.argmax(out, axis=1)
    ends = np.flatnonzero(out.any(axis=1) & ~no_start[all_, first])
    found = np.full(len(steps), np.inf)
    if len(ends):
        low, high = np.append(0.0, grid)[first[ends]], grid[first[ends]]
        yes, no = np.ones(len(ends), bool), np.zeros(len(ends), bool)
        low, high, _ = bisect_change(lambda middle: inside(reached(middle, ends)), low, high, yes, no, WIDTH)
        found[ends] = (low + high) / 2
    return found
