"""Complex numbers in many digits, with the operations that decompositions of flights take, on a tape or constant."""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath as mp
from mpmath import libmp

from nsmaps.exact.flows.recording import EXACT, NEAREST, PRECISION, Real, Recording, Tape, decide, done

KEPT = 8  #: recordings of one computation, of as many courses that it took

Finish = Callable[[list[Any]], Any]  #: makes a result of numbers of libmp
ZERO, UNITY = Real(libmp.fzero), Real(libmp.fone)


def _is(x: Real, constant: Real) -> bool:
    return not x.tape and x.value == constant.value


def _sum(x: Real, y: Real, precision: int = PRECISION) -> Real:
    if _is(x, ZERO) or _is(y, ZERO):
        return y if _is(x, ZERO) else x
    return done(libmp.mpf_add, x, y, precision)


def _product(x: Real, y: Real, precision: int = PRECISION) -> Real:
    if _is(x, ZERO) or _is(y, ZERO):
        return ZERO
    if _is(x, UNITY) or _is(y, UNITY):
        return y if _is(x, UNITY) else x
    return done(libmp.mpf_mul, x, y, precision)


def _products(a: Real, b: Real, c: Real, d: Real) -> Real:
    """The sum of a b and c d, rounded once."""
    first, second = _product(a, b, EXACT), _product(c, d, EXACT)
    if _is(first, ZERO) or _is(second, ZERO):
        return _product(c, d) if _is(first, ZERO) else _product(a, b)
    return _sum(first, second)


def _minus(x: Real) -> Real:
    return ZERO if _is(x, ZERO) else done(_negative, x, x, EXACT)


def _negative(x: Any, _: Any, _precision: int, _rounding: str) -> Any:
    return libmp.mpf_neg(x)


def _first(pair: Any, _: Any, _precision: int, _rounding: str) -> Any:
    return pair[0]


def _second(pair: Any, _: Any, _precision: int, _rounding: str) -> Any:
    return pair[1]


def _power(x: Any, n: Any, precision: int, rounding: str) -> Any:
    return libmp.mpf_pow_int(x, libmp.to_int(n), precision, rounding)


def _pair(x: Any, y: Any, _precision: int, _rounding: str) -> Any:
    return x, y


def _power_of_pair(pair: Any, n: Any, precision: int, rounding: str) -> Any:
    return libmp.mpc_pow_int(pair, libmp.to_int(n), precision, rounding)


def _exp(x: Any, _: Any, precision: int, rounding: str) -> Any:
    return libmp.mpf_exp(x, precision, rounding)


def _waves(x: Any, _: Any, precision: int, rounding: str) -> Any:
    return libmp.mpf_cos_sin(x, precision, rounding)


def _exp_of_pair(pair: Any, _: Any, precision: int, rounding: str) -> Any:
    return libmp.mpc_exp(pair, precision, rounding)


def _size_of_pair(x: Any, y: Any, precision: int, rounding: str) -> Any:
    return libmp.mpf_hypot(x, y, precision, rounding)


def _rounded(x: Any, y: Any, _precision: int, _rounding: str) -> complex:
    return complex(libmp.to_float(x, False, NEAREST), libmp.to_float(y, False, NEAREST))


@dataclass(frozen=True, slots=True, eq=False)
class Number:
    """A complex number by its parts. It is equal to another only if both are in the same places."""

    re: Real = ZERO
    im: Real = ZERO

    @property
    def parts(self) -> tuple[Real, Real]:
        """The real and the imaginary part."""
        return self.re, self.im

    def __hash__(self) -> int:
        """By the places."""
        return hash((self.re.place, self.im.place))

    def __eq__(self, other: object) -> bool:
        """Whether both are in the same places, or the same constants."""
        return isinstance(other, Number) and self.re.same(other.re) and self.im.same(other.im)

    def __add__(self, other: "Number") -> "Number":
        """The sum."""
        return Number(_sum(self.re, other.re), _sum(self.im, other.im))

    def __neg__(self) -> "Number":
        """The negative."""
        return Number(_minus(self.re), _minus(self.im))

    def __mul__(self, other: "Number") -> "Number":
        """The product."""
        a, b, c, d = self.re, self.im, other.re, other.im
        return Number(_products(a, c, _minus(b), d), _products(a, d, b, c))

    def power(self, n: int) -> "Number":
        """The n-th power."""
        exponent = Real(libmp.from_int(n))
        if n < 2:
            return self if n else ONE
        if _is(self.im, ZERO):
            return Number(done(_power, self.re, exponent))
        pair = done(_power_of_pair, done(_pair, self.re, self.im), exponent)
        return Number(done(_first, pair, pair), done(_second, pair, pair))

    def exp(self) -> "Number":
        """The exponential function."""
        if _is(self.im, ZERO):
            return Number(done(_exp, self.re, self.re))
        if _is(self.re, ZERO):
            pair = done(_waves, self.im, self.im)
        else:
            both = done(_pair, self.re, self.im)
            pair = done(_exp_of_pair, both, both)
        return Number(done(_first, pair, pair), done(_second, pair, pair))

    def real(self) -> "Number":
        """The real part."""
        return Number(self.re)

    def imag(self) -> "Number":
        """The imaginary part."""
        return Number(self.im)

    def conjugate(self) -> "Number":
        """The number with the other imaginary part."""
        return Number(self.re, _minus(self.im))

    def size(self) -> "Number":
        """The absolute value."""
        return Number(done(_size_of_pair, self.re, self.im))

    def rounded(self) -> Real:
        """As a complex number of Python."""
        return done(_rounded, self.re, self.im)

    def alike(self) -> "Number":
        """The number on the tape that was first to have this value, and is from now on said to be equal."""
        tape = self.re.tape or self.im.tape
        if tape is None:
            return self
        if not tape.alike:
            tape.alike[ZERO.value, ZERO.value] = NOTHING
        same = tape.alike.setdefault((self.re.value, self.im.value), self)
        for x, y in ((self.re, same.re), (self.im, same.im)):
            if not x.same(y):
                decide(operator.eq, x, y)
        return same


NOTHING, ONE = Number(), Number(UNITY)
UNIT = Number(ZERO, UNITY)  #: the imaginary one


def constant(x: Any) -> Number:
    """A constant."""
    x = mp.mpmathify(x)
    return Number(*map(Real, x._mpc_)) if isinstance(x, mp.mpc) else Number(Real(x._mpf_))


class Recorded:
    """A function of numbers that is not computed anew as long as all is decided alike.

    It has a list of `Number`, some of which are the same at all times. It returns those that are its results, and what makes the
    whole result of them in numbers of libmp.
    """

    def __init__(self, function: Callable[[list[Number]], tuple[list[Real], Finish]], fixed: list[bool]) -> None:
        self.function, self.fixed = function, fixed
        self.recordings: list[tuple[Any, Recording, Finish]] = []

    def __call__(self, numbers: Sequence[Any]) -> Any:
        """The result at numbers of mpmath."""
        parts = [x._mpc_ if isinstance(x, mp.mpc) else (x._mpf_,) for x in numbers]
        shape = tuple(map(len, parts))
        inputs = [x for part, fixed in zip(parts, self.fixed, strict=True) if not fixed for x in part]
        for known, recording, finish in self.recordings:
            found = recording.repeated(inputs) if known == shape else None
            if found is not None:
                return finish(found)
        return self._recorded(shape, parts, inputs)

    def _recorded(self, shape: tuple[int, ...], parts: list[Any], inputs: list[Any]) -> Any:
        tape = Tape()
        places = iter([tape.new(x) for x in inputs])
        given = [
            Number(*(Real(x) if fixed else next(places) for x in part)) for part, fixed in zip(parts, self.fixed, strict=True)
        ]
        results, finish = self.function(given)
        recording = Recording(tape, results)
        self.recordings[:] = [(shape, recording, finish), *self.recordings[: KEPT - 1]]
        return finish([x.value for x in results])
