"""The exact motion at and between impacts or events, sampled, for figures of trajectories."""

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.exact.chatter import SUMMED_SPEED, check_chatter
from nsmaps.exact.events import ModeTrack, check_samples
from nsmaps.exact.returns import Impacts
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Track:
    """The motion through M impacts, `samples` instants in each of the M - 1 flights between them, with W walls.

    A rest or chatter on a wall counts as a flight along it. Displacement is relative to the walls; places are those of
    `ImpactSystem.absolute`, relative to an observer at rest.
    """

    __repr__ = brief

    impacts: Impacts
    sides: NDArray[np.int8]  #: shape (W,), +1 for a wall that growing displacement meets, else -1
    at: Floats  #: shape (W,), displacement of each wall
    time: Floats  #: shape (M - 1, samples), since the start, in the system's time
    displacement: Floats  #: shape (M - 1, samples)
    velocity: Floats  #: shape (M - 1, samples), rate of the displacement
    ball: Floats  #: shape (M - 1, samples), place of the ball
    walls: Floats  #: shape (W, M - 1, samples), places of the walls

    @property
    def rates(self) -> Floats:
        """Velocity just before each impact, shape (M,): the impact speed with the sign of its wall's side."""
        return np.asarray(self.sides[self.impacts.wall] * self.impacts.speed, float)

    @property
    def moving(self) -> bool:
        """True if the system defines the motion of its walls."""
        return bool((np.ptp(self.walls.reshape(len(self.at), -1), axis=1) > 0).any())


@overload
def track(system: ImpactSystem, state: ArrayLike, n: int, samples: int = 60, chatter: float = ...) -> Track: ...
@overload
def track(system: HybridSystem, state: ArrayLike, n: int, samples: int = 60, chatter: float = ...) -> ModeTrack: ...
@overload
def track(system: System, state: ArrayLike, n: int, samples: int = 60, chatter: float = ...) -> Track | ModeTrack: ...
def track(system: System, state: ArrayLike, n: int, samples: int = 60, chatter: float = SUMMED_SPEED) -> Track | ModeTrack:
    """The exact motion from a state of the return map, shape (m,), through the first n impacts or events, the start included.

    Impacts are those on all walls, events those of all guards; a motion that ends, as by `Guard.ends`, or that meets no further
    event within the horizon, has fewer. Between them the motion is the system's own, by the compiled flow.

    Args:
        chatter: as in `first_return`.

    Raises:
        StateError: the state is not a start, n is less than 2, there are fewer than 2 samples, or `chatter` is negative.
    """
    check_samples(n, samples)
    check_chatter(chatter)
    system = FlowSystem.require(system, "a trajectory")
    if isinstance(system, HybridSystem):
        return system._kernel().track(np.asarray(state, float), n, samples, chatter)
    assert isinstance(system, ImpactSystem)
    impacts = system.impacts(state, n, chatter)
    time, displacement, velocity = system._kernel().trajectory(impacts, samples)
    walls = system.walls().values()
    sides, at = np.array([wall.side for wall in walls], np.int8), np.array([float(wall.at) for wall in walls])
    clock = time + impacts.phase[0] / system.phase_rate()
    ball = system.absolute(clock, displacement)
    places = np.array([system.absolute(clock, np.full(clock.shape, z)) for z in at])
    return Track(impacts, sides, at, time, displacement, velocity, np.asarray(ball, float), places)
