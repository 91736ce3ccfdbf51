"""Compiled code at work for one system with modes: its table handed over, what comes back as results."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.modes.definition import Definition, definition_of
from nsmaps.exact.modes.memory import memory
from nsmaps.exact.modes.returns import all_itineraries, first_returns, orbits, sensitivities
from nsmaps.exact.modes.tables import Tables, moved_of, tables_of
from nsmaps.exact.returns import Itineraries, Returns

if TYPE_CHECKING:
    from nsmaps.exact.hybrid import HybridSystem

CHUNK = 5_000  #: returns a thread takes at a time


@dataclass(frozen=True, slots=True)
class ModeKernel:
    """The compiled engine with the table of one system."""

    definition: Definition
    table: Tables
    values: tuple[float, ...]  #: of the parameters

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the return map."""
        return self.definition.coordinates

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of words."""
        return self.definition.letters

    def first_returns(self, start: Floats, derivative: bool) -> Returns:
        """First returns of a batch, shape (N, n), on all cores."""
        count, n = start.shape
        image, turns = np.empty((count, n)), np.zeros((count, n), np.int32)
        codes, outcome, time = np.zeros(count, np.int64), np.empty(count, np.int8), np.empty(count)
        tangents = np.empty((count if derivative else 1, n, n))
        table = self.table

        def run(k: slice) -> None:
            slopes = tangents[k] if derivative else tangents
            work = memory(table, n if derivative else 0)
            first_returns(table, start[k], image[k], turns[k], codes[k], outcome[k], time[k], slopes, work)

        in_chunks(count, run, CHUNK)
        slopes = tangents if derivative else None
        return Returns(self.coordinates, self.letters, start, image, turns, codes, outcome, time, slopes)

    def orbits(self, start: Floats, n: int, derivative: bool) -> Returns:
        """The first n returns of each of M states, shape (M, dim): n M rows, the first return of every state first."""
        m, dim = start.shape
        states, turns = np.empty((n + 1, m, dim)), np.zeros((n, m, dim), np.int32)
        codes, outcome, time = np.zeros((n, m), np.int64), np.empty((n, m), np.int8), np.empty((n, m))
        tangents = np.empty((n, m, dim, dim) if derivative else (1, 1, dim, dim))
        states[0] = start
        orbits(self.table, states, turns, codes, outcome, time, tangents, memory(self.table, dim if derivative else 0))
        rows = turns.reshape(-1, dim), codes.ravel(), outcome.ravel(), time.ravel()
        slopes = tangents.reshape(-1, dim, dim) if derivative else None
        return Returns(self.coordinates, self.letters, states[:-1].reshape(-1, dim), states[1:].reshape(-1, dim), *rows, slopes)

    def itineraries(self, start: Floats) -> Itineraries:
        """Itineraries and margins of the first returns of a batch, shape (N, n)."""
        n = len(start)
        outcome, codes, turns = np.empty(n, np.int8), np.empty(n, np.int64), np.empty(n, np.int32)
        clearance, slowest, table = np.empty(n), np.empty(n), self.table

        def run(k: slice) -> None:
            work = memory(table, 0, margins=True)
            all_itineraries(table, start[k], outcome[k], codes[k], turns[k], clearance[k], slowest[k], work)

        in_chunks(n, run, CHUNK)
        return Itineraries(self.letters, codes, turns, clearance, slowest, outcome)

    def sensitivities(self, start: Floats, rates: Floats) -> Floats:
        """The derivatives of the images of a batch, shape (N, n), by the parameters along a direction."""
        moves = np.zeros(start.shape)
        if rates.any():
            moved = moved_of(self.definition, self.table, self.values, rates)
            in_chunks(len(start), lambda k: sensitivities(self.table, start[k], moves[k], memory(self.table, 1, moved)), CHUNK)
        return moves


@lru_cache(maxsize=256)
def kernel_of(system: "HybridSystem") -> ModeKernel:
    """The kernel of a system; those used last are remembered."""
    definition = known_definition(system)
    values = tuple(system.parameters.values())
    return ModeKernel(definition, tables_of(definition, values), values)


DEFINITIONS: dict[object, Definition] = {}  #: by class, its fields other than numbers, and its formulas


def known_definition(system: "HybridSystem") -> Definition:
    """The formulas of a system's class, made when they are first asked for. Raises as `definition_of`."""
    cls = type(system)
    fixed = tuple((name, repr(getattr(system, name))) for name in cls.model_fields if name not in cls.parameter_names())
    key = cls, fixed, cls.horizon, (cls.period, cls.modes, cls.guards, cls.section)
    if key not in DEFINITIONS:
        DEFINITIONS[key] = definition_of(system)
    return DEFINITIONS[key]
