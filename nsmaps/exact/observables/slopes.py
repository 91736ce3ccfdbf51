"""Derivatives of observables of first returns by the state and by parameters, for orbits without rest and chatter."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.flight.flow import angle, evaluate, moves_at, phase_rate, rebound, tangent_at, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import IMPACT, MOST_IMPACTS, is_state, next_impact, onward
from nsmaps.exact.observables.sums import evaluated, panels

BY_SPEED, BY_PHASE, BY_PARAMETERS = range(3)


class Directions(NamedTuple):
    """What derivatives are carried in, along D directions."""

    way: Any  #: shape (P,), of the parameters
    d: Any  #: shape (inputs, D), of the inputs of formulas; of an impact system also of its state
    phase: Any  #: shape (D,), of the phase
    carried: Any  #: shape (2, D), of the state of an impact system: speed and phase
    back: Any  #: shape (inputs, D)
    moving: bool  #: whether the last direction, of an impact system, or all of them are those of the parameters


@inlined
def chained(q, g, count, row, first, rows, weight, slopes):
    """Add the derivatives of formulas, which are written, times a weight; `count` inputs have the derivatives `g.d`."""
    for c in range(rows.shape[1]):
        if rows[row, c]:
            explicit = 0.0
            for k in range(len(g.way)):
                explicit += q.out[c, count + 2 + k] * g.way[k]
            for j in range(len(g.phase)):
                total = q.out[c, count + 1] * g.phase[j]
                for i in range(count):
                    total += q.out[c, 1 + i] * g.d[i, j]
                if g.moving and j == len(g.phase) - 1:
                    total += explicit
                slopes[first + c, j] += weight * total


@inlined
def at_impact(q, g, row, phi, slope, moves, slopes):
    """Add the derivatives of an impact, whose inputs are written; `moves` are those of place and rebound by the parameters."""
    for j in range(3):
        by = 1.0 if j == BY_PARAMETERS else 0.0
        g.d[0, j] = g.carried[0, j]
        g.d[1, j] = slope * g.carried[0, j] + by * moves[1]
        g.d[2, j] = by * moves[0]
        g.phase[j] = g.carried[1, j]
    evaluated(q, q.impact, phi)
    chained(q, g, 3, row, 0, q.at, 1.0, slopes)


@inner
def at_instant(p, moved, q, g, row, phi, start, moves, x, weight, slopes):
    """Add the derivatives at a time x of the flight that starts at (place, velocity), with `g.back` those of the velocity."""
    z, w = start
    at = angle(phi)
    place_p, velocity_p = moves_at(p, moved, at, z, moves[0], w, x)
    z_phi, z_w, v_phi, v_w = tangent_at(p, at, x)
    d, v, _, _, _, _ = evaluate(p, x)
    q.y[0], q.y[1] = z + d, v
    for j in range(3):
        by, turned = (1.0 if j == BY_PARAMETERS else 0.0), g.carried[1, j]
        g.d[0, j] = z_phi * turned + z_w * g.back[0, j] + by * (moves[0] + place_p)
        g.d[1, j] = v_phi * turned + v_w * g.back[0, j] + by * velocity_p
        g.phase[j] = turned + by * moves[2] * x
    evaluated(q, q.flight, onward(p, phi, x)[0])
    chained(q, g, 2, row, q.at.shape[1], q.over, weight, slopes)


@inlined
def moved_start(p, moved, up, v):
    """Derivatives by the parameters of the place of a wall, of the speed after an impact of speed v, and of the phase's rate."""
    top, bottom = wall_places(moved)
    return (top if up else bottom), rebound(moved, up, v)[0], phase_rate(moved)


@inner
def landed(p, moved, q, g, row, phi, start, moves, now_up, s, slopes):
    """Carry the derivatives of the state to the next impact, and add those of the time of the flight."""
    z, w = start
    at, (top_p, bottom_p) = angle(phi), wall_places(moved)
    place_p, velocity_p = moves_at(p, moved, at, z, moves[0], w, s)
    z_phi, z_w, v_phi, v_w = tangent_at(p, at, s)
    d, velocity, a, _, _, _ = evaluate(p, s)
    into, wall_p = (1.0 if now_up else -1.0), top_p if now_up else bottom_p
    if q.flight != 0:
        q.y[0], q.y[1] = z + d, velocity
        evaluated(q, q.flight, onward(p, phi, s)[0])
    for j in range(3):
        by, turned = (1.0 if j == BY_PARAMETERS else 0.0), g.carried[1, j]
        dt = -(by * (moves[0] - wall_p + place_p) + z_phi * turned + z_w * g.back[0, j]) / velocity
        g.carried[0, j] = into * (a * dt + by * velocity_p + v_phi * turned + v_w * g.back[0, j])
        g.carried[1, j] = turned + by * moves[2] * s + phase_rate(p) * dt
        for c in range(q.over.shape[1]):
            if q.over[row, c]:
                slopes[q.at.shape[1] + c, j] += q.out[c, 0] * dt


@inner
def return_slopes(p, moved, q, g, v, phi, chatter, slopes):
    """Write the derivatives of the totals of a first return by its state and along the parameters; whether there are any."""
    base_up = walls_of(p)[2]
    g.carried[:] = 0.0
    g.carried[0, BY_SPEED], g.carried[1, BY_PHASE], up = 1.0, 1.0, base_up
    slopes[:] = 0.0
    if not is_state(v, phi):
        return False
    phi, _ = onward(p, phi, 0.0)
    for _ in range(MOST_IMPACTS):
        ended, now_up, s, now_v, _, slope, w = next_impact(p, up, phi, v, chatter)
        if ended != IMPACT:
            return False
        top, bottom = wall_places(p)
        into, z, row = (1.0 if up else -1.0), top if up else bottom, 0 if up == base_up else 1
        moves = moved_start(p, moved, up, v)
        if q.impact != 0:
            q.y[0], q.y[1], q.y[2] = v, -into * w, z
            at_impact(q, g, row, phi, slope, moves, slopes)
        for j in range(3):
            g.back[0, j] = -into * (slope * g.carried[0, j] + (moves[1] if j == BY_PARAMETERS else 0.0))
        if q.flight != 0:
            count, h = panels(q, s)
            for i in range(count * len(q.nodes)):
                k = i % len(q.nodes)
                x = h * (i // len(q.nodes) + q.nodes[k])
                at_instant(p, moved, q, g, row, phi, (z, w), moves, x, h * q.weights[k], slopes)
        landed(p, moved, q, g, row, phi, (z, w), moves, now_up, s, slopes)
        phi, _ = onward(p, phi, s)
        v, up = now_v, now_up
        if up == base_up:
            return True
    return False


@entry
def observed_slopes(p, moved, q, g, states, chatter, slopes):
    """The derivatives of the totals of first returns (N, 2) by speed, phase and along the parameters, slopes (N, C, 3)."""
    for i in range(len(states)):
        if not return_slopes(p, moved, q, g, states[i, 0], states[i, 1], chatter, slopes[i]):
            slopes[i] = math.nan
