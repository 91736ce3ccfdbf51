"""What a step needs in time and memory, from counts of returns, states and images of boxes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsmaps.study.reading.values import Span

GIGABYTE, HOUR = 1e9, 3600.0
RETURN, DERIVED, NOISY, IMAGE = 1e-6, 3e-6, 2e-5, 1e-3  #: seconds a return, with its derivative, under noise; an image of a box
VALUE, POINT = 1e-2, 2e-2  #: seconds that a value of a parameter, and a point of a branch, take whatever its returns
UPDATE = 1.0  #: seconds that an update of a domain of the exact map takes; of a polynomial's a tenth
STATE, MEMBER, STORED, CELL = 100.0, 300.0, 150.0, 1e4  #: bytes: state of a grid, of a surface, return of an orbit, cell
COPIES = 3.0  #: of what is kept, while it is written


@dataclass(frozen=True, slots=True)
class Size:
    """What a step needs, in seconds on one core and in bytes of memory."""

    seconds: float = 0.0
    memory: float = 0.0

    def __add__(self, other: "Size") -> "Size":
        return Size(self.seconds + other.seconds, self.memory + other.memory)

    def times(self, count: float) -> "Size":
        """So many of them, all kept."""
        return Size(self.seconds * count, self.memory * count)

    def told(self) -> str:
        """Such as `2 min and 0.3 GB`."""
        return f"{_duration(self.seconds)} on one core and {self.memory / GIGABYTE:.1g} GB of memory"


def states(grid: "Mapping[str, Span] | None") -> float:
    """How many states a grid has."""
    return math.prod(float(span.points) for span in (grid or {}).values())


def cover_size(cells: int, coordinates: int, depth: int) -> Size:
    """The first level whole, then twice as many cells a level: of what is thin, such as an attractor or an edge."""
    count = float(cells) ** coordinates * 2.0**depth
    return Size(IMAGE, CELL).times(count)


def _duration(seconds: float) -> str:
    for unit, length in (("years", 8766 * HOUR), ("days", 24 * HOUR), ("h", HOUR), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1 else f"{seconds:.1g} s"
