"""Means of observables over periodic orbits and along their branches, with their exact derivatives by parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.chatter.complete import CompleteChatter, sensitivities
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.problem import parameter_rates
from nsmaps.dynamics.observables.maps import by_parameters, map_slopes
from nsmaps.dynamics.observables.means import Means
from nsmaps.dynamics.observables.orbits import orbit_means
from nsmaps.dynamics.periodic import PeriodicOrbit, shooting_jacobian
from nsmaps.errors import NsmapsError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import CHATTER, REST
from nsmaps.results import Result, array

ELAPSED = Observable(name="_elapsed", formula="1", of="flights")  #: in whose place the time of a map's returns comes
SAME = 1e-9  #: largest relative difference of the time round an orbit and the sum of its single returns


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Slope(Result):
    """Means over a periodic orbit, or over the K of a branch, and their derivatives along a direction of the parameters."""

    value: Floats = field(metadata=array("... observable", "mean over each orbit"))
    derivative: Floats = field(metadata=array("... observable", "NaN where unknown, as of largest values and infinite sums"))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CycleMeans(Means):
    """Means of C observables over periodic orbits of q returns, and how they change with a parameter."""

    per_return: Slope
    per_time: Slope  #: per unit of the system's time
    per_period: Slope | None  #: per period of the forcing; None without forcing
    stable: Bools | None = field(default=None, metadata=array("value", "whether the orbits of a branch are known to be stable"))


def cycle_means(
    system: ReturnMap,
    orbit: PeriodicOrbit,
    observables: Sequence[ObservableLike],
    rates: Mapping[str, float] | None = None,
) -> CycleMeans:
    """Means of observables over a periodic orbit of a system, stable or not, as of `observe`."""
    from nsmaps.exact.observables.formulas import resolve_observables

    single = _single(system)
    found, way = resolve_observables(single, observables), single.direction(rates or {})
    if not np.isfinite(orbit.states).all():
        raise NsmapsError("the orbit does not exist; expected: one that was found, `orbit.converged`")
    every = (*found, ELAPSED if isinstance(single, FlowSystem) else ELAPSED.model_copy(update={"of": "returns"}))
    passed = tuple(letter + mark for letter in single.section_letters if letter for mark in (CHATTER, REST))
    whole = [word for word in orbit.words if word.startswith(passed) and word not in passed]
    if not whole:
        return _cycle(single, found, len(orbit.states), *_sums(single, orbit, every, way))
    if not isinstance(system, CompleteChatter):
        what = f"the return {whole[0]} passes a rest, which ends single returns"
        raise NsmapsError(f"{what}; expected: an orbit of single returns, or the map `CompleteChatter`")
    return _cycle(single, found, len(orbit.states), *_sums_with_rest(system, orbit, every, way))


Sums = tuple[Floats, Floats, Floats]  #: totals and weights, shape (q, C) or (1, C), and their derivatives, shape (2, C)


def _sums(system: System, orbit: PeriodicOrbit, every: tuple[Observable, ...], way: Floats) -> Sums:
    """The sums over each return of an orbit of single returns."""
    from nsmaps.exact.observables.formulas import plan_of

    means = orbit_means(system, orbit.states[:, None, :], 1, every, n_batches=1)
    plan = plan_of(system, every)
    q, n = orbit.states.shape
    slopes = _slopes(system, plan, orbit.states, way) if way.any() else np.zeros((q, len(plan.columns), n + 1))
    moved = np.concatenate([moved_states(system, orbit, way), np.ones((len(slopes), 1))], axis=1)
    each = np.full((2, len(every)), np.nan)
    for column, (k, part) in enumerate(plan.columns):
        each[part, k] = (slopes[:, column] * moved).sum()
    totals = means.totals[0, :, 0]
    totals[:, -1] = means.time[0, :, 0]
    return totals, means.weights[0, :, 0], each


def _slopes(system: System, plan: Any, states: Floats, way: Floats) -> Floats:
    """The derivatives of the totals of single returns, by the states and along parameters, shape (q, C, n + 1)."""
    if isinstance(system, FlowSystem):
        from nsmaps.exact.observables.totals import slopes_of

        return slopes_of(system, plan, states, way)
    return map_slopes(system, plan, states, way)


def _sums_with_rest(return_map: CompleteChatter, orbit: PeriodicOrbit, every: tuple[Observable, ...], way: Floats) -> Sums:
    """The sums over an orbit with complete chatter."""
    from nsmaps.exact.observables.formulas import plan_of

    system = return_map.system
    run = system.orbits(orbit.states[:1], _single_returns(system, orbit), derivative=True, chatter=SUMMED_SPEED)
    means = orbit_means(system, orbit.states[0], len(run.codes), every, n_batches=1, chatter=SUMMED_SPEED)
    plan, each = plan_of(system, every), np.zeros((2, len(every)))
    if way.any():
        each[:] = np.nan
        for (k, part), slope in zip(plan.columns, _slopes_with_rest(return_map, orbit, run, plan, way), strict=True):
            each[part, k] = slope
    return means.totals, means.weights, each


def _slopes_with_rest(return_map: CompleteChatter, orbit: PeriodicOrbit, run: Returns, plan: Any, way: Floats) -> Floats:
    """The derivatives of the totals of the single returns round an orbit with complete chatter, shape (C,)."""
    from nsmaps.dynamics.observables.rests import Chatter, rest_slopes
    from nsmaps.exact.observables.totals import slopes_of

    system, total, moved = return_map.system, np.zeros(len(plan.columns)), moved_states(return_map, orbit, way)[0]
    rates = dict(zip(system.parameter_names(), way.tolist(), strict=True))
    slopes, by_way = slopes_of(system, plan, run.start, way), sensitivities(system, run.start, rates)
    for k in range(len(run.codes)):
        if isinstance(system, ImpactSystem) and run.outcome[k] == Outcome.stuck:
            (v, phi), release = run.start[k], run.lifted[k, 1]
            total += rest_slopes(system, plan, Chatter(v, phi, release, np.append(moved, by_way[k, 1])), way)
        else:
            total += slopes[k] @ np.append(moved, 1.0)
        moved = run.slopes[k] @ moved + by_way[k]
    return total


def _single(return_map: ReturnMap) -> System:
    """The system whose single returns a map has, or NsmapsError."""
    return System.require(return_map.system if isinstance(return_map, CompleteChatter) else return_map, "observables")


def _single_returns(system: FlowSystem, orbit: PeriodicOrbit) -> int:
    """The number of single returns in the time round an orbit with complete chatter, or NsmapsError if none end with it."""
    whole = float(orbit.returns.time.sum())
    for n in (2**k for k in range(6, 21)):
        ends = np.cumsum(system.orbits(orbit.states[:1], n, chatter=SUMMED_SPEED).time)
        if not ends[-1] < 1.5 * whole:
            break
    last = int(np.argmin(np.abs(np.where(np.isfinite(ends), ends, np.inf) - whole)))
    if not abs(ends[last] - whole) <= SAME * whole:
        what = f"no impact of the first state follows after {whole:g}, the time round the orbit"
        raise NsmapsError(f"{what}; expected: an orbit of the map")
    return last + 1


def moved_states(system: System | CompleteChatter, orbit: PeriodicOrbit, way: Floats) -> Floats:
    """The derivatives of the states of a periodic orbit along a direction of the parameters, shape (q, n)."""
    states = orbit.states
    if not way.any():
        return np.zeros(states.shape)
    by_way = by_parameters(system, states, dict(zip(system.parameter_names(), way.tolist(), strict=True)))
    derivative = system.first_return(states, derivative=True).derivative
    if derivative is None or not (np.isfinite(derivative).all() and np.isfinite(by_way).all()):
        return np.full(states.shape, np.nan)
    scale = orbit.scale
    try:
        moved = np.linalg.solve(shooting_jacobian(derivative, scale), -(by_way / scale).ravel())
    except np.linalg.LinAlgError:
        return np.full(states.shape, np.nan)
    return np.asarray(moved.reshape(states.shape) * scale)


def _cycle(
    system: System,
    found: tuple[Observable, ...],
    q: int,
    totals: Floats,
    weights: Floats,
    slopes: Floats,
) -> CycleMeans:
    """Means from totals and weights of the q returns, shape (q, C + 1), whose last column is the time."""
    largest = np.array([one.largest for one in found])
    divided = np.array([bool(one.per) for one in found])
    totals, time = np.where([*largest, False], totals.max(axis=0), totals.sum(axis=0)), totals[:, -1].sum()
    weights, (by, by_weights) = weights.sum(axis=0), slopes

    def over(size: float, by_size: float) -> Slope:
        sizes = np.where(largest, 1.0, np.where(divided, weights[:-1], size))
        by_sizes = np.where(largest, 0.0, np.where(divided, by_weights[:-1], by_size))
        value = totals[:-1] / sizes
        with np.errstate(invalid="ignore"):  # infinite sums over chatter
            return Slope(value, np.where(np.isfinite(value), (by[:-1] - value * by_sizes) / sizes, np.nan))

    period = system.period()
    forced = None if period is None else over(float(round(time / float(period))), 0.0)
    return CycleMeans(found, over(float(q), 0.0), over(float(time), float(by[-1])), forced)


def branch_means(map_of: Callable[[float], ReturnMap], branch: Branch, observables: Sequence[ObservableLike]) -> CycleMeans:
    """Means of observables over the K orbits of a branch, and their derivatives by its parameter along it, as of `observe`."""
    rows, unit = [], max(float(np.ptp(branch.values)), 1e-3 * float(np.abs(branch.values).max(initial=1e-3)))
    for value, orbit in zip(branch.values.tolist(), branch.orbits, strict=True):
        rows.append(cycle_means(map_of(value), orbit, observables, parameter_rates(map_of, value, unit)))
    if not rows:
        raise NsmapsError(f"the branch has no orbits: {branch.ended}")

    def stacked(name: str) -> Slope:
        parts = [getattr(row, name) for row in rows]
        return Slope(np.array([part.value for part in parts]), np.array([part.derivative for part in parts]))

    forced = None if rows[0].per_period is None else stacked("per_period")
    stable = np.array([one is True for one in branch.stable])
    along: dict[str, Any] = {"parameter": branch.parameter, "values": branch.values, "units": branch.units}
    return CycleMeans(rows[0].observables, stacked("per_return"), stacked("per_time"), forced, stable, **along)
