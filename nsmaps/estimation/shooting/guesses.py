"""First guesses of the starts of records: states that the model visits, scored by the impacts and samples that follow."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import DataError
from nsmaps.estimation.shooting.event_map import EventMap, EventModel, before_system
from nsmaps.estimation.shooting.problem import Measured
from nsmaps.exact.returns import Returns

ORBITS, RETURNS, BLOCK = 48, 40, 8  #: of the library of states, and returns of which mean times are taken
STATES = 600  #: of these, and of further ones within their range
CANDIDATES, NEAREST = 600, 400  #: starts that are fitted to the first impacts, and those of them that are nearest in phase
STAGES, GROWTH = 4, 1.4  #: beginnings to which starts are fitted, and the growth of the number of their instants
REFINED, ITERATIONS = 8, 8  #: starts that remain, and steps of each fit
LEAST, TINY, DAMPED = 1e-3, 1e-6, 1e3  #: fall of a cost, relative and absolute, and damping, beyond which a fit ends
SAME = 1e-4  #: of spreads: starts that differ by less are the same
EXCESS = 0.25  #: cost of an impact of the model that the record does not have, relative to a mean interval squared
TOLERANCE = 0.1  #: of the spread of a state: differences that score
SAMPLED = 10  #: samples that are scored


@dataclass(frozen=True)
class Library:
    """Starts of returns on the section of a model, as frequent as the time that they take."""

    states: Floats  #: shape (L, c), without the phase
    phase: Floats  #: shape (L,)
    next_phase: Floats  #: shape (L,), at the end of the return
    duration: Floats  #: shape (L,)
    typical: float  #: time of a return, as of one under way at a random instant
    means: tuple[float, float]  #: least and greatest mean time of `BLOCK` successive returns

    @property
    def spread(self) -> Floats:
        """The spread of each coordinate, shape (c,); its size where it has none."""
        spread = self.states.std(axis=0)
        return np.where(spread > 1e-9 * np.abs(self.states).max(axis=0), spread, np.abs(self.states).max(axis=0) + 1e-30)


def library_of(model: EventModel, event_map: EventMap, rng: np.random.Generator, near: Floats | None, length: float) -> Library:
    """States on orbits from random starts over four decades of size, or near one state, and any within their range.

    Returns that take about the time `length`, that of those in the data, are the most frequent; NaN if it is unknown.

    Raises:
        DataError: no orbit of the system returns.
    """
    system = before_system(event_map.system)
    angles = system.coordinates.angles
    size = 10.0 ** rng.uniform(-2, 1.5, (ORBITS, 1)) * np.abs(rng.normal(size=(ORBITS, len(angles))))
    size *= 1 if model.is_impact else rng.choice([-1, 1], size.shape)
    starts = np.where(angles, rng.uniform(0, TWO_PI, size.shape), size)
    if near is not None:
        starts[: ORBITS // 2, ~angles] = near * (1 + 0.2 * rng.normal(size=(ORBITS // 2, len(near))))
    orbits = system.orbits(system.on_section(starts), RETURNS)
    found = _weighted(orbits, rng, length)
    if found is None:
        raise DataError(
            f"no orbit of {system} returns from {ORBITS} starts; expected: parameters at which there are impacts, or a state in "
            "`start`"
        )
    low, high = np.quantile(found.start, [0.01, 0.99], axis=0)
    wide = 0.2 * (high - low) * ~angles
    box = np.where(angles, 0.0, low - (0 if model.is_impact else wide)), np.where(angles, TWO_PI, high + wide)
    inner = _weighted(system.first_return(system.on_section(rng.uniform(*box, (STATES, len(angles))))), rng, length)
    both = Returns.concatenate([found] if inner is None else [found, inner])
    phases = both.start[:, angles].sum(axis=1), both.image[:, angles].sum(axis=1)
    typical = float(np.nansum(orbits.time[orbits.valid] ** 2) / np.nansum(orbits.time[orbits.valid]))
    blocks = np.where(orbits.valid, orbits.time, np.nan).reshape(-1, BLOCK, ORBITS).mean(axis=1)
    means = float(np.nanmin(blocks, initial=np.inf)), float(np.nanmax(blocks, initial=0.0))
    return Library(both.start[:, ~angles], *phases, both.time, typical, means)


def _weighted(found: Returns, rng: np.random.Generator, length: float) -> Returns | None:
    """Returns drawn with probabilities that fall from those that take a time on, so that chatter does not prevail; None of none.

    Without the time it is that of the mean return.
    """
    known = np.flatnonzero(found.valid & (found.time > 0) & np.isfinite(found.start).all(axis=1))
    if not len(known):
        return None
    ratio = found.time[known] / (found.time[known].mean() if np.isnan(length) else length)
    share = np.minimum(ratio, 1 / ratio)
    return found.select(np.sort(rng.choice(known, STATES, p=share / share.sum())))


def variants_of(model: EventModel, records: Sequence[Measured]) -> tuple[bool, ...]:
    """Whether the first segments may begin at an impact of the record, before it, or either, as walls are unknown."""
    ways: set[bool] = set()
    for record in records:
        possible = section_impacts(model, record)
        if not len(possible):
            ways.add(False)
        elif (record.letters < 0).any():
            ways |= {False, True}
        else:
            ways.add(bool(possible[0] > record.span[0]))
    return tuple(sorted(ways))


def beginning(record: Measured, count: int) -> Measured:
    """The first impacts and samples of a record, so many together, with the segments that begin before the last of these."""
    instants = np.sort(np.concatenate([record.times, record.sample_times]))
    if count >= len(instants):
        return record
    end = instants[count - 1]
    hits, at = record.times <= end, record.sample_times <= end
    begins = record.segments[:-1]
    return replace(
        record,
        times=record.times[hits],
        letters=record.letters[hits],
        speeds=record.speeds[hits],
        noise=record.noise[hits],
        speed_noise=record.speed_noise[hits],
        sample_times=record.sample_times[at],
        samples=record.samples[at],
        sample_noise=record.sample_noise[at],
        segments=np.append(begins[(begins < end) | (begins == begins[0])], end),
    )


def first_starts(
    model: EventModel, record: Measured, library: Library, rng: np.random.Generator, early: bool
) -> list[tuple[Floats, float, float]]:
    """Starts of a record, shape (c + 1,), with phases at time zero and costs, the best first; `early` as variants.

    Of a model without free parameters. Starts are fitted to more and more impacts, after each of which the better half remains.
    """
    event_map = model.at([])
    unit = np.concatenate([library.spread, library.duration.mean(keepdims=True), [1.0]])
    x, count = _candidates(event_map, record, library, rng, early), first_count(model, record)
    for _ in range(STAGES):
        part = beginning(record, count)
        x, costs = _refined(event_map, part, x)
        if len(part.sample_times):
            costs = costs + _sample_scores(event_map, part, x[:, :-1], x[:, -1], count + 4)
        found = list[int]()
        for k in np.argsort(costs, kind="stable"):
            if np.isfinite(costs[k]) and all(np.abs((x[k] - x[j]) / unit).max() > SAME for j in found):
                found.append(int(k))
            if len(found) == max(len(x) // 2, REFINED):
                break
        x, costs, count = x[found], costs[found], int(np.ceil(GROWTH * count))
    return [(row[:-1], float(row[-1]), float(cost)) for row, cost in zip(x[:REFINED], costs[:REFINED], strict=True)]


def first_count(model: EventModel, record: Measured) -> int:
    """The number of instants of the shortest beginning: more than unknowns of a start."""
    return len(model.names) + 2 + (model.forced and record.offset is None)


def _refined(event_map: EventMap, record: Measured, x: Floats) -> tuple[Floats, Floats]:
    """Starts with phases, shape (K, c + 2), nearer to impacts, by Levenberg and Marquardt's method all at once, and their costs.

    Starts whose costs do not fall any more are left as they are.
    """
    if not len(record.times):
        return x, np.zeros(len(x))
    free = x.shape[1] - 1 + int(record.offset is None and event_map.rate > 0)
    best, costs, damping = x.copy(), np.full(len(x), np.inf), np.full(len(x), 1e-2)
    values, slopes = np.zeros((len(x), len(record.times))), np.zeros((len(x), len(record.times), free))
    left = np.arange(len(x))
    for _ in range(ITERATIONS):
        cost, value, slope = _compared(event_map, record, x, free)
        better = cost < costs[left]
        falls = np.where(better, cost < (1 - LEAST) * costs[left] - TINY, damping[left] < DAMPED)
        mine = left[better]
        best[mine], costs[mine], values[mine], slopes[mine] = x[better], cost[better], value[better], slope[better]
        damping[left] = np.clip(np.where(better, damping[left] / 10, damping[left] * 10), 1e-9, 1e9)
        left = left[falls]
        if not len(left):
            break
        squares = slopes[left].swapaxes(1, 2) @ slopes[left]
        squares += np.eye(free) * (damping[left, None] * np.einsum("kii->ki", squares) + 1e-12)[:, None, :]
        x = best[left]
        x[:, :free] -= np.linalg.solve(squares, slopes[left].swapaxes(1, 2) @ values[left, :, None])[..., 0]
        if event_map.model.is_impact:
            x[:, 0] = np.where(x[:, 0] > 0, x[:, 0], best[left, 0] / 2)
    return best, costs


def _compared(event_map: EventMap, record: Measured, x: Floats, free: int) -> tuple[Floats, Floats, Floats]:
    """Costs (K,) of starts, differences of times (K, N) and their derivatives (K, N, free), zero where they do not count.

    Squared differences of times from the nearest impact of the model with this letter count, in units of the mean interval, 1 at
    most, and each impact that the model has more.
    """
    hits, known = record.times, record.letters >= 0
    interval, rows = (hits[-1] - hits[0]) / max(len(hits) - 1, 1), np.arange(len(x))[:, None]
    events = event_map.events(x[:, :-1], x[:, -1], len(hits) + 4)
    times = np.where((events.letter >= 0) & np.isfinite(events.time), events.time, np.inf)
    away = times[:, None, :] - hits[:, None]
    away[known[:, None] & (events.letter[:, None, :] != record.letters[:, None])] = np.inf
    nearest = np.argmin(np.abs(away), axis=2)
    value = np.take_along_axis(away, nearest[..., None], axis=2)[..., 0] / interval
    places = np.arange(free) if free < x.shape[1] else np.append(np.arange(free - 1), -1)
    slope = events.time_by[rows, nearest][..., places] / interval
    near = (np.abs(value) < 1) & np.isfinite(slope).all(axis=2)
    inside = ((times >= hits[0] - 0.1 * interval) & (times <= hits[-1] + 0.1 * interval)).sum(axis=1)
    cost = np.where(near, value**2, 1.0).sum(axis=1) + EXCESS * np.maximum(inside - len(hits), 0)
    return cost, np.where(near, value, 0.0), np.where(near[..., None], slope, 0.0)


def _candidates(event_map: EventMap, record: Measured, library: Library, rng: np.random.Generator, early: bool) -> Floats:
    """Starts of a record with their phases at time zero, shape (K, c + 2)."""
    begin, rate, offset = float(record.segments[0]), event_map.rate, record.offset or 0.0
    known = record.offset is not None and rate > 0
    possible = section_impacts(event_map.model, record)
    if len(possible) and early:
        first = possible[int(record.letters[0] < 0 and len(possible) > 1)]  # of walls unknown the second impact
        k = _nearest(library.next_phase, rate * first + offset if known else None, rng)
        times = first - library.duration[k]
    elif len(possible) and possible[0] <= begin:
        k = _nearest(library.phase, rate * begin + offset if known else None, rng)
        times = np.full(len(k), begin)
    else:
        k = rng.integers(len(library.phase), size=CANDIDATES)
        back = rng.random(len(k)) * library.duration[k]
        if known:
            back = ((rate * begin + offset - library.phase[k]) % TWO_PI) / rate
        times = begin - back
    phases = library.phase[k] - rate * times if record.offset is None else np.full(len(times), offset)
    return np.column_stack([library.states[k], times, phases])


def _nearest(phases: Floats, phase: float | None, rng: np.random.Generator) -> Ints:
    """Numbers of states in a library: those nearest in phase, and some of all."""
    others = rng.integers(len(phases), size=CANDIDATES - NEAREST if phase is not None else CANDIDATES)
    if phase is None:
        return others
    distance = np.abs((phases - phase + np.pi) % TWO_PI - np.pi)
    near = np.argsort(distance)[:NEAREST]
    return np.concatenate([near, others])


def section_impacts(model: EventModel, record: Measured) -> Floats:
    """The times of the impacts of a record that may be events of the section."""
    section = [model.letters.index(letter) for letter in model.section]
    found: Floats = record.times[(record.letters < 0) | np.isin(record.letters, section)]
    return found


def _sample_scores(event_map: EventMap, record: Measured, starts: Floats, offsets: Floats, n: int) -> Floats:
    """The squared differences of sampled states, in units of a share of their spread, each 1 at most, shape (K,)."""
    count = len(record.sample_times)
    chosen = np.unique(np.linspace(0, count - 1, min(count, SAMPLED)).astype(int))
    events = event_map.events(starts, offsets, n)
    spread = 4 * TOLERANCE * np.nanstd(record.samples, axis=0) + 1e-300
    found = np.zeros(len(starts))
    for k in chosen:
        before = np.sum(events.time <= record.sample_times[k], axis=1) - 1
        rows = np.arange(len(starts)), np.maximum(before, 0)
        states, _ = event_map.instants(events, rows, np.full(len(starts), record.sample_times[k]))
        states[before < 0] = np.nan
        difference = np.abs(states[:, record.places] - record.samples[k]) / spread
        found += np.nansum(
            np.where(np.isnan(record.samples[k]), np.nan, np.nan_to_num(np.minimum(difference, 1.0), nan=1.0)) ** 2, axis=1
        )
    return found


def segments_of(model: EventModel, times: Floats, letters: Ints, sample_times: Floats, length: float) -> Floats:
    """The times at which segments of about a length begin, impacts where there are any, and the end of the record."""
    everything = np.concatenate([times, sample_times])
    first, last = float(everything.min()), float(everything.max())
    section = [model.letters.index(letter) for letter in model.section]
    possible = times[(letters < 0) | np.isin(letters, section)]
    grid = np.linspace(first, last, max(round((last - first) / length), 1) + 1)[:-1]
    if len(possible):
        grid = np.unique(possible[np.minimum(np.searchsorted(possible, grid), len(possible) - 1)])
        grid = grid[(grid < last - 0.1 * length) | (grid == grid[0])]
    return np.append(grid, last)
