"""Parameters of a system from measured records, by multiple shooting from several starts."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from nsmaps.errors import DataError, NsmapsError
from nsmaps.estimation.records import Record, records_of
from nsmaps.estimation.result import Estimate
from nsmaps.estimation.shooting.event_map import EventModel
from nsmaps.estimation.shooting.fitting import Fit, fit
from nsmaps.estimation.shooting.growth import Guess, first_counts, first_guesses, grown, is_good
from nsmaps.estimation.shooting.guesses import EXCESS, Library, library_of
from nsmaps.estimation.shooting.inference import spread_of
from nsmaps.estimation.shooting.measured import after_transient, check_names, check_unit, return_time, shooting_of
from nsmaps.estimation.shooting.problem import GAP, Problem, check_model
from nsmaps.estimation.shooting.strobes import ReturnShooting, fit_returns
from nsmaps.estimation.space import Space, space_of
from nsmaps.estimation.summary import Found, estimate_of, pairs_of, starts_of
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import beat, shows

RETURNS = 8.0  #: returns of a segment
STARTS, REFINED = 33, 4  #: values of the parameters that are tried, and the best of them, which are fitted
UNIT_STARTS = 9  #: values of the parameters at which the time of returns is compared with that of the data
#: of time units that may be meant: time by twice or half, of minutes or seconds, by the angle or the number of turns
UNITS = 2.0, 0.5, 60.0, 1 / 60, 2 * np.pi, 0.5 / np.pi
LOSSES = "linear", "soft_l1", "huber", "cauchy", "arctan"


@shows
def estimate(
    system: System,
    data: Any,
    *,
    free: Sequence[str] | Mapping[str, tuple[float, float]],
    guess: Mapping[str, float] | None = None,
    n_guesses: int = STARTS,
    loss: str = "linear",
    n_returns: float = RETURNS,
    transient: float = 0.0,
    profile: bool | None = None,
    rng: int | np.random.Generator = 0,
) -> Estimate:
    """Parameters of a system from records of its motion, with standard errors: the least squares of times, speeds and samples.

    A record is cut into segments, whose starts are unknown and which are continuous (multiple shooting), so that chaotic
    motions can be fitted too; its beginning is fitted first, and the fit extended to the whole. Derivatives of times and states
    are exact, through every event. Impacts of record and model are paired by an alignment, in which missed and spurious ones have
    a price of 25 in chi2. Several minima are found by starts from
    a Sobol sequence over the bounds. Starts of motions are estimated, so that records may begin in a transient.

    Args:
        system: with values for all parameters; those of `free` are first guesses where `guess` has none.
        data: a `Record`, times of impacts, a CSV file, an xarray dataset, a table, or several of these.
        free: names of the parameters, or their bounds by name. Without bounds they are those of the class, and the search is
            over these or over half to twice the guess.
        guess: guesses of parameters, and of coordinates of the section.
        n_guesses: number of guesses from which it is searched; 1 for the guess alone.
        loss: of `scipy.optimize.least_squares`, robust ones as `soft_l1` against outliers.
        n_returns: of a segment, about; fewer where motions are strongly chaotic.
        transient: time at the beginning of each record that is left out, in its unit; of samples at returns so many of these.
        profile: whether to compute profile likelihoods; without, where the quadratic approximation misleads.
        rng: random numbers of the search.

    Raises:
        DataError: a record cannot be used, or no motion of the system resembles it.
        ParameterError: a parameter is unknown, or a guess out of bounds.
        NsmapsError: the system has no events, or an argument is out of range.
    """
    flow = FlowSystem.require(system, "an estimate from impacts and samples")
    if not (isinstance(n_guesses, int) and n_guesses > 0 and n_returns > 0 and transient >= 0 and loss in LOSSES):
        raise NsmapsError(
            f"n_guesses {n_guesses!r}, n_returns {n_returns}, transient {transient}, loss {loss!r}; expected: a whole number "
            f"above zero, above zero, at least zero, and one of {', '.join(LOSSES)}"
        )
    random = np.random.default_rng(rng)
    records = tuple(after_transient(record, transient) for record in records_of(data))
    space = space_of(system, free, dict(guess or {}))
    model = EventModel(flow, space.names)
    if any(record.returns for record in records):
        _check_size(model, space, records)
        return _of_returns(model, space, records, n_guesses, loss, profile, random)
    check_model(model)
    problem = _problem(model, space, records, n_returns, loss, random)
    found = _of_impacts(problem, space, records, n_guesses, profile, random)
    if found.describes:
        return found
    return replace(found, unit_factor=_unit_factor(model, space, records, n_returns, loss))


def _problem(
    model: EventModel, space: Space, records: tuple[Record, ...], n_returns: float, loss: str, random: np.random.Generator
) -> Problem:
    """The problem of records with times, checked. DataError if they cannot be of this system."""
    for record in records:
        check_names(model, record)
    _check_size(model, space, records)
    length = return_time(model, records)
    library = library_of(model, model.at(space.first), random, space.near(model), length)
    check_unit(model, length, chain([library], _libraries(model, space, length)))
    known = tuple(bool(np.isfinite(record.noise).all()) for record in records)
    shooting = shooting_of(model, records, library, n_returns, length)
    return Problem(shooting, *space.of_unknowns(shooting), loss, known)


def _of_impacts(
    problem: Problem,
    space: Space,
    records: tuple[Record, ...],
    n_guesses: int,
    profile: bool | None,
    random: np.random.Generator,
) -> Estimate:
    """An estimate from records with times."""
    fits = _fits(problem, space, n_guesses, return_time(problem.shooting.model, records), random)

    def details(best: Fit, noise: float) -> dict[str, Any]:
        return pairs_of(problem, best, records, noise) | starts_of(problem, best.x, records)

    return estimate_of(problem, _found(problem, fits, space), records, profile, details)


def _unit_factor(model: EventModel, space: Space, records: tuple[Record, ...], n_returns: float, loss: str) -> float | None:
    """The first of `UNITS` that makes, from the guess alone, a description of records that have none; None without.

    Its parameters are within the range of the search: rates of any size fit any unit.
    """
    low, high = space.searched
    for factor in UNITS:
        others = tuple(replace(one, time_unit=factor * one.time_unit) for one in records)
        with suppress(NsmapsError):  # no motion has such times
            problem, random = _problem(model, space, others, n_returns, loss, np.random.default_rng(0)), np.random.default_rng(0)
            library = library_of(model, model.at(space.first), random, space.near(model), return_time(model, others))
            guesses = first_guesses(problem, space.first, library, random, 0)
            near = any(one.cost < EXCESS * len(records) for one in guesses)
            found = _of_impacts(problem, space, others, 1, False, random) if near else None
            if found is not None and found.describes and ((low <= found.values) & (found.values <= high)).all():
                return factor
    return None


def _check_size(model: EventModel, space: Space, records: tuple[Record, ...]) -> None:
    """Refuse fewer measured numbers than unknowns: the free parameters, and the start of each record with its phase."""
    known, unknown = 0, len(space.names)
    for record in records:
        series = [record.times, record.speeds, *record.samples.values()]
        known += sum(int(np.isfinite(one).sum()) for one in series)
        phase = model.forced and record.phase is None
        unknown += len(record.samples) if record.returns else len(model.names) + 1 + phase
    if known < unknown:
        raise DataError(
            f"{known} measured numbers for {unknown} unknowns, which are {', '.join(space.names)} and the start of each record; "
            "expected: as many at least"
        )


def _libraries(model: EventModel, space: Space, length: float) -> Iterator[Library]:
    """Motions at some values of the parameters within the range of the search."""
    random = np.random.default_rng(0)
    for values in space.points(UNIT_STARTS, random)[1:]:
        with suppress(NsmapsError):  # no motion returns there
            yield library_of(model, model.at(values), random, space.near(model), length)


def _of_returns(
    model: EventModel,
    space: Space,
    records: tuple[Record, ...],
    n_guesses: int,
    loss: str,
    profile: bool | None,
    random: np.random.Generator,
) -> Estimate:
    """An estimate from samples at successive returns. DataError beside records of another kind."""
    if not all(record.returns for record in records):
        raise DataError("some records have samples without times, others have times; expected: an estimate from each kind")
    shooting = ReturnShooting(model, records)
    others = np.full(shooting.size - len(space.names), np.inf)
    low, high = space.searched
    scale = np.concatenate([high - low, np.tile(shooting.unit, len(others) // len(shooting.unit))])
    limits = np.concatenate([space.low, -others]), np.concatenate([space.high, others])
    problem = Problem(shooting, limits, scale, loss, (True,) * len(records))
    guesses = [(*shooting.guess(values), number) for number, values in enumerate(space.points(n_guesses, random))]
    first, *later = guesses
    chosen = [first, *sorted(later, key=lambda one: one[1])[:REFINED]]
    fits = [(one, number) for x, _, number in chosen if (one := fit_returns(problem, x)) is not None]
    return estimate_of(problem, _found(problem, fits, space), records, profile, shooting.details)


def _found(problem: Problem, fits: list[tuple[Fit, int]], space: Space) -> list[Found]:
    """Fits with their spread. DataError without any."""
    if not fits:
        raise DataError(
            f"no motion of {type(problem.shooting.model.system).__name__} resembles the data near {space.guess()}; expected: a "
            "record of this system, other bounds, or more `n_guesses`"
        )
    return [Found(one, spread_of(one, problem.free, problem.scale), number) for one, number in fits]


def _fits(problem: Problem, space: Space, n_guesses: int, length: float, random: np.random.Generator) -> list[tuple[Fit, int]]:
    """The minima that are reached from the guess and from the best of all starts, each with the number of its start."""
    model, guesses, found = problem.shooting.model, list[Guess](), list[tuple[Fit, int]]()
    counts, points = first_counts(problem.shooting), space.points(n_guesses, random)
    for number, values in enumerate(points):
        try:
            library = library_of(model, model.at(values), random, space.near(model), length)
        except NsmapsError:
            continue  # no motion returns at these values
        guesses += first_guesses(problem, values, library, random, number)
        beat(0.5 * (number + 1) / len(points))
    own = [one for one in guesses if one.number == 0]
    while guesses and not any(is_good(one) for one, _ in found):
        chosen, guesses = grown(problem, guesses, counts)
        found += [(reached, one.number) for one in chosen if (reached := fit(problem, one.x)) is not None]
    if all(number for _, number in found):
        chosen, _ = grown(problem, own, counts)
        found += [(reached, one.number) for one in chosen if (reached := fit(problem, one.x)) is not None]
    return found + _rivals(problem, guesses, counts, found)


def _rivals(problem: Problem, guesses: list[Guess], counts: list[int], found: list[tuple[Fit, int]]) -> list[tuple[Fit, int]]:
    """Minima reached from guesses that were not tried, of the start of the best one, which may lie beside it and be better."""
    if not found:
        return []
    best, number = min(found, key=lambda one: one[0].cost)
    limit = best.cost * (1 + GAP**2 / len(best.residuals))
    others, _ = grown(problem, [one for one in guesses if one.number == number and one.cost < EXCESS], counts, limit)
    return [(reached, number) for one in others if (reached := fit(problem, one.x)) is not None]
