"""The features of a state and their rates: own states, derived states, 1, and the waves of the phase.

Derived states and rates that are not affine come from compiled laws, at addresses of the table. Rates are by time in longest
steps of the mode; states are in the units of the system, phases in radians.
"""

from typing import NamedTuple

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_reset
from nsmaps.exact.modes.flights.laws import VALUE, parameter_column, rate_place, size_column, slope_column
from nsmaps.exact.modes.tables.memory import ONLY
from nsmaps.exact.modes.tables.taylor import wave_rates, waves


class Sum(NamedTuple):
    """The value of a row over the features."""

    value: float
    size: float  #: sum of the sizes of its terms


@inner
def dot(row, z):
    """The value of a row, and the sum of the sizes of its terms: a `Sum`."""
    total, size = 0.0, 0.0
    for j in range(len(z)):
        term = row[j] * z[j]
        total += term
        size += abs(term)
    return Sum(total, size)


@inner
def row_value(p, row, z, w):
    """As `dot`; derived states, of which memory has what their law wrote last, count as large as the terms of their formulas."""
    total, size = dot(row, z)
    if len(p.nonlinear) > 0 and p.derived != 0:
        for r in range(len(w.piece.derived)):
            size += abs(row[p.own + r]) * w.piece.derived[r, size_column(p)]
    return Sum(total, size)


@inner
def derive(p, z, w):
    """Write the derived states of own states z at the phase in memory."""
    if len(p.nonlinear) > 0 and p.derived != 0:
        call_reset(p.derived, w.piece.phase[ONLY], z.ctypes.data, p.parameters.ctypes.data, w.piece.derived.ctypes.data)
        for r in range(len(w.piece.derived)):
            z[p.own + r] = w.piece.derived[r, VALUE]


@inner
def features(p, phi, w):
    """Write the features of the own states in memory at a phase."""
    waves(phi, w.z, p.first.shape[1] - 1)
    if len(p.nonlinear) > 0:
        w.piece.phase[ONLY] = phi
        derive(p, w.z, w)


@inner
def shift(p, w):
    """Write the derivatives of the waves of the phase and of the derived states by the directions."""
    n = p.first.shape[1] - 1
    for m in range(1, (len(w.z) - n - 1) // 2 + 1):
        c, s = n + 2 * m - 1, n + 2 * m
        for k in range(w.dz.shape[1]):
            w.dz[c, k], w.dz[s, k] = -m * w.z[s] * w.dphi[k], m * w.z[c] * w.dphi[k]
    if len(p.nonlinear) > 0 and p.derived != 0 and w.dz.shape[1] > 0:
        shift_derived(p, w)


@inner
def shift_derived(p, w):
    """Write the derivatives of the derived states by the directions."""
    derive(p, w.z, w)
    own, slopes = p.own, w.piece.derived
    for r in range(len(slopes)):
        for c in range(w.dz.shape[1]):
            total = slopes[r, slope_column(own)] * w.dphi[c]
            for j in range(own):
                total += slopes[r, slope_column(j)] * w.dz[j, c]
            if w.moved.here:
                for k in range(len(p.parameters)):
                    total += slopes[r, parameter_column(p, k)] * w.moved.parameters[k]
            w.dz[own + r, c] = total


@inner
def velocity(p, mode, z, field, w):
    """Write dz/dt in the time unit of the mode."""
    n = p.first.shape[1] - 1
    if len(p.nonlinear) > 0:
        velocity_by_law(p, mode, z, field, w)
    else:
        for i in range(n):
            total, following = 0.0, i + 1
            for j in range(p.first[mode, i], p.first[mode, following]):
                total += p.values[j] * z[p.columns[j]]
            field[i] = total
    wave_rates(p.rate * p.steps[mode], z, n, field)


@inner
def velocity_by_law(p, mode, z, field, w):
    """Write the rates of own and derived states in the time unit of the mode."""
    own, step, rates, slopes = p.own, p.steps[mode], w.piece.rates, w.piece.derived
    call_reset(p.rates[mode], w.piece.phase[ONLY], z.ctypes.data, p.parameters.ctypes.data, rates.ctypes.data)
    for i in range(own):
        field[i] = rates[rate_place(p, i)] * step
    if len(p.nonlinear) > 0 and p.derived != 0:
        call_reset(p.derived, w.piece.phase[ONLY], z.ctypes.data, p.parameters.ctypes.data, slopes.ctypes.data)
        for r in range(len(slopes)):
            total = slopes[r, slope_column(own)] * p.rate * step
            for j in range(own):
                total += slopes[r, slope_column(j)] * field[j]
            field[own + r] = total


@inner
def waits(p, c, w):
    """Whether direction c moves only the phase of a motion at rest, whose next event then stays at its phase."""
    still = not w.moved.here
    for j in range(p.own):
        still = still and w.field[j] == 0.0 and w.dz[j, c] == 0.0
    return still
