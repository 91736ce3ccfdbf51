"""The box outside of which a condition is false, and that outside of which it is true, by what it compares with numbers."""

from collections.abc import Iterator, Sequence
from functools import reduce

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.reduced.conditions.fold import Algebra, fold
from nsmaps.reduced.conditions.region import Box, Region, as_condition

Side = int | float | None  #: a coordinate by its number, a number, or neither
OPPOSITE = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}


def sides_of(text: str, names: Sequence[str]) -> Floats:
    """The smallest known box of the states at which a condition holds, and that of the others, shape (2, n, 2).

    >>> sides_of("x > 1 and y < 2*x", ("x", "y"))[0].tolist()
    [[1.0, inf], [-inf, inf]]
    """
    return fold(text, names, _Sides(len(names)))


def first_sides(regions: Sequence[Region]) -> Iterator[Floats]:
    """For each of some regions a box (n, 2) that holds the states of which it is the first; boxes restrict no other region."""
    before: Floats | None = None
    for region in regions:
        whole = np.tile([-np.inf, np.inf], (2, len(region.coordinates), 1))
        there, others = whole if isinstance(region, Box) else sides_of(as_condition(region).text, region.coordinates)
        yield there if before is None else common(there, before)
        before = others if before is None else common(others, before)


def common(a: Floats, b: Floats) -> Floats:
    """The common part of two boxes (n, 2), from inf to -inf if there is none."""
    low, high = np.maximum(a[:, 0], b[:, 0]), np.minimum(a[:, 1], b[:, 1])
    return np.stack([low, high], axis=1) if (low <= high).all() else np.tile([np.inf, -np.inf], (len(a), 1))


def _hull(a: Floats, b: Floats) -> Floats:
    return np.stack([np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 1], b[:, 1])], axis=1)


class _Sides(Algebra[Side, Floats]):
    """Boxes of the states at which a test is true and false; a coordinate is an integer, a number a float."""

    def __init__(self, n: int) -> None:
        self.whole = np.tile([-np.inf, np.inf], (2, n, 1))

    def number(self, value: float) -> Side:
        return float(value)

    def coordinate(self, column: int) -> Side:
        return column

    def signed(self, sign: str, term: Side) -> Side:
        return None

    def arithmetic(self, operator: str, left: Side, right: Side) -> Side:
        return None

    def function(self, name: str, *arguments: Side) -> Side:
        return None

    def relation(self, operator: str, left: Side, right: Side) -> Floats:
        if isinstance(left, float):
            left, right, operator = right, left, OPPOSITE[operator]
        boxes = self.whole.copy()
        if isinstance(left, int) and isinstance(right, float):
            if operator in ("<", "<="):
                boxes[:, left] = [[-np.inf, right], [right, np.inf]]
            elif operator in (">", ">="):
                boxes[:, left] = [[right, np.inf], [-np.inf, right]]
            else:
                boxes[int(operator == "!="), left] = right
        return boxes

    def conjunction(self, tests: Sequence[Floats]) -> Floats:
        return np.stack([reduce(join, (test[k] for test in tests)) for k, join in enumerate((common, _hull))])

    def disjunction(self, tests: Sequence[Floats]) -> Floats:
        return self.negation(self.conjunction([self.negation(test) for test in tests]))

    def negation(self, test: Floats) -> Floats:
        return test[::-1]
