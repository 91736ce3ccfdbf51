"""Whether the Taylor series of a step is the flight: its acceleration against the equation of motion.

It is compared at the end of the step. A series at one place shows all of a polynomial, a sine or a cosine, but nothing of a steep
part that is flat there, as tanh(v/eps), sqrt(v**2 + eps**2) or the well exp(-(x/eps)**2). With such functions the comparison is
made at instants of the step, and between them the arguments may change by no more than the length over which a function changes.
"""

import math
from functools import lru_cache

import sympy as sp

from nsmaps.exact.engine.flight.flow import phase_rate
from nsmaps.exact.engine.flight.layout import AT_PARAMETERS
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import reset_by
from nsmaps.exact.flows.formulas import S, W, Z
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.ode.flight import LEADING, UNIT, size_of_step
from nsmaps.exact.ode.integrator import PLACE
from nsmaps.exact.ode.layout import STEP_PHI

INTERVALS = 8  #: of a step, between the instants at which the equation is evaluated
RESIDUAL = 1e-12  #: of the acceleration's terms that a series may leave, and of what its truncation leaves, see `step_size`
TRUNCATION = 1e-13  #: of the velocity, a step
ROUNDING = 32 * UNIT  #: of place, velocity and time, by which the acceleration may change
DERIVATIVES = 1e-12  #: of the leading terms of a derivative, which its last ones may be
NEGLIGIBLE = 1e-15  #: of the acceleration's terms
EXP, TANH, ERF, ORIGIN, ARCS, EDGES, EDGE = range(7)  #: kinds of functions with flat parts, by the length over which they change
KINDS = {
    sp.exp: EXP,
    sp.tanh: TANH,
    sp.erf: ERF,
    sp.log: ORIGIN,
    **dict.fromkeys((sp.atan, sp.asinh), ARCS),
    **dict.fromkeys((sp.asin, sp.acos, sp.atanh), EDGES),
    sp.acosh: EDGE,
}
VALUE, SIZE, BY_PLACE, BY_VELOCITY, BY_TIME, MISFIT, FIRST = range(7)  #: of a row of what is known at an instant


@lru_cache(maxsize=64)
def equation_of(acceleration: sp.Expr, parameters: tuple[sp.Symbol, ...]) -> tuple[int, tuple[int, ...]]:
    """The address of a compiled acceleration, and the kinds of its functions.

    It writes acceleration, size of its terms, derivatives by place, velocity and time, a free place, and of each function its
    argument and the derivative of the acceleration by its value.
    """
    parts = _functions(acceleration)
    size = sp.Add(*map(sp.Abs, sp.Add.make_args(acceleration)))
    formulas = [acceleration, size, *(sp.diff(acceleration, x) for x in (Z, W, S))]
    for part, argument, _ in parts:
        stand = sp.Dummy(real=True)
        formulas += [argument, sp.diff(acceleration.xreplace({part: stand}), stand).xreplace({stand: part})]
    places = [VALUE, SIZE, BY_PLACE, BY_VELOCITY, BY_TIME, *range(FIRST, FIRST + 2 * len(parts))]
    return rows_address(rows_source(formulas, places, (S, Z, W), parameters)), tuple(kind for *_, kind in parts)


def _functions(formula: sp.Expr) -> list[tuple[sp.Expr, sp.Expr, int]]:
    """The functions with flat parts in a formula that change along a flight, with their arguments and kinds."""
    found = {}
    for part in sp.preorder_traversal(formula):
        if not part.free_symbols & {S, Z, W}:
            continue
        if part.is_Pow and part.exp.free_symbols & {S, Z, W}:
            found[part] = part.exp * sp.log(part.base), EXP
        elif part.is_Pow and not (part.exp.is_Integer and part.exp > 0):
            found[part] = part.base, ORIGIN
        elif part.func in KINDS:
            found[part] = part.args[0], KINDS[part.func]
    return [(part, *about) for part, about in found.items()]


@inlined
def look(w, k, s, i):
    """Write what is known a time s after the beginning of the step of lane k into row i."""
    tc, row = w.tc, w.inside[i]
    place, velocity, slope = 0.0, 0.0, 0.0
    for m in range(tc.shape[1] - 1, -1, -1):
        place = place * s + tc[0, m, k]
        slope = slope * s + velocity
        velocity = velocity * s + tc[1, m, k]
    y = w.ends
    y[0], y[1], y[2] = w.lanes[k, STEP_PHI] / phase_rate(w.p) + s, w.pars[PLACE, k] + place, velocity
    values = w.p.table.ctypes.data + 8 * int(w.p.table[AT_PARAMETERS])
    reset_by(w.equation, 0.0, y.ctypes.data, values, row.ctypes.data)
    row[MISFIT] = abs(row[VALUE] - slope)


@inlined
def change_of(kind, low, high):
    """How much a function changes while its argument passes from low to high, if it may be flat."""
    if kind == EXP:
        return math.exp(high) - math.exp(low)
    if kind == TANH:
        return math.tanh(high) - math.tanh(low)
    if kind == ERF:
        return math.erf(high) - math.erf(low)
    return math.inf


@inlined
def scale_between(kind, low, high):
    """The length of an argument between low and high over which a function of this kind changes: to its nearest singularity."""
    nearest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    if kind == ORIGIN:
        return nearest
    if kind == ARCS:
        return math.sqrt(1.0 + nearest * nearest)
    if kind == EDGES:
        return 1.0 - max(abs(low), abs(high))
    if kind == EDGE:
        return low - 1.0
    return 1.0


@inlined
def seen(w, c, kind, scale):
    """True if a function whose argument is in column c changes between instants of the step by no more than it shows there."""
    u = w.inside
    for i in range(INTERVALS):
        before, after = max(i - 1, 0), min(i + 2, INTERVALS)
        bend = abs(u[before, c] - 2.0 * u[before + 1, c] + u[before + 2, c])
        bend = max(bend, abs(u[after - 2, c] - 2.0 * u[after - 1, c] + u[after, c])) / 8.0
        low, high = min(u[i, c], u[i + 1, c]) - bend, max(u[i, c], u[i + 1, c]) + bend
        if not high - low <= scale_between(kind, low, high):
            weight = max(abs(u[i, c + 1]), abs(u[i + 1, c + 1]))
            if not weight * change_of(kind, low, high) <= NEGLIGIBLE * scale:
                return False
    return True


@inlined
def spreads(w, k, h):
    """True if the series of the derivatives by place and velocity are exact over a step h: where flights approach one another
    fast, these are short although the flight is smooth.
    """
    tc, by, known = w.tc, (w.tc.shape[0] - 2) // 2, True
    top, power = tc.shape[1] - 1, 1.0
    for _ in range(top - 1):
        power *= h
    for i in range(4):
        row, leading, size = 2 + i % 2 + by * (i // 2), 0.0, 1.0
        for m in range(LEADING):
            leading, size = max(leading, abs(tc[row, m, k]) * size), size * h
        known = known and (abs(tc[row, top - 1, k]) + h * abs(tc[row, top, k])) * power <= DERIVATIVES * leading
    return known


@inner
def resolved(w, k, h):
    """True if the series of lane k is the flight over a step h."""
    if not spreads(w, k, h):
        return False
    place, velocity = size_of_step(w.tc, 0, k, h), size_of_step(w.tc, 1, k, h)
    size, first = 0.0, 0 if len(w.kinds) else INTERVALS
    for i in range(first, INTERVALS + 1):
        look(w, k, h * i / INTERVALS, i)
        size = max(size, w.inside[i, SIZE])
    place += abs(w.pars[PLACE, k])
    time = abs(w.lanes[k, STEP_PHI] / phase_rate(w.p)) + h
    for i in range(first, INTERVALS + 1):
        row = w.inside[i]
        noise = abs(row[BY_PLACE]) * place + abs(row[BY_VELOCITY]) * velocity + abs(row[BY_TIME]) * time
        if not row[MISFIT] <= RESIDUAL * size + TRUNCATION * velocity / h + ROUNDING * noise:
            return False
    known = True
    for j in range(len(w.kinds)):
        known = known and seen(w, FIRST + 2 * j, w.kinds[j], size + velocity / h)
    return known
