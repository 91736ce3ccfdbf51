"""Functions of parameters in balls of python-flint: programs of few steps, repeated for as long as all is decided alike.

Balls contain the exact numbers: a ball without zero is not zero, and one that contains it is zero to all of its digits.
"""

import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import fsum, isinf
from threading import RLock
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import sympy as sp
from flint import acb, arb, ctx, fmpq

from nsmaps.arrays import Floats
from nsmaps.errors import SystemDefinitionError

DIGITS = 60  #: of these computations
LAST = 10.0**-DIGITS  #: the relative error of numbers of mpmath
SPARE = 10  #: digits that mpmath may lose in a function that python-flint does not have
FLOATS = 1e-13  #: relative error of floats in formulas, after arithmetic in sympy
KEPT = 8  #: programs of one function, of as many courses that it took
ONE_AT_A_TIME = RLock()  #: python-flint and mpmath have one precision for all threads
ZERO, ONE = 0, 1  #: places of these constants in every program

Step = tuple[Callable[..., acb], int, int | None, int]  #: an operation, the places of one argument or two, that of its result


@contextmanager
def many_digits() -> Iterator[None]:
    """Computations of this thread alone, in `DIGITS` digits."""
    with ONE_AT_A_TIME:
        before, ctx.dps = ctx.prec, DIGITS
        try:
            yield
        finally:
            ctx.prec = before


def nearest_float(x: arb) -> float:
    """The float nearest to the middle of a ball, zero for one that contains zero."""
    near = float(x)  # conversions cut off
    if isinf(near) or x.contains(0):
        return near if isinf(near) else 0.0
    remainder = x - near
    second = float(remainder)
    return fsum((near, second, float(remainder - second))) if second else near


def is_zero(x: acb) -> bool:
    """Whether a number is zero to all digits."""
    return x.contains(0) and x.is_finite()


def equal(x: acb, y: acb) -> bool:
    """Whether two numbers are the same to all digits."""
    return x.overlaps(y) and x.is_finite() and y.is_finite()


@dataclass(frozen=True, slots=True, eq=False)
class Number:
    """A number of a program."""

    program: "Program"
    place: int

    def __add__(self, other: "Number") -> "Number":
        if ZERO in (self.place, other.place):
            return other if self.place == ZERO else self
        return self.program.step(operator.add, *sorted((self, other), key=operator.attrgetter("place")))

    def __sub__(self, other: "Number") -> "Number":
        return self.program.step(operator.sub, self, other) if other.place else self

    def __mul__(self, other: "Number") -> "Number":
        if self.place in (ZERO, ONE) or other.place in (ZERO, ONE):
            return self if self.place == ZERO or other.place == ONE else other
        return self.program.step(operator.mul, *sorted((self, other), key=operator.attrgetter("place")))

    def of(self, operation: Callable[[acb], acb]) -> "Number":
        """A function of the number."""
        return self.program.step(operation, self)

    def exp(self) -> "Number":
        """The exponential function."""
        return self.of(acb.exp) if self.place else Number(self.program, ONE)

    def real(self) -> "Number":
        """The real part."""
        return self.of(_real)

    def imag(self) -> "Number":
        """The imaginary part."""
        return self.of(_imag)


def _real(x: acb) -> acb:
    return acb(x.real)


def _imag(x: acb) -> acb:
    return acb(x.imag)


class Program:
    """Operations on numbers in places, each there once; those on constants are done when they are added.

    What numbers decide is noted with its outcome.
    """

    def __init__(self, symbols: Sequence[sp.Symbol], values: Sequence[float], blurred: bool = False) -> None:
        self.values = [acb(0), acb(1), *map(acb, values)]  #: in all places, at the values of the parameters given here
        self.constant = [True, True, *[False] * len(values)]
        self.steps: list[Step] = []
        self.others: list[tuple[Callable[..., Any], int]] = []  #: functions of mpmath of all parameters
        self.checks: dict[tuple[Callable[..., Any], tuple[int, ...]], Any] = {}
        self.symbols, self.given, self.blurred = tuple(symbols), list(values), blurred
        self.known: dict[Any, int] = {symbol: k for k, symbol in enumerate((sp.S.Zero, sp.S.One, *symbols))}

    def at(self, values: Sequence[float]) -> list[acb] | None:
        """The numbers in all places at other values of the parameters; None if anything is decided otherwise there."""
        found = self.values.copy()
        found[2 : 2 + len(values)] = map(acb, values)
        for function, place in self.others:
            found[place] = in_mpmath(function, values)
        for operation, i, j, place in self.steps:
            found[place] = operation(found[i]) if j is None else operation(found[i], found[j])
        alike = all(function(*[found[k] for k in places]) == outcome for (function, places), outcome in self.checks.items())
        return found if alike else None

    def decide(self, function: Callable[..., Any], *numbers: Number) -> Any:
        """What a function says of numbers; it says the same when the program is repeated."""
        places = tuple(x.place for x in numbers)
        outcome = function(*[self.values[k] for k in places])
        if not all(self.constant[k] for k in places):
            self.checks[function, places] = outcome
        return outcome

    def step(self, operation: Callable[..., acb], *numbers: Number) -> Number:
        """The result of an operation."""
        places = tuple(x.place for x in numbers)
        if (operation, places) not in self.known:
            constant = all(self.constant[k] for k in places)
            place = self._new(operation(*[self.values[k] for k in places]), constant)
            self.known[operation, places] = place
            first, *second = places
            self.steps += [] if constant else [(operation, first, next(iter(second), None), place)]
        return Number(self, self.known[operation, places])

    def _new(self, value: acb, constant: bool) -> int:
        if constant and (value == 0 or value == 1):
            return ZERO if value == 0 else ONE
        self.values.append(value)
        self.constant.append(constant)
        return len(self.values) - 1

    def number(self, formula: Any) -> Number:
        """The number that a formula of the parameters is."""
        expr = sp.sympify(formula)
        if expr not in self.known:
            self.known[expr] = self._add_formula(expr)
        return Number(self, self.known[expr])

    def _add_formula(self, expr: sp.Expr) -> int:
        if expr.is_Rational or expr.is_Float:
            exact = sp.Rational(expr)
            number = acb(fmpq(int(exact.p), int(exact.q)))
            return self._new(number * acb(arb(1, FLOATS)) if self.blurred and expr.is_Float else number, True)
        if expr in CONSTANTS:
            return self._new(acb(CONSTANTS[expr]()), True)
        if expr.is_Add or expr.is_Mul:
            first, *others = map(self.number, expr.args)
            for one in others:
                first = first + one if expr.is_Add else first * one
            return first.place
        if expr.is_Pow:
            base, exponent = map(self.number, expr.args)
            return (base.of(ROOTS[expr.exp]) if expr.exp in ROOTS else self.step(operator.pow, base, exponent)).place
        if expr.func in FUNCTIONS:
            (argument,) = expr.args
            return self.number(argument).of(FUNCTIONS[expr.func]).place
        if isinstance(expr, sp.DiracDelta):  # the derivative of a step, but at it
            return self._new(acb(0), True)
        function = sp.lambdify(self.symbols, expr, "mpmath")
        place = self._new(in_mpmath(function, self.given), not expr.free_symbols)
        self.others += [(function, place)] if expr.free_symbols else []
        return place


def in_mpmath(function: Callable[..., Any], values: Sequence[float]) -> acb:
    """A function of mpmath at values of the parameters, as a ball."""
    with mp.workdps(DIGITS + SPARE):
        return acb(mp.mpmathify(function(*map(mp.mpf, values)))) * acb(arb(1, LAST))


CONSTANTS: dict[Any, Callable[[], Any]] = {sp.pi: arb.pi, sp.E: arb.const_e, sp.I: lambda: acb(0, 1)}
ROOTS: dict[Any, Callable[[acb], acb]] = {sp.S.Half: acb.sqrt, -sp.S.Half: acb.rsqrt, sp.S.NegativeOne: lambda x: acb(1) / x}
FUNCTIONS: dict[Any, Callable[[acb], acb]] = {
    kind: getattr(acb, kind.__name__)
    for kind in (
        *(sp.exp, sp.log, sp.sin, sp.cos, sp.tan, sp.cot, sp.sec, sp.csc, sp.sinh, sp.cosh, sp.tanh, sp.coth),
        *(sp.asin, sp.acos, sp.atan, sp.asinh, sp.acosh, sp.atanh),
    )
}


class Recording(NamedTuple):
    """A program with its results."""

    program: Program
    results: list[int]  #: places
    form: Any  #: what the results are
    floats: Floats  #: results, those that change to be replaced
    changing: list[int]  #: the numbers of these
    changed: list[int]  #: and their places


@dataclass(eq=False)
class Recorded:
    """A function of parameters: `build` adds what it computes to a program, and returns its results and what they are."""

    symbols: Sequence[sp.Symbol]
    build: Callable[[Program], tuple[list[Number], Any]]
    blurred: bool = False  #: whether floats in formulas are balls of the relative error `FLOATS`
    recordings: list[Recording] = field(default_factory=list)

    def at(self, values: Sequence[float]) -> tuple[list[acb], Any]:
        """The results in balls, and what they are. Raises as `build` does, and SystemDefinitionError for a division by zero."""
        with many_digits():
            recording, found = self._replay(values)
            return [found[k] for k in recording.results], recording.form

    def floats(self, values: Sequence[float]) -> tuple[Floats, Any]:
        """The real parts of the results in floats, and what they are. Raises as `at` does."""
        with many_digits():
            recording, found = self._replay(values)
            floats = recording.floats.copy()
            floats[recording.changing] = [nearest_float(found[k].real) for k in recording.changed]
            return floats, recording.form

    def _replay(self, values: Sequence[float]) -> tuple[Recording, list[acb]]:
        for recording in self.recordings:
            found = recording.program.at(values)
            if found is not None:
                check_finite([found[k] for k in recording.changed], values)
                return recording, found
        program = Program(self.symbols, values, self.blurred)
        results, form = self.build(program)
        places = [x.place for x in results]
        check_finite([program.values[k] for k in places], values)
        floats = np.array([nearest_float(program.values[k].real) for k in places])
        changing = [k for k, place in enumerate(places) if not program.constant[place]]
        recording = Recording(program, places, form, floats, changing, [places[k] for k in changing])
        self.recordings[:] = [recording, *self.recordings[: KEPT - 1]]
        return recording, program.values


def check_finite(found: list[acb], values: Sequence[float]) -> None:
    """Refuse results that are not numbers."""
    if not all(x.is_finite() for x in found):
        shown = ", ".join(f"{value:.6g}" for value in values)
        raise SystemDefinitionError(
            f"a coefficient of the formulas divides by zero at the parameters ({shown}); expected: others, or a formula "
            "without that division"
        )
