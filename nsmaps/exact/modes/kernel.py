"""Compiled code at work for one system with modes: its table handed over, what comes back as results."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.modes.definition import Definition, definition_of
from nsmaps.exact.modes.returns import first_returns, room
from nsmaps.exact.modes.tables import Tables, tables_of
from nsmaps.exact.returns import Returns

if TYPE_CHECKING:
    from nsmaps.exact.hybrid import HybridSystem

CHUNK = 5_000  #: returns a thread takes at a time


@dataclass(frozen=True, slots=True)
class ModeKernel:
    """The compiled engine with the table of one system."""

    definition: Definition
    table: Tables

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the coordinates."""
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
            memory = room(table, n if derivative else 0)
            first_returns(table, start[k], image[k], turns[k], codes[k], outcome[k], time[k], slopes, memory)

        in_chunks(count, run, CHUNK)
        slopes = tangents if derivative else None
        return Returns(self.coordinates, self.letters, start, image, turns, codes, outcome, time, slopes)


@lru_cache(maxsize=256)
def kernel_of(system: "HybridSystem") -> ModeKernel:
    """The kernel of a system; those used last are remembered."""
    definition = known_definition(system)
    return ModeKernel(definition, tables_of(definition, list(system.parameters.values())))


DEFINITIONS: dict[object, Definition] = {}  #: by class, its fields that are no numbers, and its formulas


def known_definition(system: "HybridSystem") -> Definition:
    """The formulas of a system's class, made when they are first asked for. Raises as `definition_of`."""
    cls = type(system)
    fixed = tuple((name, repr(getattr(system, name))) for name in cls.model_fields if name not in cls.parameter_names())
    key = cls, fixed, cls.horizon, (cls.period, cls.modes, cls.guards, cls.section)
    if key not in DEFINITIONS:
        DEFINITIONS[key] = definition_of(system)
    return DEFINITIONS[key]
