"""The Taylor series of a linear flow, with a bound on what is left out."""

import math

from nsmaps.exact.engine.jit import inlined

DOUBLINGS = 5
ORDER = 2**DOUBLINGS - 2  # of the series
LEFT_OUT = 1e-18  # of the size of a state, that its series may leave out at the end of a step
ROUNDING = 1e-15  # a few units in the last place


@inlined
def features(phi, z, n):
    """Write 1 and the waves of the phase behind the states."""
    z[n] = 1.0
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        z[n + 2 * m - 1], z[n + 2 * m] = math.cos(m * phi), math.sin(m * phi)


@inlined
def next_term(p, mode, d, k):
    """Write the term k + 1 of the Taylor series of z, in the time unit of the mode, from the term k."""
    n, turn, share = p.first.shape[1] - 1, p.rate * p.steps[mode], 1.0 / (k + 1)
    for i in range(n):
        total = 0.0
        for j in range(p.first[mode, i], p.first[mode, i + 1]):
            total += p.values[j] * d[k, p.columns[j]]
        d[k + 1, i] = total * share
    d[k + 1, n] = 0.0
    for m in range(1, (d.shape[1] - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        d[k + 1, c], d[k + 1, c + 1] = -m * turn * share * d[k, c + 1], m * turn * share * d[k, c]


@inlined
def series(p, mode, d):
    """Write the terms of the Taylor series of z, of which the first is given: d[k] = z^(k)/k! up to k = ORDER + 1."""
    for k in range(ORDER + 1):
        next_term(p, mode, d, k)


@inlined
def reach(p, mode, d):
    """How far, at most 1, the series may be used: what it leaves out of each state stays beside what it holds below rounding."""
    n, width = p.first.shape[1] - 1, d.shape[1]
    far = 1.0
    for i in range(n):
        left = 0.0
        for j in range(width):
            left += p.growth[mode, i, j] * abs(d[ORDER + 1, j])
        size, power = 0.0, 1.0
        for k in range(ORDER + 1):
            size += abs(d[k, i]) * power
            power *= far
        left *= power
        if left > LEFT_OUT * size and left > 0.0:
            far *= max((LEFT_OUT * size / left) ** (1.0 / (ORDER + 1)), 1e-3)
    return far


@inlined
def rest(tau):
    """The power of a time by which what a series leaves out falls, ORDER + 1."""
    power = 1.0
    for _ in range(DOUBLINGS):
        power, tau = power * tau, tau * tau
    return power


@inlined
def left_out(p, function, d, tau):
    """A bound on what the series of a function leaves out up to tau."""
    total = 0.0
    for j in range(d.shape[1]):
        total += p.bounds[function, j] * abs(d[ORDER + 1, j])
    return total * rest(tau)


@inlined
def project(p, function, d, a):
    """The series of a function of the state."""
    for k in range(ORDER + 1):
        a[k] = 0.0
    for j in range(d.shape[1]):
        h = p.functions[function, j]
        if h != 0.0:
            for k in range(ORDER + 1):
                a[k] += h * d[k, j]


@inlined
def state_at(d, tau, n, z):
    """Write the states at tau."""
    for i in range(n):
        total = d[ORDER, i]
        for k in range(ORDER - 1, -1, -1):
            total = total * tau + d[k, i]
        z[i] = total
