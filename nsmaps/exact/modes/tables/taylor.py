"""The Taylor series of a linear flow, with a bound on what is left out.

Times `tau` and `x` are in longest steps of the mode, other quantities in the units of the system.
"""

import math

from nsmaps.exact.engine.jit import inner

DOUBLINGS = 5
ORDER = 2**DOUBLINGS - 2  # of the series
TERMS = ORDER + 2  # of arrays that hold it: full vectors of a processor
DEGREE = 20  # of a step of heyoka at its tolerance zero
CONSTANT, LINEAR, SQUARE, CUBE = range(4)  # terms of a series
SIX = 6.0  # 3!: a third derivative over its term of a series
ROUNDING = 1e-15  # a few units in the last place
EQUAL = 4.0 * ROUNDING  # relative: numbers that differ by less are equal but for rounding
SAFE = 16.0  # rate^2 over error and second derivative at a certain zero: 2 by the formula of a parabola, a factor 8 for safety
AT_ONCE = 16.0 * ROUNDING  # of the sizes of its terms: a function that is zero but for rounding


@inner
def waves(phi, z, n):
    """Write 1 and the waves of the phase behind the states."""
    z[n] = 1.0
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        sine = n + 2 * m
        cosine = sine - 1
        z[cosine], z[sine] = math.cos(m * phi), math.sin(m * phi)


@inner
def wave_rates(turn, z, n, rates):
    """Write the derivatives of 1 and of the waves behind n states, as the phase turns by so many radians a unit of time."""
    rates[n] = 0.0
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        sine = n + 2 * m
        cosine = sine - 1
        rates[cosine], rates[sine] = -m * turn * z[sine], m * turn * z[cosine]


@inner
def remaining(tau):
    """The power of a time by which what a series leaves out falls, ORDER + 1."""
    power = 1.0
    for _ in range(DOUBLINGS):
        power, tau = power * tau, tau * tau
    return power


@inner
def combine_rows(rows, z, a):
    """Write the sum of rows, each times a feature."""
    first = 0
    for k in range(len(a)):
        a[k] = rows[first, k] * z[first]
    for j in range(1, len(z)):
        for k in range(len(a)):
            a[k] += rows[j, k] * z[j]


@inner
def weighted_size(row, z):
    """The sum of the sizes of features, each times a weight."""
    total = 0.0
    for j in range(len(z)):
        total += row[j] * abs(z[j])
    return total


@inner
def write_powers(x, powers):
    """Write the powers of x from the zeroth on."""
    zeroth, length = 0, 1
    powers[zeroth] = 1.0
    while length < TERMS:
        for k in range(length):
            powers[length + k] = powers[k] * x
        x, length = x * x, 2 * length


@inner
def write_propagator(p, mode, tau, w):
    """Write the matrix by which states change within a time: of exp(Y step tau) less the unit matrix, the rows of states."""
    terms = p.propagators
    for i in range(len(w.flow)):
        w.flow[i] = p.whole[mode, i] if tau == 1.0 else 0.0
    for k in range(TERMS - 4 if tau != 1.0 else -1, -1, -4):
        k1, k2, k3 = k + 1, k + 2, k + 3
        for i in range(len(w.flow)):
            more = (w.flow[i] * tau + terms[mode, k3, i]) * tau + terms[mode, k2, i]
            w.flow[i] = (more * tau + terms[mode, k1, i]) * tau + terms[mode, k, i]


@inner
def apply_propagator(w):
    """Change states by the matrix that `write_propagator` wrote."""
    n, width = len(w.new), len(w.z)
    for i in range(n):
        total = 0.0
        for j in range(width):
            total += w.flow[i * width + j] * w.z[j]
        w.new[i] = total
    for i in range(n):
        w.z[i] += w.new[i]
