"""The exact motion at and between impacts or events, sampled, for figures of trajectories."""

from dataclasses import replace
from typing import Any, overload

from nsmaps.coordinates import StateLike
from nsmaps.errors.arguments import checked
from nsmaps.exact.chatter import SUMMED_SPEED, check_chatter
from nsmaps.exact.events import ModeTrack, Track, check_samples
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.results import units_of


@overload
def track(system: ImpactSystem, start: StateLike, n_events: int, n_samples: int = 60, chatter: float = ...) -> Track: ...
@overload
def track(system: HybridSystem, start: StateLike, n_events: int, n_samples: int = 60, chatter: float = ...) -> ModeTrack: ...
@overload
def track(system: System, start: StateLike, n_events: int, n_samples: int = 60, chatter: float = ...) -> Track | ModeTrack: ...
@checked
def track(
    system: System, start: StateLike, n_events: int, n_samples: int = 60, chatter: float = SUMMED_SPEED
) -> Track | ModeTrack:
    """The exact motion from a state of the return map, shape (m,), through the first n impacts or events, the start included.

    Impacts are those on all walls, events those of all guards; a motion that ends, as by `Guard.ends`, or that meets no further
    event within the horizon, has fewer. Between them the motion is the system's own, by the compiled flow.

    Args:
        system: with impacts or modes.
        start: a state, shape (m,) or by name, phases in radians.
        n_events: number n of impacts or events.
        n_samples: between two of them, both included.
        chatter: as in `first_return`.

    Raises:
        StateError: the state is not a start, n is less than 2, there are fewer than 2 samples, or `chatter` is negative.
    """
    check_samples(n_events, n_samples)
    check_chatter(chatter)
    found = FlowSystem.require(system, "a trajectory")._track(start, n_events, n_samples, chatter)
    about: dict[str, Any] = {"coordinates": system.coordinates} if isinstance(found, ModeTrack) else {}
    return replace(found, units=units_of(system), **about)
