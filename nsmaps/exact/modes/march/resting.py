"""Contact that lasts: whether it begins after an impact, and how words show it."""

import math

from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.accumulation import accumulation_time, corrected_time
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.flights.states import derive, dot, row_value, velocity
from nsmaps.exact.modes.march.beginning import further_term, leading
from nsmaps.exact.modes.march.section import apply_transition, check_conditions
from nsmaps.exact.modes.march.words import CHATTER, REST, unit_of
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATING,
    ACCUMULATION_TIME,
    AWAY,
    CONTACT_MARK,
    CONTACT_TIME,
    END,
    FIRST_AT_ONCE,
    NO_FUNCTION,
    PRESSURE,
    SECOND_AT_ONCE,
    SPEED_RATIO,
)
from nsmaps.exact.modes.tables.taylor import CONSTANT, CUBE, EQUAL, LINEAR, ROUNDING, SIX, SQUARE

BRIEF = 1e-8  # of a radian of the forcing: impacts that accumulate within it change a state by less than rounding
STEADY = 1e-5  # relative change of the pressure within impacts that accumulate: its cube is rounding
LONGEST = 0.125  # of a unit of time: impacts accumulate within it, so that two terms of a series bound how functions change


@inner
def contact_after(p, impact, mode, w):
    """The transition by which contact may begin after an impact, -1 for none."""
    for j in range(len(p.contacts)):
        of_impact = p.contacts[j] >= 0 and p.contacts[j] == p.impacts[impact] and p.mode[j] == mode
        if of_impact and check_conditions(p, j, w.z, w).satisfied:
            return j
    return -1


@inner
def approach(p, k, w):
    """The speed towards the surface of an impact, before its reset; infinite for other events."""
    for j in range(len(p.contacts)):
        if p.contacts[j] >= 0 and p.contacts[j] == p.impacts[k]:
            return -dot(p.begins[j, AWAY], w.z).value
    return math.inf


@inner
def is_pressed(p, mode, w):
    """Whether contact lasts at a pressure of zero: by its first derivative that is not zero; also where it stays zero."""
    for f in range(p.watched[mode], p.watched[mode + END]):
        if p.releases[p.chosen[p.choices[f]]]:
            _, lead = leading(p, f, mode, 0, True, w)
            return lead >= 0.0
    return False


@inner
def mark_of(p, k, j, mode, before, w):
    """The mark of the contact that begins at a state just after an impact: 0 for none, `CHATTER` or `REST`.

    The impacts accumulate after a time x, with their last speed u and the pressure a. Contact from the impact on, with all speed
    towards the surface lost, has the same impulse by then. Until then the states differ: within `BRIEF` by less than rounding, as
    u x does, and within a longer time, at a speed that `chatter` allows, if no other event takes place in it.
    """
    after, size = row_value(p, p.begins[j, AWAY], w.z, w)
    press, sizes = row_value(p, p.begins[j, PRESSURE], w.z, w)
    w.reals[ACCUMULATION_TIME] = 0.0
    if after <= ROUNDING * size:
        return REST if press > EQUAL * sizes or is_pressed(p, p.target[j], w) else 0
    unit = unit_of(p, mode, w)
    if not (press > 0.0 and after < before) or (p.is_section[k] and before > w.chatter * press * unit):
        return 0
    x = accumulation_time(after, after / before, press)
    first_terms(p, mode, SQUARE, w)
    step = p.steps[mode]
    jerk = dot(p.begins[j, PRESSURE], w.d[LINEAR]).value / step
    bend = 2.0 * dot(p.begins[j, PRESSURE], w.d[SQUARE]).size / (step * step)
    if x * abs(jerk) > STEADY * press or x * x * bend > STEADY * STEADY * press:
        return 0
    if x > BRIEF * unit and not (p.is_section[k] and x <= LONGEST * unit and sum_is_exact(p, j, mode, x, w)):
        return 0
    contact_state(p, j, w.z, w.other, w)
    velocity(p, p.target[j], w.other, w.field, w)
    held_jerk = dot(p.begins[j, PRESSURE], w.field).value / p.steps[p.target[j]]
    w.reals[ACCUMULATION_TIME], w.reals[SPEED_RATIO] = corrected_time(x, after / before, press, jerk, held_jerk), after / before
    return CHATTER


@inner
def first_terms(p, mode, terms, w):
    """Write the first terms of the Taylor series of the features, as of `further_term`, to `w.d`."""
    for j in range(len(w.z)):
        w.d[CONSTANT, j] = w.z[j]
    for m in range(terms):
        further_term(p, mode, m, w)


@inner
def contact_state(p, j, z, out, w):
    """Write the features z, shape (N,), in the contact with which a transition j begins: without speed at the surface."""
    n = p.resets.shape[1]
    for i in range(len(z)):
        out[i] = dot(p.resets[j, i], z).value if i < n else z[i]
    derive(p, out, w)


@inner
def sum_is_exact(p, j, mode, x, w):
    """Whether contact from an impact on is the same motion, but for rounding, once impacts have accumulated after a time x.

    No other event may take place by then. With the gap g, the direction q of impacts and the matrix M of the rates in contact
    the states of the motion are those in contact, g' q and e, where e' = M (g' q + e). As g is zero again after x, e is M^2 q
    times the integral of g then, which is at most u x^2/6 for a speed u = g' after the impact.
    """
    contact_state(p, j, w.z, w.other, w)
    velocity(p, p.target[j], w.z, w.one, w)
    velocity(p, p.target[j], w.other, w.field, w)
    for i in range(len(w.z)):
        w.two[i] = w.other[i] + (w.one[i] - w.field[i])  # M q u, in steps of the mode
    velocity(p, p.target[j], w.two, w.one, w)
    share = x / p.steps[p.target[j]]
    for i in range(len(w.new)):
        size = max(w.scales[i], abs(w.z[i]), abs(w.field[i]))
        if abs(w.one[i] - w.field[i]) * share * share > SIX * ROUNDING * size:
            return False
    return clear_until(p, mode, x, w) and clear_until(p, p.target[j], x, w)


@inner
def clear_until(p, mode, x, w):
    """Whether no function that is watched in a mode can fall to zero within a time x, but those that are zero just now."""
    first_terms(p, mode, SQUARE, w)
    share = x / p.steps[mode]
    for f in range(p.watched[mode], p.watched[mode + END]):
        value, size = row_value(p, p.functions[f], w.z, w)
        change = share * (dot(p.functions[f], w.d[LINEAR]).size + share * dot(p.functions[f], w.d[SQUARE]).size)
        if w.on[f] == 0 and ROUNDING * size < abs(value) <= 2.0 * change:
            return False
    return True


@inner
def falling(p, k, w):
    """The rate at which the function of an event falls, before its reset, if it may follow itself and the event ends a return."""
    if p.bounces[k] < 0 or not p.is_section[k]:
        return math.nan
    velocity(p, p.mode[k], w.z, w.field, w)
    return -dot(p.functions[p.function[k]], w.field).value / p.steps[p.mode[k]]


@inner
def accumulate(p, k, before, mode, w):
    """Whether events like the last one follow it ever faster, in all within rounding of the mode's unit of time."""
    f, step = p.bounces[k], p.steps[mode]
    first_terms(p, mode, CUBE, w)
    after, half = dot(p.functions[f], w.d[LINEAR]).value / step, dot(p.functions[f], w.d[SQUARE]).value
    sixth = dot(p.functions[f], w.d[CUBE]).value
    press, change = -2.0 * half / (step * step), SIX * abs(sixth) / (step * step * step)
    if not (press > 0.0 and before <= SUMMED_SPEED * press * unit_of(p, mode, w) and (after < before or before <= 0.0)):
        return False
    x = 2.0 * after / (press * (1.0 - after / before)) if before > 0.0 else 0.0
    return x * change <= STEADY * press


@inner
def enter_mode(p, k, with_reset, phi, w):
    """As `apply_transition`, into lasting contact where it begins; memory takes note of impacts that accumulate without it."""
    before = approach(p, k, w) if with_reset else 0.0
    fall = falling(p, k, w) if with_reset else math.nan
    mode = apply_transition(p, k, with_reset, phi, w)
    w.integers[ACCUMULATING] = 0
    if not math.isnan(fall) and accumulate(p, k, fall, mode, w):
        w.integers[ACCUMULATING], w.integers[FIRST_AT_ONCE], w.integers[SECOND_AT_ONCE] = 1, p.function[k], NO_FUNCTION
    j = contact_after(p, k, mode, w) if p.impacts[k] >= 0 else -1
    mark = mark_of(p, k, j, mode, before, w) if j >= 0 else 0
    if mark > 0:
        w.reals[CONTACT_TIME], w.integers[CONTACT_MARK] = 0.0, mark
        return apply_transition(p, j, True, phi, w)
    return mode
