"""Computations in many digits that are recorded and repeated at other numbers, for as long as all is decided alike.

Numbers are those of libmp, without objects of mpmath. A repetition does the operations of the first time, rounded as then. What
is decided by the numbers, as which rates are equal, is recorded with its outcome: with another one, it is recorded anew.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mpmath import libmp

DIGITS = 60  #: of these computations
PRECISION = libmp.dps_to_prec(DIGITS)
NEAREST = libmp.round_nearest
EXACT = 0  #: instead of a precision
COMMUTING = libmp.mpf_add, libmp.mpf_mul

Operation = Callable[[Any, Any, int, str], Any]  #: of two numbers, a precision and how to round
Step = tuple[Operation, int, int, int, int]  #: an operation, the places of two arguments, a precision, the place of the result


class Tape:
    """Operations on numbers in places, each done once. Constants are in places of their own where they are needed."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.steps: list[Step] = []
        self.checks: dict[tuple[Any, ...], Any] = {}  #: by a function and places, what it said of their numbers
        self.known: dict[Any, Real] = {}
        self.alike: dict[Any, Any] = {}  #: by its value, the first of equal numbers

    def new(self, value: Any) -> "Real":
        """A number in a new place."""
        self.values.append(value)
        return Real(value, self, len(self.values) - 1)

    def place(self, x: "Real") -> int:
        """The place of a number or a constant."""
        if x.tape:
            return x.place
        if x.value not in self.known:
            self.known[x.value] = self.new(x.value)
        return self.known[x.value].place

    def step(self, operation: Operation, x: "Real", y: "Real", precision: int) -> "Real":
        """The result of an operation."""
        i, j = self.place(x), self.place(y)
        if j < i and operation in COMMUTING:
            i, j = j, i
        key = operation, i, j, precision
        if key not in self.known:
            self.known[key] = self.new(operation(self.values[i], self.values[j], precision, NEAREST))
            self.steps.append((*key, self.known[key].place))
        return self.known[key]


@dataclass(frozen=True, slots=True, eq=False)
class Real:
    """A number of libmp, or a pair of them, in a place of a tape; a constant has none."""

    value: Any
    tape: Tape | None = None
    place: int = -1

    def same(self, other: "Real") -> bool:
        """Whether two are in one place, or one constant."""
        return self.place == other.place and (self.tape is not None or self.value == other.value)


def done(operation: Operation, x: Real, y: Real, precision: int = PRECISION) -> Real:
    """The result of an operation; of constants it is a constant."""
    tape = x.tape or y.tape
    return tape.step(operation, x, y, precision) if tape else Real(operation(x.value, y.value, precision, NEAREST))


def decide(function: Callable[..., Any], *args: Real) -> Any:
    """What a function says of numbers; it says the same in repetitions."""
    outcome = function(*(x.value for x in args))
    tape = next((x.tape for x in args if x.tape), None)
    if tape:
        tape.checks[(function, *map(tape.place, args))] = outcome
    return outcome


class Recording:
    """The steps of a tape that its results and what was decided depend on."""

    def __init__(self, tape: Tape, results: Sequence[Real]) -> None:
        self.places = [tape.place(x) for x in results]
        self.checks = [(function, places, outcome) for (function, *places), outcome in tape.checks.items()]
        self.template, self.steps = tape.values, list[Step]()
        needed = {*self.places, *(k for _, places, _ in self.checks for k in places)}
        for step in reversed(tape.steps):
            if step[-1] in needed:
                needed.update(step[1:3])
                self.steps.append(step)
        self.steps.reverse()

    def repeated(self, inputs: Sequence[Any]) -> list[Any] | None:
        """The results at other inputs, which are in the first places; None if anything is decided otherwise there."""
        values = [*inputs, *self.template[len(inputs) :]]
        for operation, i, j, precision, k in self.steps:
            values[k] = operation(values[i], values[j], precision, NEAREST)
        for function, places, outcome in self.checks:
            if function(*[values[k] for k in places]) != outcome:
                return None
        return [values[k] for k in self.places]
