"""Multiple shooting over returns: records of the section's coordinates at successive returns, such as strobed states.

Of a forced system whose section is at an event the section is put at a clock, where all states are coordinates. Each sample is
the start of a segment, so that what was measured is the first guess.
"""

from collections.abc import Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.errors import DataError, ParameterError, near_match
from nsmaps.estimation.records import Record
from nsmaps.estimation.result import Pairs
from nsmaps.estimation.shooting.event_map import EventModel, watched_modes
from nsmaps.estimation.shooting.fitting import WEIGHTS, Fit, is_measured, measured_chi2, minimize
from nsmaps.estimation.shooting.measured import sample_units
from nsmaps.estimation.shooting.problem import Pairing, Problem, Shooting
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.guards import Guard, PoincareSection

if TYPE_CHECKING:
    from nsmaps.exact.modes.kernel import ModeKernel

FAR = 25.0  #: squared difference of an image from a sample, in its variance, beyond which it does not count more
CLOCK, PHASE = "clock_", "clock_phase_"  #: names of the event and of the parameter of a section at a clock


@lru_cache(maxsize=64)
def strobed_class(cls: type[FlowSystem]) -> type[FlowSystem]:
    """The class of the same systems with the section at a clock: where the phase of the forcing is a further parameter."""

    def guards(self: Any, t: Any, y: SimpleNamespace) -> dict[str, Any]:
        from sympy import cos, pi, sin

        given, turn, phase = cls.guards(self, t, y), 2 * pi * t / self.period(), getattr(self, PHASE)
        function = sin(phase) * cos(turn) - cos(phase) * sin(turn)  # which falls where the turn is the phase
        return {**given, CLOCK: Guard(watched_modes(cls, self, t, y), function, letter="!", crossing=True)}

    def section(self: Any, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection(CLOCK, cls.states)

    body = {"guards": guards, "section": section, "__module__": __name__, "__qualname__": f"Strobed{cls.__name__}"}
    return type(f"Strobed{cls.__name__}", (cls,), {**body, "__annotations__": {PHASE: float}, PHASE: 0.0})


def strobed_system(system: FlowSystem, record: Record) -> FlowSystem:
    """A system with its section at the phase of a record; the system itself where this samples the phase, or there is none."""
    angles = [name for name, angle in zip(system.coordinates, system.coordinates.angles, strict=True) if angle]
    if not angles or system.period() is None or set(angles) & set(record.samples):
        return system
    if record.phase is None:
        raise DataError(
            f"the record has samples without times, and no phase; expected: sample_times, or `phase`, that of the forcing of "
            f"{type(system).__name__} at all samples"
        )
    cls = strobed_class(type(system))
    given: dict[str, Any] = {name: getattr(system, name) for name in type(system).model_fields}
    return cls.model_construct(**given | {PHASE: record.phase})


def empty_pairing() -> Pairing:
    """The pairing of a record without impacts."""
    none = np.zeros(0, int)
    return Pairing(none, (none, none), none, none, (none, none), 0, none, (none, none))


class ReturnShooting(Shooting):
    """The residuals of records of the section's c coordinates at successive returns, and of the returns between them."""

    def __init__(self, model: EventModel, records: Sequence[Record]) -> None:
        """The unknowns are the free parameters first, then all states of each record."""
        from nsmaps.exact.modes.kernel import known_definition

        self.model, self.records, self.offsets_free = model, (), []
        self.systems = [strobed_system(model.system, record) for record in records]
        self.coordinates = known_definition(self.systems[0]).coordinates
        parts = [measured_returns(model, record, self.coordinates) for record in records]
        self.measured, self.deviations = ([part[k] for part in parts] for k in (0, 1))
        self.begins = len(model.free) + np.concatenate([[0], np.cumsum([part.size for part in self.measured])])
        self.unit = np.nanmedian(np.concatenate(self.deviations), axis=0)
        self.pairings = [empty_pairing() for _ in records]
        self._pairings, self._known = (), None

    def states(self, x: Floats, number: int) -> Floats:
        """The states of a record, shape (M, c)."""
        return x[self.begins[number] : self.begins[number + 1]].reshape(-1, len(self.unit))

    def sizes(self, number: int, pairing: Pairing) -> tuple[int, int, int, int]:
        """The numbers of residuals of times, speeds, samples and continuity of a record."""
        measured = self.measured[number]
        return 0, 0, int(np.isfinite(measured).sum()), measured[1:].size

    def kernels(self, values: Floats) -> "list[ModeKernel]":
        """The return map of each record at values of the free parameters. ParameterError as `System.at`."""
        from nsmaps.exact.modes.kernel import ModeKernel

        given = dict(zip(self.model.free, map(float, values), strict=True))
        return [ModeKernel.of(system.at(**given)) for system in self.systems]

    def _residuals(self, x: Floats, pairings: Any, weight: float, derivative: bool = True) -> tuple[Floats, Floats]:
        free, rows = len(self.model.free), sum(sum(self.sizes(number, one)) for number, one in enumerate(self.pairings))
        try:
            kernels = self.kernels(x[:free])
        except ParameterError:
            return np.full(rows, np.inf), np.zeros((rows, self.size))
        values, slopes = [], []
        for number, kernel in enumerate(kernels):
            states, measured, noise = self.states(x, number), self.measured[number], self.deviations[number]
            known, places = np.isfinite(measured), np.arange(measured.size) + self.begins[number]
            by = np.zeros((measured.size, self.size))
            by[np.arange(measured.size), places] = 1.0 / noise.ravel()
            values.append((self.coordinates.difference(states, measured) / noise)[known])
            slopes.append(by[known.ravel()])
            jumps, jumps_by = self._jumps(kernel, states, places.reshape(measured.shape), derivative)
            values.append(weight * jumps)
            slopes.append(weight * jumps_by)
        found, by = np.concatenate(values), np.concatenate(slopes)
        return (found, by) if np.isfinite(found).all() and np.isfinite(by).all() else (np.full(rows, np.inf), np.zeros_like(by))

    def _jumps(self, kernel: "ModeKernel", states: Floats, places: Ints, derivative: bool) -> tuple[Floats, Floats]:
        """The images of states less the next ones over the noise, with derivatives by all unknowns."""
        returns = kernel.first_returns(np.ascontiguousarray(states[:-1]), derivative, SUMMED_SPEED)
        values = self.coordinates.difference(returns.image, states[1:]) / self.unit
        by = np.zeros((*values.shape, self.size))
        row, column = (each.reshape(values.shape) for each in np.nonzero(np.ones(values.shape, bool)))
        by[row, column, places[1:]] = -1.0 / self.unit
        if derivative:
            by[row[..., None], column[..., None], places[:-1, None]] = returns.slopes / self.unit[:, None]
            names = list(self.systems[0].parameter_names())
            for k, name in enumerate(self.model.free):
                rates = np.eye(len(names))[names.index(name)]
                by[..., k] = kernel.sensitivities(returns.start, rates, SUMMED_SPEED) / self.unit
        return values.ravel(), by.reshape(values.size, -1)

    def guess(self, values: Floats) -> tuple[Floats, float]:
        """The unknowns at values of the parameters, with images in place of missing samples, and how far images are from samples.

        The sum of squared differences, in standard deviations of an image, each 25 at most.
        """
        total, parts = 0.0, [np.asarray(values, float)]
        for kernel, measured, noise in zip(self.kernels(values), self.measured, self.deviations, strict=True):
            states = measured.copy()
            for k in range(1, len(states) if np.isnan(states).any() else 0):
                image = kernel.first_returns(states[k - 1 : k], False, SUMMED_SPEED).image[0]
                states[k] = np.where(np.isnan(states[k]), image, states[k])
            returns = kernel.first_returns(np.ascontiguousarray(states[:-1]), True, SUMMED_SPEED)
            spread = np.sqrt(np.einsum("kij,kj->ki", returns.slopes**2, noise[:-1] ** 2) + noise[1:] ** 2)
            far = (self.coordinates.difference(returns.image, states[1:]) / spread) ** 2
            total += float(np.minimum(np.nan_to_num(far, nan=FAR), FAR).sum())
            parts.append(states.ravel())
        return np.concatenate(parts), total

    def details(self, best: Fit, noise: float) -> dict[str, Any]:
        """The fields of an estimate on samples and on states, these at the section of the system that was given."""
        found, residuals, ends = [], [], []
        for number, (system, measured) in enumerate(zip(self.systems, self.measured, strict=True)):
            states, known = self.states(best.x, number), np.isfinite(measured)
            residuals.append((self.coordinates.difference(states, measured) / self.deviations[number])[known] / noise)
            ends.append(states[[0, -1]])
            if system is not self.model.system:
                phases = np.full((2, 1), getattr(system, PHASE))
                given = self.model.system.at(**dict(zip(self.model.free, best.x.tolist(), strict=False)))
                ends[-1] = given.arrivals(np.hstack([ends[-1], phases])).image
            found.append(getattr(system, PHASE, 0.0))
        jumps = best.residuals[~is_measured(self, self.pairings)]
        none, texts = np.zeros(0), np.zeros(0, str)
        return {
            "pairs": Pairs(np.zeros(0, int), none, none, texts, texts, none),
            "speed_residuals": none,
            "sample_residuals": np.concatenate(residuals),
            "starts": np.array([both[0] for both in ends]),
            "last_states": np.array([both[1] for both in ends]),
            "start_times": np.zeros(len(ends)),
            "phases": np.array(found),
            "defect": float(np.abs(jumps).max(initial=0.0)) / WEIGHTS[-1],
        }


def measured_returns(model: EventModel, record: Record, coordinates: Coordinates) -> tuple[Floats, Floats]:
    """What a record has of the coordinates at each return, shape (M, c), NaN where it has nothing, and standard deviations."""
    label = record.name or "the record"
    for name in record.samples:
        if name not in coordinates:
            near = near_match(name, coordinates)
            raise DataError(f"{label} has the coordinate {name!r}; expected: {', '.join(coordinates)}{near}")
    units = sample_units(model, record)
    empty = {name: np.full(record.returns, np.nan) for name in coordinates}
    table = np.column_stack([value / units.get(name, 1.0) for name, value in (empty | dict(record.samples)).items()])
    noise = np.column_stack([value / units.get(name, 1.0) for name, value in (empty | dict(record.sample_noise)).items()])
    missing = [name for name, known in zip(coordinates, np.isfinite(table[0]), strict=True) if not known]
    if missing or len(table) < 2:
        raise DataError(
            f"{label} begins without {', '.join(missing) or 'a second sample'}; expected: two returns or more, "
            f"and at the first all of {', '.join(coordinates)}"
        )
    return table, np.where(np.isfinite(noise), noise, np.nanmedian(noise, axis=0))


def fit_returns(problem: Problem, x: Floats) -> Fit | None:
    """The minimum reached from a guess, by continuity that tightens; None where the guess has no returns."""
    shooting = problem.shooting
    found: Any = None
    assert isinstance(shooting, ReturnShooting)
    for weight in WEIGHTS:
        found = minimize(problem, x, shooting.pairings, weight)
        if found is None:
            return None
        x = found.x
    values, _ = shooting.residuals(x, shooting.pairings, WEIGHTS[-1])
    chi2 = measured_chi2(shooting, values, shooting.pairings)
    return Fit(x, tuple(shooting.pairings), chi2, values, found.jac, 0, bool(found.status > 0))
