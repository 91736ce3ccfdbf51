"""The steps of a rotation number that grows with a parameter, with their borders, and how periods are added between them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import ClassVar, Literal

from nsmaps.coordinates import StateLike
from nsmaps.dynamics.continuation.events import TESTS
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.diagrams.borders import NOT_LOCATED, RANGE, ROUNDING
from nsmaps.dynamics.diagrams.diagram import Border
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import Model, map_along, map_or_reason
from nsmaps.dynamics.rotation.number import RotationNumber, rotation_number
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.progress import shows
from nsmaps.results import Result

Way = Literal["down", "up"]
NARROWEST = 1e-13  #: share of the range, below which a step is not found
NEAR = 1e-9  #: of p, within which a rotation number is at the end of the range
REACHED = "the range ends at"
WAYS: tuple[Way, Way] = "down", "up"
STEP = 0.2  #: longest step of a branch to the border of a step


@dataclass(frozen=True, slots=True, eq=False)
class Plateau:
    """An interval of a parameter with one rational rotation number."""

    rotation: Fraction
    cycle: PeriodicOrbit  #: at a value inside
    value: float  #: this value
    low: Border
    high: Border

    @property
    def width(self) -> float:
        """Of the interval."""
        return self.high.value - self.low.value

    @property
    def word(self) -> str:
        """The word of the cycle, from the state on from which it is first in the alphabet."""
        words = self.cycle.words
        return min("".join((*words[k:], *words[:k])) for k in range(len(words)))

    @property
    def parents(self) -> tuple[Fraction, Fraction] | None:
        """The Farey parents of the rotation number; None of a whole one."""
        return farey_parents(self.rotation)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Staircase(Result):
    """The steps up to a period, in ascending order of the rotation number."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.spans"

    plateaux: tuple[Plateau, ...]
    missing: tuple[Fraction, ...]  #: rotation numbers of the range of which no step was found
    parameter: str = ""

    def plateau(self, rotation: Fraction | str) -> Plateau:
        """That of a rotation number, such as "2/5". NsmapsError without one."""
        wanted = Fraction(rotation)
        for plateau in self.plateaux:
            if plateau.rotation == wanted:
                return plateau
        raise NsmapsError(
            f"no step of the rotation number {wanted}; there are {', '.join(str(p.rotation) for p in self.plateaux)}"
        )

    def additions(self) -> tuple[tuple[Plateau, Plateau, Plateau], ...]:
        """Each step with the two of its Farey parents, where these are there: its period is the sum of theirs."""
        known = {plateau.rotation: plateau for plateau in self.plateaux}
        found = ((plateau, *(known.get(one) for one in plateau.parents or ())) for plateau in self.plateaux)
        return tuple(row for row in found if len(row) == 3 and None not in row)  # type: ignore[misc]


def farey_parents(rotation: Fraction) -> tuple[Fraction, Fraction] | None:
    """The two neighbours whose numerators and denominators sum up to those of a fraction; None of a whole one.

    >>> farey_parents(Fraction(2, 5))
    (Fraction(1, 3), Fraction(1, 2))
    """
    p, q = rotation.numerator, rotation.denominator
    if q == 1:
        return None
    s = pow(p, -1, q)  # p s - r q = 1
    low = Fraction((p * s - 1) // q, s)
    return low, Fraction(p - low.numerator, q - s)


@shows
def staircase(
    system: Model,
    parameter: str,
    bounds: tuple[float, float],
    start: StateLike,
    *,
    max_period: int = 10,
    transient: int = 1000,
    counted: str | None = None,
) -> Staircase:
    """The intervals of a parameter with a rotation number p/q, q up to a period, where it is monotone in the parameter.

    A value of each is found by bisection on the rotation number of the orbit of the start. Its cycle is followed from there as a
    branch to the borders, which are events of branches with their precision, or the ends of the range.

    Args:
        system: with an angle or in two pieces, as of `rotation_number`, or the return map as a function of the parameter's value.
        parameter: its name.
        bounds: least and greatest value of the parameter.
        start: shape (n,) or by name.
        max_period: greatest q.
        transient: returns before the orbit is looked at.
        counted: the angle or the letter that is counted.

    Raises:
        NsmapsError: invalid bounds or period, or no rotation number at their ends.
    """
    low, high = bounds
    if not low < high or max_period < 1:
        raise NsmapsError(f"bounds {low:g} to {high:g}, period {max_period}; expected: a range, and a period of at least one")
    map_of = map_along(system, parameter)
    search = _Search(map_of, start, transient, counted)
    ends = search.at(low).value, search.at(high).value
    search.sign = 1 if ends[1] >= ends[0] else -1
    lowest, highest = sorted(ends)
    targets = {
        Fraction(p, q)
        for q in range(1, max_period + 1)
        for p in range(math.ceil(lowest * q - NEAR), math.floor(highest * q + NEAR) + 1)
    }
    plateaux, missing = list[Plateau](), list[Fraction]()
    for rotation in sorted(targets, key=lambda one: one.denominator):
        value = search.value_of(rotation, NARROWEST * (high - low))
        if value is None:
            missing.append(rotation)
        else:
            cycle = search.known[value].cycle
            assert cycle is not None
            edges = [_edge(system, parameter, cycle, value, bounds, way) for way in WAYS]
            plateaux.append(Plateau(rotation, cycle, value, *edges))
    return Staircase(tuple(sorted(plateaux, key=lambda each: each.rotation)), tuple(sorted(missing)), parameter)


@dataclass(slots=True)
class _Search:
    """The rotation numbers at values of a parameter."""

    map_of: Callable[[float], ReturnMap]
    start: StateLike
    transient: int
    counted: str | None
    sign: int = 1
    known: dict[float, RotationNumber] = field(default_factory=dict)

    def at(self, value: float) -> RotationNumber:
        """That at a value, computed once."""
        if value not in self.known:
            return_map, why = map_or_reason(self.map_of, value)
            if return_map is None:
                raise NsmapsError(f"there is no map at {value:.9g}: {why}; expected: bounds between which there is one")
            self.known[value] = rotation_number(return_map, self.start, transient=self.transient, counted=self.counted)
        return self.known[value]

    def value_of(self, rotation: Fraction, width: float) -> float | None:
        """A value with a rotation number, by bisection between values that are known; None where it is narrower than this."""
        exact = [value for value, each in self.known.items() if each.fraction == rotation]
        if exact:
            return exact[len(exact) // 2]
        below = [value for value, each in self.known.items() if self._beyond(each, rotation) < 0]
        above = [value for value, each in self.known.items() if self._beyond(each, rotation) > 0]
        if not below or not above:
            return None
        low, high = (max(below), min(above)) if self.sign > 0 else (min(below), max(above))
        while abs(high - low) > width:
            middle = (low + high) / 2
            there = self.at(middle)
            if there.fraction == rotation:
                return middle
            low, high = (middle, high) if self._beyond(there, rotation) < 0 else (low, middle)
        return None

    def _beyond(self, there: RotationNumber, rotation: Fraction) -> float:
        return float(there.value - rotation if there.fraction is None else there.fraction - rotation)


def _edge(system: Model, parameter: str, cycle: PeriodicOrbit, value: float, bounds: tuple[float, float], way: Way) -> Border:
    """The border of a step in a direction of the parameter: the first event of its cycle's branch."""
    branch = continue_branch(
        system, parameter, cycle, value, bounds, direction=way, step=STEP, max_points=1000, until=tuple(TESTS)
    )
    if branch.events:
        event = branch.events[-1]
        return Border(event.value, max(event.precision, ROUNDING * (abs(event.value) + bounds[1] - bounds[0])), event.kind)
    if branch.ended.startswith(REACHED):
        return Border(bounds[int(way == "up")], 0.0, RANGE)
    return NOT_LOCATED
