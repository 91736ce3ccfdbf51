"""Multiple shooting: residuals of records, and of the continuity between segments of motion, with exact derivatives.

The unknowns are the free parameters and, of each record, the start of every segment (the coordinates of the section without
the phase, and the time) and the phase of the forcing if it was not recorded: H. G. Bock, in: Numerical Treatment of Inverse
Problems in Differential and Integral Equations, Birkhaeuser 1983, p. 95.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.errors import NsmapsError, ParameterError
from nsmaps.estimation.shooting.alignment import UNPAIRED, align
from nsmaps.estimation.shooting.event_map import EventMap, EventModel, Events

GAP = 5.0  #: in standard deviations: an impact further from that of the model was missed or is spurious
MARGIN = 4  #: events that are computed beyond those of a segment


@dataclass(frozen=True)
class Measured:
    """A record in the units of the system."""

    times: Floats  #: shape (N,), of impacts
    letters: Ints  #: shape (N,), -1 where the wall is unknown
    speeds: Floats
    noise: Floats
    speed_noise: Floats
    sample_times: Floats  #: shape (M,)
    places: Ints  #: shape (Q,), of the sampled states among all
    samples: Floats  #: shape (M, Q), NaN where there is none
    sample_noise: Floats
    offset: float | None  #: the phase at time zero, None if unknown
    segments: Floats  #: shape (S + 1,), times at which segments begin, and the end

    @property
    def span(self) -> Floats:
        """The first and last time of all that was measured."""
        known = np.concatenate([self.times, self.sample_times])
        return np.array([known.min(), known.max()])


@dataclass(frozen=True)
class Pairing:
    """Which events of the model belong to what was measured, of one record."""

    impacts: Ints  #: shape (K,), those of the record that are paired
    rows: tuple[Ints, Ints]  #: segment and number of the event of the model of each, shape (K,)
    nodes: Ints  #: shape (S - 1,), the event of each segment with which the next one begins
    sampled: Ints  #: shape (M',), the samples that lie on the motion
    sample_rows: tuple[Ints, Ints]  #: segment and number of the event before each
    missed: int  #: events of the model, within the record, without an impact of the record
    model_letters: Ints  #: shape (L,), of the events of the model within the record
    model_rows: tuple[Ints, Ints]  #: their segments and numbers

    def same(self, other: "Pairing | None") -> bool:
        """Whether two pairings are equal."""
        if other is None:
            return False
        pairs = [(self.impacts, other.impacts), (self.nodes, other.nodes), (self.sampled, other.sampled)]
        pairs += list(zip((*self.rows, *self.sample_rows), (*other.rows, *other.sample_rows), strict=True))
        return all(np.array_equal(a, b) for a, b in pairs)

    @property
    def events(self) -> int:
        """The number of events of each segment that are needed."""
        parts = [self.rows[1], self.nodes, self.sample_rows[1], np.zeros(1, int)]
        return int(max(part.max() for part in parts if len(part))) + 1


@dataclass(frozen=True)
class Units:
    """Scales of the unknowns: spreads of coordinates and the mean time of a return, and the noise relative to these."""

    coordinates: Floats  #: shape (c + 1,), the last for time
    noise: float  #: relative, by which continuity is measured


class Shooting:
    """The residuals of records under a model, as a function of all unknowns in one array."""

    def __init__(self, model: EventModel, records: Sequence[Measured], units: Units) -> None:
        """The unknowns are the free parameters first, then those of each record: starts, and the phase if it is unknown."""
        self.model, self.records, self.units = model, tuple(records), units
        self.width = len(model.names) + 1
        self.offsets_free = [model.forced and record.offset is None for record in records]
        sizes = [(len(r.segments) - 1) * self.width + free for r, free in zip(records, self.offsets_free, strict=True)]
        self.begins = len(model.free) + np.concatenate([[0], np.cumsum(sizes)])
        self._pairings: Sequence[Pairing] = ()
        self._known: tuple[bytes, float, tuple[Floats, Floats]] | None = None

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return int(self.begins[-1])

    def starts(self, x: Floats, number: int) -> tuple[Floats, Floats]:
        """The starts of the segments of a record, shape (S, c + 1), and the phase at time zero, shape (S,)."""
        record, own = self.records[number], x[self.begins[number] : self.begins[number + 1]]
        count = len(record.segments) - 1
        offset = own[-1] if self.offsets_free[number] else record.offset or 0.0
        return own[: count * self.width].reshape(count, self.width), np.full(count, offset)

    def pack(self, values: Floats, starts: Sequence[Floats], offsets: Sequence[float]) -> Floats:
        """All unknowns in one array."""
        parts = [np.asarray(values, float)]
        for start, offset, free in zip(starts, offsets, self.offsets_free, strict=True):
            parts += [start.ravel(), np.full(int(free), offset)]
        return np.concatenate(parts)

    def pair(self, x: Floats, scales: Sequence[float]) -> list[Pairing]:
        """The pairing of each record at some unknowns; `scales` are the least deviations of times with which they are aligned."""
        event_map = self.model.at(x[: len(self.model.free)])
        return [self._pair(event_map, x, number, scale) for number, scale in enumerate(scales)]

    def _pair(self, event_map: EventMap, x: Floats, number: int, scale: float) -> Pairing:
        record, (starts, offsets) = self.records[number], self.starts(x, number)
        ends = np.append(starts[1:, -1], record.span[1])
        letters, times = enough_events(event_map, starts, offsets, ends, most_events(record))
        section = np.isin(letters, [self.model.letters.index(letter) for letter in self.model.section])
        nodes = []
        for k, end in enumerate(ends[:-1]):
            distance = np.where(section[k, 1:] & np.isfinite(times[k, 1:]), np.abs(times[k, 1:] - end), np.inf)
            nodes.append(1 + int(np.argmin(distance)))
        stops = np.append(nodes, letters.shape[1]).astype(int)
        rows = [(k, j) for k, stop in enumerate(stops) for j in range(stop) if np.isfinite(times[k, j])]
        at = tuple(np.array(part, int) for part in zip(*rows, strict=True))
        found = align(record.times, record.letters, times[at], letters[at], np.maximum(record.noise, scale), GAP)
        paired = np.flatnonzero(found != UNPAIRED)
        partners = found[paired]
        seen = letters[at] >= 0
        inside = seen & (times[at] >= record.times.min(initial=np.inf)) & (times[at] <= record.times.max(initial=-np.inf))
        before = np.searchsorted(times[at], record.sample_times, side="right") - 1
        sampled = np.flatnonzero((before >= 0) & (before < len(times[at])))
        return Pairing(
            paired,
            (at[0][partners], at[1][partners]),
            np.array(nodes, int),
            sampled,
            (at[0][before[sampled]], at[1][before[sampled]]),
            int((inside & ~np.isin(np.arange(len(seen)), partners)).sum()),
            letters[at][inside],
            (at[0][inside], at[1][inside]),
        )

    def residuals(self, x: Floats, pairings: Sequence[Pairing], weight: float) -> tuple[Floats, Floats]:
        """Residuals over their standard deviations, and their derivatives by the unknowns; not finite where there is no motion.

        After those of the records those of continuity, times `weight`.
        """
        key = x.tobytes()
        if self._known is None or self._known[:2] != (key, weight) or self._pairings is not pairings:
            self._pairings = pairings
            self._known = key, weight, self._residuals(x, pairings, weight)
        return self._known[2]

    def values(self, x: Floats, pairings: Sequence[Pairing], weight: float) -> Floats:
        """The residuals without their derivatives."""
        return self._residuals(x, pairings, weight, False)[0]

    def _residuals(self, x: Floats, pairings: Sequence[Pairing], weight: float, derivative: bool = True) -> tuple[Floats, Floats]:
        try:
            event_map = self.model.at(x[: len(self.model.free)])
        except ParameterError:
            event_map = None
        values, slopes = [], []
        for number, pairing in enumerate(pairings):
            parts = self.parts(event_map, x, number, pairing, derivative) if event_map else None
            if parts is None:
                size = sum(self.sizes(number, pairing))
                values.append(np.full(size, np.inf))
                slopes.append(np.zeros((size, self.size)))
                continue
            for k, (value, by) in enumerate(parts):
                factor = weight if k == len(parts) - 1 else 1.0
                values.append(factor * value)
                slopes.append(factor * by)
        return np.concatenate(values), np.concatenate(slopes)

    def sizes(self, number: int, pairing: Pairing) -> tuple[int, int, int, int]:
        """The numbers of residuals of times, speeds, samples and continuity of a record."""
        record = self.records[number]
        speeds = np.isfinite(record.speeds[pairing.impacts]).sum()
        samples = np.isfinite(record.samples[pairing.sampled]).sum()
        return len(pairing.impacts), int(speeds), int(samples), len(pairing.nodes) * self.width

    def parts(
        self, event_map: EventMap, x: Floats, number: int, pairing: Pairing, derivative: bool = True
    ) -> list[tuple[Floats, Floats]] | None:
        """The residuals of times, speeds, samples and continuity of a record with derivatives; None if a motion ends before."""
        record, (starts, offsets) = self.records[number], self.starts(x, number)
        events = event_map.events(starts, offsets, max(pairing.events, 2), derivative)
        row, k = pairing.rows, pairing.impacts
        times = (events.time[row] - record.times[k]) / record.noise[k]
        found = [(times, self._by(number, row[0], events.time_by[row] / record.noise[k, None]))]
        found.append(self._speeds(event_map, number, pairing, events))
        found.append(self._samples(event_map, number, pairing, events))
        found.append(self._continuity(number, pairing, starts, events))
        if not all(np.isfinite(value).all() and np.isfinite(by).all() for value, by in found):
            return None
        return found

    def _speeds(self, event_map: EventMap, number: int, pairing: Pairing, events: Events) -> tuple[Floats, Floats]:
        record, known = self.records[number], np.isfinite(self.records[number].speeds[pairing.impacts])
        k, row = pairing.impacts[known], (pairing.rows[0][known], pairing.rows[1][known])
        speed, by = event_map.speeds(events.letter[row], events.states[row], events.states_by[row])
        noise = record.speed_noise[k]
        return (speed - record.speeds[k]) / noise, self._by(number, row[0], by / noise[:, None])

    def _samples(self, event_map: EventMap, number: int, pairing: Pairing, events: Events) -> tuple[Floats, Floats]:
        record, row = self.records[number], pairing.sample_rows
        if not len(pairing.sampled):
            return np.zeros(0), np.zeros((0, self.size))
        states, by = event_map.instants(events, row, record.sample_times[pairing.sampled])
        measured, noise = record.samples[pairing.sampled], record.sample_noise[pairing.sampled]
        known = np.isfinite(measured)
        values = (states[:, record.places] - measured) / noise
        which, _ = np.nonzero(known)
        return values[known], self._by(number, row[0][which], (by[:, record.places] / noise[:, :, None])[known])

    def _continuity(self, number: int, pairing: Pairing, starts: Floats, events: Events) -> tuple[Floats, Floats]:
        """The differences of the ends of segments from the starts of the next ones."""
        count, unit = len(pairing.nodes), self.units.coordinates * self.units.noise
        if not count:
            return np.zeros(0), np.zeros((0, self.size))
        row = np.arange(count), pairing.nodes
        places = [self.model.definition.states.index(name) for name in self.model.names]
        ends = np.column_stack([events.states[row][:, places], events.time[row]])
        ends_by = np.concatenate([events.states_by[row][:, places], events.time_by[row][:, None]], axis=1)
        values, by = (ends - starts[1:]) / unit, np.zeros((count * self.width, self.size))
        segment = np.repeat(np.arange(count), self.width)
        by += self._by(number, segment, (ends_by / unit[:, None]).reshape(count * self.width, -1))
        lines = np.arange(count * self.width)
        by[lines, self.begins[number] + self.width + lines] -= np.tile(1.0 / unit, count)
        return values.ravel(), by

    def _by(self, number: int, segments: Ints, by: Floats) -> Floats:
        """Derivatives by the directions of events of segments (R, D) as those by all unknowns, shape (R, size)."""
        free, lines = len(self.model.free), np.arange(len(segments))[:, None]
        table = np.zeros((len(segments), self.size))
        columns = self.begins[number] + segments[:, None] * self.width + np.arange(self.width)
        table[lines, columns] = by[:, : self.width]
        table[:, :free] = by[:, self.width : self.width + free]
        if self.offsets_free[number]:
            table[:, self.begins[number + 1] - 1] = by[:, -1]
        return table


@dataclass(frozen=True)
class Problem:
    """A problem of least squares: residuals, limits and scales of the unknowns, and how outliers count."""

    shooting: Shooting
    limits: tuple[Floats, Floats]  #: of all unknowns
    scale: Floats  #: of all unknowns
    loss: str  #: of `scipy.optimize.least_squares`
    noise_known: tuple[bool, ...]  #: of each record; without it times are aligned by their residuals alone

    @property
    def free(self) -> int:
        """The number of free parameters."""
        return len(self.shooting.model.free)


def enough_events(event_map: EventMap, starts: Floats, offsets: Floats, ends: Floats, max_events: int) -> tuple[Ints, Floats]:
    """Letters and times of so many events, `max_events` at most, that each motion reaches its end, or stops."""
    n = 2 + MARGIN
    while True:
        letters, times = event_map.times(starts, offsets, n)
        last = times[:, -MARGIN]
        if ((last > ends) | np.isnan(last)).all() or n >= max_events:
            return letters, times
        n = min(2 * n, max_events)


def most_events(record: Measured) -> int:
    """The number of events of a segment beyond which a motion has nothing to do with a record, as that of chatter."""
    return 200 + 8 * len(record.times)


def with_noise(record: Measured, noise: float) -> Measured:
    """A record whose unknown deviations of times are these."""
    return replace(record, noise=np.where(np.isnan(record.noise), noise, record.noise))


def check_model(model: EventModel) -> None:
    """Refuse a model without events that a sensor could see, or whose section is at a clock."""
    if not model.letters:
        raise NsmapsError(
            f"{type(model.system).__name__} has no event with a letter; expected: impacts or other events in its words"
        )
    if model.forced and not model.definition.coordinates.angles.any():
        raise NsmapsError(
            f"the section of {type(model.system).__name__} is at a clock, whose phase is fixed; expected: samples at this clock, "
            "without times, or a section at an event that the state determines, such as an impact"
        )
