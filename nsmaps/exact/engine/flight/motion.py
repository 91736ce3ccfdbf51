"""The motion of a ball at an instant, and pairs of numbers in tables."""

from typing import NamedTuple

from nsmaps.exact.engine.jit import inlined


class Motion(NamedTuple):
    """Displacement since the start of a flight and its derivatives by the time."""

    displacement: float
    velocity: float
    acceleration: float
    jerk: float
    snap: float
    crackle: float


@inlined
def plus(motion, more):
    """The sum of two motions."""
    d, v, a, j, k, q = motion
    d1, v1, a1, j1, k1, q1 = more
    return Motion(d + d1, v + v1, a + a1, j + j1, k + k1, q + q1)


@inlined
def pair(numbers, begin, i):
    """Number i, from zero, of pairs that begin at a place of an array: complex numbers, or cosine and sine."""
    first = begin + 2 * i
    second = first + 1
    return numbers[first], numbers[second]
