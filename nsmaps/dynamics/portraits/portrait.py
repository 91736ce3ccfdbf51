"""Attractors as motions over a period, after the transient, and as many states of their Poincare sections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.limit_set import LimitSet
from nsmaps.dynamics.orbit import orbit
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.events import ModeTrack, Track
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.trajectory import track
from nsmaps.results import Result, units_of

ORBITS = 100  #: followed side by side on an attractor without a period
MOST = 4096  #: impacts or events of a motion
ROUNDING = 1e-9  #: share of a duration by which events at its end may be later


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PhasePortrait(Result):
    """Attractors with their motions: over a period, or over some returns of those without one."""

    picture: ClassVar[str] = "nsmaps.figures.attractors.portrait"

    attractors: tuple[Attractor | LimitSet, ...]  #: those without a period with many states of their Poincare sections
    tracks: tuple[Track | ModeTrack | None, ...]  #: the motion of each; None of a map without motions
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """The motions by name."""
        return ", ".join(each.label or "motion without a name" for each in self.attractors)


@checked
def phase_portrait(
    system: ReturnMap, attractors: Sequence[Attractor | LimitSet], *, n_points: int = 100_000, n_returns: int = 20
) -> PhasePortrait:
    """The motions of attractors, such as those of `basins`, over a period each, and states of their Poincare sections.

    Args:
        system: of the attractors.
        attractors: one or more.
        n_points: states of an attractor without a period, of 100 orbits side by side.
        n_returns: over which the motion on an attractor without a period is shown.

    Raises:
        NsmapsError: there is no attractor.
    """
    if not attractors:
        raise NsmapsError("there is no attractor; expected: those of `basins(...).attractors`, or the limit set of an orbit")
    tracks = tuple(motion_over(system, each.states[0], each.period or n_returns) for each in attractors)
    return PhasePortrait(tuple(_densely(system, each, n_points) for each in attractors), tracks, units_of(system))


def _densely(return_map: ReturnMap, attractor: Attractor | LimitSet, n_points: int) -> Attractor | LimitSet:
    """An attractor without a period with so many states, of orbits from states on it; any other as it is."""
    if attractor.period or len(attractor.states) >= n_points:
        return attractor
    path = orbit(return_map, attractor.states[-ORBITS:], -(-n_points // len(attractor.states[-ORBITS:])))
    states = path.coordinates.wrap(path.states[1:].reshape(-1, len(path.coordinates)))
    return replace(attractor, states=states[np.isfinite(states).all(axis=1)])


def motion_over(return_map: ReturnMap, start: Floats, n_returns: int) -> Track | ModeTrack | None:
    """The motion from a state, shape (n,), over a number of returns; None of a map without motions."""
    if not isinstance(return_map, FlowSystem):
        return None
    times = orbit(return_map, start, n_returns).time
    lasts, count = float(np.nansum(times)), 8
    found = track(return_map, start, count)
    while count < MOST and len(_times(found)) == count and _times(found)[-1] < lasts:
        count *= 2
        found = track(return_map, start, count, n_samples=2)
    events = int((_times(found) <= lasts * (1 + ROUNDING)).sum())
    return track(return_map, start, max(events, 2))


def _times(found: Track | ModeTrack) -> Floats:
    """Of the impacts or events."""
    return (found.impacts if isinstance(found, Track) else found.events).time
