"""A flight from one event to the next, with the derivatives that are carried along and through the event.

Times of zeros are in units of the piece, other quantities in the units of the system, phases in radians.
"""

import math
from typing import NamedTuple

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.flights.laws import size_column
from nsmaps.exact.modes.flights.motion import advance, begin_piece
from nsmaps.exact.modes.flights.pieces import bend_bound, combine, runs_away, sizes_of, term_of
from nsmaps.exact.modes.flights.rounding import ERROR, begin_errors, error_at, errors_after
from nsmaps.exact.modes.flights.states import dot, row_value, shift, velocity, waits
from nsmaps.exact.modes.march.zeros import (
    NONE,
    ONE,
    UNKNOWN,
    Zero,
    changes,
    first_zero,
    isolate,
    minima,
    size_of,
    stays_positive,
    with_rates,
    write_bernstein,
)
from nsmaps.exact.modes.tables.memory import (
    CLEARANCE,
    DOUBT_REASON,
    DOUBTED_FUNCTION,
    END,
    FIRST_AT_ONCE,
    FLIGHT_TIME,
    NO_FUNCTION,
    PIECES,
    SECOND_AT_ONCE,
)
from nsmaps.exact.modes.tables.taylor import (
    CONSTANT,
    EQUAL,
    LINEAR,
    ROUNDING,
    SAFE,
    TERMS,
    combine_rows,
    remaining,
    weighted_size,
)

MOST_PIECES = 1_000_000  # Taylor series of one flight
MOST_STEPS = 100_000  # of heyoka, of one flight
CLOUDED_SHARE = 1e-10  # of the states: a flight whose rounding errors may have grown to more before its event is in doubt
FAINT_SHARE = 3e-5  # of the rate of an event's function, which rounding errors of the place may change by more
STEEP, STIFF, CLOUDED, FAINT = 1, 2, 3, 4  # why a Taylor flight is in doubt
MOST_GROWTH = 700.0  # exponent of the growth of rounding, near the end of the range of floats
NOW = -1  # in place of a number of terms that are zero: the event takes place at once


@inner
def locate_zero(f, left, when, w):
    """The first zero of a function up to a time, with all care: a `Zero`.

    Its series is given, with a bound on its error. Terms that are zero at the start are divided out.
    """
    power = when ** w.on[f]
    if w.on[f] > 0:
        divide_by_power(w.a, w.on[f])
    if w.on[f] > 0 and w.a[CONSTANT] <= 0.0:
        return Zero(w.a[CONSTANT] < 0.0, 0.0 if w.a[CONSTANT] < 0.0 else when, False)
    return first_zero(w.a, when, left / power if power > 0.0 else 0.0, False)


@inner
def grown_rounding(p, f, grown, w):
    """The error of a function's value by what rounding at the start of the flight has grown to."""
    return 0.0 if grown == 0.0 else grown * ROUNDING * row_value(p, p.functions[f], w.z, w).size


@inner
def divide_by_power(a, first):
    """Divide a polynomial by the power of its first term that is not known to be zero, and not zero in floats."""
    while first < len(a) - 1 and a[first] == 0.0:
        first += 1
    for k in range(len(a)):
        a[k] = a[k + first] if k + first < len(a) else 0.0


@inner
def first_zero_of(p, f, when, grown, w):
    """The first zero of a function up to a time, in units of the piece: a `Zero`.

    Where the basis of Bernstein shows that there is no zero, or one alone, far from any doubt, that is enough.
    """
    z, on = w.z, w.on[f] > 0
    if w.on[f] == NOW:
        return Zero(True, 0.0, False)
    if w.on[f] == TERMS:
        return Zero(False, when, False)
    if len(p.nonlinear) > 0:
        return first_zero_ahead(p, f, when, grown, w)
    size = weighted_size(p.sizes[f], z)
    error = ROUNDING * size * (1.0 + grown) + weighted_size(p.left[f], z)
    combine_rows(p.points[f], z, w.b)
    number, guess = changes(w.b, on, error) if w.on[f] <= 1 else (UNKNOWN, 0.0)
    if number == NONE:
        return Zero(False, when, False)
    combine_rows(p.series[f], z, w.a)
    start_at_zero(f, w)
    clear, found, x = separate_zero(number, guess, on, when, error, weighted_size(p.bends[f], z), w)
    if clear:
        return Zero(found, x, False)
    return locate_zero(f, weighted_size(p.left[f], z) * remaining(when) + grown_rounding(p, f, grown, w), when, w)


@inner
def first_zero_ahead(p, f, when, grown, w):
    """As `first_zero_of`, over a piece of a Taylor flight."""
    on = w.on[f] > 0
    size, left = sizes_of(p, f, w)
    error = ROUNDING * size * (1.0 + grown) + left
    if w.on[f] <= 1 and stays_positive(term_of(p, f, w.on[f], w), size, error):
        return Zero(False, when, False)
    combine(p, f, w)
    start_at_zero(f, w)
    unknown = grown_rounding(p, f, grown, w)
    if stays_positive(w.a[LINEAR] if on else w.a[CONSTANT], size_of(w.a, 1.0), error):
        return Zero(False, when, False)
    write_bernstein(w.a, 1.0, w.powers, w.b)
    number, guess = changes(w.b, on, error) if w.on[f] <= 1 else (UNKNOWN, 0.0)
    if number == NONE:
        return Zero(False, when, False)
    clear, found, x = separate_zero(number, guess, on, when, error, bend_bound(w.a), w)
    if clear:
        error = ROUNDING * size_of(w.a, x) if on else unknown + error_at(p, f, x, w)
        return Zero(found, x, found and shifts_rate(w.a, x, error, w))
    found, x, unsure = locate_zero(f, left + (0.0 if on else formula_error(p, f, w)) + unknown, when, w)
    return Zero(found, x, unsure or (found and not on and shifts_rate(w.a, x, unknown + error_at(p, f, x, w), w)))


@inner
def formula_error(p, f, w):
    """The error of a function's value by rounding in the formulas of derived states."""
    total, derived = 0.0, w.piece.derived
    for r in range(len(derived)):
        total += abs(p.functions[f, p.own + r]) * derived[r, size_column(p)]
    return ROUNDING * total


@inner
def shifts_rate(a, x, error, w):
    """Whether an error of a function at its zero changes its rate there by more than a small share."""
    gap = with_rates(a, x)
    return error * abs(gap.acceleration) > FAINT_SHARE * gap.rate * gap.rate and not in_doubt(FAINT, w)


@inner
def start_at_zero(f, w):
    """Let the terms of a function's series that are known to be zero at the start of the flight be zero."""
    for k in range(w.on[f]):
        w.a[k] = 0.0


@inner
def separate_zero(number, guess, on, when, error, bend, w):
    """The one zero of the series `w.a`, from its changes of sign: (is it far from doubt, is it by a time, where)."""
    far = 1.0
    if number == UNKNOWN and guess > 0.0:
        far = guess
        write_bernstein(w.a, far, w.powers, w.b)
        number, guess = changes(w.b, on, error)
    if number == ONE:
        x, rate = isolate(w.a, guess * far, far, bend, w)
        close = abs(x - when) <= EQUAL * when
        if not close and rate < 0.0 and rate * rate > SAFE * error * bend:
            return True, x < when, min(x, when)
    return False, False, when


@inner
def next_event(p, mode, grown, end, w):
    """The first function of a mode that is zero by `end`, a piece at most: (which, -1 for none, when, whether doubtful).

    Of a second one at the same time, within rounding, memory takes note. `grown` is what rounding at the start of the flight
    has grown to, in units of rounding.
    """
    which, when, doubtful = NO_FUNCTION, end, False
    w.integers[FIRST_AT_ONCE] = NO_FUNCTION
    for f in range(p.watched[mode], p.watched[mode + END]):
        near = 0.0 if which == NO_FUNCTION else EQUAL * when
        found, x, unsure = first_zero_of(p, f, when + near, grown, w)
        w.integers[DOUBTED_FUNCTION] = f if unsure and w.integers[DOUBTED_FUNCTION] < 0 else w.integers[DOUBTED_FUNCTION]
        if not found:
            doubtful = doubtful or unsure
        elif which != NO_FUNCTION and abs(x - when) <= near:
            w.integers[FIRST_AT_ONCE], w.integers[SECOND_AT_ONCE], which = which, f, f if x < when else which
            when, doubtful = min(x, when), doubtful or unsure
        else:
            again = doubtful
            w.integers[FIRST_AT_ONCE], which, when, doubtful = NO_FUNCTION, f, x, unsure
            for g in range(p.watched[mode], f if again else p.watched[mode]):
                doubtful = doubtful or first_zero_of(p, g, when, grown, w).doubtful  # a doubt before this event remains
    return which, when, doubtful


@inner
def time_slope(p, function, rate, c, w):
    """How the time of the event of a function, of this rate there, changes along direction c, by derivatives at a fixed time.

    Both times are in the unit of the mode.
    """
    moved = 0.0
    for j in range(len(w.z)):
        moved += p.functions[function, j] * w.dz[j, c]
        if w.moved.here:
            moved += w.moved.functions[function, j] * w.z[j]
    return -moved / rate


@inner
def saltation(p, mode, function, w):
    """Take derivatives at a fixed time to derivatives at the event; one that takes place at once is at that time."""
    shift(p, w)
    if w.reals[FLIGHT_TIME] == 0.0:
        return
    velocity(p, mode, w.z, w.field, w)
    rate = dot(p.functions[function], w.field).value
    for c in range(w.dz.shape[1]):
        dt = time_slope(p, function, rate, c, w)
        for j in range(len(w.z)):
            w.dz[j, c] += w.field[j] * dt
        w.dphi[c] = 0.0 if waits(p, c, w) else w.dphi[c] + p.rate * p.steps[mode] * dt


@inner
def look_around(p, mode, tau, w):
    """Take note of the minima of the functions that are watched."""
    for f in range(p.watched[mode], p.watched[mode + END]):
        if len(p.nonlinear) > 0:
            combine(p, f, w)
        else:
            combine_rows(p.series[f], w.z, w.a)
        start_at_zero(f, w)
        least, number = minima(w.a, tau, w.b)
        w.margins[CLEARANCE] = min(w.margins[CLEARANCE], least / w.units[f])
        w.minima[f] += number


class Flight(NamedTuple):
    """A flight to an event, or without one to a time or to the horizon."""

    function: int  #: of the event, NO_FUNCTION without
    time: float
    phase: float  #: at its end, within a turn
    turns: int  #: whole turns of the phase
    doubtful: bool


@inner
def fly(p, mode, phi, until, w):
    """The `Flight` to the next event within a time, from the features in memory, which are those of the phase."""
    flight, turns, doubtful, taylor, grown = 0.0, 0, False, len(p.nonlinear) > 0, 0.0
    if taylor:
        begin_errors(p, w)
    for _ in range(MOST_STEPS if taylor else MOST_PIECES):
        if p.abscissa[mode] > 0.0:
            grown = math.expm1(min(p.abscissa[mode] * flight, MOST_GROWTH))
        unit = begin_piece(p, mode, until - flight, w)
        if taylor and unit <= ERROR * flight:  # within rounding of the time
            return Flight(NO_FUNCTION, flight, phi, turns, doubtful or not (runs_away(p, w) or in_doubt(STEEP, w)))
        left = (until - flight) / unit
        which, tau, unsure = next_event(p, mode, grown, min(left, 1.0), w)
        if taylor and which != NO_FUNCTION and grown * ROUNDING > CLOUDED_SHARE:
            unsure = not in_doubt(CLOUDED, w)
        last = which != NO_FUNCTION or left <= 1.0
        doubtful = doubtful or unsure
        if not math.isnan(w.margins[CLEARANCE]):
            look_around(p, mode, tau, w)
        start = phi
        phi, more = advance(p, mode, tau, unit, phi, w)
        if taylor and not last:
            grown = errors_after(p, mode, start, unit, w)
        flight, turns = flight + tau * unit, turns + more
        w.reals[FLIGHT_TIME] = flight
        w.integers[PIECES] += 1
        if last or flight >= p.horizon:
            return Flight(which, flight, phi, turns, doubtful)
        for f in range(p.watched[mode], p.watched[mode + END]):
            w.on[f] = w.on[f] if w.on[f] == TERMS else 0
    in_doubt(STIFF, w)
    return Flight(NO_FUNCTION, flight, phi, turns, True)


@inner
def in_doubt(why, w):
    """Take note of why a flight is in doubt, if it is the first reason; always False."""
    w.integers[DOUBT_REASON] = why if w.integers[DOUBT_REASON] == 0 else w.integers[DOUBT_REASON]
    return False
