"""The motion along a piece of a flight: features and derivatives at its end, and states at instants of it.

Times `tau` within a piece are in units of its length, other quantities in the units of the system, phases in radians.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.flights.pieces import advance_states, expand_slopes, slope, take_step, value_at
from nsmaps.exact.modes.flights.states import derive, features, shift
from nsmaps.exact.modes.tables.memory import ONLY
from nsmaps.exact.modes.tables.taylor import ORDER, apply_propagator, write_propagator


@inner
def carry_slopes(mode, tau, w, d):
    """Write the derivatives of states at tau: dz + F dz + dF z, where `write_propagator` has written F = exp(Y tau) - 1."""
    n, width = len(w.new), len(w.z)
    for i in range(n):
        for c in range(w.dz.shape[1]):
            d[i, c] = moved_change(mode, i, tau, w) if w.moved.here else 0.0
        for j in range(width):
            for c in range(w.dz.shape[1]):
                d[i, c] += w.flow[i * width + j] * w.dz[j, c]
        for c in range(w.dz.shape[1]):
            d[i, c] += w.dz[i, c]


@inner
def moved_change(mode, i, tau, w):
    """How a state at tau changes with the parameters by its flow."""
    total = 0.0
    for j in range(len(w.z)):
        entry = 0.0
        for k in range(ORDER, -1, -1):
            entry = entry * tau + w.moved.flows[mode, i, j, k]
        total += entry * w.z[j]
    return total


@inner
def within_turn(phi):
    """A phase that is not negative within a turn, and the whole turns."""
    more = math.floor(phi / TWO_PI) if phi >= TWO_PI else 0
    return (max(phi - more * TWO_PI, 0.0) if more > 0 else phi), more


@inner
def begin_piece(p, mode, max_length, w):
    """Begin a piece of a flight at the features in memory: its length, that of the mode's longest step, or at most `max_length`.

    Zero where no Taylor series is the flight.
    """
    return p.steps[mode] if len(p.nonlinear) == 0 else take_step(p, mode, min(max_length, p.horizon), w)


@inner
def advance(p, mode, tau, unit, phi, w):
    """Move features and derivatives on by a share of a piece of this length, from a phase: (the new one, whole turns)."""
    step = tau * unit
    shift(p, w)
    if len(p.nonlinear) > 0:
        advance_states(p, tau, w)
    else:
        write_propagator(p, mode, tau, w)
        carry_slopes(mode, tau, w, w.slopes)
        apply_propagator(w)
        for i in range(len(w.new)):
            for c in range(w.dz.shape[1]):
                w.dz[i, c] = w.slopes[i, c]
    for c in range(w.dz.shape[1]):
        w.dphi[c] += w.moved.rate * step
    phi, more = within_turn(phi + p.rate * step)
    features(p, phi, w)
    return phi, more


@inner
def piece_length(p, mode, w):
    """The length of the piece under way."""
    return p.steps[mode] if len(p.nonlinear) == 0 else w.piece.length[ONLY]


@inner
def state_at(p, mode, s, w, y):
    """Write own states a time s after the start of the piece."""
    tau, width = s / piece_length(p, mode, w), len(w.z)
    if len(p.nonlinear) > 0:
        for i in range(p.own):
            y[i] = value_at(w.piece.local[i], tau)
        return
    write_propagator(p, mode, tau, w)
    for i in range(p.own):
        total = w.z[i]
        for j in range(width):
            total += w.flow[i * width + j] * w.z[j]
        y[i] = total


@inner
def slopes_at(p, mode, s, w, y, d):
    """Write own states as `state_at`, and their derivatives by the directions."""
    tau = s / piece_length(p, mode, w)
    shift(p, w)
    state_at(p, mode, s, w, y)
    if len(p.nonlinear) > 0:
        expand_slopes(p, s, w)
        for i in range(p.own):
            for c in range(w.dz.shape[1]):
                d[i, c] = slope(p, i, c, w)
    else:
        carry_slopes(mode, tau, w, d)


@inner
def copy_features(p, w, x):
    """Let a memory have the features of another, and their derivatives."""
    for j in range(len(w.z)):
        x.z[j] = w.z[j]
        for c in range(x.dz.shape[1]):
            x.dz[j, c] = w.dz[j, c]
    for c in range(x.dz.shape[1]):
        x.dphi[c] = w.dphi[c]
    if len(p.nonlinear) > 0:
        x.piece.phase[ONLY] = w.piece.phase[ONLY]
        derive(p, x.z, x)
