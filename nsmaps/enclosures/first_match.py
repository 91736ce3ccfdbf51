"""The regions of a sequence that may be the first to contain a state of a box: by the signs of all terms that they compare.

A region is a formula of the signs of differences: of a term and a number. Over a box each sign is known or is one of several.
Every choice of the open ones that numbers of the same term allow is tried: so two regions that share a border leave no gap.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.enclosures import intervals
from nsmaps.enclosures.intervals import ROUNDING, Interval, difference
from nsmaps.reduced.conditions.fold import Algebra, fold, fold_term
from nsmaps.reduced.conditions.region import Box, Region, as_condition

Formula = Callable[[Ints], Bools]  #: signs (S, A) of all comparisons -> shape (S,)
Enclose = Callable[[Floats], Interval]  #: boxes (N, n, 2) -> the values of a term

MOST = 4096  #: choices of open signs that are tried; beyond, every region may be the first
UNREAL = 2  #: the sign where a value is NaN
ALLOWED: dict[str, tuple[int, ...]] = {
    "<": (-1,),
    "<=": (-1, 0),
    ">": (1,),
    ">=": (0, 1),
    "==": (0,),
    "!=": (-1, 1, UNREAL),
}


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A term of a condition over boxes."""

    key: str  #: the same for terms that are evaluated alike, in every text
    enclose: Enclose
    number: float | None = None  #: its value if it is constant


@dataclass(frozen=True, slots=True, eq=False)
class Winners:
    """Regions in their order; angles are in [0, 2 pi)."""

    terms: dict[str, Enclose] = field(default_factory=dict)
    limits: list[tuple[str, float]] = field(default_factory=list)  #: of each comparison: its term, and the number
    formulas: list[Formula] = field(default_factory=list)  #: one a region
    decided: dict[bytes, Bools] = field(default_factory=dict)  #: by pattern of possible signs, those that were met so far

    @classmethod
    def of(cls, regions: Sequence[Region]) -> "Winners":
        """Regions of any class, boxes by their sides and all others by their conditions."""
        winners = cls()
        for region in regions:
            box = winners._box(region) if type(region) is Box else None
            winners.formulas.append(box or fold(as_condition(region).text, region.coordinates, _Formulas(winners)))
        return winners

    def __call__(self, boxes: Floats) -> tuple[Bools, Bools]:
        """Which regions may be the first to hold a state of boxes (N, n, 2), shape (N, R), and may none, shape (N,)."""
        ends = {key: enclose(boxes) for key, enclose in self.terms.items()}
        low, high = (np.array([ends[key][k] for key, _ in self.limits]).reshape(len(self.limits), len(boxes)).T for k in (0, 1))
        limit = np.array([limit for _, limit in self.limits])
        known = (low < limit) + 2 * ((low <= limit) & (limit <= high)) + 4 * (high > limit)
        masks = np.zeros((len(boxes), len(self.limits) + 1), np.uint8)  # a row without comparisons has a byte too
        masks[:, :-1] = np.where(np.isnan(low), 15, known)
        rows = masks.view(np.dtype((np.void, masks.shape[1])))[:, 0]
        _, first, inverse = np.unique(rows, return_index=True, return_inverse=True)
        for mask in masks[first]:
            if mask.tobytes() not in self.decided:
                self.decided[mask.tobytes()] = self._decided(mask)
        found = np.array([self.decided[mask.tobytes()] for mask in masks[first]], bool).reshape(-1, len(self.formulas) + 1)
        return found[inverse, :-1], found[inverse, -1]

    def _decided(self, mask: Ints) -> Bools:
        """Of one pattern of possible signs: which regions may win, and last, may none; shape (R + 1,)."""
        signs = self._choices(mask)
        if signs is None:
            return np.ones(len(self.formulas) + 1, bool)
        holds = np.stack([*(formula(signs) for formula in self.formulas), np.ones(len(signs), bool)], axis=1)
        return np.bincount(holds.argmax(axis=1), minlength=holds.shape[1]) > 0

    def _choices(self, mask: Ints) -> Ints | None:
        """All signs (S, A) that the masks (A,) and the order of numbers allow; None if they are too many."""
        signs = np.zeros((1, len(mask)), np.int64)
        for key in self.terms:
            columns = np.array([k for k, (term, _) in enumerate(self.limits) if term == key], int)
            columns = columns[np.argsort([self.limits[k][1] for k in columns])]
            places = np.arange(2 * len(columns) + 1)[:, None]
            rows = np.sign(places - (2 * np.arange(len(columns)) + 1))
            rows = np.concatenate([rows, np.full((1, len(columns)), UNREAL)])
            rows = rows[((mask[columns] >> (rows + 1)) & 1).astype(bool).all(axis=1)]
            if len(signs) * len(rows) > MOST:
                return None
            signs = np.repeat(signs, len(rows), axis=0)
            signs[:, columns] = np.tile(rows, (len(signs) // len(rows), 1))
        return signs

    def sign(self, key: str, enclose: Enclose, limit: float, allowed: tuple[int, ...]) -> Formula:
        """Whether the sign of a term less a number is one of some."""
        self.terms.setdefault(key, enclose)
        if (key, limit) not in self.limits:
            self.limits.append((key, limit))
        column = self.limits.index((key, limit))
        table = np.isin(np.arange(-1, UNREAL + 1), allowed)
        return lambda signs: table[signs[:, column] + 1]

    def _box(self, box: Box) -> Formula:
        """A box; of an angle on every turn on which its interval may meet [0, 2 pi)."""
        sides: list[Formula] = []
        for k, (low, high) in enumerate(box.bounds.values()):
            if not box.coordinates.angles[k]:
                sides.append(self._interval(k, 0.0, (low, high)))
            elif high - low <= TWO_PI * (1 + ROUNDING):
                shifts = [-TWO_PI * turn for turn in turns_of(low, high)]
                sides.append(partial(_any, [self._interval(k, shift, (low, high)) for shift in shifts]))
        return partial(_all, sides)

    def _interval(self, k: int, shift: float, ends: tuple[float, float]) -> Formula:
        key = f"x{k}" if shift == 0 else f"x{k} less {shift!r}"
        enclose = partial(_moved, k, shift)
        parts = [self.sign(key, enclose, ends[0], (0, 1)), self.sign(key, enclose, ends[1], (-1, 0))]
        return partial(_all, parts)


class _Formulas(Algebra[Term, Formula]):
    """Conditions as formulas of the signs that some winners know."""

    def __init__(self, winners: Winners) -> None:
        self.winners = winners

    def number(self, value: float) -> Term:
        return Term(repr(value), lambda boxes: (np.full(len(boxes), value), np.full(len(boxes), value)), value)

    def coordinate(self, column: int) -> Term:
        return Term(f"x{column}", partial(_moved, column, 0.0))

    def signed(self, sign: str, term: Term) -> Term:
        return Term(f"({sign}{term.key})", lambda boxes: intervals.signed(sign, term.enclose(boxes)))

    def arithmetic(self, operator: str, left: Term, right: Term) -> Term:
        key = f"({left.key} {operator} {right.key})"
        return Term(key, lambda boxes: intervals.arithmetic(operator, left.enclose(boxes), right.enclose(boxes)))

    def function(self, name: str, *arguments: Term) -> Term:
        key = f"{name}({', '.join(each.key for each in arguments)})"
        return Term(key, lambda boxes: intervals.function(name, *(each.enclose(boxes) for each in arguments)))

    def relation(self, operator: str, left: Term, right: Term) -> Formula:
        """A comparison as the sign of a term less a number, the same for both ways to write it."""
        allowed = ALLOWED[operator]
        turned = tuple(sign if sign == UNREAL else -sign for sign in allowed)
        if right.number is not None:
            return self.winners.sign(left.key, left.enclose, right.number, allowed)
        if left.number is not None:
            return self.winners.sign(right.key, right.enclose, left.number, turned)
        if left.key > right.key:
            left, right, allowed = right, left, turned
        key = f"{left.key} less {right.key}"
        return self.winners.sign(key, lambda boxes: difference(left.enclose(boxes), right.enclose(boxes)), 0.0, allowed)

    def conjunction(self, tests: Sequence[Formula]) -> Formula:
        return partial(_all, tests)

    def disjunction(self, tests: Sequence[Formula]) -> Formula:
        return partial(_any, tests)

    def negation(self, test: Formula) -> Formula:
        return lambda signs: ~test(signs)


def enclosure_of(text: str, names: Sequence[str]) -> Enclose:
    """The values over boxes (N, n, 2) of the formula in named coordinates in a text, rounded and exact."""
    return fold_term(text, names, _Formulas(Winners())).enclose


def turns_of(low: float, high: float) -> range:
    """By which whole turns angles in [0, 2 pi) may be moved into an interval."""
    return range(math.floor(low / TWO_PI - ROUNDING), math.floor(high / TWO_PI + ROUNDING) + 1)


def _moved(k: int, shift: float, boxes: Floats) -> Interval:
    """A coordinate less a shift; unmoved it is exact."""
    low, high = boxes[:, k].T
    slack = ROUNDING * (np.abs(low) + np.abs(high) + abs(shift)) if shift else 0.0
    return low - shift - slack, high - shift + slack


def _all(parts: Sequence[Formula], signs: Ints) -> NDArray[np.bool_]:
    return np.asarray(np.logical_and.reduce([np.ones(len(signs), bool), *(part(signs) for part in parts)]))


def _any(parts: Sequence[Formula], signs: Ints) -> NDArray[np.bool_]:
    return np.asarray(np.logical_or.reduce([part(signs) for part in parts]))
