"""Means of observables on attractors: of a bifurcation diagram, of basins, and of orbits under noise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.dynamics.noise.orbits import NoisyOrbits, forced_totals, in_closed_form
from nsmaps.dynamics.observables.maps import noisy_totals, parted
from nsmaps.dynamics.observables.means import Mean, Means, ratio
from nsmaps.dynamics.observables.orbits import BATCHES, orbit_means
from nsmaps.dynamics.returnmap import first_map, map_or_reason
from nsmaps.errors import NsmapsError
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.parallel import Arrays, Parallel
from nsmaps.progress import beat

if TYPE_CHECKING:
    from nsmaps.dynamics.observables.orbits import ObservableMeans

MEANS = ("per_return", "per_time", "per_period")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AttractorMeans(Means):
    """Means of K observables on attractors, `...` the shape of the orbits on them, such as values of a parameter and starts."""

    per_return: Mean
    per_time: Mean  #: per unit of the system's time
    per_period: Mean  #: per period of the forcing; NaN without forcing


def diagram_means(
    map_of: Callable[[float], ReturnMap],
    diagram: BifurcationDiagram,
    observables: Sequence[ObservableLike],
    returns: int,
    parallel: Parallel,
) -> AttractorMeans:
    """Means of observables at every value of a bifurcation diagram, shape (V, S, K), as of `observe`.

    NaN where an orbit ended or there is no map.
    """
    found = _observables(map_of, diagram.values, observables)
    cuts, last = parallel.cuts(len(diagram.values)), diagram.states[:, :, -1]
    parts = [(map_of, diagram.values[cut], last[cut], diagram.period[cut], found, returns) for cut in cuts]

    def means(parts: Mapping[int, Arrays]) -> AttractorMeans:
        table = np.full((len(MEANS), 2, *diagram.period.shape, len(found)), np.nan)
        for k, part in parts.items():
            table[:, :, cuts[k]] = part["means"]
        return _means(found, table, parameter=diagram.parameter, values=diagram.values, units=diagram.units)

    return means(dict(enumerate(parallel.run(_along, parts, means))))


def _observables(
    map_of: Callable[[float], ReturnMap], values: Floats, observables: Sequence[ObservableLike]
) -> tuple[Observable, ...]:
    """The observables of the first system that there is."""
    from nsmaps.exact.observables.formulas import resolve_observables

    return resolve_observables(System.require(first_map(map_of, values[:, None]), "observables"), observables)


def _along(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    states: Floats,
    periods: Ints,
    observables: tuple[Observable, ...],
    returns: int,
) -> Arrays:
    """Means and errors, shape (3, 2, V, S, K), from states (V, S, n) on."""
    table = np.full((len(MEANS), 2, *states.shape[:2], len(observables)), np.nan)
    for k, value in enumerate(values.tolist()):
        system, _ = map_or_reason(map_of, value)
        for s in range(states.shape[1] if system is not None else 0):
            if np.isfinite(states[k, s]).all():
                assert isinstance(system, System)
                table[:, :, k, s] = _rows(_followed(system, states[k, s], int(periods[k, s]), observables, returns))
        beat((k + 1) / len(values), f"{k + 1} of {len(values)} values")
    return {"means": table}


def _followed(system: System, state: Floats, period: int, observables: tuple[Observable, ...], returns: int) -> "ObservableMeans":
    """The observables of an orbit, over batches of whole periods if it has one."""
    unit = max(period, 1)
    batches = max(1, min(BATCHES, returns // unit))
    return orbit_means(system, state, batches * unit * -(-returns // (batches * unit)), observables, n_batches=batches)


def _rows(observed: "ObservableMeans") -> Floats:
    """Means and errors of one orbit, shape (3, 2, K)."""
    nothing = np.full(len(observed.observables), np.nan)
    found = [getattr(observed, name) if name != "per_period" or observed.period is not None else None for name in MEANS]
    return np.array([(nothing, nothing) if mean is None else (mean.value, mean.error) for mean in found])


def _means(observables: tuple[Observable, ...], table: Floats, **along: Any) -> AttractorMeans:
    return AttractorMeans(observables, *(Mean(value, error) for value, error in table), **along)


def attractor_means(
    system: System, states: Sequence[Floats] | Floats, periods: Sequence[int], observables: Sequence[ObservableLike], returns: int
) -> AttractorMeans:
    """Means of observables of orbits on attractors, from one state (n,) of each on, shape (A, K); NaN of states that are NaN.

    `periods` are those of the attractors in returns, 0 without one. Other arguments and errors as of `observe`.
    """
    found = _observables(lambda _: system, np.zeros(1), observables)
    table = np.full((len(MEANS), 2, len(states), len(found)), np.nan)
    for k, (state, period) in enumerate(zip(states, periods, strict=True)):
        if np.isfinite(state).all():
            table[:, :, k] = _rows(_followed(system, state, period, found, returns))
    return _means(found, table)


def noisy_means(system: System, orbits: NoisyOrbits, observables: Sequence[ObservableLike]) -> AttractorMeans:
    """Means of observables over all realisations under noise, shape (K,), as of `observe`."""
    system = System.require(system, "observables under noise")
    found = _observables(lambda _: system, np.zeros(1), observables)
    if orbits.held.sum() < 2:
        raise NsmapsError(f"{orbits.held.sum()} realisations did not end; expected: two or more")
    if not isinstance(system, FlowSystem):
        totals, weights = noisy_totals(system, orbits, found)
    elif in_closed_form(system):
        totals, weights = _stored(system, orbits, found)
    else:
        totals, weights = _replayed(system, orbits, found)
    time, period = orbits.time[:, orbits.held].sum(axis=0), system.period()
    sizes = np.full(len(time), float(len(orbits.time))), time, time / (np.nan if period is None else float(period))
    divided = np.array([bool(one.per) for one in found])
    means = [ratio(totals, np.where(divided, weights, size[:, None])) for size in sizes]
    largest = np.array([one.largest for one in found])
    rows = [[np.where(largest, totals.max(axis=0), m.value), np.where(largest, np.nan, m.error)] for m in means]
    return _means(found, np.array(rows))


def _replayed(system: FlowSystem, orbits: NoisyOrbits, found: tuple[Observable, ...]) -> tuple[Floats, Floats]:
    """Totals and weights of K observables over each realisation that did not end, shape (R, K)."""
    from nsmaps.exact.observables.formulas import plan_of

    totals = forced_totals(system, orbits, found)[orbits.held]
    return parted(totals, plan_of(system, found).columns)


def _stored(system: System, orbits: NoisyOrbits, found: tuple[Observable, ...]) -> tuple[Floats, Floats]:
    """As `_of_impacts`, of the realisations that did not end, or an NsmapsError."""
    flight = next((one.name for one in found if one.of == "flights"), None)
    if flight is not None:
        raise NsmapsError(f"the observable {flight!r} is of flights, which are not stored under noise; expected: of impacts")
    impacts = orbits.impacts[orbits.held]
    if not impacts.shape[1] or np.isfinite(impacts[:, -1, 0]).any():
        raise NsmapsError(
            f"there is room for {impacts.shape[1]} impacts of each realisation; expected: `max_impacts` of `noisy_orbits` "
            "greater than the number of impacts of each"
        )
    return _of_impacts(ImpactSystem.require(system, "observables under noise"), impacts, found)


def _of_impacts(system: ImpactSystem, impacts: Floats, found: tuple[Observable, ...]) -> tuple[Floats, Floats]:
    """Totals and weights of each realisation, shape (R, K), from its impacts (R, I, 3)."""
    import sympy as sp

    from nsmaps.exact.flows.formulas import PHI
    from nsmaps.exact.observables.formulas import vocabulary_of

    vocabulary = vocabulary_of(system)
    there, walls = np.isfinite(impacts[..., 0]), list(system.walls().items())
    wall, speed, phase = np.where(there, impacts[..., 0], 0).astype(int), impacts[..., 1], impacts[..., 2]
    after = np.select([wall == k for k in range(len(walls))], [system.rebound(speed, letter) for letter, _ in walls])
    place = np.array([float(one.at) for _, one in walls])[wall]
    names = (*vocabulary.variables("impacts"), PHI, *vocabulary.parameters)
    table = np.full((2, len(impacts), len(found)), np.nan)
    for k, one in enumerate(found):
        counts = there & np.array(vocabulary.rows(one))[wall]
        for part, formula in enumerate(one.formulas):
            value = sp.lambdify(names, vocabulary.read(formula, "impacts"))(
                speed, after, place, phase, *system.parameters.values()
            )
            value = np.broadcast_to(np.asarray(value, float), there.shape) * (1.0 if part else one.scale)
            joined = np.where(counts, value, -np.inf).max(axis=1) if one.largest else np.where(counts, value, 0.0).sum(axis=1)
            table[part, :, k] = joined
    return table[0], table[1]
