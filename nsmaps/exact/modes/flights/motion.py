"""The motion along a piece of a flight: features and derivatives at its end, and states at instants of it."""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.flights.pieces import at, moved_along, slope, spread, taken
from nsmaps.exact.modes.flights.states import derive, features, shift
from nsmaps.exact.modes.tables.taylor import ORDER, moved_on, next_term, propagated, series


@inner
def carried(p, mode, tau, w):
    """Carry derivatives by tau along the flow of a mode, which the parameters move."""
    n, width, turn = p.first.shape[1] - 1, len(w.z), w.moved.rate * p.steps[mode]
    for j in range(width):
        w.d[0, j] = w.z[j]
    series(p, mode, w.d)
    for c in range(w.dz.shape[1]):
        for j in range(width):
            w.e[0, j] = w.dz[j, c]
        for k in range(ORDER + 1):
            next_term(p, mode, w.e, k)
            for i in range(n):
                for j in range(width):
                    w.e[k + 1, i] += w.moved.rates[mode, i, j] * w.d[k, j] / (k + 1)
            for m in range(1, (width - n - 1) // 2 + 1):
                x = n + 2 * m - 1
                w.e[k + 1, x] -= m * turn * w.d[k, x + 1] / (k + 1)
                w.e[k + 1, x + 1] += m * turn * w.d[k, x] / (k + 1)
        for j in range(n):
            total = w.e[ORDER, j]
            for k in range(ORDER - 1, -1, -1):
                total = total * tau + w.e[k, j]
            w.dz[j, c] = total


@inner
def within_turn(phi):
    """A phase that is not negative within a turn, and the whole turns."""
    more = math.floor(phi / TWO_PI) if phi >= TWO_PI else 0
    return (max(phi - more * TWO_PI, 0.0) if more > 0 else phi), more


@inner
def begun_piece(p, mode, max_length, w):
    """Begin a piece of a flight at the features in memory: its length, that of the mode's longest step, or at most `max_length`.

    Zero where no Taylor series is the flight.
    """
    return p.steps[mode] if len(p.nonlinear) == 0 else taken(p, mode, min(max_length, p.horizon), w)


@inner
def flown(p, mode, tau, unit, phi, w):
    """Move features and derivatives on by a share of a piece of this length, from a phase: (the new one, whole turns)."""
    step = tau * unit
    shift(p, w)
    if len(p.nonlinear) > 0:
        moved_along(p, tau, w)
    else:
        propagated(p, mode, tau, w)
        if w.moved.here:
            carried(p, mode, tau, w)
        moved_on(w)
    for c in range(w.dz.shape[1]):
        w.dphi[c] += w.moved.rate * step
    phi, more = within_turn(phi + p.rate * step)
    features(p, phi, w)
    return phi, more


@inner
def length_of(p, mode, w):
    """The length of the piece under way."""
    return p.steps[mode] if len(p.nonlinear) == 0 else w.piece.length[0]


@inner
def state_at(p, mode, s, w, y):
    """Write own states a time s after the start of the piece."""
    tau, width = s / length_of(p, mode, w), len(w.z)
    if len(p.nonlinear) > 0:
        for i in range(p.own):
            y[i] = at(w.piece.local[i], tau)
        return
    propagated(p, mode, tau, w)
    for i in range(p.own):
        total = w.z[i]
        for j in range(width):
            total += w.flow[i * width + j] * w.z[j]
        y[i] = total


@inner
def slopes_at(p, mode, s, w, y, d, back):
    """Write own states as `state_at`, and their derivatives by the directions; `back` is memory of their shape."""
    tau, width = s / length_of(p, mode, w), len(w.z)
    shift(p, w)
    state_at(p, mode, s, w, y)
    if len(p.nonlinear) > 0:
        spread(p, s, w)
        for i in range(p.own):
            for c in range(w.dz.shape[1]):
                d[i, c] = slope(p, i, c, w)
    elif w.moved.here:
        for i in range(p.own):
            back[i, 0] = w.dz[i, 0]
        carried(p, mode, tau, w)
        for i in range(p.own):
            d[i, 0], w.dz[i, 0] = w.dz[i, 0], back[i, 0]
    else:
        for i in range(p.own):
            for c in range(w.dz.shape[1]):
                total = w.dz[i, c]
                for j in range(width):
                    total += w.flow[i * width + j] * w.dz[j, c]
                d[i, c] = total


@inner
def copied(p, w, x):
    """Let a memory have the features of another, and their derivatives."""
    for j in range(len(w.z)):
        x.z[j] = w.z[j]
        for c in range(x.dz.shape[1]):
            x.dz[j, c] = w.dz[j, c]
    for c in range(x.dz.shape[1]):
        x.dphi[c] = w.dphi[c]
    if len(p.nonlinear) > 0:
        x.piece.phase[0] = w.piece.phase[0]
        derive(p, x.z, x)
