"""Estimates of the time and memory of a step, from counts of returns, states and images of boxes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsmaps.study.reading.values import Span

GIGABYTE, HOUR = 1e9, 3600.0
RETURN, DERIVED, NOISY, IMAGE = 1e-6, 3e-6, 2e-5, 1e-3  #: seconds per return, with derivative, under noise; per image of a box
NOISY_MODES = 4e-4  #: seconds per return under noise of a system with modes
INTEGRATED = 10.0  #: times as long where flights are integrated
VALUE, POINT = 1e-2, 2e-2  #: seconds per value of a parameter and per point of a branch, besides returns
UPDATE = 1.0  #: seconds per update of a domain of the exact map; of a polynomial a tenth
STATE, MEMBER, STORED, CELL = 100.0, 300.0, 150.0, 1e4  #: bytes per state of a grid, state of a surface, return of an orbit, cell
COPIES = 3.0  #: of stored results while they are written


@dataclass(frozen=True, slots=True)
class Size:
    """The time of a step, in seconds on one core, and its memory in bytes."""

    seconds: float = 0.0
    memory: float = 0.0

    def __add__(self, other: "Size") -> "Size":
        return Size(self.seconds + other.seconds, self.memory + other.memory)

    def times(self, count: float) -> "Size":
        """The size of `count` such steps whose results are all stored."""
        return Size(self.seconds * count, self.memory * count)

    def text(self) -> str:
        """Such as `2 min and 0.3 GB`."""
        return f"{_duration(self.seconds)} on one core and {self.memory / GIGABYTE:.1g} GB of memory"


def states(grid: "Mapping[str, Span] | None") -> float:
    """The number of states of a grid."""
    return math.prod(float(span.points) for span in (grid or {}).values())


def cover_size(cells: int, coordinates: int, depth: int) -> Size:
    """The size of a cover: all cells of the first level, and twice as many on each next one, as for a thin set."""
    count = float(cells) ** coordinates * 2.0**depth
    return Size(IMAGE, CELL).times(count)


def _duration(seconds: float) -> str:
    for unit, length in (("years", 8766 * HOUR), ("days", 24 * HOUR), ("h", HOUR), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1 else f"{seconds:.1g} s"
