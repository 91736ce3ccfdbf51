"""First guesses of the starts of segments: states that the model visits, scored by the impacts and samples that follow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import DataError
from nsmaps.estimation.shooting.event_map import EventMap, EventModel, before_system
from nsmaps.estimation.shooting.problem import Measured, Shooting, enough_events
from nsmaps.exact.returns import Returns

ORBITS, RETURNS = 48, 40  #: of the library of states
STATES = 600  #: of these, and of further ones within their range
CANDIDATES, NEAREST = 60, 40  #: starts that are scored for a segment, and those of them that are nearest in phase
TOLERANCE = 0.1  #: of the mean interval of impacts, or of the spread of a state: differences that score
SAMPLED = 10  #: samples of a segment that are scored


@dataclass(frozen=True)
class Library:
    """Starts of returns on the section of a model, as frequent as the time that they take."""

    states: Floats  #: shape (L, c), without the phase
    phase: Floats  #: shape (L,)
    next_phase: Floats  #: shape (L,), at the end of the return
    duration: Floats  #: shape (L,)
    typical: float  #: time of a return, as of one under way at a random instant

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
    orbits = system.orbits(starts, RETURNS)
    found = _weighted(orbits, rng, length)
    if found is None:
        raise DataError(
            f"no orbit of {system} returns from {ORBITS} starts; expected: parameters at which there are impacts, or a state in "
            "`start`"
        )
    low, high = np.quantile(found.start, [0.01, 0.99], axis=0)
    wide = 0.2 * (high - low) * ~angles
    box = np.where(angles, 0.0, low - (0 if model.is_impact else wide)), np.where(angles, TWO_PI, high + wide)
    inner = _weighted(system.first_return(rng.uniform(*box, (STATES, len(angles)))), rng, length)
    both = Returns.concatenate([found] if inner is None else [found, inner])
    phases = both.start[:, angles].sum(axis=1), both.image[:, angles].sum(axis=1)
    typical = float(np.nansum(orbits.time[orbits.valid] ** 2) / np.nansum(orbits.time[orbits.valid]))
    return Library(both.start[:, ~angles], *phases, both.time, typical)


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


def first_guess(
    shooting: Shooting, values: Floats, library: Library, rng: np.random.Generator, early: bool
) -> tuple[Floats, float]:
    """The unknowns at values of the parameters with the best-scoring starts, and the sum of the scores; `early` as variants."""
    event_map, total = shooting.model.at(values), 0.0
    starts, offsets = [], []
    for record in shooting.records:
        offset, own = record.offset, []
        for k in range(len(record.segments) - 1):
            candidates, phases = _candidates(event_map, record, k, library, offset, rng, early)
            scores = _scores(event_map, record, k, candidates, phases)
            best = int(np.argmin(scores))
            total += float(scores[best])
            own.append(candidates[best])
            offset = float(phases[best])
        starts.append(np.array(own))
        offsets.append(offset or 0.0)
    return shooting.pack(values, starts, offsets), total


def _candidates(
    event_map: EventMap,
    record: Measured,
    segment: int,
    library: Library,
    offset: float | None,
    rng: np.random.Generator,
    early: bool,
) -> tuple[Floats, Floats]:
    """Starts of a segment, shape (K, c + 1), and phases at time zero, shape (K,)."""
    begin, rate = float(record.segments[segment]), event_map.rate
    known = offset is not None and rate > 0
    possible = section_impacts(event_map.model, record)
    earlier = possible[possible <= begin + 1e-12 * abs(begin)][-(1 if (record.letters >= 0).all() else 2) :]
    parts = []
    if segment == 0 and len(possible) and early:
        first = possible[int(record.letters[0] < 0 and len(possible) > 1)]  # of walls unknown the second impact
        k = _nearest(library.next_phase, rate * first + offset if known else None, rng)
        parts.append((library.states[k], first - library.duration[k], library.phase[k]))
    for time in () if parts else earlier:
        k = _nearest(library.phase, rate * time + offset if known else None, rng)
        parts.append((library.states[k], np.full(len(k), time), library.phase[k]))
    if not parts:
        k = rng.integers(len(library.phase), size=CANDIDATES)
        back = rng.random(len(k)) * library.duration[k]
        if offset is not None and rate:
            back = ((rate * begin + offset - library.phase[k]) % TWO_PI) / rate
        parts.append((library.states[k], begin - back, library.phase[k]))
    states, times, phases = (np.concatenate(part) for part in zip(*parts, strict=True))
    return np.column_stack([states, times]), phases - rate * times if offset is None else np.full(len(times), offset)


def _nearest(phases: Floats, phase: float | None, rng: np.random.Generator) -> Ints:
    """Numbers of states in a library: those nearest in phase, and some of all."""
    others = rng.integers(len(phases), size=CANDIDATES - NEAREST if phase is not None else CANDIDATES)
    if phase is None:
        return others
    distance = np.abs((phases - phase + np.pi) % TWO_PI - np.pi)
    near = np.argsort(distance)[: 4 * NEAREST]
    return np.concatenate([rng.permutation(near)[:NEAREST], others])


def section_impacts(model: EventModel, record: Measured) -> Floats:
    """The times of the impacts of a record that may be events of the section."""
    section = [model.letters.index(letter) for letter in model.section]
    found: Floats = record.times[(record.letters < 0) | np.isin(record.letters, section)]
    return found


def _scores(event_map: EventMap, record: Measured, segment: int, starts: Floats, offsets: Floats) -> Floats:
    """How far the motions from starts are from what was measured in a segment, shape (K,)."""
    begin, end = record.segments[segment], record.segments[segment + 1]
    begin = begin if segment else record.span[0]
    mine = np.flatnonzero((record.times >= begin) & (record.times <= end))
    ends = np.full(len(starts), end)
    few = len(mine) + 2 * len(event_map.model.letters) + 2
    letters, times = event_map.times(starts, offsets, few) if len(mine) else enough_events(event_map, starts, offsets, ends, 100)
    found = np.zeros(len(starts))
    if len(mine):
        interval = TOLERANCE * (record.span[1] - record.span[0]) / max(len(record.times) - 1, 1)
        times = np.where((letters >= 0) & np.isfinite(times), times, np.inf)
        distances = np.abs(record.times[mine, None] - times[:, None, :])
        distances[(record.letters[mine, None] >= 0) & (record.letters[mine, None] != letters[:, None, :])] = np.inf
        inside = ((times >= begin - interval) & (times <= end + interval)).sum(axis=1)
        found = (np.minimum(distances.min(axis=2) / interval, 1.0) ** 2).sum(axis=1) + np.abs(inside - len(mine))
    sampled = np.flatnonzero((record.sample_times >= begin) & (record.sample_times <= end))
    if len(sampled):
        found += _sample_scores(event_map, record, sampled, starts, offsets, letters.shape[1])
    return found


def _sample_scores(event_map: EventMap, record: Measured, sampled: Ints, starts: Floats, offsets: Floats, n: int) -> Floats:
    """The squared differences of sampled states, in units of a share of their spread, each 1 at most, shape (K,)."""
    chosen = sampled[np.linspace(0, len(sampled) - 1, min(len(sampled), SAMPLED)).astype(int)]
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
