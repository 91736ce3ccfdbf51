"""One step of a flight by its Taylor series: how long it may be, the first impact in it, its end, and rounding errors."""

import math

from nsmaps.exact.engine.flight.flow import wall_places, walls_of
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.modes.march.zeros import first_zero, limits
from nsmaps.exact.modes.tables.taylor import ORDER
from nsmaps.exact.ode.layout import BOTH, FLOWN, FRESH, PLACES, UP, VELOCITIES, VELOCITY

UNIT = 2.0**-53
SIGMAS = 4.0  #: standard deviations of rounding errors that are taken as their bound
CLOUDED = 1e-10  #: of the way flown: a flight whose place may have a larger error is undecided
FAINT = 3e-5  #: of a speed: an impact whose speed may have a larger error is undecided
LEADING = 4  #: terms of the velocity with whose sizes the last ones are compared


@inlined
def step_size(tc, k, max_step):
    """The longest step of lane k whose series is exact to rounding, at most `max_step`.

    Its last two terms are rounding beside its leading ones, whatever the units of place and time.
    """
    top, h = tc.shape[1] - 1, max_step
    for m in range(top - 1, top + 1):
        tail, best = abs(tc[1, m, k]), 0.0
        if tail > 0.0:
            for j in range(LEADING):
                best = max(best, (UNIT * abs(tc[1, j, k]) / tail) ** (1.0 / (m - j)))
            h = min(h, best)
    return h


@inlined
def series_of(tc, row, k, factor, a):
    """Write the Taylor coefficients of a state of lane k, times a factor."""
    n = tc.shape[1]
    for m in range(n):
        a[m] = factor * tc[row, m, k]
    for m in range(n, ORDER + 1):
        a[m] = 0.0


@inlined
def room_to(p, left_up, upper):
    """The gap to a wall from the wall just left."""
    top, bottom = wall_places(p)
    return 0.0 if left_up == upper else top - bottom


@inlined
def size_of_step(tc, row, k, h):
    """The sum of the sizes of the terms of a series at the end of the step."""
    size = 0.0
    for m in range(tc.shape[1] - 1, -1, -1):
        size = size * h + abs(tc[row, m, k])
    return size


@inner
def impact_on(w, k, upper, end):
    """The first zero before `end` of the gap to a wall: (is there one, when, is that doubtful).

    The flight that has just left the wall begins at its zero, and later ones have the rounding errors of the steps before.
    """
    lane, count, a = w.lanes[k], w.counts[k], w.series[0]
    left_up = count[UP] == 1
    series_of(w.tc, 0, k, -1.0 if upper else 1.0, a)
    a[0] += room_to(w.p, left_up, upper)
    if count[FRESH] == 1 and left_up == upper:
        a[0] = 0.0
        if a[1] == 0.0 and a[2] < 0.0:
            a[2] = 0.0  # released: the acceleration is zero up to rounding
        return first_zero(a, end, 0.0, True)
    blur = SIGMAS * math.sqrt(lane[PLACES])
    if blur >= abs(a[0]):
        _, x, _ = first_zero(a, end, 0.0, False)
        return x < end, x, True
    found, x, doubtful = first_zero(a, end, blur, False)
    if found:
        rate = 0.0
        for m in range(ORDER, 0, -1):
            rate = rate * x + m * a[m]
        doubtful = doubtful or rate * rate <= 16.0 * blur * limits(a, end)[0]
    return found, x, doubtful


@inner
def first_impact(w, k, h):
    """The first impact within a step h of lane k: (is there one, on the upper wall, when, is that doubtful)."""
    has_up, has_down, _ = walls_of(w.p)
    found, upper, end, doubtful = False, False, h, False
    if has_down:
        found, end, doubtful = impact_on(w, k, False, h)
    if has_up:
        other, x, unsure = impact_on(w, k, True, end if found else h)
        doubtful = doubtful or unsure
        if other:
            found, upper, end = True, True, x
    return found, upper, end if found else h, doubtful


@inlined
def evaluate(w, k, s):
    """Write all states of lane k a time s after the beginning of the step; returns the acceleration there."""
    tc, ends = w.tc, w.ends
    n = tc.shape[1]
    for i in range(tc.shape[0]):
        total = tc[i, n - 1, k]
        for m in range(n - 2, -1, -1):
            total = total * s + tc[i, m, k]
        ends[i] = total
    a = 0.0
    for m in range(n - 1, 0, -1):
        a = a * s + m * tc[1, m, k]
    return a


@inlined
def propagated(w, k, h):
    """Carry the variance of the rounding errors of lane k through a step h, of which `evaluate` wrote the end."""
    lane, e = w.lanes[k], w.ends
    by = (len(e) - 2) // 2
    dd, dv, vd, vv = e[2], e[3], e[2 + by], e[3 + by]
    pp, pv, qq = lane[PLACES], lane[BOTH], lane[VELOCITIES]
    place, velocity = UNIT * size_of_step(w.tc, 0, k, h), UNIT * size_of_step(w.tc, 1, k, h)
    lane[PLACES] = dd * dd * pp + 2.0 * dd * dv * pv + dv * dv * qq + place * place
    lane[BOTH] = dd * vd * pp + (dd * vv + dv * vd) * pv + dv * vv * qq
    lane[VELOCITIES] = vd * vd * pp + 2.0 * vd * vv * pv + vv * vv * qq + velocity * velocity


@inlined
def clouded(w, k, upper, s, speed):
    """True if rounding errors have grown beyond a small share of the way flown."""
    lane = w.lanes[k]
    way = max(room_to(w.p, w.counts[k, UP] == 1, upper), (lane[FLOWN] + s) * max(abs(lane[VELOCITY]), speed))
    return SIGMAS * math.sqrt(lane[PLACES]) > CLOUDED * way


@inlined
def faint(w, k, a, speed):
    """True if rounding errors of the place change the speed of an impact, of acceleration a, by more than a small share."""
    return SIGMAS * math.sqrt(w.lanes[k, PLACES]) * abs(a) > FAINT * speed * speed
