"""The return map in which complete chatter at the section, with the rest and the release that follow, is one event."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, Self

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.surfaces.compose import compose_returns
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import encode

CALLS = (64, 128, 256, 512, 1024, 2048, 4096, 1920)  #: impacts of a state in successive calls; more are not complete chatter


class Released(NamedTuple):
    """The states with complete chatter among some, K in number, and what becomes of them by their release."""

    rows: Ints  #: shape (K,), their numbers
    returns: Returns  #: to the release, with derivatives if these are asked for
    last: Floats  #: shape (K,), times of the last single returns, which end with the release
    moved: Floats  #: shape (K, n), derivatives of the release by the parameters; zero if no rates are given


@dataclass(frozen=True, slots=True)
class CompleteChatter(ExactMap):
    """The return map of a system in which complete chatter at its section, where contact may last, is one event.

    A state from which impacts at the section alone accumulate returns where the motion next meets the section after the rest and
    its release: word `B~B`, or `B~TB`. An orbit with complete chatter thus has as many returns as without its infinitely many
    impacts, whatever their number before they are summed, and can be continued in a parameter. Other states return as in the
    system. The image does not depend on the speed of the first impact beyond what it gives other bodies; of an impact system all
    such states have one image, so that the derivative is zero, exactly.
    """

    system: FlowSystem

    def __post_init__(self) -> None:
        system = FlowSystem.require(self.system, "complete chatter")
        if isinstance(system, HybridSystem) and not any(
            system._definition().transitions[start.transition].guard for start in system._definition().starts
        ):
            raise NsmapsError(
                f"complete chatter of a {type(system).__name__}: no guard of its section `rests`; expected: a section at the "
                "impacts that accumulate. Returns to another section, as a clock, pass chatter, rest and release as they are"
            )

    @classmethod
    def of(cls, system: System) -> Self:
        """The map of a system, which is to be an `ImpactSystem` or a `HybridSystem`."""
        return cls(system)  # type: ignore[arg-type]

    def at(self, **changes: Any) -> Self:
        """The map of the system with some parameters changed. ParameterError for an invalid one."""
        return replace(self, system=self.system.at(**changes))

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the system."""
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
        """First returns of states of shape (N, n)."""
        single = self.system.first_return(states, derivative)
        rows, chattered, _, _ = self._released(single.start, derivative)
        whole = compose_returns(chattered, self.system.first_return(chattered.image, derivative))
        names = [field.name for field in fields(Returns) if isinstance(getattr(single, field.name), np.ndarray)]
        merged = {name: getattr(single, name).copy() for name in names}
        for name, values in merged.items():
            values[rows] = getattr(whole, name)
        return replace(single, **merged)

    def extents(self, states: ArrayLike) -> Floats | None:
        """As of the system."""
        return self.system.extents(states)

    def on_section(self, states: ArrayLike) -> Floats:
        """As of the system."""
        return self.system.on_section(states)

    def rests(self, states: ArrayLike) -> Floats:
        """How long contact lasts until its release, in radians of phase, shape (N,); NaN without complete chatter.

        Chatter that is summed counts with the rest: its time is at most 1e-5 of that in which the force at the contact changes.
        Without forcing in units of time.
        """
        start = as_states(states, self.coordinates)
        found = self._released(start)
        durations = np.full(len(start), np.nan)
        durations[found.rows] = found.last * (self.phase_rate() or 1.0)
        return durations

    def itineraries(self, states: ArrayLike) -> Itineraries:
        """The distance of returns from a graze; after complete chatter that of the flights from the release on."""
        start = as_states(states, self.coordinates).copy()
        found = self._released(start)
        start[found.rows] = found.returns.image
        return self.system.itineraries(start)

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivative of first returns by the parameters, which change at these rates, shape (N, n)."""
        start = as_states(states, self.coordinates).copy()
        rows, chattered, _, by_rates = self._released(start, rates=rates)
        start[rows] = chattered.image
        moved = self.system.sensitivity(start, rates)
        if len(rows):
            slopes = self.system.first_return(chattered.image, derivative=True).slopes
            moved[rows] += np.einsum("nij,nj->ni", slopes, by_rates)
        return moved

    def _released(self, start: Floats, derivative: bool = False, rates: Mapping[str, float] | None = None) -> Released:
        """The states of some, shape (N, n), with complete chatter, up to their release."""
        found: list[Released] = []
        rows, now, system = np.arange(len(start)), start, self.system
        turns, time, moved = np.zeros(start.shape, np.int32), np.zeros(len(start)), np.zeros(start.shape)
        slopes = np.tile(np.eye(start.shape[1]), (len(start), 1, 1))
        for n in CALLS:
            run = system.orbits(now, n, derivative or rates is not None, chatter=np.inf)
            plain = np.isin(run.codes, [encode(2 * letter, run.walls) for letter in system.section_letters if letter])
            plain = plain.reshape(n, len(rows))
            length = np.where(plain.all(axis=0), n, (~plain).argmax(axis=0))
            each, columns = np.arange(n)[:, None], np.arange(len(rows))
            counted = each <= length
            time += np.where(counted, run.time.reshape(counted.shape), 0).sum(axis=0)
            turns += np.where(counted[..., None], run.turns.reshape(n, *turns.shape), 0).sum(axis=0, dtype=np.int32)
            if run.derivative is not None:
                _carry(system, run, counted, rates, slopes, moved)
            last = run.select(np.minimum(length, n - 1) * len(rows) + columns)
            stuck = (length < n) & (last.outcome == Outcome.stuck)
            ends = replace(last.select(stuck), start=start[rows[stuck]], turns=turns[stuck], time=time[stuck])
            ends = replace(ends, derivative=slopes[stuck] if derivative else None)
            found.append(Released(rows[stuck], ends, last.time[stuck], moved[stuck]))
            on = (length == n) & (last.image != now).any(axis=1)  # a state that comes back to itself never rests
            rows, now, turns, time, moved, slopes = rows[on], last.image[on], turns[on], time[on], moved[on], slopes[on]
            if not len(rows):
                break
        numbers, parts, lasts, ways = zip(*found, strict=True)
        return Released(np.concatenate(numbers), Returns.concatenate(parts), np.concatenate(lasts), np.concatenate(ways))


def _carry(
    system: FlowSystem, run: Returns, counted: Bools, rates: Mapping[str, float] | None, slopes: Floats, moved: Floats
) -> None:
    """Carry derivatives by states, shape (M, n, n), and by parameters, (M, n), through the single returns that count, (K, M)."""
    shape = *counted.shape, moved.shape[1]
    singles = run.slopes.reshape(*shape, -1)
    by_rates = np.zeros(shape) if rates is None else sensitivities(system, run.start, rates, chatter=np.inf).reshape(shape)
    for single, by, on in zip(singles, by_rates, counted, strict=True):
        slopes[on] = single[on] @ slopes[on]
        moved[on] = np.einsum("nij,nj->ni", single[on], moved[on]) + by[on]


def sensitivities(system: FlowSystem, start: Floats, rates: Mapping[str, float], **how: Any) -> Floats:
    """The derivatives of single returns of states (N, n) by the parameters, of impact systems also of those to a release."""
    moved = system.sensitivity(start, rates, **how)
    if isinstance(system, ImpactSystem):
        from nsmaps.exact.flows.release import release_rates

        returns = system.first_return(start, **how)
        stuck = returns.outcome == Outcome.stuck
        moved[stuck, 0], moved[stuck, 1] = 0.0, release_rates(system, returns.image[stuck, 1], rates)
    return moved
