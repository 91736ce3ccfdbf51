"""A flight from one event to the next, with the derivatives that are carried along and through the event."""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.march.zeros import changes, first_zero, isolated, narrowed, value
from nsmaps.exact.modes.tables.taylor import (
    ORDER,
    ROUNDING,
    TERMS,
    features,
    moved_on,
    next_term,
    propagated,
    remaining,
    series,
    sized,
    weighed,
)

MOST_TURNS = 1_000  # minima and maxima within one series
MOST_PIECES = 1_000_000  # Taylor series of one flight
NO_FUNCTION = -1
NOW = -1  # in place of a number of terms that are zero: the event takes place at once


@inner
def dot(row, z):
    """The value of a row, and the sum of the sizes of its terms."""
    total, size = 0.0, 0.0
    for j in range(len(z)):
        term = row[j] * z[j]
        total += term
        size += abs(term)
    return total, size


@inner
def velocity(p, mode, z, field):
    """Write dz/dt in the time unit of the mode."""
    n, turn = p.first.shape[1] - 1, p.rate * p.steps[mode]
    for i in range(n):
        total = 0.0
        for j in range(p.first[mode, i], p.first[mode, i + 1]):
            total += p.values[j] * z[p.columns[j]]
        field[i] = total
    field[n] = 0.0
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        field[c], field[c + 1] = -m * turn * z[c + 1], m * turn * z[c]


@inner
def shift_waves(z, dz, dphi, n):
    """Write the derivatives of the waves of the phase by the directions."""
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        for k in range(dz.shape[1]):
            dz[c, k], dz[c + 1, k] = -m * z[c + 1] * dphi[k], m * z[c] * dphi[k]


@inner
def carried(p, mode, tau, w):
    """Carry derivatives by tau along the flow of a mode, which the parameters move."""
    n, width, turn = p.first.shape[1] - 1, len(w.z), w.moved.rate * p.steps[mode]
    for j in range(width):
        w.d[0, j] = w.z[j]
    series(p, mode, w.d)
    for c in range(w.dz.shape[1]):
        for j in range(width):
            w.e[0, j] = w.dz[j, c]
        for k in range(ORDER + 1):
            next_term(p, mode, w.e, k)
            for i in range(n):
                for j in range(width):
                    w.e[k + 1, i] += w.moved.rates[mode, i, j] * w.d[k, j] / (k + 1)
            for m in range(1, (width - n - 1) // 2 + 1):
                x = n + 2 * m - 1
                w.e[k + 1, x] -= m * turn * w.d[k, x + 1] / (k + 1)
                w.e[k + 1, x + 1] += m * turn * w.d[k, x] / (k + 1)
        for j in range(n):
            total = w.e[ORDER, j]
            for k in range(ORDER - 1, -1, -1):
                total = total * tau + w.e[k, j]
            w.dz[j, c] = total


@inner
def followed(p, f, z, when, grown, w):
    """The first zero of a function up to a time, with all care: (is there one, where, is that doubtful); its series is given.

    Terms that are zero at the start are divided out.
    """
    blur = 0.0 if grown == 0.0 else grown * ROUNDING * dot(p.functions[f], z)[1]
    left, power = sized(p.left[f], z) * remaining(when) + blur, when ** w.on[f]
    if w.on[f] > 0:
        divided(w.a, w.on[f])
    if w.on[f] > 0 and w.a[0] <= 0.0:
        return w.a[0] < 0.0, 0.0 if w.a[0] < 0.0 else when, False
    return first_zero(w.a, when, left / power if power > 0.0 else 0.0, False)


@inner
def divided(a, first):
    """Divide a polynomial by the power of its first term that is not known to be zero, and not zero in floats."""
    while first < len(a) - 1 and a[first] == 0.0:
        first += 1
    for k in range(len(a)):
        a[k] = a[k + first] if k + first < len(a) else 0.0


@inner
def sought(p, f, when, grown, w):
    """The first zero of a function up to a time: (is there one, where, is that doubtful).

    Where the basis of Bernstein shows that there is no zero, or one alone, far from any doubt, that is enough.
    """
    z, on = w.z, w.on[f] > 0
    if w.on[f] == NOW:
        return True, 0.0, False
    if w.on[f] == TERMS:
        return False, when, False
    size = sized(p.sizes[f], z)
    error = ROUNDING * size * (1.0 + grown) + sized(p.left[f], z)
    weighed(p.points[f], z, w.b)
    number, guess = changes(w.b, on, error) if w.on[f] <= 1 else (2, 0.0)
    if number == 0:
        return False, when, False
    weighed(p.series[f], z, w.a)
    for k in range(w.on[f]):
        w.a[k] = 0.0
    far = 1.0
    if number > 1 and guess > 0.0:
        far = guess
        narrowed(w.a, far, w.powers, w.b)
        number, guess = changes(w.b, on, error)
    if number == 1:
        x, rate = isolated(w.a, guess * far, far, sized(p.bends[f], z), w)
        close = abs(x - when) <= 4.0 * ROUNDING * when
        if not close and rate < 0.0 and rate * rate > 16.0 * error * sized(p.bends[f], z):
            return x < when, min(x, when), False
    return followed(p, f, z, when, grown, w)


@inner
def next_event(p, mode, grown, end, w):
    """The first function of a mode that is zero by `end`, a longest step at most: (which, -1 for none, when, whether doubtful).

    Of a second one at the same time, within rounding, `w.both` takes note. `grown` is what rounding at the start of the flight
    has grown to, in units of rounding.
    """
    which, when, doubtful = NO_FUNCTION, end, False
    w.both[0] = NO_FUNCTION
    for f in range(p.watched[mode], p.watched[mode + 1]):
        near = 0.0 if which == NO_FUNCTION else 4.0 * ROUNDING * when
        found, x, unsure = sought(p, f, when + near, grown, w)
        w.doubt[0] = f if unsure and w.doubt[0] < 0.0 else w.doubt[0]
        if not found:
            doubtful = doubtful or unsure
        elif which != NO_FUNCTION and abs(x - when) <= near:
            w.both[0], w.both[1], which = which, f, f if x < when else which
            when, doubtful = min(x, when), doubtful or unsure
        else:
            again = doubtful
            w.both[0], which, when, doubtful = NO_FUNCTION, f, x, unsure
            for g in range(p.watched[mode], f if again else p.watched[mode]):
                doubtful = doubtful or sought(p, g, when, grown, w)[2]  # a doubt before this event remains
    return which, when, doubtful


@inner
def saltation(p, mode, function, w):
    """Take derivatives at a fixed time to derivatives at the event; one that takes place at once is at that time."""
    shift_waves(w.z, w.dz, w.dphi, p.first.shape[1] - 1)
    if w.lapse[0] == 0.0:
        return
    velocity(p, mode, w.z, w.field)
    slope, _ = dot(p.functions[function], w.field)
    turn = p.rate * p.steps[mode]
    for c in range(w.dz.shape[1]):
        moved = 0.0
        for j in range(len(w.z)):
            moved += p.functions[function, j] * w.dz[j, c]
            if w.moved.here:
                moved += w.moved.functions[function, j] * w.z[j]
        dt = -moved / slope
        for j in range(len(w.z)):
            w.dz[j, c] += w.field[j] * dt
        w.dphi[c] += turn * dt


@inner
def minima(a, end, b):
    """The least value of a polynomial at its minima in (0, end), inf without one, and their number; b is memory."""
    for k in range(ORDER):
        b[k] = (k + 1) * a[k + 1]
    b[ORDER] = 0.0
    x, least, number = 0.0, math.inf, 0
    for _ in range(MOST_TURNS):
        falls = b[0] < 0.0 or (b[0] == 0.0 and b[1] < 0.0)
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
        found, step, _ = first_zero(b, end - x, 0.0, b[0] == 0.0)
        if not found:
            break
        x += step
        for i in range(ORDER):
            for k in range(ORDER - 1, i - 1, -1):
                b[k] += step * b[k + 1]
        b[0] = 0.0
        if falls:
            for k in range(ORDER):
                b[k] = -b[k]
            least, number = min(least, value(a, x)[0]), number + 1
    return least, number


@inner
def look_around(p, mode, tau, w):
    """Take note of the minima of the functions that are watched."""
    for f in range(p.watched[mode], p.watched[mode + 1]):
        weighed(p.series[f], w.z, w.a)
        for k in range(w.on[f]):
            w.a[k] = 0.0
        least, number = minima(w.a, tau, w.b)
        w.near[0] = min(w.near[0], least / w.units[f])
        w.minima[f] += number


@inner
def within_turn(phi):
    """A phase that is not negative within a turn, and the whole turns."""
    more = math.floor(phi / TWO_PI) if phi >= TWO_PI else 0
    return (max(phi - more * TWO_PI, 0.0) if more > 0 else phi), more


@inner
def fly(p, mode, phi, until, w):
    """To the next event: (its function, -1 for none until a time or within the horizon; time; phase; whole turns; doubtful).

    The features are those of the phase.
    """
    n, directions, flight, turns, doubtful = p.first.shape[1] - 1, w.dz.shape[1], 0.0, 0, False
    for _ in range(MOST_PIECES):
        grown = math.expm1(min(p.abscissa[mode] * flight, 700.0)) if p.abscissa[mode] > 0.0 else 0.0
        left = (until - flight) / p.steps[mode]
        which, tau, unsure = next_event(p, mode, grown, min(left, 1.0), w)
        doubtful, step = doubtful or unsure, tau * p.steps[mode]
        if not math.isnan(w.near[0]):
            look_around(p, mode, tau, w)
        shift_waves(w.z, w.dz, w.dphi, n)
        propagated(p, mode, tau, w)
        if w.moved.here:
            carried(p, mode, tau, w)
        moved_on(w)
        flight += step
        w.lapse[0] = flight
        w.spent[0] += 1
        for c in range(directions):
            w.dphi[c] += w.moved.rate * step
        phi, more = within_turn(phi + p.rate * step)
        turns += more
        features(phi, w.z, n)
        if which != NO_FUNCTION or left <= 1.0 or flight >= p.horizon:
            return which, flight, phi, turns, doubtful
        for f in range(p.watched[mode], p.watched[mode + 1]):
            w.on[f] = w.on[f] if w.on[f] == TERMS else 0
    return NO_FUNCTION, flight, phi, turns, True
