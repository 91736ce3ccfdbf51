"""How a motion begins in a mode: which functions are zero there, and whether it can continue.

Series are in time in longest steps of the mode; other quantities are in the units of the system, phases in radians.
"""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import ACCUMULATES, BLOCKED, REPELLING, RETURNED
from nsmaps.exact.modes.flights.laws import size_column, size_place, slope_column, slope_place
from nsmaps.exact.modes.flights.pieces import LOG_2, UNIT_EXPONENT, exact_exponent, expand, exponent_of
from nsmaps.exact.modes.flights.states import dot, velocity
from nsmaps.exact.modes.march.flight import NOW
from nsmaps.exact.modes.march.section import is_repelled
from nsmaps.exact.modes.march.words import reset_image, unit_of
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATING,
    AFTER,
    BEFORE,
    END,
    FIRST_AT_ONCE,
    FLIGHT_TIME,
    FUNCTION_BEFORE,
    IDLE_EVENTS,
    LAST_FUNCTION,
    NO_FUNCTION,
    SECOND_AT_ONCE,
    START_FUNCTION,
    TIMED_EVENTS,
)
from nsmaps.exact.modes.tables.taylor import (
    AT_ONCE,
    CONSTANT,
    DEGREE,
    EQUAL,
    LINEAR,
    SQUARE,
    TERMS,
    wave_rates,
    weighted_size,
)

GOES_ON = -1  # in place of an outcome
ACCUMULATED, SLOWER = 1e-12, 1.0 - 1e-6  # of a unit of time and of a speed: returns that are as short and slow down end
MOST_IDLE = 64  # events in a row that take no time but for rounding


@inner
def next_term(p, mode, d, k, sizes):
    """Write the term k + 1 of the series of affine states, or of bounds on its sizes, from the term k."""
    following = k + 1
    share = 1.0 / following
    for i in range(p.first.shape[1] - 1):
        total = 0.0
        for j in range(p.first[mode, i], p.first[mode, i + END]):
            total += (abs(p.values[j]) if sizes else p.values[j]) * d[k, p.columns[j]]
        d[following, i] = total * share


@inner
def sized_value(p, f, known, w):
    """The value of a function, and the sum of the sizes of its terms.

    States are as large as they are, or, where the function is not `known` to be zero, as they were in this return: of a speed
    that came to rest only rounding is left. Waves are as large as they become.
    """
    value, size = 0.0, 0.0
    for j in range(len(w.z)):
        value += p.functions[f, j] * w.z[j]
        size += abs(p.functions[f, j]) * size_of_feature(p, j, known, w)
    return value, size


@inner
def size_of_feature(p, j, known, w):
    """The size of a feature: see `sized_value`; of a derived state that of the terms of its formula."""
    if j >= p.first.shape[1] - 1:
        return 1.0
    if len(p.nonlinear) > 0 and j >= p.own:
        return w.piece.derived[j - p.own, size_column(p)]
    return abs(w.z[j]) if known else w.scales[j]


@inner
def further_term(p, mode, k, w):
    """Write the term k + 1 of the Taylor series of the features in memory, in the time unit of the mode, from the term k."""
    if len(p.nonlinear) == 0:
        next_term(p, mode, w.d, k, False)
    elif k == 0:
        expand(p.taylor[mode], len(w.piece.state), w.piece.state, w.piece.series, w)
        for j in range(len(w.piece.state)):
            power = 1.0
            for m in range(DEGREE + 1):
                w.d[m, j], power = w.piece.series[j, m] * power, power * p.steps[mode]
    following = k + 1
    wave_rates(p.rate * p.steps[mode] * (1.0 / following), w.d[k], p.first.shape[1] - 1, w.d[following])


@inner
def further_sizes(p, mode, k, w):
    """Write the sizes of the term k + 1, from those of the term k; of a Taylor flight from its rates and its step."""
    if len(p.nonlinear) == 0:
        next_term(p, mode, w.e, k, True)
    elif k == 0:
        velocity(p, mode, w.z, w.field, w)
        h = min(p.horizon, math.exp(LOG_2 * exact_exponent(w.piece.series, 0, UNIT_EXPONENT, exponent_of(p.horizon) + 1.0)))
        step = p.steps[mode]
        for j in range(len(w.piece.state)):
            w.e[LINEAR, j] = size_of_rate(p, j, w) * step
            w.e[SQUARE, j] = max(w.e[LINEAR, j] * step / h, 0.5 * size_of_second_rate(p, j, w) * step * step)
            for m in range(SQUARE, DEGREE):
                following = m + 1
                w.e[following, j] = w.e[m, j] * step / h
    n, later = p.first.shape[1] - 1, k + 1
    wave_rates(p.rate * p.steps[mode] * (1.0 / later), w.e[k], n, w.e[later])
    for j in range(n, len(w.z)):
        w.e[later, j] = abs(w.e[later, j])


@inner
def size_of_rate(p, j, w):
    """The size of the terms of the rate of an own or derived state, by what the laws of rates and derived states have written."""
    own, rates = p.own, w.piece.rates
    if j < own:
        return rates[size_place(p, j)]
    total = abs(w.piece.derived[j - own, slope_column(own)]) * p.rate
    for i in range(own):
        total += abs(w.piece.derived[j - own, slope_column(i)]) * rates[size_place(p, i)]
    return total


@inner
def size_of_second_rate(p, j, w):
    """The size of the terms of the second derivative of an own state by the time, by what the law of the rates has written."""
    if j >= p.own:
        return 0.0
    rates = w.piece.rates
    total = abs(rates[slope_place(p, j, p.own)]) * p.rate
    for i in range(p.own):
        total += abs(rates[slope_place(p, j, i)]) * rates[size_place(p, i)]
    return total


@inner
def leading(p, f, mode, first, known, w):
    """The first term of a function's series, from one on, that is not zero but for rounding: (its number, its value).

    Sizes are those of `sized_value`. All `TERMS` are zero where as many are as there are features: the function stays zero.
    """
    for j in range(len(w.z)):
        w.d[CONSTANT, j], w.e[CONSTANT, j] = w.z[j], size_of_feature(p, j, known, w)
    for k in range(min(first + len(w.z), TERMS - 2 if len(p.nonlinear) == 0 else DEGREE)):
        if k >= first:
            value, size = 0.0, 0.0
            for j in range(len(w.z)):
                value += p.functions[f, j] * w.d[k, j]
                size += abs(p.functions[f, j]) * w.e[k, j]
            if abs(value) > AT_ONCE * size:
                return k, value
        further_term(p, mode, k, w)
        further_sizes(p, mode, k, w)
    return TERMS, 0.0


@inner
def begin_mode(p, mode, w):
    """Whether a motion can continue in a mode: GOES_ON, or the outcome that ends it.

    Writes how many of the first terms of each function are zero, or NOW where its event takes place at once: where it is zero and
    falls, or where sliding or contact begins though its own conditions do not hold, as after a jump of a force.
    """
    if w.integers[ACCUMULATING] == 1:
        w.integers[ACCUMULATING] = 0
        return ACCUMULATES
    if is_repelled(p, mode, w):
        return REPELLING
    for j in range(len(w.scales)):
        w.scales[j] = max(w.scales[j], abs(w.z[j]))  # how large states have been in the return
    for f in range(p.watched[mode], p.watched[mode + END]):
        if w.on[f] == TERMS:
            continue
        known = w.on[f] > 0
        if not known:
            value, size = sized_value(p, f, known, w)
            if value > AT_ONCE * size:
                continue
            if value < -AT_ONCE * max(size, weighted_size(p.sizes[f], w.z)):
                if not p.leaves[f]:
                    w.integers[FIRST_AT_ONCE], w.integers[SECOND_AT_ONCE] = f, NO_FUNCTION
                    return BLOCKED
                w.on[f] = NOW
                continue
        terms, lead = leading(p, f, mode, max(w.on[f], 1), known, w)
        w.on[f] = NOW if lead < 0.0 else terms
    return GOES_ON


@inner
def outcome_of_idle_events(which, time, w):
    """GOES_ON after an event of a function, or the outcome of events that follow one another within rounding of the time.

    Writes the functions of the last two events that differ.
    """
    if w.reals[FLIGHT_TIME] > EQUAL * time:
        w.integers[IDLE_EVENTS], w.integers[LAST_FUNCTION], w.integers[FUNCTION_BEFORE] = 0, which, NO_FUNCTION
        return GOES_ON
    if which != w.integers[LAST_FUNCTION]:
        w.integers[LAST_FUNCTION], w.integers[FUNCTION_BEFORE] = which, w.integers[LAST_FUNCTION]
    w.integers[IDLE_EVENTS] += 1
    if w.reals[FLIGHT_TIME] > 0.0:
        w.integers[TIMED_EVENTS] = w.integers[IDLE_EVENTS]
    if w.integers[IDLE_EVENTS] <= MOST_IDLE:
        return GOES_ON
    return without_end(w)


@inner
def without_end(w):
    """The outcome of events that follow one another at once: one only, or some that took time at first, accumulate."""
    w.integers[FIRST_AT_ONCE], w.integers[SECOND_AT_ONCE] = w.integers[LAST_FUNCTION], w.integers[FUNCTION_BEFORE]
    return ACCUMULATES if w.integers[FUNCTION_BEFORE] == NO_FUNCTION or w.integers[TIMED_EVENTS] > 0 else BLOCKED


@inner
def write_rates(p, mode, field, w):
    """Write dz/dt of the features in memory, in units of time."""
    velocity(p, mode, w.z, field, w)
    for j in range(len(field)):
        field[j] /= p.steps[mode]


@inner
def ever_faster(p, mode, which, time, w):
    """Whether a return within rounding of the mode's unit of time ended with less speed than it began with: so all that follow.

    The speed is that at which the function of the event changes, on the side of events on which states are. The return ends at
    the event that it began with, that of the function `START_FUNCTION`, where it may not follow itself, or at one whose function
    rose first: one that fell from the start is met once.
    """
    if w.integers[START_FUNCTION] == NO_FUNCTION or not brief(p, mode, time, w):
        return False
    if which != w.integers[START_FUNCTION] and dot(p.functions[which], w.start_rates[AFTER]).value <= 0.0:
        return False
    write_rates(p, mode, w.field, w)
    before = dot(p.functions[which], w.start_rates[AFTER if p.after else BEFORE]).value
    return abs(dot(p.functions[which], w.field).value) < SLOWER * abs(before)


@inner
def brief(p, mode, time, w):
    """Whether a return is within rounding of a unit of time."""
    return time <= ACCUMULATED * unit_of(p, mode, w)


@inner
def outcome_in_time(p, outcome, mode, which, time, w):
    """The outcome of a return that has ended with the event of a function, or GOES_ON as `outcome_of_idle_events`.

    One that took no time has no image.
    """
    lasting = outcome_of_idle_events(which, time, w)
    if outcome == GOES_ON:
        return lasting
    if outcome != RETURNED or not (time <= 0.0 or ever_faster(p, mode, which, time, w)):
        return outcome
    if time > 0.0:
        w.integers[LAST_FUNCTION], w.integers[FUNCTION_BEFORE] = which, NO_FUNCTION
    reset_image(w)
    return without_end(w)
