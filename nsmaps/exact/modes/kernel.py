"""Compiled code at work for one system with modes: its table handed over, what comes back as results."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from itertools import pairwise

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import StateError, SystemDefinitionError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.compiling.compiled import code_of, compilers
from nsmaps.exact.events import Arrivals, ModeTrack
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.modes.blocks.lanes import block_of, motions
from nsmaps.exact.modes.blocks.wide import FEW, returns
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.definitions.reading import definition_of
from nsmaps.exact.modes.paths.arriving import arrivals_of
from nsmaps.exact.modes.paths.extents import extents_of, fastest_of
from nsmaps.exact.modes.paths.impacts import flights_of, impacts_of
from nsmaps.exact.modes.paths.placing import Surfaces, nearest_on_section, on_section, surfaces_of, why_off
from nsmaps.exact.modes.paths.reasons import arrival_reasons_of, reasons_of
from nsmaps.exact.modes.paths.tracks import mode_track, shortest_rest
from nsmaps.exact.modes.tables.memory import Memory, Moved, Record, memory, record
from nsmaps.exact.modes.tables.nonlinear import varied
from nsmaps.exact.modes.tables.tables import Tables, moved_of, tables_of
from nsmaps.exact.returns import Impacts, Itineraries, Returns
from nsmaps.exact.systems.files import place_of
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.interrupts import check_stop

CHUNK = 5_000  #: returns a thread takes at a time


@dataclass(frozen=True, slots=True)
class ModeKernel:
    """The compiled engine with the table of one system."""

    definition: Definition
    table: Tables
    values: tuple[float, ...]  #: of the parameters
    surfaces: Surfaces  #: on which starts lie, where some coordinates determine others

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the return map."""
        return self.definition.coordinates

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of words."""
        return self.definition.letters

    @property
    def name(self) -> str:
        """A digest of the formulas and of the engine: equal names mean equal returns."""
        d = self.definition
        text = "\0".join([*map(str, (d.states, d.phase_rate, d.horizon, *d.rows, d.starts)), code_of(returns), *compilers()])
        return sha256(text.encode()).hexdigest()[:20]

    def first_returns(self, start: Floats, derivative: bool, chatter: float = SUMMED_SPEED) -> Returns:
        """First returns of a batch, shape (N, n), on all cores."""
        return self._returns(self._batch(start, start.shape[1] if derivative else 0, chatter), derivative)

    def orbits(self, start: Floats, n: int, derivative: bool, chatter: float = SUMMED_SPEED) -> Returns:
        """The first n returns of each of M states, shape (M, dim): n M rows, the first return of every state first."""
        found = record(start, n, start.shape[1] if derivative else 0)
        self._prepare(found.tangents.shape[-1])
        self._computed(found, memory(self.table, found.tangents.shape[-1], chatter=chatter))
        return self._returns(found, derivative)

    def itineraries(self, start: Floats, chatter: float = SUMMED_SPEED, speeds: Floats | None = None) -> Itineraries:
        """Itineraries and margins of the first returns of a batch, shape (N, n), these as shares of speeds by transition (T,)."""
        units = np.ones(len(self.table.functions)) if speeds is None else speeds[self._leads]
        found = self._batch(start, 0, chatter, units=units)
        clearance, slowest, turns = found.near[0].T
        return Itineraries(self.letters, found.codes[0], turns.astype(np.int32), clearance, slowest, found.outcome[0])

    def sensitivities(self, start: Floats, rates: Floats, chatter: float = SUMMED_SPEED) -> Floats:
        """The derivatives of the images of a batch, shape (N, n), by the parameters along a direction."""
        if not rates.any():
            return np.zeros(start.shape)
        moved = moved_of(self.definition, self.table, self.values, rates)
        return self._batch(start, 1, chatter, moved).tangents[0, :, :, 0]

    def arrivals(self, states: ArrayLike, modes: str | Sequence[str] | None, derivative: bool) -> Arrivals:
        """As `HybridSystem.arrivals`."""
        return arrivals_of(self.definition, self.table, states, modes, derivative)

    def rests(self, start: Floats) -> Floats:
        """The shortest rest within each first return of a batch, shape (N, n), in units of time; NaN without."""
        known = self.first_returns(start, False).valid & self.table.resting.any()
        rests = np.full(len(start), np.nan)
        rests[known] = [shortest_rest(self.definition, self.table, row) for row in start[known]]
        return rests

    def guard_speeds(self, start: Floats, between: bool) -> Floats:
        """As `HybridSystem.guard_speeds`, by transition, shape (T,); 1 of functions that do not change."""
        found, speeds = fastest_of(self.definition, self.table, start, between), np.ones(len(self.definition.transitions))
        for function, (begin, end) in enumerate(pairwise(self.table.choices)):
            speeds[self.table.chosen[begin:end]] = found[function] or 1.0
        return speeds

    @property
    def _leads(self) -> Ints:
        """The first transition of each function, shape (S,)."""
        return np.asarray(self.table.chosen[self.table.choices[:-1]])

    def extents(self, start: Floats) -> Floats:
        """As `HybridSystem.extents`, of a batch, shape (N, n)."""
        return extents_of(self.definition, self.table, start)

    def track(self, start: Floats, n: int, samples: int, chatter: float = SUMMED_SPEED) -> ModeTrack:
        """The motion from one state, shape (m,), through at most n events. Raises as `mode_track` and `as_states`."""
        rows = as_states(start[None], self.coordinates)
        if not on_section(self.table, self.surfaces, rows).all():
            raise StateError(self._why_off(rows[0]))
        return mode_track(self.definition, self.table, rows[0], n, samples, chatter)

    def impacts(self, start: Floats, n: int, chatter: float = SUMMED_SPEED) -> Impacts:
        """As `ImpactSystem.impacts`, of a state that is a start, shape (2,)."""
        return impacts_of(self.definition, self.table, start, n, chatter)

    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        return flights_of(self.definition, self.table, impacts, samples)

    def reasons(self, start: Floats, chatter: float = SUMMED_SPEED) -> tuple[str, ...]:
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

    def _batch(
        self, start: Floats, directions: int, chatter: float, moved: Moved | None = None, units: Floats | None = None
    ) -> Record:
        """First returns of a batch, shape (N, n), on all cores."""
        parts: dict[int, Record] = {}
        self._prepare(directions)

        def run(k: slice) -> None:
            parts[k.start] = record(start[k], 1, directions)
            self._computed(parts[k.start], memory(self.table, directions, moved, units, chatter))

        in_chunks(len(start), run, CHUNK)
        ordered = [parts[begin] for begin in sorted(parts)] or [record(start, 1, directions)]
        return (
            ordered[0]
            if len(ordered) == 1
            else Record(*(np.concatenate(arrays, axis=1) for arrays in zip(*ordered, strict=True)))
        )

    def _prepare(self, directions: int) -> None:
        """Make the programs of derivatives of nonlinear modes, if there are directions."""
        if directions:
            varied(self.definition, self.table.variations)

    def _computed(self, found: Record, memory: Memory) -> None:
        """Compute a record; many returns in blocks, where no more than the image is asked for.

        Ctrl-C is heard within about a second.
        """
        p = self.table
        plain = found.tangents.shape[-1] == 0 and np.isnan(memory.near[0]) and (p.contacts < 0).all() and not p.taylor.any()
        wide = plain and found.states.shape[1] >= FEW
        at, o, b = np.zeros(2, np.int64), motions(p, wide), block_of(p)
        given = found.states[0].copy()
        found.states[0] = self.starts(given)
        while not returns(p, found, at, memory, o, b):
            check_stop()
        found.states[0] = given

    def _returns(self, found: Record, derivative: bool) -> Returns:
        """A record as a result, one row a return."""
        m = found.states.shape[-1]
        start, image, turns = (array.reshape(-1, m) for array in (found.states[:-1], found.states[1:], found.turns))
        rows = found.codes.ravel(), found.outcome.ravel(), found.time.ravel()
        slopes = found.tangents.reshape(-1, m, m) if derivative else None
        named = self.coordinates, self.letters
        integrated = bool(self.definition.smooth)
        return Returns(*named, start, image, turns, *rows, slopes, integrated=integrated, alphabet=self.definition.alphabet)


@lru_cache(maxsize=256)
def kernel_of(system: HybridFormulas) -> ModeKernel:
    """The kernel of a system; those used last are remembered."""
    definition = known_definition(system)
    values = tuple(system.parameters.values())
    table = tables_of(definition, values)
    return ModeKernel(definition, table, values, surfaces_of(definition, table))


DEFINITIONS: dict[object, Definition] = {}  #: by class, its fields other than numbers, and its formulas


def known_definition(system: HybridFormulas, driven: bool = False) -> Definition:
    """The formulas of a system's class, made when they are first asked for. Arguments and errors as `definition_of`."""
    cls = type(system)
    fixed = tuple((name, repr(value)) for name, value in choices_of(system).items())
    key = cls, fixed, cls.horizon, driven, cls.noise, *cls.formulas().values()
    if key not in DEFINITIONS:
        try:
            DEFINITIONS[key] = definition_of(system, driven)
        except SystemDefinitionError as error:
            formula = next((name for name in cls.formulas() if f"{cls.__name__}.{name}" in str(error)), None)
            raise error if formula is None else SystemDefinitionError(f"{error}{place_of(cls, formula)}") from None
    return DEFINITIONS[key]
