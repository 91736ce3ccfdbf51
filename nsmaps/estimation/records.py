"""Measured records: times and speeds of impacts and sampled states, in any units, as they are checked and read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.errors import DataError, near_match
from nsmaps.results import NONE, Result, array

TIME, WALL, SPEED, NOISE, SPEED_NOISE = "time", "wall", "speed", "noise", "speed_noise"
RETURN = "return"  #: column of the numbers of returns, in place of the time
COLUMNS = TIME, WALL, SPEED, NOISE, SPEED_NOISE
FASTEST, SLOWEST = 1e6, 1e-4  #: of the mean interval of impacts, in periods: beyond these the unit of time cannot be right


@dataclass(frozen=True, eq=False, repr=False)
class Record(Result):
    """A record of one motion: N impacts, and samples of states, each in the units of the record.

    Times count from any instant; `phase` is the phase of the forcing at time zero, None where it was not recorded, which is then
    estimated. A time in the system's unit is one of the record over `time_unit`, a length that over `length_unit`.

    Without any times, samples are those of the coordinates of the section at successive returns. If these include a phase and the
    samples do not, they are those of all states once a period of the forcing, at `phase`.
    """

    times: Floats = field(metadata=array("impact", "of impacts, which do not decrease"))
    walls: NDArray[np.str_] = field(metadata=array("impact", "letter of the wall or event; '' where it is unknown", NONE))
    speeds: Floats = field(metadata=array("impact", "impact speeds; NaN where they were not measured"))
    noise: Floats = field(metadata=array("impact", "standard deviations of the times; NaN where they are unknown"))
    speed_noise: Floats = field(metadata=array("impact", "standard deviations of the speeds"))
    sample_times: Floats = field(metadata=array("timed_sample", "of samples, in order; none of samples at returns"))
    samples: Mapping[str, Floats]  #: by state, shape (M,), NaN where it was not measured
    sample_noise: Mapping[str, Floats]  #: by state, shape (M,), standard deviations
    phase: float | None = None
    time_unit: float = 1.0  #: the system's unit of time in that of the record, as seconds
    length_unit: float = 1.0
    name: str = ""

    def summary(self) -> str:
        """The numbers that matter."""
        span, name = np.concatenate([self.times, self.sample_times]), f"{self.name}: " if self.name else ""
        if self.returns:
            return f"{name}{self.returns} returns with {', '.join(self.samples)}"
        samples = f", {len(self.sample_times)} samples of {', '.join(self.samples)}" if self.samples else ""
        return f"{name}{len(self.times)} impacts{samples}, time {span.min():.6g} to {span.max():.6g}"

    @property
    def returns(self) -> int:
        """The number of returns at which there are samples without times, 0 of other records."""
        timed = len(self.times) or len(self.sample_times) or not self.samples
        return 0 if timed else len(next(iter(self.samples.values())))

    @classmethod
    def of(
        cls,
        times: ArrayLike = (),
        walls: Sequence[str] | str | None = None,
        speeds: ArrayLike | None = None,
        noise: ArrayLike | None = None,
        speed_noise: ArrayLike | None = None,
        sample_times: ArrayLike = (),
        samples: Mapping[str, ArrayLike] | None = None,
        sample_noise: Mapping[str, ArrayLike] | float | None = None,
        phase: float | None = None,
        time_unit: float = 1.0,
        length_unit: float = 1.0,
        name: str = "",
    ) -> Self:
        """A record from arrays, checked.

        Args:
            times: of impacts, shape (N,).
            walls: a letter for each impact, '' where it is unknown; None if all are.
            speeds: impact speeds, shape (N,), NaN where there are none.
            noise: standard deviation of the times, one or shape (N,); None if it is unknown and to be estimated.
            speed_noise: of the speeds, needed where there are any.
            sample_times, samples, sample_noise: of sampled states, by the names of the states, and their standard deviations;
                without times at successive returns, NaN where there is none.
            phase, time_unit, length_unit, name: as the fields.

        Raises:
            DataError: with what is wrong, where, and what to do.
        """
        label = f"record {name!r}" if name else "the record"
        hits, at = _numbers(label, "times", times), _numbers(label, "sample_times", sample_times)
        at_returns = not len(hits) and not len(at) and bool(samples)
        if not len(hits) and not len(at) and not at_returns:
            raise DataError(
                f"{label} has no impacts and no samples; expected: times of impacts, or sampled states with their times"
            )
        for what, series in (("times", hits), ("sample_times", at)):
            _check_order(label, what, series)
        _check_units(label, {"time_unit": time_unit, "length_unit": length_unit})
        _check_phase(label, phase)
        letters = _letters(label, walls, len(hits))
        given = _column(label, "speeds", np.nan if speeds is None else speeds, len(hits))
        if (given < 0).any():
            raise DataError(
                f"{label}: speed {given[given < 0][0]:g} is negative; expected: impact speeds towards the wall, at least zero"
            )
        deviations = _deviations(label, "noise", np.nan if noise is None else noise, np.ones(len(hits), bool), noise is not None)
        of_speeds = _deviations(label, "speed_noise", np.nan if speed_noise is None else speed_noise, np.isfinite(given), True)
        count = np.size(next(iter(samples.values()))) if samples and at_returns else len(at)
        states = {key: _column(label, f"samples of {key}", value, count) for key, value in (samples or {}).items()}
        of_samples = _sample_deviations(label, states, sample_noise)
        if len(at) and not states:
            raise DataError(f"{label} has sample_times without samples; expected: samples={{'name of a state': values}}")
        return cls(hits, letters, given, deviations, of_speeds, at, states, of_samples, phase, time_unit, length_unit, name)

    @classmethod
    def read(cls, data: Any, **options: Any) -> Self:
        """A record from a CSV file, an xarray dataset, a table of pandas, or any mapping of columns; options as of `of`.

        Columns are `time`, and `wall`, `speed`, `noise` and `speed_noise` where they are known; all others are states, sampled at
        `time` instead of impacts, with their standard deviations in a column `x_noise` of the state `x` or in `sample_noise`.
        With a column `return`, whose whole numbers increase, in place of `time` they are samples at returns.

        Raises:
            DataError: as `of`; the file cannot be read, or has no column `time`.
        """
        columns = _csv(Path(data)) if isinstance(data, str | Path) else {str(key): np.asarray(data[key]) for key in data}
        if TIME not in columns and RETURN in columns:
            return cls.of(**{**_at_returns(columns), **options})
        if TIME not in columns:
            found = ", ".join(columns) or "none"
            raise DataError(f"no column {TIME!r}; the columns are {found}{near_match(TIME, columns)}; expected: times of impacts")
        states = {key: value for key, value in columns.items() if key not in COLUMNS and not key.endswith("_noise")}
        states = {key: value for key, value in states.items() if np.ndim(value) == 1}
        if not states:
            known = {"times": TIME, "walls": WALL, "speeds": SPEED, "noise": NOISE, "speed_noise": SPEED_NOISE}
            return cls.of(**{**{key: columns[column] for key, column in known.items() if column in columns}, **options})
        errors = {key: columns[f"{key}_noise"] for key in states if f"{key}_noise" in columns}
        return cls.of(**{"sample_times": columns[TIME], "samples": states, "sample_noise": errors or None, **options})


def _check_phase(label: str, phase: Any) -> None:
    if phase is not None and (isinstance(phase, str) or not np.isfinite(phase)):
        raise DataError(f"{label}: phase is {phase!r}; expected: radians at time zero, or None if it is unknown")


def _letters(label: str, walls: Sequence[str] | str | None, count: int) -> NDArray[np.str_]:
    """The letters of so many impacts, '' where they are unknown."""
    letters = np.array([""] * count if walls is None else [str(wall).strip() for wall in walls], str)
    if len(letters) != count:
        raise DataError(f"{label} has {len(letters)} walls for {count} impacts; expected: one for each, '' if unknown")
    return letters


def _at_returns(columns: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """The samples at returns of a table, with NaN at returns that it does not have."""
    number = _numbers("the record", RETURN, columns.pop(RETURN))
    if (number % 1 != 0).any() or (np.diff(number) <= 0).any():
        raise DataError(f"the column {RETURN!r} has {number.tolist()[:6]}; expected: whole numbers of returns, which increase")
    places, tables = (number - number[0]).astype(int), {}
    for key, value in columns.items():
        tables[key] = np.full(places[-1] + 1, np.nan)
        tables[key][places] = _column("the record", key, value, len(number))
    states = {key: value for key, value in tables.items() if not key.endswith("_noise")}
    noise = {key: tables[f"{key}_noise"] for key in states if f"{key}_noise" in tables}
    return {"samples": states, "sample_noise": noise or None}


def records_of(data: Any) -> tuple[Record, ...]:
    """Records from one or several, each a `Record`, the times of impacts, a file, a dataset or a table. DataError as there."""
    if isinstance(data, Record):
        return (data,)
    if isinstance(data, str | Path | Mapping) or hasattr(data, "data_vars") or hasattr(data, "columns"):
        return (Record.read(data),)
    if isinstance(data, Sequence) and data and not np.isscalar(data[0]):
        return tuple(record for one in data for record in records_of(one))
    return (Record.of(data),)


def _csv(path: Path) -> dict[str, NDArray[Any]]:
    """The columns of a CSV file with a header, separated by commas, tabs, or semicolons with decimal points or commas."""
    import csv

    try:
        lines = [
            line
            for line in path.read_text(encoding="utf-8-sig").splitlines()
            if line.strip() and not line.lstrip().startswith("#")
        ]
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(
            f"{path} cannot be read: {getattr(error, 'strerror', 'it is not a text file')}; expected: a CSV file with a header"
        ) from None
    separator = max(",;\t", key=lines[0].count) if lines else ","
    header, *rows = csv.reader(lines, delimiter=separator) if lines else [[]]
    if separator == ";":
        rows = [[value.replace(",", ".") for value in row] for row in rows]
    names = [name.strip() for name in header]
    for number, row in enumerate(rows, 1):
        if len(row) != len(names):
            raise DataError(f"{path}, row {number}: {len(row)} values for {len(names)} columns; expected: one for each")
    return {name: np.array([row[k] for row in rows], str) for k, name in enumerate(names)}


def _numbers(label: str, what: str, values: ArrayLike) -> Floats:
    """Finite numbers, shape (N,)."""
    found = _column(label, what, values, None)
    for k in np.flatnonzero(~np.isfinite(found)):
        raise DataError(
            f"{label}: number {k + 1} of {what} is {found[k]}; expected: finite times; leave out what was not measured"
        )
    return found


def _column(label: str, what: str, values: Any, count: int | None) -> Floats:
    """Numbers, shape (count,), empty texts as NaN."""
    raw = np.asarray(values)
    if raw.dtype.kind in "Mm":
        raise DataError(f"{label}: {what} are of type {raw.dtype}; expected: numbers, as (t - t[0]) / np.timedelta64(1, 's')")
    try:
        if raw.dtype.kind in "US":
            raw = np.where(np.char.strip(raw) == "", "nan", raw)
        found = np.atleast_1d(np.asarray(raw, float))
    except (TypeError, ValueError):
        raise DataError(f"{label}: {_not_a_number(what, raw)}; expected: numbers, with a decimal point") from None
    found = np.broadcast_to(found, (count,)).copy() if count is not None and found.shape == (1,) else found
    if found.ndim != 1 or (count is not None and len(found) != count):
        raise DataError(f"{label}: {what} have shape {found.shape}; expected: ({'N' if count is None else count},)")
    return found


def _not_a_number(what: str, values: NDArray[Any]) -> str:
    """The first value that cannot be read as a number, in words."""
    for k, value in enumerate(values.ravel().tolist()):
        try:
            float(value)
        except (TypeError, ValueError):
            return f"number {k + 1} of {what} is {value!r}"
    return f"{what} are not numbers"


def _deviations(label: str, what: str, values: Any, needed: NDArray[np.bool_], required: bool) -> Floats:
    """Positive standard deviations where they are needed."""
    found = _column(label, what, values, len(needed))
    wrong = needed & ~((found > 0) & (found < np.inf)) & (required | ~np.isnan(found))
    for k in np.flatnonzero(wrong):
        raise DataError(
            f"{label}: {what} {k + 1} is {found[k]:g}; expected: a finite standard deviation above zero, in the record's unit"
        )
    return found


def _sample_deviations(
    label: str, states: Mapping[str, Floats], noise: Mapping[str, ArrayLike] | float | None
) -> dict[str, Floats]:
    """The standard deviations of sampled states by name, from one for all or one for each."""
    given = noise if isinstance(noise, Mapping) else dict.fromkeys(states, noise)
    found = {}
    for key, value in states.items():
        own = given.get(key)
        found[key] = _deviations(label, f"sample_noise of {key}", np.nan if own is None else own, np.isfinite(value), True)
    return found


def _check_order(label: str, what: str, series: Floats) -> None:
    if len(series) > 1 and (series == series[0]).all():
        raise DataError(f"{label}: all {len(series)} {what} are {series[0]:.9g}; expected: {what} that increase")
    for k in np.flatnonzero(np.diff(series) < 0):
        raise DataError(
            f"{label}: {what} decrease from {series[k]:.9g} to {series[k + 1]:.9g} (numbers {k + 1} and {k + 2}); expected: one "
            "motion in order; sort them, or give each motion as a record of its own"
        )


def _check_units(label: str, units: Mapping[str, float]) -> None:
    for name, value in units.items():
        if isinstance(value, str) or not (np.isfinite(value) and value > 0):
            raise DataError(f"{label}: {name} is {value!r}; expected: the system's unit in that of the record, above zero")
