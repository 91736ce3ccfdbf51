"""Derivatives of a block of motions: along flights, by the series of exp(Y tau), and to the times of events."""

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.series_block import evaluate_row, sum_row, write_rates
from nsmaps.exact.modes.blocks.workspace import AT, IN
from nsmaps.exact.modes.tables.taylor import TERMS


@inner
def write_wave_tangents(p, d, n, b):
    """Write the derivatives of the waves of the phase along a direction."""
    states = p.first.shape[1] - 1
    for k in range(n):
        b.dz[d, states, k] = 0.0
    for m in range(1, (len(b.z) - states - 1) // 2 + 1):
        sines = states + 2 * m
        cosines = sines - 1
        for k in range(n):
            b.dz[d, cosines, k], b.dz[d, sines, k] = -m * b.z[sines, k] * b.dphi[d, k], m * b.z[cosines, k] * b.dphi[d, k]


@inner
def begin_tangents(p, d, n, b):
    """Write the derivatives of what is given at a start by its coordinate d: themselves, and the waves of the phase."""
    for k in range(n):
        b.dphi[d, k] = 1.0 if p.places[d] < 0 else 0.0
    for i in range(p.first.shape[1] - 1):
        for k in range(n):
            b.dz[d, i, k] = 1.0 if p.places[d] == i else 0.0
    write_wave_tangents(p, d, n, b)


@inner
def carry_tangents(p, mode, n, b):
    """Carry derivatives within a step to the times of columns: dz(tau) = exp(Y tau) dz(0), Y of the mode in its longest steps.

    Entries of exp(Y tau) - 1 are polynomials; flows of some states are given less those of another one.
    """
    directions, states = len(b.dz), p.first.shape[1] - 1
    order, used = p.flow_features
    for d in range(directions):
        write_wave_tangents(p, d, n, b)
    for q in range(states):
        i = p.flow_order[mode, q]
        base, last = p.flow_bases[mode, i], TERMS - 1
        for d in range(directions):
            for k in range(n):
                b.tangent_change[d, i, k] = b.tangent_change[d, base, k] if base != i else 0.0
        for number in range(len(b.z)):
            j = order[mode, i, number]
            while last >= 0 and used[mode, i, last] <= number:
                last -= 1
            if last < 0:
                break
            if j == states:  # the feature 1 has no derivative
                continue
            evaluate_row(p.flows[mode, i, j], last + 1, n, b.t)
            for d in range(directions):
                for k in range(n):
                    b.tangent_change[d, i, k] += b.t[AT.value + k] * b.dz[d, j, k]
    for d in range(directions):
        for i in range(states):
            for k in range(n):
                b.dz[d, i, k] += b.tangent_change[d, i, k]


@inner
def move_to_event(p, mode, n, b):
    """Take derivatives at a fixed time to derivatives at plain events, each later by -dg/(g' step) for a function g.

    The saltation of M. A. Aizerman and F. R. Gantmakher (1958), as in `nsmaps.exact.modes.march.flight`.
    """
    t, h, directions, turn, following = b.t, b.h, len(b.dz), p.rate * p.steps[mode], mode + 1
    write_rates(p, mode, n, b)
    for k in range(n):
        t[AT.rate + k] = 1.0
    for f in range(p.watched[mode], p.watched[following]):
        sum_row(p.functions[f], b.field, n, t)
        for k in range(n):
            t[AT.rate + k] = t[AT.value + k] if h[IN.function + k] == f else t[AT.rate + k]
    for d in range(directions):
        write_wave_tangents(p, d, n, b)
        for k in range(n):
            t[AT.delay + k] = 0.0
        for f in range(p.watched[mode], p.watched[following]):
            sum_row(p.functions[f], b.dz[d], n, t)
            for k in range(n):
                here = (h[IN.function + k] == f) & (h[IN.transition + k] >= 0)
                t[AT.delay + k] = -t[AT.value + k] / t[AT.rate + k] if here else t[AT.delay + k]
        for j in range(len(b.z)):
            for k in range(n):
                b.dz[d, j, k] += b.field[j, k] * t[AT.delay + k]
        for k in range(n):
            b.dphi[d, k] += turn * t[AT.delay + k]
