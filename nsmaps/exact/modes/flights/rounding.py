"""How rounding errors grow along a Taylor flight, piece by piece.

The errors of the states at the start of a flight are those of rounding, independent of each other, and each piece adds as much.
So their covariance S, in squares of units of rounding, becomes F S F' + D over a piece, where F is the derivative of the flow
and D has the squares of the sizes of the states. F is the exponential of Magnus' expansion to its first term, by the middle of
the piece (S. Blanes, F. Casas, J. A. Oteo and J. Ros, Physics Reports 470 (2009) 151, section 5.4): F = exp(h J), where J has the
derivatives of the rates there. That is right to some per cent: a piece is at most a sixth of the distance r to the nearest
singularity of the flight, (2**-53)**(1/20), and the terms left out are h J (h/r)**2/12 and less.

Where rates do not depend on the phase, an error along the velocity f is a shift of time: it stays one, and moves neither an event
from its place nor its state (Guckenheimer & Holmes 1983, section 1.5). So after each piece the part of the errors along f is left
out, and what remains is the error of the path: with lengths in units of the sizes of the states, P S P' with P = 1 - f f'/(f'f).
The time of the event has the errors left out. They are shifts while they change f by little, that is if |J e| is small against
|f|; next to an equilibrium nothing is left out.
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import LANES, multiply_lanes
from nsmaps.exact.modes.flights.laws import rate_place, slope_place
from nsmaps.exact.modes.flights.resolution import HALF, flat_parts, write_law
from nsmaps.exact.modes.tables.memory import INTERVALS
from nsmaps.exact.modes.tables.taylor import DEGREE, ROUNDING

UNIT = 2.0**-53
ERROR = 4.0 * UNIT  # of the states, four standard deviations of rounding
SHIFTED = 0.01  # of the velocity, which errors that are shifts of time may change
SPREAD, FACTOR, EXPONENT, SQUARE, PRODUCT = range(5)  # matrices in `Piece.growth`: S, F, A = h J, A A, memory
MOST_SQUARES = 60
LEAST = 1e-290  # of a square: one by it is a float
CUBIC, QUARTIC = 1.0 / 6.0, 1.0 / 24.0  # coefficients of the exponential


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
def enlarge(q, i, extent):
    """Let an own state have been as large as this; its weight is zero where the square is zero but for underflow."""
    square = extent * extent
    q.extent[i], q.weights[i] = extent, 1.0 / square if square > LEAST else 0.0


@inner
def begin_errors(p, w):
    """Let the errors of the own states be those of rounding, of the largest sizes that the states have had in this return."""
    q = w.piece
    for i in range(p.own):
        enlarge(q, i, max(w.scales[i], abs(w.z[i])))
        for j in range(p.own):
            q.growth[SPREAD, i, j] = q.extent[i] ** 2 if i == j else 0.0


@inner
def multiply(a, b, product):
    """Write the product of two matrices, shapes (own, LANES times a number), columns from own on zero."""
    count, width = a.shape
    for i in range(count):
        for c in range(0, width, LANES):
            multiply_lanes(a[i].ctypes.data, b[:, c:].ctypes.data, count, width, product[i, c:].ctypes.data)


@inner
def exponential(p, h, w):
    """Write F, the exponential of A = h J in the middle of a piece, by its terms up to A**4, A A (A/6 + A A/24) for the last two.

    A is divided by a power of two until the rows of A A are at most one in sum, and F becomes a square as often.
    """
    g, size = w.piece.growth, 0.0
    a, square, factor, product = g[EXPONENT], g[SQUARE], g[FACTOR], g[PRODUCT]
    for i in range(p.own):
        for j in range(p.own):
            a[i, j] = h * w.piece.inside[HALF, slope_place(p, i, j)]
    multiply(a, a, square)
    for i in range(p.own):
        total = 0.0
        for j in range(p.own):
            total += abs(square[i, j])
        size = max(size, total)
    share, squares = 1.0, 0
    while share * share * size > 1.0 and squares < MOST_SQUARES:
        share, squares = 0.5 * share, squares + 1
    for i in range(p.own):
        for j in range(p.own):
            a[i, j], square[i, j] = share * a[i, j], share * share * square[i, j]
            factor[i, j] = CUBIC * a[i, j] + QUARTIC * square[i, j]
    multiply(square, factor, product)
    for i in range(p.own):
        for j in range(p.own):
            factor[i, j] = product[i, j] + 0.5 * square[i, j] + a[i, j] + (1.0 if i == j else 0.0)
    for _ in range(squares):
        multiply(factor, factor, product)
        for i in range(p.own):
            for j in range(p.own):
                factor[i, j] = product[i, j]


@inner
def transform(p, w):
    """Replace S by F S F'."""
    g = w.piece.growth
    multiply(g[FACTOR], g[SPREAD], g[PRODUCT])
    for i in range(p.own):
        for j in range(p.own):
            g[SQUARE, j, i] = g[PRODUCT, i, j]
    multiply(g[FACTOR], g[SQUARE], g[SPREAD])


@inner
def turn(p, w):
    """The square of what the errors at the end of the piece change the velocity by, each rate as a share of the state's size."""
    spread, total = w.piece.growth[SPREAD], 0.0
    for i in range(p.own):
        variance = 0.0
        for j in range(p.own):
            entry = 0.0
            for k in range(p.own):
                entry += spread[j, k] * w.piece.inside[INTERVALS, slope_place(p, i, k)]
            variance += entry * w.piece.inside[INTERVALS, slope_place(p, i, j)]
        total += variance * w.piece.weights[i]
    return total * ERROR * ERROR


@inner
def leave_out_shifts(p, w):
    """Replace S by P S P', if the errors along the velocity are shifts of time."""
    own, spread, moved = p.own, w.piece.growth[SPREAD], w.new
    f, scaled, speed, along = w.field, w.other, 0.0, 0.0
    for i in range(own):
        f[i] = w.piece.inside[INTERVALS, rate_place(p, i)]
        scaled[i] = f[i] * w.piece.weights[i]
        speed += scaled[i] * f[i]
    if speed > 0.0 and turn(p, w) <= SHIFTED * SHIFTED * speed:
        for i in range(own):  # S b/(f b) with b the scaled velocity
            total = 0.0
            for j in range(own):
                total += spread[i, j] * scaled[j]
            moved[i] = total / speed
            along += scaled[i] * moved[i]
        along /= speed
        for i in range(own):
            for j in range(own):
                spread[i, j] += f[i] * f[j] * along - f[i] * moved[j] - f[j] * moved[i]


@inner
def write_factor(p, mode, phi, h, w):
    """Write F of a piece of length h from a phase: with derivatives it is known."""
    q = w.piece
    if w.dz.shape[1] == 0:
        if flat_parts(p, mode) == 0:
            write_law(p, mode, phi + 0.5 * p.rate * h, HALF, w)
        exponential(p, h, w)
        return
    for i in range(p.own):
        for j in range(p.own):
            q.growth[FACTOR, i, j] = q.flow[i, j]


@inner
def errors_after(p, mode, phi, h, w):
    """The largest error of a state after a piece of length h from a phase, as a share of its size, in units of ROUNDING.

    States are as large as they were in this return and at the ends of the pieces so far.
    """
    q, largest = w.piece, 0.0
    for i in range(p.own):
        if not abs(q.states[INTERVALS, i]) <= q.extent[i]:
            enlarge(q, i, abs(q.states[INTERVALS, i]))
    write_factor(p, mode, phi, h, w)
    transform(p, w)
    if p.rate == 0.0:
        leave_out_shifts(p, w)
    for i in range(p.own):
        q.growth[SPREAD, i, i] = max(q.growth[SPREAD, i, i], 0.0) + q.extent[i] ** 2
        share = q.growth[SPREAD, i, i] * q.weights[i]
        if q.weights[i] == 0.0 and not ERROR * math.sqrt(q.growth[SPREAD, i, i]) <= q.extent[i]:
            share = math.inf
        largest = share if not share <= largest else largest
    return (ERROR * math.sqrt(largest) if largest <= 1.0 / (ERROR * ERROR) else 1.0) / ROUNDING
