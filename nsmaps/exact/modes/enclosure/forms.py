"""Affine forms: sets of states that are linear in symbols but for a remainder.

L. H. de Figueiredo, J. Stolfi, *Affine arithmetic: concepts and applications*, Numerical Algorithms 37, 2004, here with one
remainder in place of new symbols.

A *form* is a row (c, a_1, ..., a_m, r): the numbers c + a e + b with |e_k| <= 1, |b| <= r. The forms of one set have the symbols
e_k in common, the remainders b may be any. A *set* of states has a form for each state and one for the phase, and as many
symbols; its *features* are the forms of the states, of 1 and of the waves of the phase. Rounding errors are added to remainders,
as in `balls`.
"""

from nsmaps.exact.enclosure.arithmetic.balls import GROW, TINY, UNIT, Ball, high, low
from nsmaps.exact.enclosure.arithmetic.elementary import bwave
from nsmaps.exact.engine.constants import ROUNDING
from nsmaps.exact.engine.jit import inlined, inner

CENTRE, SYMBOLS, REMAINDER = 0, 1, -1  #: places in a form; from the second on the coefficients of symbols
PHASE = -1  #: place of the form of the phase in a set
ROUNDINGS = 4 * UNIT  #: of the size of a sum of a few terms: more than their rounding errors
ROUNDED = 1e-14  #: relative: more than the rounding errors of sums and quotients of floats
BEYOND, WITHIN = 1.0 + ROUNDED, 1.0 - ROUNDED


@inlined
def radius(form):
    """A bound on how far the numbers of a form lie from its centre."""
    total = form[REMAINDER]
    for k in range(SYMBOLS, len(form) - 1):
        total += abs(form[k])
    return total * GROW


@inlined
def lower_bound(form):
    """A lower bound on a form."""
    return low(Ball(form[CENTRE], radius(form)))


@inlined
def upper_bound(form):
    """An upper bound on a form."""
    return high(Ball(form[CENTRE], radius(form)))


@inlined
def magnitude(form):
    """A bound on the absolute values of a form."""
    return (abs(form[CENTRE]) + radius(form)) * GROW


@inlined
def copy_form(form, to):
    """Copy a form."""
    for k in range(len(form)):
        to[k] = form[k]


@inlined
def copy_set(a_set, to):
    """Copy a set."""
    for i in range(len(a_set)):
        copy_form(a_set[i], to[i])


@inlined
def put_plain(form, ball):
    """Write the form of a ball, without symbols."""
    for k in range(len(form)):
        form[k] = 0.0
    form[CENTRE], form[REMAINDER] = ball.centre, ball.radius


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
            form[REMAINDER] += abs(h) * z[j, REMAINDER]
    form[REMAINDER] = (form[REMAINDER] * (1.0 + UNIT) + (len(row) + 3) * UNIT * size) * GROW + TINY


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
                form[REMAINDER] += (abs(h) + r) * z[j, REMAINDER] + r * whole
                size += abs(h) * whole
        form[REMAINDER] = (form[REMAINDER] + (e.shape[1] + 3) * UNIT * size) * GROW + TINY


@inlined
def put_wave(form, value, slope, phase, spread, remainder):
    """Write a wave by its Taylor series, from its value and derivative, balls, at the centre of the phase, and a remainder."""
    form[CENTRE] = value.centre
    for k in range(SYMBOLS, len(form) - 1):
        form[k] = slope.centre * phase[k]
    size = abs(slope.centre)
    form[REMAINDER] = (value.radius + (slope.radius + UNIT * size) * spread + size * phase[REMAINDER]) * GROW
    form[REMAINDER] += remainder


@inner
def add_waves(phase, z, n):
    """Write 1 and the waves of the phase behind the states of features."""
    spread = radius(phase)
    put_plain(z[n], Ball(1.0, 0.0))
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c, centre = n + 2 * m, Ball(m * phase[CENTRE], UNIT * m * abs(phase[CENTRE]))
        before = c - 1
        cosine_form, sine_form = z[before], z[c]
        bend = 0.5 * m * m * spread * spread * GROW
        linear_part = bend + m * phase[REMAINDER] < m * spread and bend < 0.5
        less, sine, _ = bwave(centre if linear_part else Ball(centre.centre, (centre.radius + m * spread) * GROW))
        cosine = Ball(1.0 + less.centre, less.radius + UNIT)
        if linear_part:  # errors of waves are larger than what their products with m round by
            put_wave(cosine_form, cosine, Ball(-m * sine.centre, m * sine.radius), phase, spread, bend)
            put_wave(sine_form, sine, Ball(m * cosine.centre, m * cosine.radius), phase, spread, bend)
        else:
            put_plain(cosine_form, cosine)
            put_plain(sine_form, sine)


@inner
def put_features(a_set, z, n):
    """Write the features of a set."""
    for i in range(n):
        copy_form(a_set[i], z[i])
    add_waves(a_set[n], z, n)


@inner
def shave(a_set, form, least_wanted):
    """Narrow the symbols of a set to where a form of them may be at least a bound; returns False if it is nowhere."""
    above = upper_bound(form) - least_wanted
    if above < 0.0:
        return False
    for k in range(SYMBOLS, len(form) - 1):
        share = abs(form[k])
        if share > 0.0 and above * BEYOND < 2.0 * share:  # e_k >= 1 - above/share, where a_k > 0
            part = min(above * BEYOND / (2.0 * share) + ROUNDING, 1.0)
            middle = (1.0 - part) if form[k] > 0.0 else (part - 1.0)
            for i in range(len(a_set)):  # by a new symbol for this part of the range
                each = a_set[i]
                size = abs(each[CENTRE]) + abs(each[k])
                each[CENTRE] += each[k] * middle
                each[k] *= part
                each[REMAINDER] = (each[REMAINDER] + ROUNDINGS * size) * GROW
    return True


@inner
def fill(a_set, lower, upper):
    """Write the set that fills a box, each of whose sides has a symbol."""
    for i in range(len(a_set)):
        side, middle = a_set[i], 0.5 * (lower[i] + upper[i])
        put_plain(side, Ball(middle, 0.0))
        half = max(middle - lower[i], upper[i] - middle)
        if half > 0.0:
            side[SYMBOLS + i] = (half + UNIT * abs(middle)) * GROW
