"""How rounding errors grow along a Taylor flight, piece by piece.

The errors of the states at the start of a flight are those of rounding, independent of each other, and each piece adds as much.
So their covariance S, in squares of units of rounding, becomes F S F' + D over a piece, where F is the derivative of the flow
and D has the squares of the sizes of the states. F is the exponential of Magnus' expansion to its second term, with Simpson's
rule for J, the derivatives of the rates (S. Blanes, F. Casas, J. A. Oteo and J. Ros, Physics Reports 470 (2009) 151):

    F = exp(h (J0 + 4 Jm + J1)/6 - h**2 [J0, J1]/12), over a piece of length h.

Where rates do not depend on the phase, an error along the velocity f is a shift of time: it stays one, and moves neither an event
from its place nor its state (Guckenheimer & Holmes 1983, section 1.5). So after each piece the part of the errors along f is left
out, and what remains is the error of the path: with lengths in units of the sizes of the states, P S P' with P = 1 - f f'/(f'f).
The time of the event has the errors left out. They are shifts while they change f by little, that is if |J e| is small against
|f|; next to an equilibrium nothing is left out.
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.flights.laws import rate_place, slope_place
from nsmaps.exact.modes.flights.resolution import HALF, compare_rates, flat_parts
from nsmaps.exact.modes.tables.memory import INTERVALS
from nsmaps.exact.modes.tables.taylor import DEGREE, ROUNDING

UNIT = 2.0**-53
ERROR = 4.0 * UNIT  # of the states, four standard deviations of rounding
SHIFTED = 0.01  # of the velocity, which errors that are shifts of time may change
SPREAD, EXPONENT, FACTOR, ROOM = range(4)  # matrices in `Piece.growth`: S, the exponent of F, F, memory
EXPONENTIAL_TERMS = 4  # of exp(A), where A is divided by a power of two until its size is at most one: to 1/100
MOST_SQUARES = 60
SIMPSON, COMMUTATOR = 6.0, 12.0  # divisors of the rule and of Magnus' second term


@inner
def error_at(p, f, x, w):
    """The error of a function's value at a share x of the piece: what its series leaves out, and rounding.

    Of a term this is UNIT each in the state, its product with the function's coefficient, the sum over states, and the last step
    of Horner's scheme (Higham 2002, section 5.1).
    """
    row, size, left = p.functions[f], 0.0, 0.0
    for j in range(len(w.z)):
        if row[j] != 0.0:
            total = abs(w.piece.local[j, DEGREE])
            for k in range(DEGREE - 1, -1, -1):
                total = total * x + abs(w.piece.local[j, k])
            size += abs(row[j]) * total
            left += abs(row[j]) * w.piece.tails[j]
    return ERROR * size + left * x ** (DEGREE - 1)


@inner
def begin_errors(p, w):
    """Let the errors of the own states be those of rounding, of the largest sizes that the states have had in this return."""
    q = w.piece
    for i in range(p.own):
        q.extent[i] = max(w.scales[i], abs(w.z[i]))
        for j in range(p.own):
            q.growth[SPREAD, i, j] = q.extent[i] ** 2 if i == j else 0.0


@inner
def slope_at(p, instant, i, j, w):
    """The derivative of the rate of an own state by another at an instant of the piece, from 0 to INTERVALS."""
    return w.piece.inside[instant, slope_place(p, i, j)]


@inner
def exponent(p, h, w):
    """Write the exponent of F over a piece of length h; the largest sum of the sizes in a row."""
    size = 0.0
    for i in range(p.own):
        total = 0.0
        for j in range(p.own):
            mean = slope_at(p, 0, i, j, w) + 4 * slope_at(p, HALF, i, j, w) + slope_at(p, INTERVALS, i, j, w)
            twist = 0.0
            for k in range(p.own):
                twist += slope_at(p, 0, i, k, w) * slope_at(p, INTERVALS, k, j, w)
                twist -= slope_at(p, INTERVALS, i, k, w) * slope_at(p, 0, k, j, w)
            w.piece.growth[EXPONENT, i, j] = h * (mean / SIMPSON - h * twist / COMMUTATOR)
            total += abs(w.piece.growth[EXPONENT, i, j])
        size = max(size, total)
    return size


@inner
def multiply(p, a, b, w):
    """Write the product of two matrices of `Piece.growth`, (own, own), in place of the second."""
    g = w.piece.growth
    for i in range(p.own):
        for c in range(p.own):
            total = 0.0
            for j in range(p.own):
                total += g[a, i, j] * g[b, j, c]
            g[ROOM, i, c] = total
    for i in range(p.own):
        for c in range(p.own):
            g[b, i, c] = g[ROOM, i, c]


@inner
def exponential(p, size, w):
    """Write F, the exponential of the exponent, whose rows have at most this size, by its series and by squares."""
    g, squares = w.piece.growth, 0
    while size > 1.0 and squares < MOST_SQUARES:
        size, squares = 0.5 * size, squares + 1
    for i in range(p.own):
        for j in range(p.own):
            g[EXPONENT, i, j] *= 0.5**squares
            g[FACTOR, i, j] = 1.0 if i == j else 0.0
    for k in range(EXPONENTIAL_TERMS, 0, -1):  # 1 + A (1 + A (...)/3)/2
        multiply(p, EXPONENT, FACTOR, w)
        for i in range(p.own):
            for j in range(p.own):
                g[FACTOR, i, j] = g[FACTOR, i, j] / k + (1.0 if i == j else 0.0)
    for _ in range(squares):
        multiply(p, FACTOR, FACTOR, w)


@inner
def transform(p, w):
    """Replace S by F S F'."""
    g = w.piece.growth
    multiply(p, FACTOR, SPREAD, w)
    for i in range(p.own):
        for j in range(i):
            g[SPREAD, i, j], g[SPREAD, j, i] = g[SPREAD, j, i], g[SPREAD, i, j]
    multiply(p, FACTOR, SPREAD, w)


@inner
def scaled_velocity(p, i, w):
    """The rate of an own state at the end of the piece, as a share of the square of its size."""
    size = w.piece.extent[i]
    return w.piece.inside[INTERVALS, rate_place(p, i)] / (size * size) if size > 0.0 else 0.0


@inner
def turn(p, w):
    """The square of what the errors at the end of the piece change the velocity by, each rate as a share of the state's size."""
    g, total = w.piece.growth, 0.0
    for i in range(p.own):
        variance = 0.0
        for j in range(p.own):
            for k in range(p.own):
                variance += slope_at(p, INTERVALS, i, j, w) * g[SPREAD, j, k] * slope_at(p, INTERVALS, i, k, w)
        total += variance / w.piece.extent[i] ** 2 if w.piece.extent[i] > 0.0 else 0.0
    return total * ERROR * ERROR


@inner
def leave_out_shifts(p, w):
    """Replace S by P S P', if the errors along the velocity are shifts of time."""
    q, own = w.piece, p.own
    speed, along, g = 0.0, 0.0, q.growth
    for i in range(own):
        speed += scaled_velocity(p, i, w) * q.inside[INTERVALS, rate_place(p, i)]
    if not (speed > 0.0 and turn(p, w) <= SHIFTED * SHIFTED * speed):
        return
    for i in range(own):  # S b/(f b) with b the scaled velocity
        total = 0.0
        for j in range(own):
            total += g[SPREAD, i, j] * scaled_velocity(p, j, w)
        g[ROOM, i, i] = total / speed
        along += scaled_velocity(p, i, w) * g[ROOM, i, i]
    along /= speed
    for i in range(own):
        f = q.inside[INTERVALS, rate_place(p, i)]
        for j in range(own):
            v = q.inside[INTERVALS, rate_place(p, j)]
            g[SPREAD, i, j] += f * v * along - f * g[ROOM, j, j] - v * g[ROOM, i, i]


@inner
def errors_after(p, mode, h, w):
    """The largest error of a state at the end of a piece of length h, as a share of its size, in units of ROUNDING.

    States are as large as they were in this return and at the ends of the pieces so far.
    """
    q, largest = w.piece, 0.0
    for i in range(p.own):
        q.extent[i] = max(q.extent[i], abs(q.state[i]))
    for i in range(0, INTERVALS if flat_parts(p, mode) == 0 else 0, HALF):
        compare_rates(p, mode, h, i, w)
    exponential(p, exponent(p, h, w), w)
    transform(p, w)
    if p.rate == 0.0:
        leave_out_shifts(p, w)
    for i in range(p.own):
        q.growth[SPREAD, i, i] = max(q.growth[SPREAD, i, i], 0.0) + q.extent[i] ** 2
        error = ERROR * math.sqrt(q.growth[SPREAD, i, i])
        if not error <= q.extent[i]:
            return 1.0 / ROUNDING
        largest = max(largest, error / q.extent[i] if q.extent[i] > 0.0 else 0.0)
    return largest / ROUNDING
