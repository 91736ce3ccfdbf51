"""The return map in which complete chatter on the base wall, with the rest and the release that follow, is one event."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.surfaces.compose import joined
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import encode

CALLS = (64, 128, 256, 512, 1024, 2048, 4096, 1920)  #: impacts of a state in successive calls; more are not complete chatter


@dataclass(frozen=True, slots=True)
class CompleteChatter(ExactMap):
    """The return map of an impact system in which complete chatter on its base wall is one event.

    A state from which impacts on the base wall alone accumulate returns where the ball next meets that wall after its rest and
    release: word `B~B`, or `B~TB`. All such states have one image, so that the derivative is zero, exactly. Other states return
    as in the system. An orbit with complete chatter thus has as many returns as without its infinitely many impacts, whatever
    their number before they are summed, and its multipliers are zero: it can be continued in a parameter.
    """

    system: ImpactSystem

    def __post_init__(self) -> None:
        if isinstance(self.system, HybridSystem):
            clock = "of a system with modes a section at a clock, whose returns pass chatter, rest and release"
            raise NsmapsError(
                f"chatter of a {type(self.system).__name__} is not one event here; expected: an ImpactSystem; {clock}"
            )
        ImpactSystem.require(self.system, "complete chatter")

    @classmethod
    def of(cls, system: System) -> Self:
        """The map of a system, which is to be an `ImpactSystem`."""
        return cls(system)  # type: ignore[arg-type]

    def at(self, **changes: Any) -> Self:
        """The map of the system with some parameters changed. ParameterError for an invalid one."""
        return replace(self, system=self.system.at(**changes))

    @property
    def coordinates(self) -> Coordinates:
        """Impact speed and phase."""
        return self.system.coordinates

    @property
    def parameters(self) -> Mapping[str, float]:
        """The values of the parameters."""
        return self.system.parameters

    def parameter_names(self) -> tuple[str, ...]:
        """The names of the parameters."""
        return self.system.parameter_names()

    def phase_rate(self) -> float:
        """Radians of phase per unit of time."""
        return self.system.phase_rate()

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """First returns of states of shape (N, 2); those with complete chatter have a derivative of zero."""
        single = self.system.first_return(states, derivative)
        rows, chattered, _ = self._released(single.start)
        if derivative:
            chattered = replace(chattered, derivative=np.zeros((len(rows), 2, 2)))
        whole = joined(chattered, self.system.first_return(chattered.image, derivative))
        names = [field.name for field in fields(Returns) if isinstance(getattr(single, field.name), np.ndarray)]
        merged = {name: getattr(single, name).copy() for name in names}
        for name, values in merged.items():
            values[rows] = getattr(whole, name)
        return replace(single, **merged)

    def extents(self, states: ArrayLike) -> Floats:
        """As of the system."""
        return self.system.extents(states)

    def rests(self, states: ArrayLike) -> Floats:
        """How long the ball rests before its release, in radians of phase, shape (N,); NaN without complete chatter.

        Chatter that is summed counts with the rest: its time is at most 1e-5 of that in which the force on the ball changes.
        """
        start = as_states(states, self.coordinates)
        rows, _, last = self._released(start)
        durations = np.full(len(start), np.nan)
        durations[rows] = last * self.phase_rate()
        return durations

    def itineraries(self, states: ArrayLike) -> Itineraries:
        """The distance of returns from a graze; after complete chatter that of the flights from the release on."""
        start = as_states(states, self.coordinates).copy()
        rows, chattered, _ = self._released(start)
        start[rows] = chattered.image
        return self.system.itineraries(start)

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivative of first returns by the parameters, which change at these rates, shape (N, 2)."""
        start = as_states(states, self.coordinates).copy()
        rows, chattered, _ = self._released(start)
        start[rows] = chattered.image
        moved = self.system.sensitivity(start, rates)
        if len(rows):
            from nsmaps.exact.flows.release import release_rates

            slopes = self.system.first_return(chattered.image, derivative=True).derivative
            assert slopes is not None
            moved[rows] += slopes[:, :, 1] * release_rates(self.system, chattered.image[:, 1], rates)[:, None]
        return moved

    def _released(self, start: Floats) -> tuple[Ints, Returns, Floats]:
        """The numbers of the states with complete chatter, their returns to the release, and the times of the last of these."""
        letter = self.system.letters[0]
        found: list[tuple[Ints, Returns, Floats]] = []
        rows, now = np.arange(len(start)), start
        turns, time = np.zeros(start.shape, np.int32), np.zeros(len(start))
        for n in CALLS:
            run = self.system.orbits(now, n, chatter=np.inf)
            plain = (run.codes == encode(2 * letter, run.walls)).reshape(n, len(rows))
            length = np.where(plain.all(axis=0), n, (~plain).argmax(axis=0))
            each, columns = np.arange(n)[:, None], np.arange(len(rows))
            counted = each <= length
            time += np.where(counted, run.time.reshape(counted.shape), 0).sum(axis=0)
            turns += np.where(counted[..., None], run.turns.reshape(*counted.shape, 2), 0).sum(axis=0, dtype=np.int32)
            last = run.select(np.minimum(length, n - 1) * len(rows) + columns)
            stuck = (length < n) & (last.outcome == Outcome.stuck)
            ends = replace(last.select(stuck), start=start[rows[stuck]], turns=turns[stuck], time=time[stuck])
            found.append((rows[stuck], ends, last.time[stuck]))
            on = (length == n) & (last.image != now).any(axis=1)  # a state that comes back to itself never rests
            rows, now, turns, time = rows[on], last.image[on], turns[on], time[on]
            if not len(rows):
                break
        numbers, parts, lasts = zip(*found, strict=True)
        return np.concatenate(numbers), Returns.concatenated(parts), np.concatenate(lasts)
