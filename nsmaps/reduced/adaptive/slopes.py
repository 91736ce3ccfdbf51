"""The derivative of a map of strips, compiled: that of its polynomials, by the chain rule through their charts."""

import math

import numpy as np

from nsmaps.exact.engine.jit import entry
from nsmaps.reduced.adaptive.kernel import (
    ABOVE_COUNT,
    ABOVE_FIRST,
    BELOW_COUNT,
    BELOW_FIRST,
    DEGREE,
    OFFSET,
    ORDER,
    S_CENTRE,
    S_CHART,
    S_SCALE,
    SPEED_HIGH,
    SPEED_LOW,
    X_CENTRE,
    X_CHART,
    X_SCALE,
    allocating,
    along,
    inner,
    phase,
)
from nsmaps.reduced.adaptive.slabs import HIGH, LOW, STRAIGHT


@allocating
def _gradient(a, at, degree, u, w):
    """The derivatives of speed and advance by u and by w: (speed by u, advance by u, speed by w, advance by w)."""
    f, fu, fw = np.zeros(2), np.zeros(2), np.zeros(2)
    for power in range(degree % 4, degree + 1, 4):
        g, gw = np.zeros((4, 2)), np.zeros((4, 2))
        for _ in range(power + 1):
            for r in range(4):
                for o in range(2):
                    gw[r, o] = gw[r, o] * w + g[r, o]
                    g[r, o] = g[r, o] * w + a[at + 4 * o + r]
            at += 8
        for r in range(3, -1, -1):
            for o in range(2):
                fu[o] = fu[o] * u + f[o]
                f[o] = f[o] * u + g[r, o]
                fw[o] = fw[o] * u + gw[r, o]
    return fu[0], fu[1], fw[0], fw[1]


@inner
def _bend(curve, first, count, s):
    """The derivative of a curve's phase by s."""
    x = (s + 1.0) * (0.5 * count)
    k = min(max(int(x), 0), count - 1)
    t = 2.0 * (x - k) - 1.0
    slope = 0.0
    for i in range(ORDER - 1, 0, -1):
        slope = slope * t + i * curve[k + first, i]
    return slope * count


@entry
def slopes(tables, v, phi, number, out):
    """The derivatives of speed and advance by speed and phase, written into (N, 2, 2), by the chain rule through the charts."""
    curve = tables.curve
    for i in range(len(v)):
        if number[i] < 0:
            continue
        leaf = tables.leaf[number[i]]
        low, high, bend = leaf[SPEED_LOW], leaf[SPEED_HIGH], leaf[S_CHART]
        s = along(low, high, bend, v[i])
        s_v = 2.0 / (high - low) if bend == STRAIGHT else 2.0 / ((s + 1.0 if bend == LOW else 1.0 - s) * (high - low))
        first, count, next_first = int(leaf[BELOW_FIRST]), int(leaf[BELOW_COUNT]), int(leaf[ABOVE_FIRST])
        below, below_s = phase(curve, first, count, s), _bend(curve, first, count, s)
        count = int(leaf[ABOVE_COUNT])
        above, above_s = phase(curve, next_first, count, s), _bend(curve, next_first, count, s)
        from_above = leaf[X_CHART] == HIGH
        width, width_s = above - below, above_s - below_s
        y = (above - phi[i] if from_above else phi[i] - below) / width
        y_s = (above_s - y * width_s if from_above else -below_s - y * width_s) / width
        y_phi = (-1.0 if from_above else 1.0) / width
        x, x_y = (y, 1.0) if leaf[X_CHART] == STRAIGHT else (math.sqrt(y), 0.5 / math.sqrt(y))
        s_scale, x_scale = leaf[S_SCALE], leaf[X_SCALE]
        u, w = (s - leaf[S_CENTRE]) * s_scale, (x - leaf[X_CENTRE]) * x_scale
        f_u, g_u, f_w, g_w = _gradient(tables.coefficient, int(leaf[OFFSET]), int(leaf[DEGREE]), u, w)
        u_v, w_v, w_phi = s_scale * s_v, x_scale * x_y * y_s * s_v, x_scale * x_y * y_phi
        out[i, 0, 0], out[i, 0, 1] = f_u * u_v + f_w * w_v, f_w * w_phi
        out[i, 1, 0], out[i, 1, 1] = g_u * u_v + g_w * w_v, g_w * w_phi
