"""How a motion begins in a mode: which functions are zero there, and whether it can continue."""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import ACCUMULATES, BLOCKED, REPELLING, RETURNED
from nsmaps.exact.modes.flights.pieces import UNIT, exact_length, expand
from nsmaps.exact.modes.flights.states import dot, velocity
from nsmaps.exact.modes.march.flight import NOW
from nsmaps.exact.modes.march.section import repelled
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATING,
    AFTER,
    BEFORE,
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
from nsmaps.exact.modes.tables.taylor import DEGREE, ROUNDING, TERMS, next_term, sized

GOES_ON = -1  # in place of an outcome
AT_ONCE = 16.0 * ROUNDING  # of the sizes of its terms: a function that is zero but for rounding
ACCUMULATED, SLOWER = 1e-12, 1.0 - 1e-6  # of a unit of time and of a speed: returns that are as short and slow down end
MOST_IDLE = 64  # events in a row that take no time but for rounding


@inner
def next_sizes(p, mode, d, k):
    """Write bounds on the sizes of the term k + 1 of the series of z, from those of the term k."""
    n, turn, share = p.first.shape[1] - 1, p.rate * p.steps[mode], 1.0 / (k + 1)
    for i in range(n):
        total = 0.0
        for j in range(p.first[mode, i], p.first[mode, i + 1]):
            total += abs(p.values[j]) * d[k, p.columns[j]]
        d[k + 1, i] = total * share
    d[k + 1, n] = 0.0
    for m in range(1, (d.shape[1] - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        d[k + 1, c], d[k + 1, c + 1] = m * turn * share * d[k, c + 1], m * turn * share * d[k, c]


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
        return w.piece.derived[j - p.own, w.piece.derived.shape[1] - 1]
    return abs(w.z[j]) if known else w.scales[j]


@inner
def grown_to(w):
    """Take note of how large the states have been in a return."""
    for j in range(len(w.scales)):
        w.scales[j] = max(w.scales[j], abs(w.z[j]))


@inner
def further_term(p, mode, k, w):
    """Write the term k + 1 of the Taylor series of the features in memory, in the time unit of the mode, from the term k."""
    if len(p.nonlinear) == 0:
        next_term(p, mode, w.d, k)
    elif k == 0:
        expand(p, mode, w)
        for j in range(len(w.piece.state)):
            power = 1.0
            for m in range(DEGREE + 1):
                w.d[m, j], power = w.piece.series[j, m] * power, power * p.steps[mode]
    if len(p.nonlinear) > 0:
        next_waves(p, mode, w.d, k, 1.0)


@inner
def next_waves(p, mode, d, k, sign):
    """Write the term k + 1 of the series of 1 and of the waves, or of their sizes with the sign -1."""
    n, turn = p.first.shape[1] - 1, p.rate * p.steps[mode] / (k + 1)
    d[k + 1, n] = 0.0
    for m in range(1, (d.shape[1] - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        d[k + 1, c], d[k + 1, c + 1] = -sign * m * turn * d[k, c + 1], m * turn * d[k, c]


@inner
def further_sizes(p, mode, k, w):
    """Write the sizes of the term k + 1, from those of the term k; of a Taylor flight from its rates and its step."""
    if len(p.nonlinear) == 0:
        next_sizes(p, mode, w.e, k)
        return
    if k == 0:
        velocity(p, mode, w.z, w.field, w)
        h = exact_length(w.piece.series, 0, UNIT, p.horizon)
        step = p.steps[mode]
        for j in range(len(w.piece.state)):
            w.e[1, j] = size_of_rate(p, j, w) * step
            w.e[2, j] = max(w.e[1, j] * step / h, 0.5 * size_of_second_rate(p, j, w) * step * step)
            for m in range(3, DEGREE + 1):
                w.e[m, j] = w.e[m - 1, j] * step / h
    next_waves(p, mode, w.e, k, -1.0)


@inner
def size_of_rate(p, j, w):
    """The size of the terms of the rate of an own or derived state, by what the laws of rates and derived states have written."""
    own, rates = p.own, w.piece.rates
    if j < own:
        return rates[j * (own + 3) + 1]
    total = abs(w.piece.derived[j - own, own + 1]) * p.rate
    for i in range(own):
        total += abs(w.piece.derived[j - own, 1 + i]) * rates[i * (own + 3) + 1]
    return total


@inner
def size_of_second_rate(p, j, w):
    """The size of the terms of the second derivative of an own state by the time, by what the law of the rates has written."""
    if j >= p.own:
        return 0.0
    own, rates, row = p.own, w.piece.rates, j * (p.own + 3)
    total = abs(rates[row + own + 2]) * p.rate
    for i in range(own):
        total += abs(rates[row + 2 + i]) * rates[i * (own + 3) + 1]
    return total


@inner
def leading(p, f, mode, first, known, w):
    """The first term of a function's series, from one on, that is not zero but for rounding: (its number, its value).

    Sizes are those of `sized_value`. All `TERMS` are zero where as many are as there are features: the function stays zero.
    """
    for j in range(len(w.z)):
        w.d[0, j], w.e[0, j] = w.z[j], size_of_feature(p, j, known, w)
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
    if repelled(p, mode, w):
        return REPELLING
    grown_to(w)
    for f in range(p.watched[mode], p.watched[mode + 1]):
        if w.on[f] == TERMS:
            continue
        known = w.on[f] > 0
        if not known:
            value, size = sized_value(p, f, known, w)
            if value > AT_ONCE * size:
                continue
            if value < -AT_ONCE * max(size, sized(p.sizes[f], w.z)):
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
    if w.reals[FLIGHT_TIME] > 4.0 * ROUNDING * time:
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
    if which != w.integers[START_FUNCTION] and dot(p.functions[which], w.start_rates[AFTER])[0] <= 0.0:
        return False
    write_rates(p, mode, w.field, w)
    before = dot(p.functions[which], w.start_rates[AFTER if p.after else BEFORE])[0]
    return abs(dot(p.functions[which], w.field)[0]) < SLOWER * abs(before)


@inner
def brief(p, mode, time, w):
    """Whether a return is within rounding of a unit of time."""
    return time <= ACCUMULATED * unit_of(p, mode, w)


@inner
def unit_of(p, mode, w):
    """A unit of time: a radian of the forcing, without one the longest step of a mode, of a Taylor flight the last one."""
    if p.rate > 0.0:
        return 1.0 / p.rate
    return p.steps[mode] if len(p.nonlinear) == 0 else w.piece.length[0]


@inner
def reset_image(w):
    """Let the return in memory have no image."""
    for c in range(len(w.image)):
        w.image[c] = math.nan
        for j in range(w.tangent.shape[1]):
            w.tangent[c, j] = math.nan


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
