"""Sets of states along the linear flow of a mode, and bounds on the functions of guards over them."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW, UNIT
from nsmaps.exact.engine.constants import INWARD, OUTWARD, THREE
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.steps import first_step, safe_step
from nsmaps.exact.modes.enclosure.forms import apply_matrix, apply_row, lower_bound, magnitude, upper_bound
from nsmaps.exact.modes.enclosure.tables import BEND, CELLS, CRACKLE, JERK, POWERS, RATE, RATES, SNAP, VALUE


@inlined
def span(begins, k):
    """The rows of number k, from where they begin to where those of the next do."""
    following = k + 1
    return range(begins[k], begins[following])


@inner
def put_exponential(p, mode, x, e, off):
    """Write exp(Y x), 0 <= x <= 1, by its series, with bounds on the errors."""
    width = len(e)
    power = x ** (POWERS + 1) * OUTWARD
    for i in range(width):
        for j in range(width):
            total = p.powers[mode, POWERS, i, j]
            for k in range(POWERS - 1, -1, -1):
                total = total * x + p.powers[mode, k, i, j]
            e[i, j] = total
            rounding = UNIT * (abs(total) + 2.0 * (POWERS + 2) * x * p.blur[mode, i, j])
            off[i, j] = (rounding + power * p.left_out[mode, i, j]) * GROW


@inner
def multiply(e, off, table, f, f_off):
    """Write the product of a matrix with radii and one of the table."""
    width = len(e)
    for i in range(width):
        for j in range(width):
            total, size, spread = 0.0, 0.0, 0.0
            for k in range(width):
                total += e[i, k] * table[k, j]
                size += abs(e[i, k] * table[k, j])
                spread += off[i, k] * abs(table[k, j])
            f[i, j], f_off[i, j] = total, (spread + (width + 3) * UNIT * size) * GROW


@inner
def flow_to(p, mode, s, w):
    """Write the features at the time s, in cells, of the set whose features at the start are `w.start`."""
    whole = math.floor(s)
    put_exponential(p, mode, s - whole, w.e, w.off)
    if whole == 0:
        apply_matrix(w.e, w.off, w.start, w.z)
        return
    multiply(w.e, w.off, p.near[mode, whole % CELLS], w.f, w.f_off)
    if whole < CELLS:
        apply_matrix(w.f, w.f_off, w.start, w.z)
        return
    put_exponential(p, mode, 0.0, w.e, w.off)
    multiply(w.f, w.f_off, p.far[mode, whole // CELLS], w.e, w.off)
    apply_matrix(w.e, w.off, w.start, w.z)


@inner
def measure(p, function, span, w):
    """Write bounds on a function and its derivatives now, and on |jerk| and |snap| for a time `span` <= 1 before and after."""
    for k in range(RATES):
        apply_row(p.functions[function, k], w.z, w.rows[k])
        w.low[function, k], w.high[function, k] = lower_bound(w.rows[k]), upper_bound(w.rows[k])
    top = 0.0
    for j in range(len(w.z)):
        top += p.bounds[function, j] * magnitude(w.z[j])
    third, fourth, fifth = magnitude(w.rows[JERK]), magnitude(w.rows[SNAP]), magnitude(w.rows[CRACKLE])
    w.jerk[function] = (third + span * (fourth + span * (0.5 * fifth + span * top / (2 * THREE)))) * OUTWARD
    w.snap[function] = (fourth + span * (fifth + span * 0.5 * top)) * OUTWARD


@inlined
def clear_time(function, begins, rises, w):
    """A time for which a function certainly stays positive over the set; `begins` where it is zero now, and only now."""
    u, b, j = w.low[function, RATE], w.low[function, BEND], w.low[function, JERK]
    if begins:
        if not rises and u <= 0.0:
            return 0.0
        return first_step(max(u, 0.0), b, j, w.jerk[function], w.snap[function]) * INWARD
    y = w.low[function, VALUE]
    return safe_step(y, u, b, j, w.jerk[function], w.snap[function]) * INWARD if y > 0.0 else 0.0
