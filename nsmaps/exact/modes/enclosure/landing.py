"""Sets of states at events: all that certainly meet a guard once, and those that may meet it within a short time."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW, UNIT, badd, between, bmul, high, low
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.modes.enclosure.flow import flow_to, measure
from nsmaps.exact.modes.enclosure.forms import apply_row, fill, greatest, largest, least, radius, same

STARTED, FALLING, LOOSE = 1, 2, 4  # of a set: at the section; the function of its event fell; a box, or a part of a set
MOST_AIMS = 6  # of Newton's method


@inlined
def rates_of(p, mode, w):
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
        third += p.third[mode, i, j] * largest(w.z[j])
    return (largest(w.bends[i]) + span * third) * GROW


@inlined
def phase_now(p, mode, s, phase, form):
    """Write the phase at a time s after the start, a ball of a time."""
    turned = bmul((p.turn[mode], UNIT * p.turn[mode]), s)
    same(phase, form)
    centre = badd((phase[0], phase[len(phase) - 1]), turned)
    form[0], form[len(form) - 1] = centre


@inner
def aim(p, mode, function, s, first, last, w):
    """Flow to about the time at which the centre of the set meets a guard, between two times: that time."""
    for _ in range(MOST_AIMS):
        flow_to(p, mode, s, w)
        apply_row(p.functions[function, 0], w.z, w.rows[0])
        apply_row(p.functions[function, 1], w.z, w.rows[1])
        step = -w.rows[0, 0] / w.rows[1, 0]
        if not abs(step) > 1e-3 * radius(w.rows[0]) / abs(w.rows[1, 0]) + 1e-15 * s:
            break
        new = min(max(s + step, first), last)
        if not math.isfinite(new) or new == s:
            break
        s = new
    return s


@inner
def crossing_time(function, s, first, last, w):
    """Write the time after s at which the set meets a guard as a form; a bound on its size, negative where that is not proved.

    With y, u, b the function and its derivatives now, 0 = y + u t + b t^2/2, so t is -y/u_0 for the centre u_0 of u, less
    ((u - u_0) t + b t^2/2)/u_0.
    """
    y, u, q = w.rows[0], w.rows[1], len(w.late)
    slope, spread, bend = abs(u[0]), radius(u), largest(w.rows[2])
    reach = largest(y) / slope
    guess = reach * (1.05 + 2.0 * (spread + bend * reach) / slope)
    bend += w.jerk[function] * guess
    least_rate = (slope - spread - bend * guess) * (1.0 - 1e-14)
    if not (u[0] < 0.0 and guess < 1.0 and least_rate > 0.0 and s - guess > first and s + guess < last):
        return -1.0
    t = largest(y) / least_rate * (1.0 + 1e-14)
    if not t < guess:
        return -1.0
    for k in range(q):
        w.late[k] = y[k] / slope
    size = largest(w.late)
    w.late[q - 1] = ((y[q - 1] + spread * t + 0.5 * bend * t * t) / slope + 4.0 * UNIT * size) * GROW
    return t


@inner
def landed(p, mode, function, s, first, last, start, w, out):
    """Write the set at its event with a guard that all meet once, between two times, about s; returns whether that is proved.

    `start` is the set at the start of the flight.
    """
    n, q = len(start) - 1, len(w.late)
    s = aim(p, mode, function, s, first, last, w)
    measure(p, function, 1.0, w)
    t = crossing_time(function, s, first, last, w)
    if t < 0.0:
        return False
    rates_of(p, mode, w)
    for i in range(n):
        rate, late = w.rates[i], w.late
        lost = radius(rate) * t + 0.5 * bend_over(p, mode, i, t, w) * t * t + abs(rate[0]) * late[q - 1]
        lost += 4.0 * UNIT * (largest(w.z[i]) + abs(rate[0]) * t)
        for k in range(q - 1):
            out[i, k] = w.z[i, k] + rate[0] * late[k]
        out[i, q - 1] = (w.z[i, q - 1] + lost) * GROW
    phase_now(p, mode, (s, 0.0), start[n], out[n])
    turn = p.turn[mode]
    for k in range(q - 1):
        out[n, k] += turn * w.late[k]
    out[n, q - 1] = (out[n, q - 1] + turn * w.late[q - 1] + 4.0 * UNIT * (abs(out[n, 0]) + radius(out[n]) + turn * t)) * GROW
    return True


@inner
def swept(p, mode, h, w):
    """Write the box of the features of a set from now until a time h <= 1 later."""
    rates_of(p, mode, w)
    for i in range(len(w.z)):
        bend = 0.5 * h * h * bend_over(p, mode, i, h, w)
        ahead, behind = max(h * greatest(w.rates[i]), 0.0), min(h * least(w.rates[i]), 0.0)
        size = 4.0 * UNIT * (largest(w.z[i]) + max(ahead, -behind))
        w.lower[i], w.upper[i] = least(w.z[i]) + behind - bend - size, greatest(w.z[i]) + ahead + bend + size


@inner
def contracted(row, least_value, greatest_value, w, n):
    """Narrow the states of a box of features to where a row may lie between two bounds; returns False if it is nowhere."""
    total, size = (0.0, 0.0), 0.0
    for j in range(len(row)):
        if row[j] != 0.0:
            term = bmul((row[j], UNIT * abs(row[j])), between(w.lower[j], w.upper[j]))
            total, size = badd(total, term), size + abs(term[0]) + term[1]
    if low(total) > greatest_value or high(total) < least_value:
        return False
    for j in range(n):
        if row[j] != 0.0:
            term = bmul((row[j], UNIT * abs(row[j])), between(w.lower[j], w.upper[j]))
            slack = 1e-14 * size
            others = low(total) + (term[1] - term[0]) - slack, high(total) - (term[0] + term[1]) + slack
            ends = (least_value - others[1]) / row[j], (greatest_value - others[0]) / row[j]
            small, big = min(ends[0], ends[1]), max(ends[0], ends[1])
            w.lower[j], w.upper[j] = max(w.lower[j], small - 1e-15 * abs(small)), min(w.upper[j], big + 1e-15 * abs(big))
            if w.lower[j] > w.upper[j]:
                return False
    return True


@inner
def passed(p, mode, function, s, h, proper, start, w, out):
    """Write the box of the states of a set that may meet a guard from s, now, until s + h; returns whether there may be any.

    `proper` means that the function of none was negative at the start of the flight, so that it is zero and falls at the event.
    """
    n = len(start) - 1
    swept(p, mode, h, w)
    if proper:
        rate, value = p.functions[function, 1], p.functions[function, 0]
        for _ in range(2):
            if not contracted(value, 0.0, 0.0, w, n) or not contracted(rate, -math.inf, 0.0, w, n):
                return False
    phase_now(p, mode, between(s, s + h), start[n], out[n])
    w.lower[n], w.upper[n] = least(out[n]), greatest(out[n])
    fill(out, w.lower, w.upper)
    return True
