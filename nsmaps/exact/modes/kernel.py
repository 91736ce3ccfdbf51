"""Compiled code at work for one system with modes: its table handed over, what comes back as results."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from itertools import pairwise
from typing import ClassVar, NoReturn

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import as_states
from nsmaps.errors import NsmapsError, StateError, SystemDefinitionError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.compiling.compiled import compilers
from nsmaps.exact.compiling.digest import code_of
from nsmaps.exact.events import Arrivals, ModeTrack
from nsmaps.exact.kernel import START, MotionKernel, ReturnRows, in_chunks, return_rows
from nsmaps.exact.modes.blocks.batch_scheduler import FEW, returns
from nsmaps.exact.modes.blocks.workspace import workspace
from nsmaps.exact.modes.definitions.build import definition_of
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.arriving import arrivals_of
from nsmaps.exact.modes.paths.placing import Surfaces, nearest_on_section, on_section, surfaces_of, why_off
from nsmaps.exact.modes.paths.reasons import arrival_reasons_of, reasons_of
from nsmaps.exact.modes.paths.tracks import extents_of, fastest_of, flights_of, impacts_of, mode_track, shortest_rest
from nsmaps.exact.modes.tables.memory import Memory, Record, memory
from nsmaps.exact.modes.tables.nonlinear import write_variations
from nsmaps.exact.modes.tables.tables import Tables, first_choices, moved_of, tables_of
from nsmaps.exact.returns import Impacts, Itineraries
from nsmaps.exact.systems.files import place_of
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.interrupts import check_stop

CHUNK = 5_000  #: returns a thread takes at a time
NEAR = 3  #: numbers of a return's margin, as of `Record`


@dataclass(frozen=True, eq=False)
class ModeKernel(MotionKernel):
    """The compiled engine with the table of one system."""

    system: HybridFormulas
    definition: Definition
    table: Tables
    values: tuple[float, ...]  #: of the parameters
    surfaces: Surfaces  #: on which starts lie, where some coordinates determine others
    chunk: ClassVar[int] = CHUNK

    def __post_init__(self) -> None:
        known = {name: getattr(self.definition, name) for name in ("coordinates", "letters", "alphabet")}
        for name, value in (known | {"integrated": bool(self.definition.smooth)}).items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, system: HybridFormulas) -> "ModeKernel":
        """The kernel of a system."""
        definition, values = known_definition(system), tuple(system.parameters.values())
        table = tables_of(definition, values)
        return cls(system, definition, table, values, surfaces_of(definition, table))

    @property
    def name(self) -> str:
        """A digest of the formulas and of the engine: equal names mean equal returns."""
        d = self.definition
        text = "\0".join([*map(str, (d.states, d.phase_rate, d.horizon, *d.rows, d.starts)), code_of(returns), *compilers()])
        return sha256(text.encode()).hexdigest()[:20]

    @property
    def modes(self) -> "ModeKernel":
        """This kernel."""
        return self

    def closed_form(self, what: str, refusal: type[NsmapsError] = NsmapsError) -> NoReturn:
        """Refused, as flights are not in closed form."""
        raise refusal(
            f"{what} need flights in closed form, and {type(self.system).__name__} {self.system.obstacle()}; expected: a system "
            "with a displacement, and no wall at which motions end"
        )

    def compute(self, rows: ReturnRows, chatter: float) -> None:
        """Compute returns from the starts in `rows`."""
        self._march(rows, memory(self.table, rows.tangents.shape[-1], chatter=chatter))

    def itineraries(self, start: Floats, chatter: float, speeds: Floats | None = None) -> Itineraries:
        """Itineraries and margins of first returns, these as shares of speeds by transition, shape (T,), if they are given."""
        units = np.ones(len(self.table.functions)) if speeds is None else speeds[first_choices(self.table)]
        rows, near = return_rows(start, 1, 0), np.zeros((1, len(start), NEAR))

        def run(k: slice) -> None:
            self._march(rows.part(k), memory(self.table, 0, None, units, chatter), near[:, k])

        in_chunks(len(start), run, self.chunk)
        (clearance, slowest, turns), (codes,), (outcome,) = near.reshape(-1, NEAR).T, rows.codes, rows.outcome
        return Itineraries(self.letters, codes, turns.astype(np.int32), clearance, slowest, outcome)

    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of first images by the parameters, which change at the rates (P,), shape (N, n)."""
        if not rates.any():
            return np.zeros(start.shape)
        rows, moved = return_rows(start, 1, 1), moved_of(self.definition, self.table, self.values, rates)
        in_chunks(len(start), lambda k: self._march(rows.part(k), memory(self.table, 1, moved, None, chatter)), self.chunk)
        return rows.tangents.reshape(start.shape)

    def _march(self, rows: ReturnRows, w: Memory, near: Floats | None = None) -> None:
        """Compute returns, and their margins if asked for; many in blocks."""
        p, directions = self.table, rows.tangents.shape[-1]
        if directions:
            write_variations(self.definition, p.variations, w.moved.here)
        margins = np.zeros((*rows.codes.shape, NEAR)) if near is None else near
        found = Record(*map(np.ascontiguousarray, (*rows, margins)))
        given = rows.start.copy()
        found.states[START] = self.starts(given)
        in_blocks = not p.taylor.any() and near is None and not p.resting.any() and rows.states.shape[1] >= FEW
        at, b = np.zeros(2, np.int64), workspace(p, directions, in_blocks, w.moved)
        while not returns(p, found, at, w, b):
            check_stop()
        if found.states is rows.states:
            rows.start[:] = given
        else:
            rows.images[:] = found.states[START + 1 :]

    def arrivals(self, states: ArrayLike, modes: str | Sequence[str] | None, derivative: bool) -> Arrivals:
        """As `HybridSystem.arrivals`."""
        return arrivals_of(self.definition, self.table, states, modes, derivative)

    def rests(self, start: Floats) -> Floats:
        """The shortest rest within each first return of a batch, shape (N, n), in units of time; NaN without."""
        known = self.first_returns(start, False, SUMMED_SPEED).valid & self.table.resting.any()
        rests = np.full(len(start), np.nan)
        rests[known] = [shortest_rest(self.definition, self.table, row) for row in start[known]]
        return rests

    def guard_speeds(self, start: Floats, between: bool) -> Floats:
        """As `HybridSystem.guard_speeds`, by transition, shape (T,); 1 of functions that do not change."""
        found, speeds = fastest_of(self.definition, self.table, start, between), np.ones(len(self.definition.transitions))
        for function, (begin, end) in enumerate(pairwise(self.table.choices)):
            speeds[self.table.chosen[begin:end]] = found[function] or 1.0
        return speeds

    def extents(self, start: Floats) -> Floats:
        """As `HybridSystem.extents`, of a batch, shape (N, n)."""
        return extents_of(self.definition, self.table, start)

    def track(self, start: Floats, n: int, samples: int, chatter: float) -> ModeTrack:
        """The motion from one state, shape (m,), through at most n events. Raises as `mode_track` and `as_states`."""
        (row,) = rows = as_states(start[None], self.coordinates)
        if not on_section(self.table, self.surfaces, rows).all():
            raise StateError(self._why_off(row))
        return mode_track(self.definition, self.table, row, n, samples, chatter)

    def impacts(self, start: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts and releases of an impact system from one state, shape (2,)."""
        return impacts_of(self.definition, self.table, start, n, chatter)

    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        return flights_of(self.definition, self.table, impacts, samples)

    def reasons(self, start: Floats, chatter: float) -> tuple[str, ...]:
        """As `HybridSystem.reasons`."""
        known = on_section(self.table, self.surfaces, start)
        sentences = iter(reasons_of(self.definition, self.table, start[known], chatter))
        return tuple(next(sentences) if on else self._why_off(row) for on, row in zip(known, start, strict=True))

    def on_section(self, start: Floats) -> Floats:
        """As `HybridSystem.on_section`, of a batch, shape (N, n)."""
        return nearest_on_section(self.table, self.surfaces, start)

    def starts(self, start: Floats) -> Floats:
        """A batch, shape (N, n), with NaN for rows that do not lie on the section."""
        return np.where(on_section(self.table, self.surfaces, start)[:, None], start, np.nan)

    def _why_off(self, row: Floats) -> str:
        return why_off(self.definition, self.table, self.surfaces, row)

    def arrival_reasons(self, states: ArrayLike, modes: str | Sequence[str] | None) -> tuple[str, ...]:
        """As `HybridSystem.arrival_reasons`."""
        return arrival_reasons_of(self.definition, self.table, states, modes)


DEFINITIONS: dict[object, Definition] = {}  #: by class, its fields other than numbers, and its formulas


def known_definition(system: HybridFormulas, driven: bool = False) -> Definition:
    """The formulas of a system's class, made when they are first asked for. Arguments and errors as `definition_of`."""
    cls = type(system)
    fixed = tuple((name, repr(value)) for name, value in choices_of(system).items())
    key = fixed, driven, *cls.definition_key()
    if key not in DEFINITIONS:
        try:
            DEFINITIONS[key] = definition_of(system, driven)
        except SystemDefinitionError as error:
            formula = next((name for name in cls.formulas() if f"{cls.__name__}.{name}" in str(error)), None)
            raise error if formula is None else SystemDefinitionError(f"{error}{place_of(cls, formula)}") from None
    return DEFINITIONS[key]
