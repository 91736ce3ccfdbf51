"""Records in the units of a system, cut into segments, as a problem of multiple shooting."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nsmaps.errors import DataError, check_known
from nsmaps.estimation.records import Record
from nsmaps.estimation.shooting.event_map import EventModel
from nsmaps.estimation.shooting.fitting import mean_interval
from nsmaps.estimation.shooting.guesses import Library, segments_of
from nsmaps.estimation.shooting.problem import Measured, Shooting, Units, with_noise

SAMPLED = "samples", "sample_noise"  #: fields of records by state
UNKNOWN_NOISE = 0.01  #: of the mean interval of impacts: deviations that stand in for unknown ones
LONGER = 1.5  #: mean time of returns in the data over the greatest of the model, beyond which the unit of time is wrong
SHORTER = 300.0  #: a usual time of the model over that in the data, likewise: chatter may be short without a bound


def after_transient(record: Record, transient: float) -> Record:
    """A record without what was measured within a time, or so many returns, of its beginning. DataError if nothing is left."""
    if not transient > 0:
        return record
    if record.returns > transient:
        samples, noise = ({k: one[int(transient) :] for k, one in getattr(record, name).items()} for name in SAMPLED)
        return replace(record, samples=samples, sample_noise=noise)
    begin = float(np.concatenate([record.times, record.sample_times]).min(initial=np.inf)) + transient
    hits, at = record.times >= begin, record.sample_times >= begin
    if not hits.any() and not at.any():
        raise DataError(f"nothing of {record} is left after a transient of {transient:g}; expected: less than its length")
    names = "times", "walls", "speeds", "noise", "speed_noise"
    cut: dict[str, Any] = {name: getattr(record, name)[hits] for name in names}
    for name in SAMPLED:
        cut[name] = {key: value[at] for key, value in getattr(record, name).items()}
    return replace(record, **cut, sample_times=record.sample_times[at])


def return_time(model: EventModel, records: Sequence[Record]) -> float:
    """The time of a return in the records, by the number of impacts that may be at the section; NaN without any."""
    total, count = 0.0, 0.0
    for record in records:
        possible = record.times[np.isin(record.walls, [*model.section, ""])]
        if len(possible) > 1:
            total += float(np.ptp(possible)) / record.time_unit
            count += (len(possible) - 1) / (len(model.letters) if (record.walls == "").all() else 1)
    return total / count if total > 0 else np.nan


def check_unit(model: EventModel, length: float, libraries: Iterable[Library]) -> None:
    """Refuse records whose returns take a mean time `length` that motions do not have at any of several values of parameters."""
    low, high, typical = np.inf, 0.0, 0.0
    for library in libraries:
        low, high = min(low, library.means[0]), max(high, library.means[1])
        typical = typical or library.typical
        if np.isnan(length) or max(low / LONGER, typical / SHORTER) <= length <= high * LONGER:
            return
    raise DataError(
        f"returns take about {length:.3g} units of the system's time in the data, {length / typical:.2g} times as long as in "
        f"{type(model.system).__name__}, as no motion has; the unit of time may be wrong; expected: `time_unit`, the system's "
        "unit of time in that of the record"
    )


def shooting_of(model: EventModel, records: Sequence[Record], library: Library, returns: float, length: float) -> Shooting:
    """The residuals of several records, `length` as of `return_time`."""
    length = float(np.median(library.duration)) if np.isnan(length) else length
    measured, relative = [], []
    for record in records:
        one = measured_of(model, record, length, returns)
        one = with_noise(one, UNKNOWN_NOISE * mean_interval(one))
        measured.append(one)
        relative.append(one.noise / length)
        if len(one.sample_times):
            relative.append((one.sample_noise / (np.nanstd(one.samples, axis=0) + 1e-300)).ravel())
    noise = float(np.nanmedian(np.concatenate(relative)))
    return Shooting(model, measured, Units(np.append(library.spread, length), noise))


def measured_of(model: EventModel, record: Record, length: float, returns: float) -> Measured:
    """A record in the units of the system, whose mean return takes a time `length`. DataError if it cannot be one of it."""
    letters = np.array([model.letters.index(wall) if wall else -1 for wall in record.walls], int)
    unit, speed = record.time_unit, record.length_unit / record.time_unit
    times, at, names = record.times / unit, record.sample_times / unit, tuple(record.samples)
    empty, units = np.zeros((len(at), 0)), sample_units(model, record)
    table = np.column_stack([empty, *(record.samples[name] / units.get(name, 1.0) for name in names)])
    deviations = np.column_stack([empty, *(record.sample_noise[name] / units.get(name, 1.0) for name in names)])
    places = np.array([model.definition.states.index(name) for name in names], int)
    segments = segments_of(model, times, letters, at, returns * length)
    noise = record.noise / unit, record.speed_noise / speed
    return Measured(times, letters, record.speeds / speed, *noise, at, places, table, deviations, record.phase, segments)


def sample_units(model: EventModel, record: Record) -> dict[str, float]:
    """The units of the states of an impact system in those of a record; none of other systems, whose dimensions are unknown."""
    speed = record.length_unit / record.time_unit
    return {"place": record.length_unit, "v": speed} if model.is_impact else {}


def check_names(model: EventModel, record: Record) -> None:
    """Refuse walls and states that the system does not have."""
    cls, label = type(model.system).__name__, record.name or "the record"
    walls = [wall for wall in dict.fromkeys(record.walls.tolist()) if wall]
    for what, names, known in (("wall", walls, model.letters), ("state", record.samples, model.definition.states)):
        for name in names:
            check_known(f"{label} is not of {cls}: there is no {what}", name, known, DataError)
