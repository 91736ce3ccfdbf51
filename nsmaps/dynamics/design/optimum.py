"""The parameters at which a periodic motion delivers most, or least, of an observable, under conditions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Storable
from nsmaps.coordinates import StateLike, as_states
from nsmaps.dynamics.attractors.basins import Basins, basins
from nsmaps.dynamics.design.arguments import box, check_limits, family_of, first_point, observed, offsets_of, text
from nsmaps.dynamics.design.basin import Basin
from nsmaps.dynamics.design.conditions import BINDING, Condition, gains
from nsmaps.dynamics.design.problem import Point, Problem
from nsmaps.dynamics.design.search import LOST, Search
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.errors import NsmapsError
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import Progress, beat, shows
from nsmaps.results import Result, array

BALANCED = 1e-3  #: residual of a local optimum, at most
ROUNDS = 8  #: of a search that ends where the motion is found further on, or beside the conditions, at most


@dataclass(frozen=True, slots=True)
class Attempt(Storable):
    """What became of one start of the search."""

    start: dict[str, float]  #: the parameters from which it was begun, where the motion is
    end: dict[str, float]  #: those at which it ended
    value: float  #: of the observable there
    feasible: bool  #: whether all conditions but the share of the basin are met there
    message: str  #: why it ended
    evaluations: int  #: number of orbits computed with their observable
    residual: float = np.nan  #: as of `Optimum`; NaN where conditions are not met

    @property
    def optimal(self) -> bool:
        """True if it ended at a local optimum: all conditions are met, and the residual is at most 1e-3."""
        return self.feasible and self.residual <= BALANCED


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Optimum(Result):
    """The largest or least value of an observable that was found, with the motion there and all that limits it."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.optimum"

    observable: Observable
    per: str  #: mean per period of the forcing, per return or per time
    sense: str  #: max or min
    parameters: dict[str, float]
    value: float
    gradient: dict[str, float]  #: exact derivative of the value by each parameter
    residual: float  #: gradient over the parameters' ranges that active conditions leave, a share of the largest value met
    conditions: tuple[Condition, ...]
    orbit: PeriodicOrbit
    basins: Basins | None  #: what attracts at the optimum, of the given states
    attempts: tuple[Attempt, ...]  #: every start, in order
    flat: bool = False  #: whether all motions met have the same value, to 1e-9: the parameters have no effect on it
    size: float = 0.0  #: unit of the residual: the largest value met, or what its first derivatives make of the ranges

    def summary(self) -> str:
        """The numbers that matter."""
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.parameters.items())
        limits = ", ".join(each.name for each in self.conditions if each.active) or "no condition"
        found = f"{self.sense}imum of {self.observable.name} {self.value:.8g} per {self.per}"
        return f"{found} at {where}, residual {self.residual:.1g}; active: {limits}{'; flat: others are as good' * self.flat}"

    @property
    def active(self) -> tuple[str, ...]:
        """The names of the conditions and parameters on whose bounds it lies; empty inside of all."""
        return tuple(one.name for one in self.conditions if one.active)

    @property
    def evaluations(self) -> int:
        """The number of orbits computed with their observable, of all starts."""
        return sum(one.evaluations for one in self.attempts)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NoisyOptimum(Result):
    """The observable at an optimum under noise, for each of K amplitudes."""

    sigma: tuple[float, ...]
    value: Floats = field(metadata=array("amplitude", "mean over all realisations that did not end"))
    error: Floats = field(metadata=array("amplitude", "standard error"))

    def summary(self) -> str:
        """The numbers that matter."""
        rows = zip(self.sigma, self.value, self.error, strict=True)
        return "; ".join(f"sigma = {sigma:g}: {value:.6g} +- {error:.1g}" for sigma, value, error in rows)


@shows
def optimize(
    system: System | Callable[..., System],
    observable: ObservableLike,
    bounds: Mapping[str, tuple[float, float]],
    start: StateLike,
    *,
    guess: Mapping[str, float] | None = None,
    period: int = 1,
    sense: Literal["max", "min"] = "max",
    per: Literal["period", "return", "time"] | None = None,
    motion: str = "",
    multiplier: float | None = 0.95,
    graze: float = 0.01,
    states: Grid | ArrayLike | None = None,
    share: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    max_returns: int = 1000,
    n_guesses: int = 5,
    progress: Progress | None = None,
) -> Optimum:
    """The parameters within bounds at which a periodic motion delivers most, or least, of an observable: a local optimum.

    The motion is followed over the parameters from where it is known, with the same words. SLSQP finds the optimum of the mean
    with its exact gradient, from several starts; derivatives of the conditions are extrapolated central differences of
    neighbouring orbits. A step to where the motion is lost, or the class refuses the parameters, is shortened. Where the motion
    ceases to exist before there is an optimum, the last one found is returned, with the active condition `existence`.

    Args:
        system: an exact system, or a function of other parameters that gives one, as of physical quantities.
        observable: a name, an `Observable` or its keys, as of `observe`.
        bounds: least and greatest value of each parameter.
        start: its first state, or all of them, as of `periodic_orbit`.
        guess: the parameters, within the bounds, at which `start` is near the motion; those of the system if omitted.
        period: of the motion, in returns.
        sense: "max" or "min".
        per: the mean per "period" of the forcing, the default where there is one, per "return" or per unit of "time".
        motion: its word or its name, such as BTB or 1:1/T, if it is to be checked.
        multiplier: largest magnitude of its multipliers, up to 1; None admits unstable motion.
        graze: least margin from a graze, in the units of branches: impact speeds as shares of the largest on the orbit, gaps to
            walls that are not met as shares of the distance flown at it in a radian of phase.
        states: whose basins are computed at the optimum, as of `basins`; None for none.
        share: of these states that is at least to come to the motion. It is sampled and has no derivative: where the optimum of
            SLSQP has less, the best point that holds it is sought in boxes of all sizes around that, and around the best one
            known, down to 4e-3 of the bounds, with the same states. Neighbours within 1e-3 of the bounds have to hold it too.
        tolerances: of parameters. The share is also to be kept where one of them differs by its tolerance, either way, since the
            basins of attractors that come and go change with every parameter.
        max_returns: within which a state is to come to the motion.
        n_guesses: number of `guess` and points of a Halton sequence in the bounds, each moved towards `guess` as far as the
            motion is lost there.
        progress: called now and then with the fraction of the starts that is done, from 0 to 1.

    Raises:
        NsmapsError: an argument is not valid, there is no such motion at `guess`, the observable has no derivative, no motion
            was found that meets the conditions, or no search ends at an optimum or where the motion ceases to exist.
    """
    counts = {"period": period, "n_guesses": n_guesses, "max_returns": max_returns}
    check_limits(sense, multiplier, graze, share, counts, states is not None)
    system_of, guess = family_of(system, bounds, guess)
    (names, low, high, first), offsets = box(bounds, guess), offsets_of(tolerances or {}, bounds)
    what, mean = observed(system_of(**{name: float(guess[name]) for name in names}), observable, per)
    problem = Problem(system_of, names, low, high, what, mean, multiplier, graze)
    problem.known.append(first_point(problem, first, start, period, motion))
    search = Search(problem, -1.0 if sense == "max" else 1.0)
    (best, attempts, edge), basin, lies_on_share = _searched(search, first, n_guesses), None, False
    if states is not None:
        sample = states.states() if isinstance(states, Grid) else as_states(states, best.system.coordinates)
        basin = Basin(search, sample, max_returns, share, offsets)
        lies_on_share = basin.share(best) < share
        best, edge = (_with_share(basin, best), False) if lies_on_share else (best, edge)
    found = None if states is None else basins(best.system, states, max_returns=max_returns)
    conditions, left = _all_conditions(search, best, edge, basin, lies_on_share)
    gradient = dict(zip(names, (best.gradient / (high - low)).tolist(), strict=True))
    about = what, mean, sense, problem.parameters(best.at), best.value, gradient, _residual(search, left), conditions
    flat = not any(one.active for one in conditions) and search.flat(best.at)
    return Optimum(*about, best.orbit, found, attempts, flat, problem.size)


def _searched(search: Search, first: Floats, starts: int) -> tuple[Point, tuple[Attempt, ...], bool]:
    """The best motion of searches from several starts, what became of each, and whether it lies where the motion is lost."""
    ends, attempts, edges = [], [], []
    for number, at in enumerate(_spread(first, starts)):
        end, attempt, edge = _attempt(search, at)
        ends.append(end)
        attempts.append(attempt)
        edges.append(edge)
        beat((number + 1) / starts)
    return _best(search, ends, attempts, edges), tuple(attempts), not any(attempt.optimal for attempt in attempts)


def _spread(first: Floats, starts: int) -> Floats:
    """The first parameters and points of a Halton sequence, shape (starts, k)."""
    from scipy.stats.qmc import Halton

    return np.vstack([first, Halton(len(first), scramble=False).random(starts)[1:]])


def _attempt(search: Search, at: Floats) -> tuple[Floats, Attempt, bool]:
    """Where the search ends from one start, what became of it, and whether the motion is lost further on.

    It continues where the motion is found a little further along what is left of the gradient, and is better there; where it ends
    beside the conditions, from the best parameters on its way that meet them.
    """
    problem = search.problem
    before, begun = len(problem.known), search.begun(at)
    further: Floats | None = begun
    for _ in range(ROUNDS + 1):
        if further is None:
            break
        ended, message = search.run(further)
        end = search.kept(ended, before)
        residual, further, edge = _left(search, end)
        further = further if end is ended else end
    point, _ = search.here(end)
    assert point is not None
    about = point.value, search.met(end), LOST if edge else message, len(problem.known) - before
    return end, Attempt(problem.parameters(begun), problem.parameters(end), *about, residual), edge


def _left(search: Search, end: Floats) -> tuple[float, Floats | None, bool]:
    """The residual where a search ends, better parameters further on if it is large, and whether the motion is lost there."""
    point, _ = search.here(end)
    if point is None or not search.met(end):
        return np.nan, None, False
    left = _conditions(search, point)[1]
    residual = _residual(search, left)
    return (residual, *search.beyond(end, left)) if residual > BALANCED else (residual, None, False)


def _residual(search: Search, left: Floats) -> float:
    """The length of what is left of a gradient, as a share of the largest value met."""
    return float(np.linalg.norm(left)) / search.problem.size


def _best(search: Search, ends: list[Floats], attempts: list[Attempt], edges: list[bool]) -> Point:
    """The best of the local optima that meet the conditions; without one the best motion where it ceases to exist further on."""
    known = [(end, attempt.optimal, edge) for end, attempt, edge in zip(ends, attempts, edges, strict=True) if attempt.feasible]
    some = [end for end, optimal, _ in known if optimal] or [end for end, _, edge in known if edge]
    points = [point for point in (search.here(end)[0] for end in some) if point is not None]
    if points:
        return min(points, key=lambda point: search.sign * point.value)
    if known:
        nearest = min((attempt for attempt in attempts if attempt.feasible), key=lambda attempt: attempt.residual)
        raise NsmapsError(
            f"no search ends at an optimum; the nearest does at {text(nearest.end)} with the residual {nearest.residual:.3g}: "
            f"{nearest.message}; expected: narrower bounds, or more starts"
        )
    near = search.here(max(ends, key=lambda end: float(search.here(end)[1].min(initial=0.0))))[0]
    assert near is not None
    missed = [one for one in _conditions(search, near)[0] if one.margin < 0]
    what = ", ".join(f"{one.name} {one.value:.6g}" for one in missed)
    limit = ", ".join(f"at most {one.high:g}" if one.value > one.high else f"at least {one.low:g}" for one in missed)
    where = text(search.problem.parameters(near.at))
    raise NsmapsError(f"no motion that meets the conditions was found; nearest at {where}: {what}; expected: {limit}")


def _with_share(basin: Basin, best: Point) -> Point:
    """The best motion whose basin holds the share that is asked for."""
    found = basin.best(best.at)
    if found is None:
        largest = max(basin.shares.values())
        raise NsmapsError(
            f"the basin holds at most {largest:.3g} of {len(basin.states)} states, over {len(basin.shares)} parameters from the "
            f"optimum at {text(basin.search.problem.parameters(best.at))} on; expected: {basin.least:g}"
        )
    return found


def _all_conditions(
    search: Search, point: Point, edge: bool, basin: Basin | None, lies_on_share: bool
) -> tuple[tuple[Condition, ...], Floats]:
    """As `_conditions`, with that of existence, at whose `edge` an optimum may be, and that of the share of a basin."""
    conditions, left = _conditions(search, point, lies_on_share)
    if edge:
        conditions += (Condition("existence", 0.0, 0.0, np.inf, True, np.nan),)
    if basin is not None:
        gain = np.nan if lies_on_share else 0.0
        conditions += (Condition("share", basin.share(point), basin.least, np.inf, lies_on_share, gain),)
    return conditions, left


def _conditions(search: Search, point: Point, unknown: bool = False) -> tuple[tuple[Condition, ...], Floats]:
    """The conditions at a motion, and what those that are active leave of the gradient of what is maximised, shape (k,).

    Gains and the latter are NaN where they are `unknown`, since a condition without derivative is active.
    """
    problem = search.problem
    now, count = problem.conditions(point.system, point.orbit), len(problem.names)
    slopes = np.vstack([problem.slopes(point), np.eye(count), -np.eye(count)])
    active = np.concatenate([now, point.at, 1 - point.at]) <= BINDING
    each = np.zeros(len(active))
    each[active], left = gains(-search.sign * point.gradient, slopes[active])
    if unknown:
        each[active], left = np.nan, np.full(count, np.nan)
    motion, sides = problem.limits(point, active[: len(now)], each[: len(now)]), slice(len(now), None)
    gain = each[sides].reshape(2, -1).sum(axis=0) / (problem.high - problem.low)
    on = np.atleast_1d(active[sides].reshape(2, -1).any(axis=0)).tolist()
    rows = problem.parameters(point.at).items(), problem.low.tolist(), problem.high.tolist(), on, gain.tolist()
    own = [Condition(*value, low, high, there, more) for value, low, high, there, more in zip(*rows, strict=True)]
    return (*motion, *own), left
