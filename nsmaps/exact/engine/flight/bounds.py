"""Bounds on the time derivatives of a flight and on the sizes of its terms, from some time on."""

import math
from typing import NamedTuple

from nsmaps.exact.engine.flight.layout import (
    ACCELERATION,
    AT_CHAINS,
    AT_RATES,
    AT_TERMS,
    CHAIN,
    CHAIN_POWER,
    CHAINED,
    COSINE,
    CRACKLE,
    DIFFERENCE_RE,
    DRIFT,
    HARMONICS,
    JERK,
    LOCAL,
    ONE,
    PLACE,
    POLYNOMIAL,
    POP,
    POWERS,
    REACH,
    SIMPLE,
    SNAP,
    SPEED,
    VELOCITY,
)
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.jit import inner


class Bounds(NamedTuple):
    """Bounds on the absolute values of derivatives of a flight from some time on."""

    jerk: float
    snap: float
    crackle: float
    pop: float
    reach: float  #: the time for which they hold
    acceleration: float
    size: float  #: of the sum of the absolute values of the displacement's terms, at that time


@inner
def limits(p, s):
    """The bounds of a flight from time s on."""
    c = p.flight
    if p.table[LOCAL] > 0.0:
        return limits_of_growth(p, s)
    steady = abs(c[POLYNOMIAL]) if p.table[POWERS] > 0.0 else 0.0
    size = s * (abs(c[SPEED]) + 0.5 * s * steady + min(0.5 * s * c[ACCELERATION], 2.0 * c[DRIFT]))
    return Bounds(c[JERK], c[SNAP], c[CRACKLE], c[POP], math.inf, steady + c[ACCELERATION], size)


@inner
def limits_of_growth(p, s):
    """As `limits`, for bounds that depend on the time: every term is bounded by its largest value up to the end of the reach."""
    t, c = p.table, p.flight
    plain, n = int(t[SIMPLE]), int(t[CHAINED])
    row, rates, at = POLYNOMIAL + int(t[POWERS]), int(t[AT_RATES]), int(t[AT_CHAINS])
    reach = t[REACH]
    end = s + reach
    size, acceleration, jerk, snap, crackle, pop = abs(c[SPEED]) * s, 0.0, 0.0, 0.0, 0.0, 0.0
    power, l0, l1, l2, l3, l4, l5 = end, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0  # s^m/m! and the previous ones
    now = s
    for n in range(int(t[POWERS])):
        power, l0, l1, l2, l3, l4, l5 = power * end / (n + 2), power, l0, l1, l2, l3, l4
        now *= s / (n + 2)
        x = abs(c[POLYNOMIAL + n])
        size, acceleration, jerk, snap = size + x * now, acceleration + x * l1, jerk + x * l2, snap + x * l3
        crackle, pop = crackle + x * l4, pop + x * l5
    b0, b1, b2, b3, b4, b5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(plain + n):
        alpha, omega = pair(t, rates, i)
        re, im = pair(c, row, i)
        x, speed, degree, fastest = math.hypot(re, im), math.hypot(alpha, omega), 0, alpha
        if i >= plain:
            chain = at + CHAIN * (i - plain)
            degree = int(t[chain + CHAIN_POWER])
            fastest = max(alpha, alpha - t[chain + DIFFERENCE_RE])
        if degree == 0:
            b0, b1, b2, b3, b4, b5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        value, here = math.exp(fastest * s + max(fastest, 0.0) * reach), math.exp(max(fastest * s, 0.0))
        for m in range(1, degree + 1):
            value, here = value * end / m, here * s / m
        if degree == 0:
            here *= min(0.5 * speed * speed * s * s, 2.0 * speed * s)
        first = speed * value + b0
        second, third = speed * first + b1, 0.0
        third = speed * second + b2
        fourth = speed * third + b3
        fifth = speed * fourth + b4
        size, acceleration, jerk, snap = size + x * here, acceleration + x * second, jerk + x * third, snap + x * fourth
        crackle, pop = crackle + x * fifth, pop + x * (speed * fifth + b5)
        b0, b1, b2, b3, b4, b5 = value, first, second, third, fourth, fifth
    return Bounds(jerk, snap, crackle, pop, reach, acceleration, size)


@inner
def sizes_of(t, row, z, w):
    """A bound on the sum of the absolute values of the terms of a row that is linear in the features, for all phases."""
    total = abs(t[row + ONE]) + abs(t[row + PLACE] * z) + abs(t[row + VELOCITY] * w)
    for m in range(int(t[HARMONICS])):
        cosine, sine = pair(t, row + COSINE, m)
        total += abs(cosine) + abs(sine)
    return total


@inner
def rounding_growth(p, z, s, unit):
    """The size at time s of an error of `unit` of the numbers from which the coefficients of growing terms are added up.

    Next to the stable manifold of a saddle these numbers cancel: a bound on the displacement's error in units of its own terms at
    s would not show the digits lost.
    """
    t, w, total = p.table, p.flight[SPEED], 0.0
    plain, width, rates = int(t[SIMPLE]), COSINE + 2 * int(t[HARMONICS]), int(t[AT_RATES])
    for i in range(plain + int(t[CHAINED])):
        re, im = pair(t, rates, i)
        alpha, degree = re, 0
        if i >= plain:
            at = int(t[AT_CHAINS]) + CHAIN * (i - plain)
            alpha, degree = max(alpha, alpha - t[at + DIFFERENCE_RE]), int(t[at + CHAIN_POWER])
        if alpha > 0.0:
            by, x = math.exp(alpha * s), math.hypot(re, im) * s
            share = unit * by
            if degree == 0:
                share *= min(0.5 * x * x, 1.0 + (1.0 + x) / by)  # of exp(x) - 1 - x
            for m in range(1, degree + 1):
                share *= s / m
            row = int(t[AT_TERMS]) + 2 * i * width
            total += share * (sizes_of(t, row, z, w) + sizes_of(t, row + width, z, w))
    return total
