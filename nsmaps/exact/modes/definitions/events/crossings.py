"""Crossings: guards whose functions may be negative in their modes, as a clock, or a section at v = 0 at which nothing changes.

Their function must rise again before the next such event: a mode in which one is watched becomes two, before and after the
function has fallen through zero, and an event without a letter leads back.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.modes.definitions.definition import Transition
from nsmaps.exact.modes.definitions.rows import Row, equal, factor_of, same_row

MOST_MODES = 64

Flags = tuple[bool, ...]  # of each function that is crossed in a mode: whether it has fallen below zero


@dataclass(frozen=True)
class Crossings:
    """The functions that are crossed in each mode, and the numbers of the modes into which it is divided."""

    name: str  #: of the class
    functions: tuple[tuple[Row, ...], ...]  #: of each mode
    numbers: dict[tuple[int, Flags], int]
    later: Mapping[sp.Symbol, sp.Symbol]  #: signs of kinks, and their symbols just after an event

    def flags(self, mode: int) -> Iterator[Flags]:
        """The parts of a mode."""
        return product((False, True), repeat=len(self.functions[mode]))

    def all(self, transitions: Sequence[Transition]) -> Iterator[Transition]:
        """The transitions between the divided modes."""
        for one in transitions:
            for below in self.flags(one.mode):
                if not crosses(one):
                    yield from self.with_change(one, below)
                elif not below[self.functions[one.mode].index(one.function)]:
                    yield from self.without_change(one, below) if nothing_changes(one) else self.with_change(one, below)
        for (mode, below), number in self.numbers.items():
            for k, function in enumerate(self.functions[mode]):
                like, *others = (one for one in transitions if one.mode == mode and one.function == function and crosses(one))
                if below[k]:
                    yield silent_transition(like, number, -function, self.at(mode, below, k, False))
                elif all(each.where for each in (like, *others)):
                    yield silent_transition(like, number, function, self.at(mode, below, k, True))

    def at(self, mode: int, below: Flags, k: int, flag: bool) -> int:
        """The part of a mode in which the function k has another flag."""
        return self.numbers[mode, tuple(flag if i == k else each for i, each in enumerate(below))]

    def below_after(self, after: Row, one: Transition, below: Flags) -> bool | None:
        """Whether a function is below zero just after an event in a part of its mode; None where that depends on the state.

        On the surface that is crossed it counts as below, unless it surely rises; what an event does not change keeps its sign.
        """
        if factor_of(after, one.function) is not None:
            return not rises(after, one.function)
        for function, flag in zip(self.functions[one.mode], below, strict=True):
            if equal(after, function):
                return flag
            if equal(after, -function):
                return not flag
        return None

    def without_change(self, one: Transition, below: Flags) -> Iterator[Transition]:
        """A crossing at which nothing changes, in a part of its mode where its function is not below zero."""
        functions = self.functions[one.mode]
        k = functions.index(one.function)
        factors = [factor_of(each, one.function) for each in functions]
        back = [
            i for i, factor in enumerate(factors) if factor is not None and factor.is_negative is True
        ]  # rise from below zero
        if all(below[i] for i in back):
            others = [side(each, below[i]) for i, each in enumerate(functions) if i != k and i not in back]
            flags = tuple(i == k or (below[i] and i not in back) for i in range(len(functions)))
            mode, target = self.numbers[one.mode, below], self.numbers[one.mode, flags]
            yield replace(one, mode=mode, target=target, where=(*one.where, *others))

    def with_change(self, one: Transition, below: Flags) -> Iterator[Transition]:
        """An event at which something changes, in a part of its mode.

        It leads to the part where each function has the sign that it has just after.
        """
        if one.target < 0:
            yield replace(one, mode=self.numbers[one.mode, below])
            return
        after = [function.subs(self.later).at(one.reset) for function in self.functions[one.target]]
        known = [self.below_after(row, one, below) for row in after]
        for flags in self.flags(one.target):
            if all(part in (None, flag) for part, flag in zip(known, flags, strict=True)):
                sides = [side(row, flag) for row, flag, part in zip(after, flags, known, strict=True) if part is None]
                mode, target = self.numbers[one.mode, below], self.numbers[one.target, flags]
                yield replace(one, mode=mode, target=target, where=(*one.where, *sides))


def crosses(one: Transition) -> bool:
    """Whether an event is a crossing: it is declared as one, depends on the time alone, or changes nothing."""
    clock = not one.begins and not one.leaves and one.function.timed
    return one.crossing or clock or nothing_changes(one)


def nothing_changes(one: Transition) -> bool:
    """Whether an event changes neither mode nor states."""
    rows = [row.coefficients for row in one.reset]
    same = sp.Matrix(rows) == sp.eye(len(rows)) and not any(row.remainder != 0 for row in one.reset)
    return one.target == one.mode and same and not one.curved


def rises(clock: Row, function: Row) -> bool:
    """Whether a function of the time alone surely rises where another falls through zero."""
    return clock.timed and sp.simplify(clock.remainder / function.remainder).is_negative is True


def divide_modes(
    name: str, transitions: tuple[Transition, ...], modes: int, later: Mapping[sp.Symbol, sp.Symbol]
) -> tuple[tuple[Transition, ...], list[tuple[int, Flags]]]:
    """The transitions of a class of this name between parts of its modes; of each part the mode, and what is below zero there.

    Raises:
        SystemDefinitionError: there are too many events at which nothing changes, or a reset whose sides cannot be distinguished.
    """
    own = [[one.function for one in transitions if one.mode == mode and crosses(one)] for mode in range(modes)]
    functions = tuple(tuple(dict.fromkeys(rows)) for rows in own)
    total = sum(2 ** len(rows) for rows in functions)
    if total > MOST_MODES:
        raise SystemDefinitionError(
            f"{name}.guards: events at which nothing changes divide the modes into {total} parts; expected: at most {MOST_MODES}"
        )
    parts = [(mode, flags) for mode, rows in enumerate(functions) for flags in product((False, True), repeat=len(rows))]
    crossings = Crossings(name, functions, {part: k for k, part in enumerate(parts)}, later)
    return tuple(crossings.all(transitions)), parts


def silent_transition(like: Transition, mode: int, function: Row, target: int) -> Transition:
    """An event without name and letter at which nothing changes but the part of the mode."""
    n = len(like.reset)
    same = tuple(same_row(k, n) for k in range(n))
    return Transition("", "", mode, function, target, same, held=like.held)


def side(function: Row, below: bool) -> Row:
    """What is not negative on one side of a surface."""
    return -function if below else function
