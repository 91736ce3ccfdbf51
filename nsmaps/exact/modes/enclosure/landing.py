"""Sets of states at events: all that certainly meet a guard once, and those that may meet it within a short time."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW, UNIT, Ball, badd, between, bmul, exact, high, low
from nsmaps.exact.enclosure.first_events import RESERVE
from nsmaps.exact.engine.constants import LATEST, ROUNDING
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.modes.enclosure.flow import flow_to, measure
from nsmaps.exact.modes.enclosure.forms import (
    BEYOND,
    CENTRE,
    PHASE,
    REMAINDER,
    ROUNDED,
    ROUNDINGS,
    WITHIN,
    apply_row,
    copy_form,
    fill,
    lower_bound,
    magnitude,
    radius,
    upper_bound,
)
from nsmaps.exact.modes.enclosure.tables import BEND, RATE, VALUE

MOST_AIMS = 6  #: of Newton's method
AIMED = 1e-3  #: of the spread of times at which a set meets a guard: the time of its centre is as near as needed


@inlined
def derive_features(p, mode, w):
    """Write the first and second derivatives of features."""
    for i in range(len(w.z)):
        apply_row(p.flows[mode, i], w.z, w.rates[i])
    for i in range(len(w.z)):
        apply_row(p.flows[mode, i], w.rates, w.bends[i])


@inlined
def bend_over(p, mode, i, span, w):
    """A bound on |z_i''| for a time `span` <= 1 before and after."""
    third = 0.0
    for j in range(len(w.z)):
        third += p.third[mode, i, j] * magnitude(w.z[j])
    return (magnitude(w.bends[i]) + span * third) * GROW


@inlined
def put_phase(p, mode, s, phase, form):
    """Write the phase at a time s after the start, a ball of a time."""
    turned = bmul(Ball(p.turn[mode], UNIT * p.turn[mode]), s)
    copy_form(phase, form)
    now = badd(Ball(phase[CENTRE], phase[REMAINDER]), turned)
    form[CENTRE], form[REMAINDER] = now.centre, now.radius


@inner
def flow_near_event(p, mode, near, w):
    """Flow to about the time at which the centre of the set meets the nearest guard: that time."""
    last, function, value, rate = near.time + LATEST * near.reach, near.function, w.rows[VALUE], w.rows[RATE]
    s = near.time + near.reach
    for _ in range(MOST_AIMS):
        flow_to(p, mode, s, w)
        apply_row(p.functions[function, VALUE], w.z, value)
        apply_row(p.functions[function, RATE], w.z, rate)
        step = -value[CENTRE] / rate[CENTRE]
        if not abs(step) > AIMED * radius(value) / abs(rate[CENTRE]) + ROUNDING * s:
            break
        new = min(max(s + step, near.time), last)
        if not math.isfinite(new) or new == s:
            break
        s = new
    return s


@inner
def put_delay(s, near, w):
    """Write the time after s at which the set meets a guard as a form; a bound on its size, negative where that is not proved.

    With y, u, b the function and its derivatives now, 0 = y + u t + b t^2/2, so t is -y/u_0 for the centre u_0 of u, less
    ((u - u_0) t + b t^2/2)/u_0.
    """
    y, u, q = w.rows[VALUE], w.rows[RATE], len(w.delay)
    slope, spread, bend = abs(u[CENTRE]), radius(u), magnitude(w.rows[BEND])
    reach = magnitude(y) / slope
    guess = reach * (RESERVE + 2.0 * (spread + bend * reach) / slope)
    bend += w.jerk[near.function] * guess
    least_rate = (slope - spread - bend * guess) * WITHIN
    inside = s - guess > near.time and s + guess < near.time + LATEST * near.reach
    if not (u[CENTRE] < 0.0 and guess < 1.0 and least_rate > 0.0 and inside):
        return -1.0
    t = magnitude(y) / least_rate * BEYOND
    if not t < guess:
        return -1.0
    for k in range(q):
        w.delay[k] = y[k] / slope
    size = magnitude(w.delay)
    w.delay[REMAINDER] = ((y[REMAINDER] + spread * t + 0.5 * bend * t * t) / slope + ROUNDINGS * size) * GROW
    return t


@inner
def land_set(p, flight, near, w, out):
    """Write the set at its event with the nearest guard, that all meet once; returns whether that is proved."""
    start, mode, delay = w.parts[flight.part], flight.mode, w.delay
    s = flow_near_event(p, mode, near, w)
    measure(p, near.function, 1.0, w)
    t = put_delay(s, near, w)
    if t < 0.0:
        return False
    derive_features(p, mode, w)
    for i in range(len(start) - 1):
        z, rate, form = w.z[i], w.rates[i], out[i]
        lost = radius(rate) * t + 0.5 * bend_over(p, mode, i, t, w) * t * t + abs(rate[CENTRE]) * delay[REMAINDER]
        lost += ROUNDINGS * (magnitude(z) + abs(rate[CENTRE]) * t)
        for k in range(len(form) - 1):
            form[k] = z[k] + rate[CENTRE] * delay[k]
        form[REMAINDER] = (z[REMAINDER] + lost) * GROW
    phase, turn = out[PHASE], p.turn[mode]
    put_phase(p, mode, exact(s), start[PHASE], phase)
    for k in range(len(phase) - 1):
        phase[k] += turn * delay[k]
    size = abs(phase[CENTRE]) + radius(phase) + turn * t
    phase[REMAINDER] = (phase[REMAINDER] + turn * delay[REMAINDER] + ROUNDINGS * size) * GROW
    return True


@inner
def sweep(p, mode, h, w):
    """Write the box of the features of a set from now until a time h <= 1 later."""
    derive_features(p, mode, w)
    for i in range(len(w.z)):
        bend = 0.5 * h * h * bend_over(p, mode, i, h, w)
        ahead, behind = max(h * upper_bound(w.rates[i]), 0.0), min(h * lower_bound(w.rates[i]), 0.0)
        size = ROUNDINGS * (magnitude(w.z[i]) + max(ahead, -behind))
        w.lower[i], w.upper[i] = lower_bound(w.z[i]) + behind - bend - size, upper_bound(w.z[i]) + ahead + bend + size


@inlined
def term_of(row, j, w):
    """The term of a row, rounded numbers, over the box of features."""
    return bmul(Ball(row[j], UNIT * abs(row[j])), between(w.lower[j], w.upper[j]))


@inner
def contract(row, least_value, greatest_value, w, n):
    """Narrow the states of a box of features to where a row may lie between two bounds; returns False if it is nowhere.

    Hull consistency (F. Benhamou, F. Goualard, L. Granvilliers, J.-F. Puget, *Revising hull and box consistency*, 1999).
    """
    total, size = exact(0.0), 0.0
    for j in range(len(row)):
        if row[j] != 0.0:
            term = term_of(row, j, w)
            total, size = badd(total, term), size + abs(term.centre) + term.radius
    if low(total) > greatest_value or high(total) < least_value:
        return False
    for j in range(n):
        if row[j] != 0.0:
            term, slack = term_of(row, j, w), ROUNDED * size
            least_others = low(total) + (term.radius - term.centre) - slack
            greatest_others = high(total) - (term.centre + term.radius) + slack
            one, other = (least_value - greatest_others) / row[j], (greatest_value - least_others) / row[j]
            small, big = min(one, other), max(one, other)
            w.lower[j] = max(w.lower[j], small - ROUNDING * abs(small))
            w.upper[j] = min(w.upper[j], big + ROUNDING * abs(big))
            if w.lower[j] > w.upper[j]:
                return False
    return True


@inner
def enclose_passage(p, flight, near, function, h, w, out):
    """Write the box of the states of a set that may meet a guard from now until a time h later; whether there may be any.

    Where the function of none was negative at the start of the flight, it is zero and falls at the event.
    """
    start, mode, s = w.parts[flight.part], flight.mode, near.time
    n = len(start) - 1
    sweep(p, mode, h, w)
    if w.proper[function]:
        rate, value = p.functions[function, RATE], p.functions[function, VALUE]
        for _ in range(2):
            if not contract(value, 0.0, 0.0, w, n) or not contract(rate, -math.inf, 0.0, w, n):
                return False
    phase = out[PHASE]
    put_phase(p, mode, between(s, s + h), start[PHASE], phase)
    w.lower[n], w.upper[n] = lower_bound(phase), upper_bound(phase)
    fill(out, w.lower, w.upper)
    return True
