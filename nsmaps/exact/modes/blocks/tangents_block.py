"""Derivatives of a block of motions at starts and events."""

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.series_block import sum_row, write_rates
from nsmaps.exact.modes.blocks.workspace import AT, IN


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
    """Write the derivatives of what is given at a start along a direction: by the coordinate d, or by parameters."""
    for k in range(n):
        b.dphi[d, k] = b.moved.phase if b.moved.here else 1.0 if p.places[d] < 0 else 0.0
    for i in range(p.first.shape[1] - 1):
        for k in range(n):
            b.dz[d, i, k] = 1.0 if p.places[d] == i and not b.moved.here else 0.0
    write_wave_tangents(p, d, n, b)


@inner
def change_by_row(rows, moved_rows, i, n, b):
    """Write row i over the features, and its derivatives, to `change`."""
    for d in range(len(b.features)):
        sum_row(rows[i], b.features[d], n, b.t)
        for k in range(n):
            b.change[d, i, k] = b.t[AT.value + k]
        if d > 0 and b.moved.here:
            sum_row(moved_rows[i], b.z, n, b.t)
            for k in range(n):
                b.change[d, i, k] += b.t[AT.value + k]


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
            if b.moved.here:
                sum_row(b.moved.functions[f], b.z, n, t)
                for k in range(n):
                    here = (h[IN.function + k] == f) & (h[IN.transition + k] >= 0)
                    t[AT.delay + k] -= t[AT.value + k] / t[AT.rate + k] if here else 0.0
        for j in range(len(b.z)):
            for k in range(n):
                b.dz[d, j, k] += b.field[j, k] * t[AT.delay + k]
        for k in range(n):
            b.dphi[d, k] += turn * t[AT.delay + k]
