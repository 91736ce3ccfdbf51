"""Means of observables of whatever has orbits: starts, periodic orbits, branches, diagrams, attractors, noise."""

from collections.abc import Mapping, Sequence
from typing import Any, overload

from nsmaps.coordinates import StateLike
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.basins import Basins
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.dynamics.noise.orbits import NoisyOrbits
from nsmaps.dynamics.observables.attractors import AttractorMeans, attractor_means, diagram_means, noisy_means
from nsmaps.dynamics.observables.cycles import CycleMeans, branch_means, cycle_means
from nsmaps.dynamics.observables.orbits import BATCHES, ObservableMeans, orbit_means
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import Model, map_along
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.observables.spec import ObservableLike
from nsmaps.parallel import SERIAL, Parallel, divides

Attracting = BifurcationDiagram | Basins | Sequence[Attractor] | NoisyOrbits


@overload
def observe(
    system: Model,
    orbits: PeriodicOrbit | Branch,
    observables: Sequence[ObservableLike],
    *,
    rates: Mapping[str, float] | None = ...,
) -> CycleMeans: ...


@overload
def observe(
    system: Model, orbits: Attracting, observables: Sequence[ObservableLike], *, n_returns: int = ..., parallel: Parallel = ...
) -> AttractorMeans: ...


@overload
def observe(
    system: Model,
    orbits: StateLike,
    observables: Sequence[ObservableLike],
    *,
    n_returns: int = ...,
    transient: int = ...,
    n_batches: int = ...,
    chatter: float = ...,
    parallel: Parallel = ...,
) -> ObservableMeans: ...


@divides
def observe(
    system: Any,
    orbits: Any,
    observables: Sequence[ObservableLike],
    *,
    n_returns: int = 1000,
    transient: int = 0,
    n_batches: int = BATCHES,
    chatter: float = SUMMED_SPEED,
    rates: Mapping[str, float] | None = None,
    parallel: Parallel = SERIAL,
) -> ObservableMeans | CycleMeans | AttractorMeans:
    """Means of observables along orbits of a system.

    They are summed impact by impact as the returns are computed, of maps return by return; nothing is stored. The returns of
    starts are taken in batches of the same length, whose means give the standard errors. Chatter is followed impact by impact as
    far as `chatter` says and added to its limit: a formula that is not zero at speed zero, such as the number of impacts, is then
    infinite. On attractors with a period a whole number of periods is taken.

    Of periodic orbits the means have derivatives, which follow from those of the returns and of the observables through every
    impact, by implicit differentiation of the orbit. Errors under noise are those of independent realisations. Where flights are
    in closed form these are observables of the stored impacts. Else each realisation is computed again from its seed, and the
    observables along it, over events and flights.

    Args:
        system: the system; for a branch or a diagram also a function of its parameter's value that gives it, for orbits with
            complete chatter as one event its `CompleteChatter`: impacts are followed singly and their remainder is summed.
        orbits: a start, shape (n,) or by name, or many, shape (..., n): `ObservableMeans`. A `PeriodicOrbit`, stable or not, or a
            `Branch` of them: `CycleMeans`. A `BifurcationDiagram`, from the last state of each of its orbits on, `Basins`,
            `Attractor`s, or `NoisyOrbits`: `AttractorMeans`.
        observables: names that the system has, objects of `Observable`, or mappings of their keys.
        n_returns: at least one; of starts with more than `n_batches`, the last ones that do not fill a batch are not computed. On
            attractors at least as many of each orbit.
        transient: returns of starts before these, which do not count.
        n_batches: of the returns of starts, at most `n_returns`; with one there is no error.
        chatter: as in `first_return` of an impact system, on every wall.
        rates: of change of parameters, such as {"d": 1.0} for derivatives of a periodic orbit by d; without them they are zero.
        parallel: see `nsmaps.Parallel`; of a diagram each value is a part.

    Raises:
        StateError: a start does not have the system's coordinates.
        ParameterError: a parameter is unknown.
        NsmapsError: an observable is unknown or cannot be read, a number is too small, the map is not a system; a periodic orbit
            does not exist, or is of another map; a branch has no orbit; fewer than two realisations did not end, or flights are
            in closed form and an observable is of flights, or not all impacts were stored.
        Interrupted: Ctrl-C; in `result` the means of values of a diagram that are not finished are NaN.
    """
    if isinstance(orbits, PeriodicOrbit):
        return cycle_means(system, orbits, observables, rates)
    if isinstance(orbits, Branch):
        return branch_means(map_along(system, orbits.parameter), orbits, observables)
    if isinstance(orbits, BifurcationDiagram):
        return diagram_means(map_along(system, orbits.parameter), orbits, observables, n_returns, parallel)
    if isinstance(orbits, NoisyOrbits):
        return noisy_means(system, orbits, observables)
    found = orbits.attractors if isinstance(orbits, Basins) else orbits
    if isinstance(found, tuple | list) and all(isinstance(each, Attractor) for each in found):
        states, periods = [each.states[-1] for each in found], [each.period for each in found]
        return attractor_means(system, states, periods, observables, n_returns)
    return orbit_means(system, orbits, n_returns, observables, transient, n_batches, chatter)
