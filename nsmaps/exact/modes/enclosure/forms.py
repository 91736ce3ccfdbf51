"""Affine forms: sets of states that are linear in symbols but for a remainder.

A *form* is a row (c, a_1, ..., a_m, r): the numbers c + a e + b with |e_k| <= 1, |b| <= r. The forms of one set have the symbols
e_k in common, the remainders b may be any. A *set* of states has a form for each state and one for the phase, and as many
symbols; its *features* are the forms of the states, of 1 and of the waves of the phase. Rounding errors are added to remainders,
as in `balls`.
"""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW, TINY, UNIT, high, low
from nsmaps.exact.enclosure.arithmetic.elementary import bwave
from nsmaps.exact.engine.jit import inlined, inner


@inlined
def radius(form):
    """A bound on how far the numbers of a form lie from its centre."""
    total = form[len(form) - 1]
    for k in range(1, len(form) - 1):
        total += abs(form[k])
    return total * GROW


@inlined
def linear(form):
    """A bound on the part of a form that is linear in the symbols."""
    return radius(form) - form[len(form) - 1]


@inlined
def least(form):
    """A lower bound on a form."""
    return low((form[0], radius(form)))


@inlined
def greatest(form):
    """An upper bound on a form."""
    return high((form[0], radius(form)))


@inlined
def largest(form):
    """A bound on the absolute values of a form."""
    return (abs(form[0]) + radius(form)) * GROW


@inlined
def same(form, to):
    """Copy a form."""
    for k in range(len(form)):
        to[k] = form[k]


@inlined
def plain(form, centre, spread):
    """Write the form of a ball without symbols."""
    for k in range(len(form)):
        form[k] = 0.0
    form[0], form[len(form) - 1] = centre, spread


@inlined
def apply_row(row, z, form):
    """Write the form of a row of the table, each number known to `UNIT`, times features."""
    q = len(form)
    for k in range(q):
        form[k] = 0.0
    size = 0.0
    for j in range(len(row)):
        h = row[j]
        if h != 0.0:
            for k in range(q - 1):
                form[k] += h * z[j, k]
                size += abs(h * z[j, k])
            form[q - 1] += abs(h) * z[j, q - 1]
    form[q - 1] = (form[q - 1] * (1.0 + UNIT) + (len(row) + 3) * UNIT * size) * GROW + TINY


@inlined
def apply_matrix(e, off, z, out):
    """Write the forms of a matrix, each entry known to a radius, times features."""
    q = z.shape[1]
    for i in range(len(e)):
        form, size = out[i], 0.0
        for k in range(q):
            form[k] = 0.0
        for j in range(e.shape[1]):
            h, r = e[i, j], off[i, j]
            if h != 0.0 or r != 0.0:
                whole = 0.0
                for k in range(q - 1):
                    form[k] += h * z[j, k]
                    whole += abs(z[j, k])
                form[q - 1] += (abs(h) + r) * z[j, q - 1] + r * whole
                size += abs(h) * whole
        form[q - 1] = (form[q - 1] + (e.shape[1] + 3) * UNIT * size) * GROW + TINY


@inlined
def written(z, row, centre, slope, phase, spread):
    """Write a wave from its value and derivative in balls at the phase's centre, a bound on the rest of Taylor's theorem."""
    q = z.shape[1]
    z[row, 0] = centre[0]
    for k in range(1, q - 1):
        z[row, k] = slope[0] * phase[k]
    z[row, q - 1] = (centre[1] + (slope[1] + UNIT * abs(slope[0])) * spread + abs(slope[0]) * phase[q - 1]) * GROW


@inner
def add_waves(phase, z, n):
    """Write 1 and the waves of the phase behind the states of features."""
    q, spread = z.shape[1], radius(phase)
    plain(z[n], 1.0, 0.0)
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c, centre = n + 2 * m - 1, (m * phase[0], UNIT * m * abs(phase[0]))
        less, sine, _ = bwave(centre)
        cosine = (1.0 + less[0], less[1] + UNIT)
        bend = 0.5 * m * m * spread * spread * GROW
        if bend + m * phase[q - 1] < m * spread and bend < 0.5:
            written(z, c, cosine, (-m * sine[0], m * sine[1]), phase, spread)
            written(z, c + 1, sine, (m * cosine[0], m * cosine[1]), phase, spread)
            z[c, q - 1] += bend
            z[c + 1, q - 1] += bend
        else:
            less, sine, _ = bwave((centre[0], (centre[1] + m * spread) * GROW))
            plain(z[c], 1.0 + less[0], less[1] + UNIT)
            plain(z[c + 1], sine[0], sine[1])


@inner
def features(a_set, z, n):
    """Write the features of a set."""
    for i in range(n):
        same(a_set[i], z[i])
    add_waves(a_set[n], z, n)


@inner
def shave(a_set, form, least_wanted):
    """Narrow the symbols of a set to where a form of them may be at least a bound; returns False if it is nowhere."""
    q = len(form)
    above = greatest(form) - least_wanted
    if above < 0.0:
        return False
    for k in range(1, q - 1):
        share = abs(form[k])
        if share > 0.0 and above * (1.0 + 1e-14) < 2.0 * share:  # e_k >= 1 - above/share, where a_k > 0
            part = min(above * (1.0 + 1e-14) / (2.0 * share) + 1e-15, 1.0)
            middle = (1.0 - part) if form[k] > 0.0 else (part - 1.0)
            for i in range(len(a_set)):
                size = abs(a_set[i, 0]) + abs(a_set[i, k])
                a_set[i, 0] += a_set[i, k] * middle
                a_set[i, k] *= part
                a_set[i, q - 1] = (a_set[i, q - 1] + 4.0 * UNIT * size) * GROW
    return True


@inner
def fill(a_set, lower, upper):
    """Write the set that fills a box, each of whose sides has a symbol."""
    for i in range(len(a_set)):
        middle = 0.5 * (lower[i] + upper[i])
        plain(a_set[i], middle, 0.0)
        half = max(middle - lower[i], upper[i] - middle)
        if half > 0.0:
            a_set[i, 1 + i] = (half + UNIT * abs(middle)) * GROW


@inlined
def finite(form):
    """Whether a form is bounded."""
    return math.isfinite(form[0]) and math.isfinite(radius(form))
