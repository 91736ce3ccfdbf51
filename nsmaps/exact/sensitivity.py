"""How the image of a first return moves with the parameters, through every impact on the way.

Like `flight.py`, this file is not imported but copied behind the flow that is generated for a system.
"""

import math

from numba import njit

from nsmaps.exact.flight import angle, coefficients
from nsmaps.exact.flow import BASE_UP, evaluate, phase_rate, rebound, tangent_at, wall_places
from nsmaps.exact.returns import IMPACT, MOST_IMPACTS, is_state, next_impact, onward

# === engine ===

WIDEST = 1e-4  # change of the parameters along their direction, in units of its length


@njit(cache=True, nogil=True, error_model="numpy")
def leg_at(p, up, phi, v, w, now_up, s):
    """What a leg depends on: speed after the impact, place and velocity at s relative to the next wall, radians of s."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    place, velocity, _, _, _, _ = evaluate(coefficients(p, phi, z, w), s)
    return rebound(p, up, v)[0], z + place - (top if now_up else bottom), velocity, phase_rate(p) * s


@njit(cache=True, nogil=True, error_model="numpy")
def leg_moves(p, way, up, phi, v, w, now_up, s):
    """The derivatives of `leg_at` by the parameters along a way, all else at rest: smooth, also next to a graze.

    By central differences of two widths and their extrapolation, right to some 1e-12.
    """
    h = WIDEST / math.sqrt((way * way).sum())
    a, b = leg_at(p + h * way, up, phi, v, w, now_up, s), leg_at(p - h * way, up, phi, v, w, now_up, s)
    h *= 0.5
    c, d = leg_at(p + h * way, up, phi, v, w, now_up, s), leg_at(p - h * way, up, phi, v, w, now_up, s)
    x, y = 4.0 / (6.0 * h), 1.0 / (12.0 * h)
    return (
        x * (c[0] - d[0]) - y * (a[0] - b[0]),
        x * (c[1] - d[1]) - y * (a[1] - b[1]),
        x * (c[2] - d[2]) - y * (a[2] - b[2]),
        x * (c[3] - d[3]) - y * (a[3] - b[3]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivity(p, way, v, phi, chatter):
    """The derivatives of speed and phase of a first return by the parameters along a way; NaN with a rest or without an image."""
    v_p, phi_p, up = 0.0, 0.0, BASE_UP
    if not is_state(v, phi):
        return math.nan, math.nan
    phi, _ = onward(p, phi, 0.0)
    for _ in range(MOST_IMPACTS):
        ended, now_up, s, now_v, _, slope, w = next_impact(p, up, phi, v, chatter if up == BASE_UP else math.inf)
        if ended != IMPACT:
            break
        into, now_into = 1.0 if up else -1.0, 1.0 if now_up else -1.0
        u_p, place_p, velocity_p, turned_p = leg_moves(p, way, up, phi, v, w, now_up, s)
        top, bottom = wall_places(p)
        z = top if up else bottom
        w_p = -into * (slope * v_p + u_p)
        z_phi, z_w, velocity_phi, velocity_w = tangent_at(p, angle(phi), z, w, s)
        _, velocity, a, _, _, _ = evaluate(coefficients(p, phi, z, w), s)
        s_p = -(place_p + z_phi * phi_p + z_w * w_p) / velocity
        v_p = now_into * (a * s_p + velocity_p + velocity_phi * phi_p + velocity_w * w_p)
        phi_p += turned_p + phase_rate(p) * s_p
        phi, _ = onward(p, phi, s)
        v, up = now_v, now_up
        if up == BASE_UP:
            return v_p, phi_p
    return math.nan, math.nan


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivities(p, way, states, chatter, moves):
    """The sensitivities of a batch, written into the array given."""
    for i in range(len(states)):
        moves[i, 0], moves[i, 1] = sensitivity(p, way, states[i, 0], states[i, 1], chatter)
