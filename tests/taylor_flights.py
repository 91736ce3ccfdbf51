"""First returns of forced oscillators with a stop by Taylor series of 40 digits: a reference without code of nsmaps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import mul
from typing import Any

import numpy as np
from flint import arb, arb_poly

DIGITS, ORDER, STEP, LOOKS, FAR = 40, 40, arb(0.25), 8, 100
HALVINGS, CORRECTIONS = 24, 5  #: of an interval with a zero, and steps of Newton's method from there
PLACES = [arb(x) for x in (0.0, *(0.25 * 10.0**-k for k in range(16, 1, -1)), *(0.25 * k / LOOKS for k in range(1, LOOKS + 1)))]


@dataclass(frozen=True)
class Stop:
    """x'' + c x' + spring(x) = f cos(w t), stopped at x = d from below with restitution r; numbers are balls of python-flint."""

    spring: Callable[[list[Any], list[Any]], Any]  #: next coefficient of the force by those of x so far, and a list of its own
    c: Any
    f: Any
    w: Any
    d: Any
    r: Any

    def series(self, t: Any, x: Any, u: Any) -> list[Any]:
        """The Taylor coefficients of x from time t on."""
        sine, cosine = (self.w * t).sin_cos()
        a, room, size, waves = [x, u], [], self.f, (cosine, -sine, -cosine, sine)
        for n in range(ORDER - 1):
            force = size * waves[n % 4] - self.c * (n + 1) * a[n + 1] - self.spring(a[: n + 1], room)
            a.append(force / ((n + 1) * (n + 2)))
            size *= self.w / (n + 1)
        return a

    def first_return(self, v: Any, phi: Any) -> tuple[Any, Any, Any]:
        """Speed, lifted phase and time of the next impact after one of speed v at phase phi; no rest or chatter."""
        t, x, u, s = phi / self.w, self.d, -self.r * v, arb(0)
        while s < FAR:
            a = self.series(t + s, x, u)
            gap = [self.d - a[0], *(-c for c in a[1:])]
            gap = gap[1:] if s == 0 else gap  # the zero at the start is divided out
            found = first_zero(gap)
            if found is not None:
                return value([n * c for n, c in enumerate(a)][1:], found), phi + self.w * (s + found), s + found
            x, u, s = value(a, STEP).mid(), value([n * c for n, c in enumerate(a)][1:], STEP).mid(), s + STEP
        raise ValueError(f"no impact until {s}")


def value(a: list[Any], s: Any) -> Any:
    """A polynomial at s."""
    return arb_poly(a)(s)


def first_zero(a: list[Any]) -> Any:
    """The first zero in (0, STEP] of a polynomial, positive at first: between its extrema, which are found between looks."""
    extrema = zeros([n * c for n, c in enumerate(a)][1:], PLACES)
    return next(zeros(a, sorted([*PLACES, *extrema])), None)


def zeros(a: list[Any], places: list[Any]) -> Iterator[Any]:
    """The zeros of a polynomial at which its sign changes between places, in order."""
    signs = sure_signs(a, places)
    for low, high, before, beyond in zip(places, places[1:], signs, signs[1:], strict=False):
        if before * beyond <= 0:
            yield zero_between(arb_poly(a), low, high, before)


def zero_between(p: arb_poly, low: Any, high: Any, before: int) -> Any:
    """The zero of a polynomial between two places, with this sign at the lower one."""
    for _ in range(HALVINGS):
        middle = ((low + high) / 2).mid()
        low, high = (middle, high) if sign(p(middle)) == before else (low, middle)
    slope, s = p.derivative(), ((low + high) / 2).mid()
    for _ in range(CORRECTIONS):
        s = (s - p(s) / slope(s)).mid()
    return s


def sign(x: Any) -> int:
    """The sign of the midpoint of a ball."""
    return int(x.mid() > 0) - int(x.mid() < 0)


def sure_signs(a: list[Any], places: list[Any]) -> list[int]:
    """The signs of a polynomial at places >= 0: of its value in floats where that is larger than its rounding."""
    coefficients, powers = np.array(a, float), np.array(places, float)[:, None] ** np.arange(len(a))
    sums, sizes = powers @ coefficients, powers @ np.abs(coefficients)
    sure = (np.abs(sums) > 1e-12 * sizes) & (np.abs(sums) > 1e-250)
    return [int(np.sign(x)) if ok else sign(value(a, s)) for x, ok, s in zip(sums, sure, places, strict=True)]


def dot(one: list[Any], other: list[Any]) -> Any:
    """The sum of products, up to the end of the shorter list."""
    return sum(map(mul, one, other), start=arb(0))


def cubic(a: Any, b: Any) -> Callable[[list[Any], list[Any]], Any]:
    """The force a x + b x^3."""

    def spring(x: list[Any], squares: list[Any]) -> Any:
        middle = len(x) // 2
        twice = 2 * dot(x[:middle], x[::-1])  # the terms of the square on either side of its middle
        squares.append(twice + x[middle] ** 2 if len(x) % 2 else twice)
        return a * x[-1] + b * dot(squares, x[::-1])

    return spring


def sine(x: list[Any], waves: list[Any]) -> Any:
    """The force sin x: `waves` has k times the coefficient k of x, and the coefficients of sin x and of cos x."""
    slopes, sines, cosines = waves if waves else waves.extend(([], [x[0].sin()], [x[0].cos()])) or waves
    if n := len(x) - 1:
        slopes.append(n * x[n])
        sines.append(dot(slopes, cosines[::-1]) / n)
        cosines.append(-dot(slopes, sines[-2::-1]) / n)
    return sines[-1]
