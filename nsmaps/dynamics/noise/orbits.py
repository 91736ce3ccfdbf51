"""Orbits under noise: of motions by Ornstein-Uhlenbeck forcing, exact at the points of a grid in time, of maps on the images."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Random, entropy_of
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.dynamics.noise.images import RETURNS, generator, kicked_realisations
from nsmaps.dynamics.noise.law import Noise, exact_step, linear_law, usual_step
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.returnmap import ReturnMap, letters_of
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import words_of
from nsmaps.interrupts import threads
from nsmaps.parallel import SERIAL, Arrays, Parallel, begun, concatenated, divides
from nsmaps.results import NONE, TIME, TURNS, Result, array, array_property

if TYPE_CHECKING:
    from nsmaps.exact.engine.kernel import SpectralKernel
    from nsmaps.exact.noise.driven import DrivenKernel
    from nsmaps.exact.observables.spec import Observable

CHUNK = 8  #: realisations of a task of an executor
SUBSTEPS = 1  #: exact steps in each step: with 2 and `step=2*h` the path is every second point of that of `step=h`


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NoisyOrbits(WithCoordinates, Result):
    """R realisations of n returns to the section under noise."""

    coordinates: Coordinates
    walls: tuple[str, ...]
    noise: Noise
    step: float  #: of the grid in time, in the system's time; NaN of noise on images
    chatter: float  #: as of `noisy_orbits`; NaN of noise on images
    seed: int | Sequence[int]
    states: Floats = field(metadata=array("step orbit coordinate", "the starts first; NaN after an orbit's end"))
    turns: NDArray[np.int32] = field(metadata=array("return orbit coordinate", "whole turns on each return", TURNS))
    codes: NDArray[np.int64] = field(metadata=array("return orbit", "words as numbers; see `words`", NONE))
    outcome: NDArray[np.int8] = field(metadata=array("return orbit", f"that which ended an orbit is repeated: {OUTCOMES}", NONE))
    time: Floats = field(metadata=array("return orbit", "of each return", TIME))
    eta: Floats  #: shape (n + 1, R), the forcing at each state; of noise on images (n + 1, R, dim), what was added to the state
    impacts: Floats  #: shape (R, K, 3), the first K impacts after the start: index of the wall, or of the letter of an event, the
    #: speed, or the rate at which the guard's function falls, and the phase; NaN beyond the last; none of noise on images

    def summary(self) -> str:
        """The numbers that matter."""
        returns, orbits = self.outcome.shape
        ended = int((self.outcome[-1] != Outcome.returned).sum()) if returns else 0
        about = f"{orbits} realisations of {returns} returns of ({self.coordinates})"
        return f"{about} under noise of sigma = {self.noise.sigma:g}; {ended} ended"

    @array_property("return orbit", "word of each return; empty after an orbit's end", NONE)
    def words(self) -> NDArray[np.str_]:
        """The word of each return, shape (n, R); "" after an orbit's end."""
        return words_of(self.codes, self.walls)

    @property
    def held(self) -> NDArray[np.bool_]:
        """True for realisations that did not end, shape (R,)."""
        return np.asarray(np.isfinite(self.states[-1]).all(axis=-1))

    def ended(self) -> dict[str, int]:
        """How many realisations ended before the last return, by outcome."""
        values, numbers = np.unique(self.outcome[-1:, ~self.held], return_counts=True)
        return {Outcome(value).name: int(number) for value, number in zip(values, numbers, strict=True)}


@divides
def noisy_orbits(
    system: ReturnMap,
    starts: StateLike,
    noise: Noise,
    *,
    n_returns: int,
    n_realisations: int = 1,
    step: float | None = None,
    chatter: float = 1e-6,
    max_impacts: int = 0,
    rng: Random = 0,
    parallel: Parallel = SERIAL,
) -> NoisyOrbits:
    """The first n returns of a map under noise, for R realisations.

    Noise with a correlation time is a forcing. Of an impact system it is added to the acceleration of flights, in a system with
    modes wherever its formulas have it. The noise, its velocity and its displacement are drawn exactly at the points of a grid in
    time, by the matrix exponential of z'' = -k z - c z' + eta, whose k and c are those of flights in closed form, else zero.
    Between the points the noise's displacement is a quintic: its error is of order step^(5/2), that of its velocity of order
    step^(3/2), which is the strong order after an impact. In a system with modes, and in one that is given by its acceleration,
    the noise is the cubic that is its second derivative, and every event is met as without noise; until the first event errors
    are of order step^3. Where flights are in closed form a contact that begins and ends between two points is missed unless the
    gap has a minimum between them. Release from rest occurs at a zero of the contact force of the quintic, and events whose guard
    has the noise at one of the cubic: under noise their time is of order step^(1/2) only.

    Noise without a correlation time is added to the images of any map: to each coordinate of each image a normal deviate, those
    of angles on the circle. An orbit that thereby leaves the map's domain ends there.

    Realisation i has its own Philox generator, seeded by `rng` and i: results do not depend on threads and executors.

    Args:
        starts: shape (dim,) or by name, or one for each realisation, shape (R, dim). A forcing starts from its stationary law.
        n_returns: number of returns of each.
        n_realisations: number R.
        step: of the grid in time, at most tau; by default a hundredth of the period, or a tenth of tau if that is less.
        chatter: as in `first_return`; the noise is neglected within the time of the sum.
        max_impacts: number of impacts of each realisation, on any wall, that are stored; with modes of events that have a letter.
        rng: of the noise, as `numpy.random.default_rng` takes it; 0 by default, so that a call gives the same numbers again.
        parallel: see `nsmaps.Parallel`; a part is 8 realisations, or 20,000 returns of noise on images if these are more, in
            threads on all cores if there is no executor.

    Raises:
        StateError: the start has another shape.
        NsmapsError: a count is negative, the step is not in (0, tau], chatter is negative, a class with modes has no noise, the
            map has no motion that could be forced, or noise on images has a step, impacts or a scale of no coordinate.
        Interrupted: Ctrl-C; `result` has the first realisations, up to a part that was not finished.
    """
    system = ReturnMap.require(system, "noise")
    coordinates = Coordinates(system.coordinates)
    each, dim, n, seed = as_starts(starts, coordinates), len(coordinates), n_returns, entropy_of(rng)
    if each.shape not in ((dim,), (n_realisations, dim)) or n_realisations < 0:
        raise StateError(f"the start has shape {each.shape}; expected: ({dim},) or ({max(n_realisations, 0)}, {dim})")
    check_noise(system, noise)
    if noise.tau is None:
        how = _of_images(system, n, noise, step, max_impacts)
        work, part, h, chatter = kicked_realisations, max(CHUNK, RETURNS // max(n, 1)), np.nan, np.nan
    else:
        h, how = _forced(system, n, noise, noise.tau, step, chatter, max_impacts)
        work, part = _realised, CHUNK
    each, letters = np.broadcast_to(each, (n_realisations, dim)), letters_of(system)
    tasks = [((*how, seed), each[cut], range(cut.start, cut.stop)) for cut in parallel.cuts(n_realisations, part)]

    def joined(parts: Sequence[Arrays]) -> NoisyOrbits:
        tables = concatenated(parts or [work((*how, seed), each[:0], ())])
        along = {name: table if name == "impacts" else np.swapaxes(table, 0, 1) for name, table in tables.items()}
        return NoisyOrbits(coordinates, letters, noise, h, chatter, seed, **along)

    def first(found: Mapping[int, Arrays]) -> NoisyOrbits | None:
        return joined(begun(found)) if 0 in found else None

    return joined(_run(work, tasks, parallel, first))


def _run(
    work: Callable[..., Arrays],
    tasks: Sequence[tuple[Any, ...]],
    parallel: Parallel,
    unfinished: Callable[..., Any] | None = None,
) -> list[Arrays]:
    """As `Parallel.run`, in threads on all cores if there is no executor."""
    if parallel.executor is None and len(tasks) > 1:
        with threads(os.cpu_count() or 1) as pool:
            return replace(parallel, executor=pool).run(work, tasks, unfinished)
    return parallel.run(work, tasks, unfinished)


def forced_totals(system: FlowSystem, orbits: NoisyOrbits, observables: "tuple[Observable, ...]") -> Floats:
    """The totals of the formulas of observables over each realisation, shape (R, C), which is computed again from its seed.

    Columns are those of the plan of the observables; not of a system whose flights are in closed form.
    """
    (n, r), noise = orbits.codes.shape, orbits.noise
    assert noise.tau is not None
    _, how = _forced(system, n, noise, noise.tau, orbits.step, orbits.chatter, 0, observables)
    parts = [((*how, orbits.seed), orbits.states[0, cut], range(cut.start, cut.stop)) for cut in Parallel(part=CHUNK).cuts(r)]
    return np.asarray(concatenated(_run(_realised, parts, SERIAL))["totals"])


def check_noise(return_map: ReturnMap, noise: Noise) -> None:
    """Refuse a noise that a map does not have, with an NsmapsError."""
    name, coordinates = type(return_map).__name__, Coordinates(return_map.coordinates)
    if noise.tau is not None:
        if not isinstance(return_map, FlowSystem):
            raise NsmapsError(
                f"noise with a correlation time, tau = {noise.tau:g}, of a {name}, which has no motion between its returns that "
                "it could force; expected: no tau, of noise on the images"
            )
    elif noise.scale is None and isinstance(return_map, FlowSystem):
        raise NsmapsError(
            f"the noise of a {name} has neither tau nor scale; expected: tau, the correlation time of a forcing, or scale, such "
            f"as {{{coordinates[0]}: 1}}, of noise on the images, whose coordinates differ in their units"
        )
    noise.sizes(coordinates)


def _of_images(return_map: ReturnMap, n: int, noise: Noise, step: float | None, impacts: int) -> tuple[Any, ...]:
    """What `kicked_realisations` needs besides the seed."""
    if n < 0 or step is not None or impacts:
        raise NsmapsError(
            f"{n} returns, a step of {step}, {impacts} impacts of noise on images; expected: a number that is not negative, and "
            "a step and impacts only of a forcing, which has a correlation time `tau`"
        )
    return return_map, noise.sizes(Coordinates(return_map.coordinates)), n


def _forced(
    return_map: ReturnMap,
    n: int,
    noise: Noise,
    tau: float,
    step: float | None,
    chatter: float,
    impacts: int,
    observables: "tuple[Observable, ...]" = (),
) -> tuple[float, tuple[Any, ...]]:
    """The step of the grid in time, and what `_realised` needs besides the seed."""
    system = FlowSystem.require(return_map, "noise with a correlation time")
    h = usual_step(system, tau) if step is None else float(step)
    if n < 0 or impacts < 0 or not 0 < h <= tau or not chatter >= 0:
        raise NsmapsError(
            f"{n} returns, a step of {h:g}, {impacts} impacts, chatter {chatter:g}; expected: a step "
            f"above 0 and at most tau = {tau:g}, numbers that are not negative"
        )
    law = linear_law(system) if in_closed_form(system) else (0.0, 0.0)
    _kernel_of(system, h, observables)
    how = (*law, h, noise.sigma), exact_step(*law, noise, h / SUBSTEPS), SUBSTEPS, chatter, n, impacts
    return h, (system, *how, observables)


def _blank(n: int, r: int, impacts: int, dim: int) -> Arrays:
    """Tables of R realisations none of whose returns is known, in the order of the arguments of the compiled loop."""
    return {
        "states": np.full((r, n + 1, dim), np.nan),
        "turns": np.zeros((r, n, dim), np.int32),
        "codes": np.zeros((r, n), np.int64),
        "outcome": np.zeros((r, n), np.int8),
        "time": np.full((r, n), np.nan),
        "eta": np.full((r, n + 1), np.nan),
        "impacts": np.full((r, impacts, 3), np.nan),
    }


def in_closed_form(system: FlowSystem) -> TypeGuard[ImpactSystem]:
    """Whether flights under noise are sums of those in closed form and of the noise's part."""
    return not system.obstacle()


def _kernel_of(system: FlowSystem, step: float, observables: "tuple[Observable, ...]") -> "SpectralKernel | DrivenKernel":
    """What computes one realisation."""
    if in_closed_form(system):
        return system._kernel().closed_form("orbits under noise")
    from nsmaps.exact.noise.driven import driven_kernel

    return driven_kernel(system, step, observables)


def _realised(how: tuple[Any, ...], starts: Floats, numbers: Sequence[int]) -> Arrays:
    """The tables of the realisations with the given numbers, and the totals of observables if there are any."""
    system, law, step, parts, chatter, n, impacts, observables, seed = how
    tables = _blank(n, len(numbers), impacts, starts.shape[1])
    tables["states"][:, 0] = starts
    kernel = _kernel_of(system, law[2], observables)
    if observables:
        tables["totals"] = np.empty((len(numbers), sum(len(one.formulas) for one in observables)))
    for i, number in enumerate(numbers):
        kernel.noisy_orbit(law, step, parts, chatter, generator(seed, number), tuple(table[i] for table in tables.values()))
    return tables
