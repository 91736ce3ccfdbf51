"""From fits to a result: distinct minima, errors, profiles, and the impacts side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import wrap
from nsmaps.estimation.records import Record
from nsmaps.estimation.result import LEVELS, POOR, Estimate, Minima, Pairs, Profile
from nsmaps.estimation.shooting.event_map import EventMap
from nsmaps.estimation.shooting.fitting import WEIGHTS, Fit
from nsmaps.estimation.shooting.inference import ProfileLine, Spread, crossing, misleads, profile
from nsmaps.estimation.shooting.problem import Problem, Shooting, enough_events, most_events

SAME = 0.5  #: standard errors within which minima of one chi2 are the same
TWO_SIGMA = 4.0  #: rise of chi2 at two standard errors


@dataclass(frozen=True)
class Found:
    """A fit with its spread, and the number of its start."""

    fit: Fit
    spread: Spread
    start: int


def estimate_of(
    problem: Problem,
    found: list[Found],
    records: tuple[Record, ...],
    profiled: bool | None,
    details: Callable[[Fit, float], dict[str, Any]],
) -> Estimate:
    """The result of all fits; `profiled` as of `estimate`, and `details` the fields on what was paired and on states."""
    found = sorted(found, key=lambda one: one.fit.cost)
    best, spread = found[0].fit, found[0].spread
    shooting, free, known = problem.shooting, problem.free, all(problem.noise_known)
    dof = int((~np.isnan(best.residuals)).sum()) - shooting.size  # what joins segments is as many as their unknowns
    noise = 1.0 if known else float(np.sqrt(best.chi2 / max(dof, 1)))
    errors = _errors(spread, noise, problem.scale[:free])
    probability = _probability(best.chi2, dof) if known and dof > 0 else float("nan")
    profiled = False if profiled is None and probability < POOR else profiled  # the errors of a false minimum say nothing
    lines = _profiles(problem, found[0], errors, noise, profiled)
    around, bent = intervals_of(best.x[:free], errors, lines, problem.limits)
    groups, names = distinct(found, free, noise), shooting.model.free
    return Estimate(
        names=names,
        values=best.x[:free].copy(),
        errors=errors,
        covariance=noise**2 * spread.covariance,
        intervals=with_rivals(around, [group[0] for group in groups], noise, problem.limits),
        profiled=bent,
        relative_errors=noise * spread.singular,
        directions=spread.directions,
        scale=problem.scale[:free],
        limits=np.array([each[:free] for each in problem.limits]).T,
        chi2=best.chi2 / noise**2,
        dof=dof,
        noise=noise,
        probability=probability,
        converged=best.converged,
        minima=minima_of(groups, free, noise),
        profiles={name: Profile(one.values, one.chi2 / noise**2) for name, one in zip(names, lines, strict=True) if one},
        records=records,
        coordinates=tuple(map(str, shooting.model.definition.coordinates)),
        **details(best, noise),
    )


def _errors(spread: Spread, noise: float, scale: Floats) -> Floats:
    """The standard errors, infinite of parameters that the data leave open."""
    errors = noise * np.sqrt(np.diag(spread.covariance))
    return np.where(errors > scale * 1e6, np.inf, errors)


def _probability(chi2: float, dof: int) -> float:
    """That of a larger sum of squares with so many degrees of freedom."""
    from scipy.stats import chi2 as distribution

    return float(distribution.sf(chi2, dof))


def _profiles(problem: Problem, found: Found, errors: Floats, noise: float, profiled: bool | None) -> list[ProfileLine | None]:
    """The profile of each parameter; without a wish only where two points of it differ from the parabola."""
    lines: list[ProfileLine | None] = []
    for number, error in enumerate(errors):
        reach = min(float(error), 0.2 * float(problem.scale[number]))
        wanted = profiled or (profiled is None and _is_curved(problem, found, number, reach, noise))
        lines.append(profile(problem, found.fit, number, reach, found.spread) if wanted else None)
    return lines


def _is_curved(problem: Problem, found: Found, number: int, error: float, noise: float) -> bool:
    """Whether residuals at two standard errors, all else moved along the parabola, are not those of the parabola."""
    covariance = found.spread.of_unknowns
    if not covariance[number, number] > 0:
        return True
    step = covariance[:, number] / covariance[number, number] * 2 * error
    expected = TWO_SIGMA * error**2 / (noise**2 * covariance[number, number]) * noise**2
    for sign in (-1.0, 1.0):
        x = found.fit.x + sign * step
        if not ((x >= problem.limits[0]) & (x <= problem.limits[1])).all():
            return True
        residuals = problem.shooting.values(x, found.fit.pairings, WEIGHTS[-1])
        rise = float((residuals**2).sum() - (found.fit.residuals**2).sum())
        if not abs(rise / expected - 1) < 0.3:
            return True
    return False


def intervals_of(
    values: Floats, errors: Floats, lines: Sequence[ProfileLine | None], limits: tuple[Floats, Floats]
) -> tuple[Floats, np.ndarray]:
    """Intervals (P, level, 2), and of which parameters they are those of the profile."""
    from scipy.stats import chi2 as distribution

    multiples = np.sqrt(distribution.ppf(LEVELS, 1))
    found = values[:, None, None] + errors[:, None, None] * multiples[:, None] * np.array([-1.0, 1.0])
    bent = [line is not None and misleads([line], values[k : k + 1], errors[k : k + 1])[0] for k, line in enumerate(lines)]
    for k, line in enumerate(lines):
        if line is not None and bent[k]:
            ends = np.array([crossing(line.values, line.chi2, multiple**2) for multiple in multiples])
            found[k] = np.where(np.isnan(ends), found[k], ends)
    low, high = (limit[: len(values), None] for limit in limits)
    return np.stack([np.maximum(found[..., 0], low), np.minimum(found[..., 1], high)], axis=-1), np.array(bent, bool)


def with_rivals(intervals: Floats, firsts: Sequence[Found], noise: float, limits: tuple[Floats, Floats]) -> Floats:
    """Intervals (P, level, 2) that enclose those of other minima, where these are as likely as the ends of the interval.

    The sum of squares near each is taken as quadratic.
    """
    from scipy.stats import chi2 as distribution

    best, free = firsts[0].fit, len(intervals)
    low, high = (limit[:free, None] for limit in limits)
    for one in firsts[1:]:
        room = distribution.ppf(LEVELS, 1) - (one.fit.cost - best.cost) / noise**2
        wide = noise * np.sqrt(np.diag(one.spread.covariance))[:, None] * np.sqrt(np.maximum(room, 1e-300))
        ends = [np.maximum(one.fit.x[:free, None] - wide, low), np.minimum(one.fit.x[:free, None] + wide, high)]
        enclosing = np.stack([np.minimum(intervals[..., 0], ends[0]), np.maximum(intervals[..., 1], ends[1])], axis=-1)
        intervals = np.where((room > 0)[:, None], enclosing, intervals)
    return intervals


def distinct(found: Sequence[Found], free: int, noise: float) -> list[list[Found]]:
    """Fits by the minimum that they reached, the best first."""
    groups: list[list[Found]] = []
    for one in found:
        for group in groups:
            first = group[0]
            errors = noise * np.sqrt(np.diag(first.spread.covariance))
            near = np.abs(one.fit.x[:free] - first.fit.x[:free]) <= SAME * errors
            if near.all() and abs(one.fit.cost - first.fit.cost) <= 0.5 * noise**2 + 1e-3 * first.fit.cost:
                group.append(one)
                break
        else:
            groups.append([one])
    return groups


def minima_of(groups: Sequence[Sequence[Found]], free: int, noise: float) -> Minima:
    """The distinct minima, the best first, with weights by Laplace's approximation."""
    firsts = [group[0] for group in groups]
    volumes = [0.5 * np.linalg.slogdet(one.spread.covariance)[1] for one in firsts]
    logs = np.array([-0.5 * one.fit.cost / noise**2 + volume for one, volume in zip(firsts, volumes, strict=True)])
    weights = np.exp(logs - logs.max())
    return Minima(
        np.array([one.fit.x[:free] for one in firsts]),
        np.array([one.fit.chi2 for one in firsts]) / noise**2,
        np.array([one.fit.unpaired for one in firsts]),
        weights / weights.sum(),
        np.array([len({one.start for one in group}) for group in groups]),
    )


def pairs_of(problem: Problem, best: Fit, records: Sequence[Record], scale: float) -> dict[str, Any]:
    """The fields of an estimate on what was paired, with the residuals of speeds and samples, and the largest defect."""
    shooting, lines = problem.shooting, []
    speeds, samples, defects = [np.zeros(0)], [np.zeros(0)], [0.0]
    event_map = shooting.model.at(best.x[: problem.free])
    for number, (record, pairing) in enumerate(zip(records, best.pairings, strict=True)):
        starts, offsets = shooting.starts(best.x, number)
        ends = np.append(starts[1:, -1], shooting.records[number].span[1])
        _, times = enough_events(event_map, starts, offsets, ends, most_events(shooting.records[number]))
        parts = shooting.parts(event_map, best.x, number, pairing) or [(np.zeros(0), np.zeros(0))] * 4
        speeds.append(parts[1][0])
        samples.append(parts[2][0])
        defects.append(float(np.abs(parts[3][0]).max(initial=0.0)))
        of_model = dict(zip(zip(*pairing.rows, strict=True), pairing.impacts.tolist(), strict=True))
        used = set(pairing.impacts.tolist())
        names = shooting.model.letters
        for letter, row in zip(pairing.model_letters, zip(*pairing.model_rows, strict=True), strict=True):
            k, time = of_model.pop(row, None), times[row] * record.time_unit
            mine = (record.times[k], record.walls[k]) if k is not None else (np.nan, "")
            lines.append((number, mine[0], time, mine[1], names[letter]))
        for row, k in of_model.items():  # at the ends of the record
            letter = _letter(event_map, shooting, best.x, number, row)
            lines.append((number, record.times[k], times[row] * record.time_unit, record.walls[k], letter))
        lines += [(number, record.times[k], np.nan, record.walls[k], "") for k in range(len(record.times)) if k not in used]
    return {
        "pairs": _sorted_pairs(lines, shooting, records, scale),
        "speed_residuals": np.concatenate(speeds) / scale,
        "sample_residuals": np.concatenate(samples) / scale,
        "defect": max(defects),
    }


def _sorted_pairs(lines: list[Any], shooting: Shooting, records: Sequence[Record], scale: float) -> Pairs:
    """Pairs by record and time: number of the record, time and time of the model, wall and wall of the model."""
    lines.sort(key=lambda line: (line[0], np.nanmin(line[1:3])))
    columns = list(zip(*lines, strict=True)) if lines else [()] * 5
    which, time, model_time = np.array(columns[0], int), np.array(columns[1], float), np.array(columns[2], float)
    noise = np.array([_noise_at(shooting, records, number, at) for number, at in zip(which, time, strict=True)])
    walls, model_walls = np.array(columns[3], str), np.array(columns[4], str)
    return Pairs(which, time, model_time, walls, model_walls, (model_time - time) / (scale * noise))


def _noise_at(shooting: Shooting, records: Sequence[Record], number: int, time: float) -> float:
    """The standard deviation of the time of an impact of a record, in its unit."""
    if np.isnan(time):
        return float("nan")
    k = int(np.argmin(np.abs(records[number].times - time)))
    return float(shooting.records[number].noise[k] * records[number].time_unit)


def _letter(event_map: EventMap, shooting: Shooting, x: Floats, number: int, row: tuple[int, int]) -> str:
    """The letter of one event of the model."""
    starts, offsets = shooting.starts(x, number)
    letters, _ = event_map.times(starts, offsets, row[1] + 2)
    return str(shooting.model.letters[letters[row]])


def starts_of(problem: Problem, x: Floats, records: Sequence[Record]) -> dict[str, Any]:
    """The fields of an estimate on the starts of segments, of each record."""
    model = problem.shooting.model
    event_map, names = model.at(x[: problem.free]), model.definition.coordinates
    first, last, times, phases = [], [], [], []
    for number, record in enumerate(records):
        starts, offsets = problem.shooting.starts(x, number)
        phase = wrap(event_map.rate * starts[:, -1] + offsets)
        rows = np.array([starts[:, model.names.index(name)] if name in model.names else phase for name in names]).T
        first.append(rows[0])
        last.append(rows[-1])
        times.append(starts[0, -1] * record.time_unit)
        phases.append(float(wrap(offsets[0])))
    return {"starts": np.array(first), "last_states": np.array(last), "start_times": np.array(times), "phases": np.array(phases)}
